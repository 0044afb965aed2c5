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
timer_wheel& empty_wheel(real_time& rt) { return wheel_with(rt, 0); }
timer_wheel& half_full_wheel(real_time& rt) { return wheel_with(rt, entries / 2); }
timer_wheel& full_wheel(real_time& rt) { return wheel_with(rt, entries); }

constexpr exercise list[] = {
    {"basic_timer_wheel::insert", "into an empty wheel", calls_on<empty_wheel>([](auto& wheel, auto i) {
       wheel.insert(node_of(i), start + ttl_of(i));
       wheel.cancel(node_of(i));
     })},
    {"basic_timer_wheel::insert", "an entry that is on the wheel, which moves it",
     calls_on<full_wheel>([](auto& wheel, auto i) { wheel.insert(node_of(i), start + ttl_of(i)); })},
    {"basic_timer_wheel::insert", "with an expiry in the past, far away or never",
     [](real_time& rt) {
       auto& wheel = half_full_wheel(rt);
       constexpr time_point odd[] = {start - 1s, time_point{}, rt::never - 1ns, rt::never};
       rt.calls([&](std::uint64_t i) { wheel.insert(node_of(i), odd[i % 4]); });
     }},
    {"basic_timer_wheel::cancel", "an entry that is on the wheel",
     calls_on<full_wheel>([](auto& wheel, auto i) {
       wheel.cancel(node_of(i));
       wheel.insert(node_of(i), start + ttl_of(i));
     })},
    {"basic_timer_wheel::cancel", "an entry that is not",
     calls_on<empty_wheel>([](auto& wheel, auto i) { wheel.cancel(node_of(i)); })},
    {"basic_timer_wheel::prefetch", "an entry that is on the wheel",
     calls_on<full_wheel>([](auto& wheel, auto i) { wheel.prefetch(node_of(i)); })},
    {"basic_timer_wheel::prefetch_neighbours", "of entries on the wheel and of others",
     calls_on<half_full_wheel>([](auto& wheel, auto i) { wheel.prefetch_neighbours(node_of(i)); })},
    {"basic_timer_wheel::expire", "when nothing is due",
     calls_on<full_wheel>([](auto& wheel) { return wheel.expire(start); })},
    {"basic_timer_wheel::expire", "as time passes, over all levels",
     [](real_time& rt) {
       auto& wheel = full_wheel(rt);
       time_point now = start;
       rt.calls([&](std::uint64_t i) {
         now += 2us;
         for (std::uint32_t node; (node = wheel.expire(now)) != timer_wheel::none;)
           wheel.insert(node, now + ttl_of(i));
       });
     }},
    {"basic_timer_wheel::expire", "in jumps",
     [](real_time& rt) {
       auto& wheel = full_wheel(rt);
       time_point now = start;
       rt.calls([&](std::uint64_t i) {
         now += ttl_of(i) / 1000;
         for (std::uint32_t node; (node = wheel.expire(now)) != timer_wheel::none;)
           wheel.insert(node, now + ttl_of(i));
       });
     }},
    {"basic_timer_wheel::next_wake", "of an empty wheel",
     calls_on<empty_wheel>([](auto& wheel) { return wheel.next_wake(); })},
    {"basic_timer_wheel::next_wake", "of a full wheel",
     calls_on<full_wheel>([](auto& wheel) { return wheel.next_wake(); })},
    {"basic_timer_wheel::contains", "always",
     calls_on<half_full_wheel>([](auto& wheel, auto i) { return wheel.contains(node_of(i)); })},
    {"basic_timer_wheel::expiry_of", "always",
     calls_on<half_full_wheel>([](auto& wheel, auto i) { return wheel.expiry_of(node_of(i)); })},
    {"basic_timer_wheel::size", "always",
     calls_on<half_full_wheel>([](auto& wheel) { return wheel.size(); })},
    {"basic_timer_wheel::empty", "always",
     calls_on<half_full_wheel>([](auto& wheel) { return wheel.empty(); })},
};

} // namespace

std::span<const exercise> exercises_of_the_wheel() { return list; }

} // namespace rowe::contract
