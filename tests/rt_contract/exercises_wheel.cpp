// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/timer_wheel.hpp>

namespace rowe::contract {
namespace {

using namespace std::chrono_literals;
using rt::duration;
using rt::time_point;
using rt::timer_node;
using rt::timer_wheel;

constexpr std::uint32_t entries = 4096; // their nodes span sixteen pages
constexpr time_point start{1000s};

std::uint32_t node_of(std::uint64_t i) { return static_cast<std::uint32_t>(i % entries); }

// From one millisecond to ten seconds.
duration ttl_of(std::uint64_t i) {
  return 1ms + duration{static_cast<std::int64_t>((i * 0x9E3779B97F4A7C15) % 9'999'000'000)};
}

timer_wheel& wheel_with(real_time& rt, std::uint32_t inserted) {
  auto& wheel = rt.make<timer_wheel>(rt.array<timer_node>(entries), start);
  for (std::uint32_t node = 0; node < inserted; ++node) wheel.insert(node, start + ttl_of(node));
  return wheel;
}

constexpr exercise list[] = {
    {"basic_timer_wheel::insert", "into an empty wheel",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, 0), [](auto& wheel, auto i) {
         wheel.insert(node_of(i), start + ttl_of(i));
         wheel.cancel(node_of(i));
       });
     }},
    {"basic_timer_wheel::insert", "an entry that is on the wheel, which moves it",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries),
                   [](auto& wheel, auto i) { wheel.insert(node_of(i), start + ttl_of(i)); });
     }},
    {"basic_timer_wheel::insert", "with an expiry in the past, far away or never",
     [](real_time& rt) {
       auto& wheel = wheel_with(rt, entries / 2);
       constexpr time_point odd[] = {start - 1s, time_point{}, rt::never - 1ns, rt::never};
       rt.calls([&](std::uint64_t i) { wheel.insert(node_of(i), odd[i % 4]); });
     }},
    {"basic_timer_wheel::cancel", "an entry that is on the wheel",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries), [](auto& wheel, auto i) {
         wheel.cancel(node_of(i));
         wheel.insert(node_of(i), start + ttl_of(i));
       });
     }},
    {"basic_timer_wheel::cancel", "an entry that is not",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, 0), [](auto& wheel, auto i) { wheel.cancel(node_of(i)); });
     }},
    {"basic_timer_wheel::prefetch", "an entry that is on the wheel",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries), [](auto& wheel, auto i) { wheel.prefetch(node_of(i)); });
     }},
    {"basic_timer_wheel::prefetch_neighbours", "of entries on the wheel and of others",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries / 2),
                   [](auto& wheel, auto i) { wheel.prefetch_neighbours(node_of(i)); });
     }},
    {"basic_timer_wheel::expire", "when nothing is due",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries), [](auto& wheel, auto) { return wheel.expire(start); });
     }},
    {"basic_timer_wheel::expire", "as time passes, over all levels",
     [](real_time& rt) {
       auto& wheel = wheel_with(rt, entries);
       time_point now = start;
       rt.calls([&](std::uint64_t i) {
         now += 2us;
         for (std::uint32_t node; (node = wheel.expire(now)) != timer_wheel::none;)
           wheel.insert(node, now + ttl_of(i));
       });
     }},
    {"basic_timer_wheel::expire", "in jumps",
     [](real_time& rt) {
       auto& wheel = wheel_with(rt, entries);
       time_point now = start;
       rt.calls([&](std::uint64_t i) {
         now += ttl_of(i) / 1000;
         for (std::uint32_t node; (node = wheel.expire(now)) != timer_wheel::none;)
           wheel.insert(node, now + ttl_of(i));
       });
     }},
    {"basic_timer_wheel::next_wake", "of an empty wheel",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, 0), [](auto& wheel, auto) { return wheel.next_wake(); });
     }},
    {"basic_timer_wheel::next_wake", "of a full wheel",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries), [](auto& wheel, auto) { return wheel.next_wake(); });
     }},
    {"basic_timer_wheel::contains", "always",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries / 2),
                   [](auto& wheel, auto i) { return wheel.contains(node_of(i)); });
     }},
    {"basic_timer_wheel::expiry_of", "always",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries / 2),
                   [](auto& wheel, auto i) { return wheel.expiry_of(node_of(i)); });
     }},
    {"basic_timer_wheel::size", "always",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries / 2), [](auto& wheel, auto) { return wheel.size(); });
     }},
    {"basic_timer_wheel::empty", "always",
     [](real_time& rt) {
       rt.calls_on(wheel_with(rt, entries / 2), [](auto& wheel, auto) { return wheel.empty(); });
     }},
};

} // namespace

std::span<const exercise> exercises_of_the_wheel() { return list; }

} // namespace rowe::contract
