// SPDX-License-Identifier: Apache-2.0
// Who gets a place among the handshakes, and who loses one.
#include "net/handshakes.hpp"

#include <algorithm>
#include <utility>

#include "net/handshake_answers.hpp"
#include "net/send_answer.hpp"

namespace rowe::net {

handshakes::handshake* handshakes::free_or_closing() noexcept {
  const auto found = std::find_if(handshakes_.begin(), handshakes_.end(),
                                  [](const handshake& one) { return one.now == phase::free; });
  if (found != handshakes_.end()) return &*found;
  auto* closing = static_cast<handshake*>(closing_.oldest());
  if (closing) leave(*closing);
  return closing;
}

// True if its request is not complete, as far as we know.
bool handshakes::may_be_evicted(const handshake& one) const noexcept {
  return one.now == phase::header && one.turn != turn_ && (one.events == 0 || one.looked_at);
}

// Of the sockets whose request is not complete, as far as we know, the one that is `weaker` than all others,
// and of those the oldest; nullptr if there is none. weaker(one, nullptr): whether it is looked at.
template <class Weaker>
handshakes::handshake* handshakes::unfinished(Weaker&& weaker) noexcept {
  handshake* found = nullptr;
  (void)header_.oldest_of([&](deadline_node& node) {
    auto& one = static_cast<handshake&>(node);
    if (may_be_evicted(one) && weaker(one, found)) found = &one;
    return false;
  });
  return found;
}

// A free place; else the place of the socket that has been closing longest, because its answer is sent; else
// that of one whose request is not complete: of the source that had begun most handshakes lately which have
// led to nothing, and of those of one without unread bytes, because these may complete a request. Whose own
// source had begun more than that displaces one of its own. A source that has used up its limit gets only the
// places for the stop in addition; for a third it displaces no other source.
handshakes::handshake* handshakes::place(const socket_address& peer, bool crowded,
                                         std::uint32_t before) noexcept {
  const auto is_such = [&](const handshake& one) {
    return one.now == phase::header && one.crowded && same_source(one.peer, peer);
  };
  const auto unread = [](const handshake& one) { return one.events != 0; };
  const auto weaker_of = [&](auto&& wanted) {
    return [&](const handshake& one, const handshake* than) {
      return wanted(one) && (than == nullptr || unread(*than) > unread(one));
    };
  };
  handshake* one = nullptr;
  if (crowded && std::count_if(handshakes_.begin(), handshakes_.end(), is_such) >=
                     static_cast<std::ptrdiff_t>(kept_for_stop(limits_.handshakes_max))) {
    one = unfinished(weaker_of(is_such));
    if (one == nullptr) return nullptr;
  } else {
    one = free_or_closing();
    if (one == nullptr) {
      one = unfinished([&](const handshake& next, const handshake* than) {
        return than == nullptr ||
               std::pair{next.before, unread(*than)} > std::pair{than->before, unread(next)};
      });
      if (one != nullptr && one->before < before)
        one = unfinished(weaker_of([&](const handshake& own) { return same_source(own.peer, peer); }));
    }
  }
  if (one != nullptr && one->now != phase::free) evict(*one);
  return one;
}

bool handshakes::must_wait() const noexcept {
  bool any_header = false;
  for (const handshake& one : handshakes_) {
    if (one.now == phase::free || one.now == phase::closing || may_be_evicted(one)) return false;
    any_header = any_header || one.now == phase::header;
  }
  return any_header; // it will be looked at, or known to be silent, in a turn to come
}

void handshakes::evict(handshake& one) noexcept {
  ++counters_.handshakes_evicted;
  if (one.scanned != 0) { // who has said nothing expects nothing
    send_answer(one.socket.get(), answer::evicted());
  }
  leave(one);
}

bool handshakes::too_many_from(const socket_address& peer) const noexcept {
  if (is_loopback(peer)) return false;
  const auto waiting = std::count_if(handshakes_.begin(), handshakes_.end(), [&](const handshake& one) {
    return one.now != phase::free && one.now != phase::closing && same_source(one.peer, peer);
  });
  return connections_.count_from(peer) + static_cast<std::uint32_t>(waiting) >=
         limits_.connections_per_address_max;
}

} // namespace rowe::net
