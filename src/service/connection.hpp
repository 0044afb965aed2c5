// SPDX-License-Identifier: Apache-2.0
// What the core knows of one peer: the parser of its frames, what waits to be written to it, and when it was
// last heard. Service thread only.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/rt/clock.hpp>

#include "service/calls.hpp"
#include "service/rate_limit.hpp"
#include "service/transport.hpp"
#include "wire/protocols.hpp"
#include "wire/websocket.hpp"

namespace rowe::service {

// What a peer that came for the stop alone is told of everything else.
inline constexpr std::string_view stop_only_sentence =
    "a connection on /rowe/stop may only stop the robot (/rowe/stop) and see that (/rowe/stop/state)";

struct advertisement {
  std::uint32_t topic = no_index;
  bool latched = false; // what this peer publishes there is kept for those who come late
};

struct connection {
  enum class phase : std::uint8_t { free, open, closing };

  connection_id id;
  phase state = phase::free;
  side ours = side::server;
  bool unheard = false; // the carrier does not read it: its pongs and its silence mean nothing
  const wire::protocol* protocol = nullptr; // of one that is not free
  wire::severity status_level = wire::severity::error;

  std::uint32_t first_subscription = no_index;
  std::uint32_t subscriptions = 0;
  std::span<advertisement> advertised; // `advertisements` of them in use
  std::uint32_t advertisements = 0;

  bool stop_only = false;         // it came on stop_path: see stop_peers.cpp
  rt::time_point stopped_at{};    // when it last stopped a robot that could move
  bool local = false;             // on this machine: it may reset a stop, and guard
  std::uint8_t stops_awaited = 0; // that it asked for, and the loops have not acknowledged
  rt::time_point stop_shown_at{};
  bool takes_messages = false;   // plain ones may be sent to it
  wire::codec_id spoke_last{};   // in which it is answered where its words do not tell
  std::uint32_t calls_asked = 0; // by it, and not answered yet
  std::uint32_t services = 0;    // that it provides
  rate_limit messages;           // of what it says
  rate_limit refusals;           // of what it is refused,
  rate_limit reports;            // and of the events about that
  std::uint32_t unreported = 0;  // refusals since the last event
  std::uint64_t messages_in = 0;
  std::uint64_t messages_out = 0;

  rt::time_point opened_at{};
  rt::time_point heard_at{};
  rt::time_point unheard_until{}; // the last time that it was not read
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
  bool open() const noexcept { return state == phase::open; }
};

} // namespace rowe::service
