// SPDX-License-Identifier: Apache-2.0
#include "send_back.hpp"

#include <cstdint>
#include <string>

#include "interrupt.hpp"
#include "json_values.hpp"
#include "sending.hpp"

namespace rowe::tools {
namespace {

// Messages that may come at once before the first was sent back; more are dropped and counted. Each takes as
// much as the largest may, both ways: 60 MiB in all.
constexpr std::uint32_t burst = 512;

// Queues one answer, however long there is no room: the order is kept, and who sends too fast has to wait.
void send_back(endpoint& through, const received& message, const console& to) {
  // A reply carries the number of its call under another name.
  const std::string text =
      message.wants_reply() ? without_member(message.text(), "message_id") : std::string{message.text()};
  while (!interrupt::seen()) {
    const status done = message.wants_reply() ? through.try_reply(message, text)
                                              : through.try_send(text, rt::for_ever, message.from());
    if (done || done.code() == errc::peer_lost || done.code() == errc::expired) return;
    if (done.code() != errc::full) return to.error(sentence_of(done.error()));
    interrupt::sleep_until(rt::monotonic_clock::now() + room_period);
  }
}

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
  while (!interrupt::seen()) {
    if (report_events(through, to) && once) return;
    const auto message = through.receive(interrupt::slice);
    if (message) {
      send_back(through, *message, to);
    } else if (message.code() != errc::timed_out) {
      return to.error(sentence_of(message.error()));
    }
  }
}

} // namespace rowe::tools
