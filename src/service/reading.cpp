// SPDX-License-Identifier: Apache-2.0
// What has been read and is not carried out yet. When several peers have
// something to say, receiving only puts it aside: then one message of each is carried out in turn, those who
// have waited longest first, up to a stated amount of work in one cycle. So a peer waits for one message of
// every other peer, not for all that they have sent. A stop does not even wait for that: it is carried out as
// it is read, before what its own peer sent in front of it.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <iterator>
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
constexpr std::string_view stop_marks[] = {"rowe/stop", "rowe\\/stop"};

bool says_stop(std::string_view escaped) noexcept {
  return json::says(escaped, "/rowe/stop") || json::says(escaped, "rowe/stop");
}

// Whether a text of which this is the beginning has a "service" or "topic" of its own that is the stop: not
// one inside of something else. Whether it is JSON, and asks to stop, only reading it says.
bool begins_as_stop(std::string_view text) noexcept {
  const bool marked = std::any_of(std::begin(stop_marks), std::end(stop_marks), [&](std::string_view mark) {
    return text.find(mark) != std::string_view::npos;
  });
  if (!marked) return false;
  int depth = 0;
  bool in_value = false;
  std::string_view name;
  for (std::size_t at = 0; at < text.size(); ++at) {
    switch (text[at]) {
    case '{':
    case '[': ++depth; break;
    case '}':
    case ']':
      if (--depth <= 0) return false;
      break;
    case ':': in_value = in_value || depth == 1; break;
    case ',': in_value = in_value && depth != 1; break;
    case '"': {
      const std::size_t begin = ++at;
      while (at < text.size() && text[at] != '"') at += text[at] == '\\' ? 2U : 1U;
      if (at >= text.size()) return false;
      const std::string_view said = text.substr(begin, at - begin);
      if (depth != 1) break;
      if (!in_value) {
        name = said;
      } else if (name == "service" ? says_stop(said.substr(0, said.find('#')))
                                   : name == "topic" && says_stop(said)) {
        return true;
      }
      break;
    }
    default: break;
    }
  }
  return false;
}

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

// Carries out the stops among what was read, and takes them out: what stands before a stop, of its own peer
// too, waits for its turn, and so does what only looks like one. A text that claims to be a stop and is none
// has cost one reading more than its turn will; until more is read nothing else of its peer is looked at, so
// that nobody pays for it. A stop whose service or topic stands further behind, or that came in pieces, waits
// for its turn.
void core::read_stops(connection& c) noexcept {
  if (!stop_.in_use()) return;
  const std::span<std::byte> all = c.unread;
  const auto begun = c.parser.look_ahead(all);
  if (!begun || begun->rest >= all.size()) return;
  bool in_message = begun->in_message;
  std::size_t kept = begun->rest; // the end of what stays; from `at` on nothing was looked at
  std::size_t at = kept;
  const auto keep = [&](std::size_t bytes) {
    if (kept != at) std::memmove(all.data() + kept, all.data() + at, bytes);
    kept += bytes;
    at += bytes;
  };
  while (at < all.size() && c.open()) {
    const auto frame = all.subspan(at);
    const std::size_t bytes = wire::whole_frame_bytes(frame);
    const wire::opcode what = wire::opcode_of(frame[0]);
    if (bytes == 0 || what == wire::opcode::close) break;
    const bool begins = wire::is_data(what) && what != wire::opcode::continuation;
    if (wire::is_data(what) && begins == in_message) break; // against the protocol: in its turn
    if (wire::is_data(what)) in_message = !wire::is_final(frame[0]);
    std::array<char, look_bytes> room;
    if (!begins || !begins_as_stop(wire::look_at_text(frame, std::as_writable_bytes(std::span{room})))) {
      keep(bytes);
    } else if (take_if_stop(c, frame.first(bytes))) {
      at += bytes;
    } else {
      break;
    }
  }
  keep(all.size() - at);
  c.unread = all.first(kept);
}

// A text in a whole frame, where it is a request to stop; false, and nothing was done, where it is not. The
// frame stays as it came.
bool core::take_if_stop(connection& c, std::span<const std::byte> frame) noexcept {
  std::array<std::byte, read_bytes_in_turn + tailroom_bytes> room;
  std::memcpy(room.data(), frame.data(), frame.size());
  std::memset(room.data() + frame.size(), 0, tailroom_bytes);
  wire::frame_parser alone = c.parser.anew();
  const wire::frame_step step = alone.next(std::span{room}.first(frame.size()));
  const bool stops = step.event == wire::frame_event::text &&
                     is_stop({reinterpret_cast<const char*>(step.payload.data()), step.payload.size()});
  if (stops) take(c, step); // within the rate of its peer, like all that it says
  return stops;
}

} // namespace rowe::service
