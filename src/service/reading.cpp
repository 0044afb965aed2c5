// SPDX-License-Identifier: Apache-2.0
// What has been read and is not carried out yet. When several peers have something to say, receiving only
// puts it aside: then one message of each is carried out in turn, those who have waited longest first, up to
// a stated amount of work in one cycle. So a peer waits for one message of every other peer, not for all that
// they have sent. A stop does not even wait for that: a frame that begins like one is carried out as it is
// read.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <string_view>

#include "service/core.hpp"

namespace rowe::service {
namespace {

// Work of one cycle: a message counts as one, and so does each kilobyte of it and of what is composed for it.
// About 100 us on a fast core.
constexpr std::size_t work_per_cycle = 100;
constexpr std::size_t work_of(std::size_t bytes) noexcept { return 1 + bytes / 1024; }

// How much of a text is looked at, and what a stop has there.
constexpr std::size_t look_bytes = 160;
constexpr std::string_view stop_marks[] = {"rowe/stop\"", "rowe\\/stop\""};

} // namespace

// What was put aside is carried out before more is read.
bool core::wants_bytes(connection_id id) const noexcept {
  const connection* const c = find(id);
  return c == nullptr || c->unread.empty();
}

void core::on_bytes(connection_id id, std::span<std::byte> bytes) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  add(counter::bytes_in, bytes.size());
  c->heard_at = now_;
  attempts_failed_ = 0; // a server that says something is alive
  if (bytes.size() > c->aside.size() - tailroom_bytes) return read_all(*c, bytes); // it was alone
  assert(c->unread.empty());
  std::memcpy(c->aside.data(), bytes.data(), bytes.size());
  c->unread = c->aside.first(bytes.size());
  read_stops(*c);
  take_turn(*c);
}

void core::read_all(connection& c, std::span<std::byte> bytes) noexcept {
  c.unread = bytes;
  while (!c.unread.empty()) read_one(c);
}

void core::take_turn(connection& c) noexcept {
  if (c.unread.empty() || c.in_turn) return;
  c.in_turn = true;
  unread_.push(c.id.index);
}

// One message, or what there is of it; returns the work it was.
std::size_t core::read_one(connection& c) noexcept {
  if (!c.open()) {
    c.unread = {};
    return 0;
  }
  composed_bytes_ = 0;
  const wire::frame_step step = c.parser.next(c.unread);
  c.unread = c.unread.subspan(step.consumed);
  const bool ends_message = step.event == wire::frame_event::text || step.event == wire::frame_event::binary;
  if (ends_message) c.message_began_at = rt::never;
  if (step.event != wire::frame_event::need_more) take(c, step);
  if (!c.parser.mid_message()) {
    c.message_began_at = rt::never;
  } else if (c.message_began_at == rt::never) {
    c.message_began_at = now_;
  }
  return work_of(step.payload.size() + composed_bytes_);
}

void core::read_in_turn() noexcept {
  for (std::size_t work = 0; !unread_.empty() && work < work_per_cycle;) {
    connection& c = connections_[unread_.pop()];
    c.in_turn = false;
    work += read_one(c);
    take_turn(c);
  }
}

// Carries out everything up to the last stop that is here whole: what stands before it is its peer's own, and
// not more than was read at once.
void core::read_stops(connection& c) noexcept {
  const std::size_t end = end_of_stops(c);
  const std::size_t left = c.unread.size() - end;
  while (end != 0 && c.unread.size() > left) read_one(c);
}

// Where the last frame ends that begins like a request to stop; 0: there is none. A frame that only looks
// like one is carried out a little earlier than its turn; a stop whose service or topic stands further
// behind, or that came in pieces, waits for its turn.
std::size_t core::end_of_stops(const connection& c) const noexcept {
  if (!stop_.in_use()) return 0;
  const auto begun = c.parser.rest_of_frame();
  if (!begun) return 0; // in the middle of a header
  std::size_t found = 0;
  for (std::size_t at = *begun; at < c.unread.size();) {
    const auto frame = c.unread.subspan(at);
    const std::size_t bytes = wire::whole_frame_bytes(frame);
    if (bytes == 0) break;
    std::array<char, look_bytes> room;
    const std::string_view text = wire::look_at_text(frame, std::as_writable_bytes(std::span{room}));
    const bool marked = std::any_of(std::begin(stop_marks), std::end(stop_marks), [&](std::string_view mark) {
      return text.find(mark) != std::string_view::npos;
    });
    at += bytes;
    if (marked) found = at;
  }
  return found;
}

} // namespace rowe::service
