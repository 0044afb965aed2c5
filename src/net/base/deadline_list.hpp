// SPDX-License-Identifier: Apache-2.0
// Deadlines that are all equally far away when they are set. So they come in the order in which they were
// set: they form a queue, and only its front is looked at. All deadlines of the transport are of this kind.
// So it needs no wheel, and a turn costs the same with one socket or a thousand.
//
// A deadline that is found long after its time shows that this process did not run: a debugger, SIGSTOP, a
// suspended machine. That time does not count against peers: all deadlines move, so that the first of them is
// as far away as it may be found late. Not twice in a row: where a thread gets so little of its core that
// each deadline is found late, they end all the same.
#pragma once
#include <algorithm>
#include <chrono>
#include <utility>

#include <rowe/rt/clock.hpp>

namespace rowe::net {

// Base of what may be in one deadline_list at a time. Its destructor takes it out.
class deadline_node {
 public:
  deadline_node() noexcept = default;
  deadline_node(const deadline_node&) = delete;
  deadline_node& operator=(const deadline_node&) = delete;
  ~deadline_node() { disarm(); }

  void disarm() noexcept {
    next_->previous_ = previous_;
    previous_->next_ = next_;
    next_ = previous_ = this;
  }

 private:
  friend class deadline_list;
  deadline_node* next_ = this;
  deadline_node* previous_ = this;
  rt::time_point due_{};
};

class deadline_list {
 public:
  explicit deadline_list(rt::duration timeout) noexcept : timeout_{timeout} {}

  // Sets the deadline of `node` to now + timeout; it leaves the list it was in. `now` never goes backwards.
  void arm(deadline_node& node, rt::time_point now) noexcept {
    node.disarm();
    node.due_ = rt::deadline_after(now, timeout_);
    node.next_ = &head_;
    node.previous_ = head_.previous_;
    head_.previous_->next_ = &node;
    head_.previous_ = &node;
  }

  // The node that waits longest, or nullptr.
  deadline_node* oldest() noexcept { return head_.next_ == &head_ ? nullptr : head_.next_; }

  // The node that waits longest among those for which `wanted(node)` is true, or nullptr. Linear.
  template <class Wanted>
  deadline_node* oldest_of(Wanted&& wanted) noexcept {
    for (deadline_node* node = head_.next_; node != &head_; node = node->next_)
      if (wanted(*node)) return node;
    return nullptr;
  }

  static constexpr rt::duration late_max = std::chrono::seconds{1};

  // Takes oldest() out of the list and returns it, if its time has come; else nullptr.
  deadline_node* take_due(rt::time_point now) noexcept {
    deadline_node* node = oldest();
    if (!node || node->due_ > now) return nullptr;
    const bool late = now - node->due_ > late_max;
    if (late && !std::exchange(postponed_, true)) {
      postpone(now - node->due_ + std::min(timeout_, late_max));
      return nullptr;
    }
    postponed_ = late;
    node->disarm();
    return node;
  }

  // When take_due() will next have something; rt::never when the list is empty.
  rt::time_point next() const noexcept { return head_.next_ == &head_ ? rt::never : head_.next_->due_; }

 private:
  void postpone(rt::duration by) noexcept {
    for (deadline_node* node = head_.next_; node != &head_; node = node->next_)
      node->due_ = rt::deadline_after(node->due_, by);
  }

  rt::duration timeout_;
  deadline_node head_;
  bool postponed_ = false; // nothing was found in time since
};

} // namespace rowe::net
