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
#include <utility>

#include "service/core.hpp"

namespace rowe::service {
namespace {

// Work of one cycle: a message counts as one, and so does each kilobyte of it and of what is composed for it.
// About 100 us on a fast core.
constexpr std::size_t work_per_cycle = 100;
constexpr std::uint32_t stops_ahead_max = 64; // carried out in one cycle before their turn
constexpr std::size_t work_of(std::size_t bytes) noexcept { return 1 + bytes / 1024; }

// How much of a text is looked at, and what a stop has there; and how long its frame is.
constexpr std::size_t look_bytes = 160;
constexpr std::size_t stop_frame_bytes_max = transport_sink::read_bytes_in_turn;
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

// What was put aside is carried out before more is read. More than a connection's own room for that only
// where it may lie behind what the parser has assembled, and assembles meanwhile: keep_unread().
std::size_t core::wanted_bytes(connection_id id) const noexcept {
  const connection* const c = find(id);
  if (c == nullptr) return read_bytes_alone;
  if (!c->unread.empty() || c->parked()) return 0;
  const std::size_t room = bounds_.message_bytes_max - c->parser.assembled_bytes();
  return room >= 2 * read_bytes_alone ? read_bytes_alone : read_bytes_in_turn;
}

void core::on_bytes(connection_id id, std::span<std::byte> bytes) noexcept {
  connection* const c = find(id);
  if (c == nullptr) return;
  add(counter::bytes_in, bytes.size());
  c->heard_at = now_;
  attempts_failed_ = 0; // a server that says something is alive
  if (bytes.size() > c->aside.size() - tailroom_bytes) return read_all(*c, bytes); // it was alone
  assert(c->unread.empty() && !c->parked());
  std::memcpy(c->aside.data(), bytes.data(), bytes.size());
  c->unread = c->aside.first(bytes.size());
  read_stops(*c);
  take_turn(*c);
}

void core::read_all(connection& c, std::span<std::byte> bytes) noexcept {
  read_now_ = bytes;
  c.unread = bytes;
  // What waits may go where messages are assembled, so not in the middle of one that came in pieces.
  std::size_t work = 0;
  const auto ends_here = [&] { return work >= work_per_cycle && !c.parser.mid_message(); };
  while (!c.unread.empty() && !c.parked() && !ends_here()) work += read_one(c);
  const bool waits = !c.unread.empty() || c.parked();
  if (waits) keep_unread(c);
  read_now_ = {};
  if (!waits) return;
  read_stops(c);
  take_turn(c);
}

// What was read into the carrier's own memory, from the message on that waits. Where that is too much
// for the connection's own, it goes to the end of what messages are assembled in: of those that follow, so
// much at most lies in front of it before it is read (wanted_bytes()).
void core::keep_unread(connection& c) noexcept {
  const bool with_text = c.parked_text >= read_now_.data() && c.parked_text < c.unread.data();
  const std::byte* const from = with_text ? c.parked_text : c.unread.data(); // else: in c.assembly
  const auto bytes = static_cast<std::size_t>(read_now_.data() + read_now_.size() - from);
  const bool fits_aside = bytes <= c.aside.size() - tailroom_bytes;
  const auto into =
      fits_aside ? c.aside.first(bytes) : c.assembly.subspan(bounds_.message_bytes_max - bytes, bytes);
  if (bytes != 0) std::memcpy(into.data(), from, bytes);
  c.unread = into.last(c.unread.size());
  if (with_text) c.parked_text = into.data();
}

// Nothing of it is left.
void core::end_unread(connection& c) noexcept {
  c.unread = {};
  c.parked_text = nullptr;
  if (!std::exchange(c.unheard, false)) return;
  c.heard_at = c.unheard_until = now_;
  carrier_.read_enabled(c.id, true);
}

// The message that is being carried out finds no room.
void core::park(connection& c) noexcept {
  c.parked_text = heard_now_.data();
  c.parked_bytes = static_cast<std::uint32_t>(heard_now_.size());
  unparked_at_ = UINT64_MAX; // looked at once more: something may have been taken meanwhile
  if (std::exchange(c.unheard, true)) return;
  carrier_.read_enabled(c.id, false);
  sender_.ignore_credit({c.id.index});
}

void core::take_turn(connection& c) noexcept {
  if (c.in_turn) return;
  if (c.unread.empty() && !c.parked()) return end_unread(c);
  c.in_turn = true;
  (c.parked() ? parked_ : unread_).push(c.id.index);
}

// Those that are parked, in their turn, as far as there is room now.
void core::unpark() noexcept {
  if (parked_.empty()) return;
  if (receiver() != receives_) begin_receiver();
  if (receives_ == no_index) door_.ask_for_slots(); // what came home before is found here, or there
  mark_taken();
  collect_taken(0);
  if (const std::uint64_t changes = room_changes(); std::exchange(unparked_at_, changes) == changes) return;
  for (std::uint32_t left = parked_.count; left != 0; --left) {
    connection& c = peers_[peer_index{parked_.pop()}];
    if (c.open() && c.parked() && admit(c) == admission::later) {
      parked_.push(c.id.index);
    } else {
      unread_.push(c.id.index);
    }
  }
}

// One message, or what there is of it; returns the work it was.
std::size_t core::read_one(connection& c) noexcept {
  if (!c.open()) {
    end_unread(c);
    return 0;
  }
  work_bytes_ = 0;
  if (c.parked()) {
    const std::span again{std::exchange(c.parked_text, nullptr), c.parked_bytes};
    heard_before_ = true;
    hear(c, again);
    heard_before_ = false;
    return work_of(again.size() + work_bytes_);
  }
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
  return work_of(step.payload.size() + work_bytes_);
}

void core::read_in_turn() noexcept {
  for (std::size_t work = 0; !unread_.empty() && work < work_per_cycle;) {
    connection& c = peers_[peer_index{unread_.pop()}];
    c.in_turn = false;
    work += read_one(c);
    take_turn(c);
  }
}

// Carries out the stops among what was read, and takes them out: what stands before a stop, of its own peer
// too, waits for its turn, and so does what only looks like one. A text that claims to be a stop and is none
// has cost one reading more than its turn will; until more is read nothing else of its peer is looked at, so
// that nobody pays for it. The first stop of each peer is carried out, and stops_ahead_max more of all; the
// others change nothing. A stop whose service or topic stands further behind, that is longer, or that came
// in pieces, waits for its turn.
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
  for (bool first = true; at < all.size() && c.open();) {
    const auto frame = all.subspan(at);
    const std::size_t bytes = wire::whole_frame_bytes(frame);
    const wire::opcode what = wire::opcode_of(frame[0]);
    if (bytes == 0 || what == wire::opcode::close) break;
    const bool begins = wire::is_data(what) && what != wire::opcode::continuation;
    if (wire::is_data(what) && begins == in_message) break; // against the protocol: in its turn
    if (wire::is_data(what)) in_message = !wire::is_final(frame[0]);
    std::array<char, look_bytes> room;
    const bool may_stop =
        begins && bytes <= stop_frame_bytes_max && (first || stops_ahead_ < stops_ahead_max);
    if (!may_stop || !begins_as_stop(wire::look_at_text(frame, std::as_writable_bytes(std::span{room})))) {
      keep(bytes);
    } else if (take_if_stop(c, frame.first(bytes))) {
      at += bytes;
      first = false;
      ++stops_ahead_;
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
  std::array<std::byte, stop_frame_bytes_max + tailroom_bytes> room;
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
