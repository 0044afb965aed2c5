// SPDX-License-Identifier: Apache-2.0
// What the core knows of one peer: the parser of its frames, what waits to be written to it, and when it was
// last heard. Service thread only.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls.hpp"
#include "service/credit.hpp"
#include "service/queues.hpp"
#include "service/rate_limit.hpp"
#include "service/stop_frames.hpp"
#include "service/transport.hpp"
#include "wire/rosbridge.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

// Bytes that are frames already: pongs, pings and the close frame, written before any message. The room of
// one frame is the close frame's alone.
struct control_frames {
  static constexpr std::size_t frame_bytes_max = wire::frame_header_bytes_max + wire::control_bytes_max;

  std::array<std::byte, 4 * frame_bytes_max> bytes;
  std::size_t written = 0;
  std::size_t size = 0;
  std::size_t last_at = 0; // where the last frame begins

  std::span<const std::byte> rest() const noexcept { return {bytes.data() + written, size - written}; }

  // Where a frame of so many bytes goes; null when it is not to be sent. RFC 6455 5.5.3 asks for a pong to
  // the latest ping only: where there is no room for one more, it takes the place of the last one. A ping of
  // ours is not worth sending behind pongs that were not read.
  std::byte* place(wire::opcode what, std::size_t frame_bytes) noexcept {
    if (written != 0) {
      std::memmove(bytes.data(), bytes.data() + written, size - written);
      size -= written;
      last_at -= std::min(last_at, written); // of a frame that is begun only the rest is here, and much room
      written = 0;
    }
    if (what == wire::opcode::ping && size != 0) return nullptr;
    // By the longest frame, not by this one: whatever takes the place of the last one fits there.
    const std::size_t room = bytes.size() - (what == wire::opcode::close ? 0 : frame_bytes_max);
    if (room - size < (ROWE_MUTANT(pong_room) ? frame_bytes : frame_bytes_max)) size = last_at;
    last_at = size;
    size += frame_bytes;
    return bytes.data() + last_at;
  }
};

// What a peer that came for the stop alone is told of everything else.
inline constexpr std::string_view stop_only_sentence =
    "a connection on /rowe/stop may only stop the robot (/rowe/stop) and see that (/rowe/stop/state)";

// The message whose first bytes a socket has already: it goes on before anything else.
struct begun_frame {
  std::uint32_t slot = no_index;
  std::size_t written = 0; // of header and payload together
  wire::mask_key key{};    // client side: the rest is masked with the same key
  bool unslashed = false;  // as subscription::unslashed
  rt::time_point since{};
};

// The subscriptions of one priority that have something to write, served in turn.
struct ready_list {
  std::uint32_t head = no_index;
  std::uint32_t tail = no_index;
};

struct advertisement {
  std::uint32_t topic = no_index;
  bool latched = false; // what this peer publishes there is kept for those who come late
};

struct connection {
  enum class phase : std::uint8_t { free, open, closing };

  connection_id id;
  phase state = phase::free;
  side ours = side::server;
  bool blocked = false;   // the carrier has no room; on_writable() comes
  bool held = false;      // the credit has none for what is not urgent; a pong comes
  bool waits_to_begin = false; // others keep it from beginning its next frame: may_begin_in()
  bool near = false;      // the carrier was told so
  bool slow = false;      // it answers no pings, and that was counted
  bool listed = false;    // on the core's list of connections with something to write
  bool in_turn = false;   // on its list of those with something unread, or of those that are parked
  bool unheard = false;   // the carrier does not read it: its pongs and its silence mean nothing
  bool told_full = false; // senders are told `full`: it has its share of what waits
  wire::rosbridge::level status_level = wire::rosbridge::level::error;
  wire::frame_parser parser;
  std::span<std::byte> assembly;
  std::span<std::byte> aside;  // room for what is read while others are heard,
  std::span<std::byte> unread; // and what of it is still to be carried out
  // The text in front of `unread` that whoever receives has no room for: it is parked. Null: it is not.
  const std::byte* parked_text = nullptr;

  control_frames control;
  stop_frames stop_out;
  class credit credit;
  begun_frame begun;
  queue direct;                 // answers to its own requests
  std::array<queue, 3> letters; // by priority
  std::array<ready_list, 3> ready;

  std::uint32_t first_subscription = no_index;
  std::uint32_t subscriptions = 0;
  std::uint32_t owed = 0;              // of these, those whose latched value is still to be queued
  std::span<advertisement> advertised; // `advertisements` of them in use
  std::uint32_t advertisements = 0;

  bool stop_only = false;         // it came on stop_path: see stop_peers.cpp
  rt::time_point stopped_at{};    // when it last stopped a robot that could move
  bool local = false;             // on this machine: it may reset a stop, and guard
  std::uint8_t stops_awaited = 0; // that it asked for, and the loops have not acknowledged
  rt::time_point stop_shown_at{};
  bool bare = false;                  // plain messages may be sent to it
  dialect spoke_last = dialect::bare; // what a text that is no JSON is answered in
  std::uint32_t calls_asked = 0;      // by it, and not answered yet
  std::uint32_t services = 0;         // that it provides
  rate_limit messages;                // of what it says
  rate_limit refusals;                // of what it is refused,
  rate_limit reports;                 // and of the events about that
  std::uint32_t unreported = 0;       // refusals since the last event
  std::uint64_t held_in = 0;          // the sender's turn in which a message to it found no room
  std::uint32_t held_count = 0;       // how many in that turn
  std::uint32_t untaken = 0;          // of its messages, with whoever receives
  std::uint32_t answers_held = 0;     // likewise, in the last turn of whoever receives
  std::uint32_t parked_bytes = 0;
  std::uint64_t messages_in = 0;
  std::uint64_t messages_out = 0;

  rt::time_point opened_at{};
  rt::time_point heard_at{};
  rt::time_point unheard_until{}; // the last time that it was not read
  rt::time_point message_began_at = rt::never;
  std::string_view farewell; // why we close it, as far as there is something to say; outlives the connection

  std::array<char, 64> address{};
  std::size_t address_bytes = 0;

  // Topics on which it published what no handle could take, and when it was told so, in ms since it is there.
  struct misfit {
    std::uint32_t topic = no_index;
    std::uint32_t told_ms = 0;
  };
  std::array<misfit, 2> misfits;
  // Whether it may be told so now: once a second for each topic, and of as many topics as there are places.
  bool may_be_told(std::uint32_t topic, rt::time_point now) noexcept {
    // The clock of one peer ends after 49 days, and then begins anew.
    const auto ms = static_cast<std::uint32_t>((now - opened_at) / std::chrono::milliseconds{1});
    const auto long_ago = [ms](const misfit& one) {
      return one.topic == no_index || ms - one.told_ms >= 1000;
    };
    auto place =
        std::find_if(misfits.begin(), misfits.end(), [&](const misfit& one) { return one.topic == topic; });
    if (place == misfits.end()) place = std::find_if(misfits.begin(), misfits.end(), long_ago);
    if (place == misfits.end() || !long_ago(*place)) return false;
    *place = {topic, ms};
    return true;
  }

  std::string_view peer() const noexcept { return {address.data(), address_bytes}; }
  bool parked() const noexcept { return parked_text != nullptr; }
  bool open() const noexcept { return state == phase::open; }
  // It reads more slowly than we would write, or waits for others who do.
  bool behind() const noexcept { return blocked || held || waits_to_begin; }
};

} // namespace rowe::service
