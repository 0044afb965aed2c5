// SPDX-License-Identifier: Apache-2.0
// Ordinary threads of a simulated world, by the submission queue and the shared inbox. They submit and wait,
// or give up before the outcome is there; they receive, and reply or forget to.
#pragma once
#include <string>
#include <vector>

#include "handles.hpp"

namespace sim {

class ordinary_threads {
 public:
  explicit ordinary_threads(world_context& in) : in_{in}, number_{in.book.new_actor()} {}

  void act(const std::vector<std::unique_ptr<messaging_peer>>& peers) {
    const messaging_peer* const to =
        !peers.empty() && in_.random.one_in(4) ? peers[in_.random.below(peers.size())].get() : nullptr;
    switch (in_.random.below(8)) {
    case 0:
    case 1: return send(to);
    case 2: return invoke(to);
    case 3: return receive();
    case 4:
    case 5: return answer();
    default: return leave();
    }
  }

  // By now everything that was submitted has its outcome.
  void finish_up() {
    receive_all();
    while (!held_.empty()) answer();
  }
  // Takes the outcomes of all that still wait.
  void collect() {
    for (const waiting& one : waiting_) {
      if (!outcome_is_there(one)) in_.book.fail("a thread waits in vain for what it submitted");
    }
    waiting_.clear();
  }

 private:
  using entry = rowe::detail::entry;
  struct waiting {
    std::uint32_t slot = 0;
    entry what = entry::message;
    std::uint32_t number = 0; // in the ledger
  };

  static rowe::detail::peer_ref ref(const messaging_peer* of) {
    return of != nullptr ? rowe::detail::ref_of(of->named()) : rowe::detail::peer_ref{};
  }

  void send(const messaging_peer* to) {
    const duration ttl = some_time(in_.random);
    const bool good = !in_.random.one_in(16);
    const bool waits = in_.random.one_in(2);
    const time_point expires = rowe::detail::expiry_after(in_.on.now, ttl);
    const std::uint32_t n = in_.book.new_message({.sender = number_,
                                                  .to = to != nullptr ? to->number() : 0,
                                                  .accepted = in_.on.now,
                                                  .expires = ttl == 0ns ? rowe::rt::never : expires,
                                                  .only_now = ttl == 0ns,
                                                  .good = good,
                                                  .waits = waits});
    const auto slot = in_.on.submissions.submit({.what = entry::message,
                                                 .wants_outcome = waits,
                                                 .peer = ref(to),
                                                 .stamped = in_.on.now,
                                                 .expires = expires},
                                                message_text(in_.random, n, good));
    if (!slot) return in_.book.take_back_message();
    if (waits) waiting_.push_back({*slot, entry::message, n});
  }

  void invoke(const messaging_peer* to) {
    const duration timeout = some_time(in_.random);
    const time_point deadline = rowe::rt::deadline_after(in_.on.now, timeout);
    const std::uint32_t k = in_.book.new_call(deadline);
    constexpr const char* services[] = {"/add", "/echo", "/peer0", "/peer1", "nobody's"};
    const std::string text = R"({"service":")" +
                             std::string{services[in_.random.below(std::size(services))]} + R"(","a":)" +
                             std::to_string(k) + R"(,"b":0})";
    const auto slot = in_.on.submissions.submit({.what = entry::invocation,
                                                 .wants_outcome = true,
                                                 .peer = ref(to),
                                                 .stamped = in_.on.now,
                                                 .expires = deadline},
                                                text);
    if (!slot) return in_.book.take_back_call();
    waiting_.push_back({*slot, entry::invocation, k});
  }

  // Takes the outcome of one request, or gives up before it is there.
  void leave() {
    if (waiting_.empty()) return;
    const auto which = waiting_.begin() + static_cast<std::ptrdiff_t>(in_.random.below(waiting_.size()));
    if (!outcome_is_there(*which)) {
      if (which->what == entry::message) in_.book.message(which->number).waits = false;
      if (which->what == entry::invocation) in_.book.call(which->number).wanted = false;
    }
    waiting_.erase(which);
  }

  bool outcome_is_there(const waiting& one) {
    auto& queue = in_.on.submissions;
    if (!queue.wait(one.slot, time_point{1ns})) return false; // long past, so it does not sleep
    const rowe::status done = queue.outcome(one.slot);
    if (one.what == entry::message) {
      in_.book.announcement_of_message(one.number, done, in_.on.now);
    } else if (one.what == entry::invocation) {
      const std::uint32_t sum = number_after(queue.reply_text(one.slot), R"("sum":)");
      if (done && sum == 0) in_.book.fail("a reply without what it must hold");
      in_.book.ended(one.number, done ? sum : 0, done ? errc::misuse : done.code(), in_.on.now);
    }
    queue.release(one.slot);
    return true;
  }

  void receive() {
    auto& inbox = in_.on.inbox;
    const auto slot = inbox.try_receive(in_.on.now);
    if (!slot) return;
    if (inbox.header(*slot).what == entry::invocation) {
      held_.push_back({inbox.header(*slot).call, number_after(inbox.text(*slot), R"("a":)")});
    }
    inbox.release(*slot);
  }
  void receive_all() {
    for (std::uint32_t left = in_.on.inbox.slots(); left > 0; --left) receive();
  }

  void answer() {
    if (held_.empty()) return;
    const auto which = held_.begin() + static_cast<std::ptrdiff_t>(in_.random.below(held_.size()));
    const auto [call, k] = *which;
    held_.erase(which);
    if (in_.random.one_in(8)) return; // forgotten
    const bool refuses = in_.random.one_in(8);
    const bool waits = in_.random.one_in(2);
    const std::uint32_t r = refuses ? 0 : in_.book.new_answer(k);
    const auto slot = in_.on.submissions.submit({.what = refuses ? entry::refusal : entry::reply,
                                                 .wants_outcome = waits,
                                                 .call = call,
                                                 .stamped = in_.on.now},
                                                refuses ? "no" : reply_text(r));
    if (!slot) return refuses ? void() : in_.book.take_back_answer(k);
    if (refuses) in_.book.refuse(k);
    if (waits) waiting_.push_back({*slot, refuses ? entry::refusal : entry::reply, k});
  }

  world_context& in_;
  std::uint32_t number_;
  std::vector<waiting> waiting_;
  std::vector<std::pair<rowe::detail::call_ref, std::uint32_t>> held_;
};

} // namespace sim
