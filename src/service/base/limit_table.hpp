// SPDX-License-Identifier: Apache-2.0
// Every limit with its name and its range, in one table: what is checked when an endpoint opens, what
// /rowe/stats says, and how limits are set by their names.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/result.hpp>

namespace rowe::service {

struct limit_row {
  argument which;
  std::uint64_t (*of)(const limits& bounds) noexcept;
  void (*set)(limits& bounds, std::uint64_t value) noexcept; // within the range
  std::uint64_t least;
  std::uint64_t most;
};

template <auto Member>
consteval limit_row limit_between(argument which, std::uint64_t least, std::uint64_t most) noexcept {
  return {which, [](const limits& bounds) noexcept -> std::uint64_t { return bounds.*Member; },
          [](limits& bounds, std::uint64_t value) noexcept {
            bounds.*Member = static_cast<std::remove_reference_t<decltype(bounds.*Member)>>(value);
          },
          least, most};
}

inline constexpr std::uint64_t many = 1U << 20;

// The range of each limit alone, in the order of the struct. Within these ranges all products fit into 64
// bits. Whether there is enough memory, the arena says.
inline constexpr std::array limit_table{
    limit_between<&limits::connections_max>(argument::connections_max, 1, 65536),
    limit_between<&limits::connections_per_address_max>(argument::connections_per_address_max, 1, 65536),
    limit_between<&limits::handshakes_max>(argument::handshakes_max, 1, 1024),
    limit_between<&limits::handshake_bytes>(argument::handshake_bytes, 1U << 16, 1U << 26),
    limit_between<&limits::message_bytes_max>(argument::message_bytes_max, 128, 1U << 26),
    limit_between<&limits::fragments_max>(argument::fragments_max, 1, many),
    limit_between<&limits::depth_max>(argument::depth_max, 1, 1024),
    limit_between<&limits::messages_per_second_max>(argument::messages_per_second_max, 0, 1'000'000'000),
    limit_between<&limits::refusals_per_second_max>(argument::refusals_per_second_max, 0, 1'000'000'000),
    limit_between<&limits::long_message_bytes_max>(argument::long_message_bytes_max, 0, 1U << 26),
    limit_between<&limits::long_slots>(argument::long_slots, 4, 1024),
    limit_between<&limits::topics_max>(argument::topics_max, 3, many),
    limit_between<&limits::topic_bytes_max>(argument::topic_bytes_max, 16, 255), // queue_pair::name_bytes_max
    limit_between<&limits::subscriptions_max>(argument::subscriptions_max, 1, many),
    limit_between<&limits::subscriptions_per_connection_max>(argument::subscriptions_per_connection_max, 1,
                                                             many),
    limit_between<&limits::advertisements_per_connection_max>(argument::advertisements_per_connection_max, 1,
                                                              many),
    limit_between<&limits::small_slots>(argument::small_slots, 1, many),
    limit_between<&limits::small_slot_bytes>(argument::small_slot_bytes, 128, 1U << 26),
    limit_between<&limits::large_slots>(argument::large_slots, 1, many),
    limit_between<&limits::queue_depth_max>(argument::queue_depth_max, 1, many),
    limit_between<&limits::queued_max>(argument::queued_max, 1, many),
    limit_between<&limits::latched_bytes>(argument::latched_bytes, 0, 1U << 30),
    limit_between<&limits::services_max>(argument::services_max, 1, 65536),
    limit_between<&limits::calls_max>(argument::calls_max, 1, 65536),
    limit_between<&limits::calls_per_connection_max>(argument::calls_per_connection_max, 1, 65536),
    limit_between<&limits::parameters_max>(argument::parameters_max, 0, 65536),
    limit_between<&limits::door_slots>(argument::door_slots, 1, 4096),
    limit_between<&limits::door_slot_bytes>(argument::door_slot_bytes, 128, 1U << 26),
    limit_between<&limits::handles_max>(argument::handles_max, 1, 1024),
    limit_between<&limits::handle_bytes>(argument::handle_bytes, 0, 1U << 30),
    limit_between<&limits::events_max>(argument::events_max, 1, many),
};

// How many members the struct has: as many as it can be initialised with.
struct anything {
  template <class T>
  constexpr operator T() const noexcept; // NOLINT(google-explicit-constructor): that it converts is all
};
template <std::size_t... Index>
consteval bool limits_take(std::index_sequence<Index...>) noexcept {
  return requires { limits{(static_cast<void>(Index), anything{})...}; };
}
static_assert(limits_take(std::make_index_sequence<limit_table.size()>{}) &&
                  !limits_take(std::make_index_sequence<limit_table.size() + 1>{}),
              "each limit has its row");

} // namespace rowe::service
