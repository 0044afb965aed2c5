// SPDX-License-Identifier: Apache-2.0
// What the core is given when it is made: its options, and the seams to what is outside it.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/options.hpp>
#include <rowe/rt/clock.hpp>

#include "service/base/transport.hpp"
#include "service/threads/policy_handover.hpp"
#include "wire/protocols/protocols.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

// Where random bytes come from: the kernel, or a seed. Masks of a client's frames must be unpredictable (RFC
// 6455 10.3); the back-off of reconnecting wants jitter.
class entropy {
 public:
  virtual void fill(std::span<std::byte> bytes) noexcept = 0;
  std::uint64_t number() noexcept {
    std::array<std::byte, sizeof(std::uint64_t)> bytes;
    fill(bytes);
    return std::bit_cast<std::uint64_t>(bytes);
  }

 protected:
  ~entropy() = default;
};

// The stop's options, with the service_timeout that holds where they leave it open: by whether the service
// thread has real-time priority.
constexpr stop_options settled(stop_options of, bool real_time) noexcept {
  if (of.service_timeout == rt::duration::zero()) of.service_timeout = service_timeout_default(real_time);
  return of;
}

// What of an endpoint's options the core needs.
struct core_options {
  limits bounds;
  side ours = side::server;
  bool relay = false;
  bool messages_unasked = false; // plain messages also go to peers that have sent none
  bool answers_any = false;
  bool handles_wake = false; // a handle that submits something wakes the service thread
  bool predicts = false;     // values are expected by their periods (publish_predictor)
  rt::duration inbound_ttl = rt::for_ever;
  rt::duration call_timeout = rt::for_ever;
  std::string_view name; // copied
  rt::duration ping_period;
  rt::duration silence_max;
  rt::duration message_time_max;
  rt::duration stats_period;
  rt::duration retry_min;
  rt::duration retry_max;
  stop_options stop;
  std::int64_t wall_offset_ns = 0; // from the endpoint's clock to the time since 1970

  // When a peer's message expires: after its own time to live, unless that is negative, or after ours,
  // whichever is earlier.
  rt::time_point inbound_expiry(rt::time_point now, std::int64_t ttl_ns = wire::unlimited) const noexcept {
    return std::min(rt::deadline_after(now, rt::duration{ttl_ns}), rt::deadline_after(now, inbound_ttl));
  }

  static core_options from(const endpoint_options& options, side ours, std::string_view name) noexcept {
    return {.bounds = options.limits,
            .ours = ours,
            .relay = options.relay,
            .messages_unasked = options.plain_unasked,
            .answers_any = options.answers_any,
            .handles_wake = options.idle_policy == idle::wake,
            .predicts = options.idle_policy == idle::phase,
            .inbound_ttl = options.inbound_ttl,
            .call_timeout = options.call_timeout,
            .name = name,
            .ping_period = options.ping_period,
            .silence_max = options.silence_max,
            .message_time_max = options.message_time_max,
            .stats_period = options.stats_period,
            .retry_min = options.retry_min,
            .retry_max = options.retry_max,
            .stop = options.stop};
  }
};

struct core_seams {
  class transport& transport;
  entropy& random;
  json::reader& validator;
  const page_source* pages; // nullptr: none
  const wire::protocol_set& protocols;
  policy_handover<>& access; // who may do what
  // The time now, which is later than the cycle's. None: time stands still during a cycle.
  rt::time_point (*clock)() noexcept = nullptr;
  std::span<std::byte> chunk_pool = {};      // for long messages (chunk_store.hpp); empty: there are none
  class pool_opener* chunk_opener = nullptr; // none: all of the pool can be used
};

} // namespace rowe::service
