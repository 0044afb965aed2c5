// SPDX-License-Identifier: Apache-2.0
#include "send_back.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "../rowe/interrupt.hpp"
#include "../rowe/text/json_values.hpp"

namespace rowe::tools {
namespace {

// Messages that may come at once before the first was sent back. Each takes as much as the largest may, both
// ways: 60 MiB in all.
constexpr std::uint32_t burst = 512;

// What is sent back, in the order of each peer. Who reads nothing is soon read no further, so there is room
// for each answer; but for those of several such peers there may not be. They are kept, and cost the others
// nothing.
class answers {
 public:
  answers(endpoint& through, const console& to) : through_{through}, to_{to} {}

  void send(received message) {
    const auto of_peer = std::find_if(unsent_.begin(), unsent_.end(), [&](const auto& waiting) {
      return waiting.front().from() == message.from();
    });
    if (of_peer != unsent_.end()) {
      of_peer->push_back(std::move(message));
    } else if (!try_send(message)) {
      unsent_.emplace_back().push_back(std::move(message));
    }
  }
  // Those that found no room, again.
  void retry() {
    for (std::deque<received>& waiting : unsent_) {
      while (!waiting.empty() && may_have_room(waiting.front().from()) && try_send(waiting.front()))
        waiting.pop_front();
    }
    std::erase_if(unsent_, [](const std::deque<received>& waiting) { return waiting.empty(); });
  }

 private:
  bool may_have_room(connection peer) const {
    const status now = through_.wait_room(duration::zero(), peer);
    return now || now.code() != errc::timed_out;
  }
  // False: its peer has no room.
  bool try_send(const received& message) {
    // A reply carries the number of its call under another name.
    const std::string text =
        message.wants_reply() ? without_member(message.json(), "message_id") : std::string{message.value()};
    while (!interrupt::seen()) {
      const status done = message.wants_reply() ? through_.try_reply(message, text)
                                                : through_.try_send(text, rt::for_ever, message.from());
      if (done || done.code() == errc::peer_lost || done.code() == errc::expired) return true;
      if (done.code() != errc::full) {
        to_.error(done.error().message());
        return true;
      }
      if (through_.wait_room(duration::zero())) return false; // there is room for others
      (void)through_.wait_room(interrupt::slice);             // or it is tried in vain once more
    }
    return true;
  }

  endpoint& through_;
  const console& to_;
  // Of each peer, never empty. Each keeps its place in the inbox, so they are few.
  std::vector<std::deque<received>> unsent_;
};

// True: a peer has left.
bool report_events(endpoint& through, const console& to) {
  bool left = false;
  while (const auto happened = through.try_event()) {
    left = left || happened->what_kind == event::kind::peer_left;
    to.note(sentence_of(*happened));
  }
  return left;
}

} // namespace

endpoint_options echoing_options(const limits& bounds) {
  endpoint_options options;
  options.limits = bounds;
  options.limits.door_slots = burst;
  options.limits.door_slot_bytes = options.limits.message_bytes_max;
  options.answers_any = true;
  options.page = false;
  return options;
}

void send_back(endpoint& through, bool once, const console& to) {
  answers back{through, to};
  while (!interrupt::seen()) {
    if (report_events(through, to) && once) return;
    auto message = through.receive(interrupt::slice);
    back.retry();
    if (message) {
      back.send(std::move(*message));
    } else if (message.code() != errc::timed_out) {
      return to.error(message.error().message());
    }
  }
}

} // namespace rowe::tools
