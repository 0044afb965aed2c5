// SPDX-License-Identifier: Apache-2.0
// What the core knows of one peer: its address, its protocol, and when it was last heard. Service thread
// only.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include <rowe/connection.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/rate_limit.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/transport.hpp"
#include "wire/protocols/protocols.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::service {

// The answer to a peer on stop_path when it asks for anything but the stop.
inline constexpr std::string_view stop_only_diagnostic =
    "a connection on /rowe/stop may only stop the robot (/rowe/stop) and read its state (/rowe/stop/state)";

inline constexpr std::string_view no_binary_diagnostic = "binary messages have no meaning here";

// The report to a peer for which messages were dropped. Programs list problems by their words, so it has no
// number that changes.
inline constexpr std::string_view losses_diagnostic =
    "messages for this client were dropped, because it reads more slowly than they come: subscribe to less, "
    "or "
    "publish less often (/rowe/stats counts them, as outbox_full and evicted)";

// Whether a peer is on this machine, by its address.
constexpr bool is_loopback(std::string_view address) noexcept {
  return address.starts_with("127.") || address.starts_with("[::1]");
}

// The number of a peer in the rules of the stop and of drivers. It is never used again.
constexpr std::uint64_t key_of(connection_id id) noexcept {
  return std::uint64_t{id.generation} << 32 | id.index;
}
inline constexpr std::uint64_t key_of_this_process = 1; // a peer's is never so small

struct connection {
  // to_close: see peer_table::close_later()
  enum class phase : std::uint8_t { free, open, to_close, closing };

  connection_id id;
  phase state = phase::free;
  side ours = side::server;
  bool unheard = false;    // we do not read it, so its pongs and its silence say nothing
  bool gone = false;       // nobody reads what we answer; what it sent before is still read
  wire::list_place list{}; // of the message that is being read: the requests from here on are left
  const wire::protocol* protocol = nullptr; // set unless the row is free

  bool stop_only = false;      // it came on stop_path: see core.cpp
  bool local = false;          // on this machine
  access::subject who{};       // its role, if there are roles
  identity_name identity;      // as whom it came in; the same when rights change
  bool takes_messages = false; // plain messages may be sent to it
  wire::codec_id spoke_last{}; // the codec to answer in, if a message does not say
  rate_limit messages;         // limits what it says
  rt::time_point said_at{};    // when it was read last; all that was read then may wait, or be parked
  std::uint64_t messages_in = 0;
  std::uint64_t messages_out = 0;

  rt::time_point opened_at{};
  rt::time_point heard_at{};
  rt::time_point unheard_until{};    // when we last did not read it
  rt::time_point losses_next{};      // when the next report may say that messages for it were dropped,
  std::uint32_t losses_reported = 0; // and how many were reported: peer_queues::dropped
  std::uint16_t closes_as = 0;       // close code; to_close
  std::uint16_t address_bytes = 0;
  std::string_view close_reason; // or empty; the text outlives the peer

  std::array<char, 64> address{};

  // A topic on which it published a message that no handle could decode, and when that was reported, in ms
  // since it connected.
  struct reported_topic {
    topic_id topic{};
    std::uint32_t told_ms = 0;
  };
  std::array<reported_topic, 2> reported_topics;
  // Whether it may get a report now: once a second for each topic, and for as many topics as there are
  // places.
  bool may_report(topic_id topic, rt::time_point now) noexcept {
    // The milliseconds wrap around after 49 days.
    const auto ms = static_cast<std::uint32_t>((now - opened_at) / std::chrono::milliseconds{1});
    const auto long_ago = [ms](const reported_topic& one) {
      return !one.topic || ms - one.told_ms >= undecodable_period / std::chrono::milliseconds{1};
    };
    auto place = std::find_if(reported_topics.begin(), reported_topics.end(),
                              [&](const reported_topic& one) { return one.topic == topic; });
    if (place == reported_topics.end())
      place = std::find_if(reported_topics.begin(), reported_topics.end(), long_ago);
    if (place == reported_topics.end() || !long_ago(*place)) return false;
    *place = {topic, ms};
    return true;
  }

  // For people: its identity's name; without one its address.
  std::string_view name() const noexcept { return identity.empty() ? peer() : identity.view(); }
  std::string_view peer() const noexcept { return {address.data(), address_bytes}; }
  bool open() const noexcept { return state == phase::open; }
};

} // namespace rowe::service
