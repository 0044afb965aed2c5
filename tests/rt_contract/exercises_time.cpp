// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/clock.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/histogram.hpp>
#include <rowe/rt/periodic.hpp>

namespace rowe::contract {
namespace {

using namespace std::chrono_literals;
using rt::counter;
using rt::duration;
using rt::histogram;
using rt::periodic;
using rt::time_point;
using histogram_inside = rt::inline_histogram<7>; // its counters span seven pages

duration value_of(std::uint64_t i) {
  return duration{static_cast<std::int64_t>((i * 0x9E3779B97F4A7C15) >> 24)};
}

histogram& histogram_with(real_time& rt, std::uint64_t values) {
  auto& h = rt.make<histogram_inside>();
  for (std::uint64_t i = 0; i < values; ++i) h.record(value_of(i));
  return h;
}

template <class Call>
void with_loop(real_time& rt, Call call) {
  rt.calls_on(rt.make<periodic>(1ms), [call](auto& loop, auto) { return call(loop); });
}

constexpr exercise list[] = {
    {"monotonic_clock::now", "always",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(rt::monotonic_clock::now()); }); }, true},
    {"deadline_after", "a time and a finite wait",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(rt::deadline_after(time_point{1s}, value_of(i))); });
     }},
    {"deadline_after", "a time and a wait for ever",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) {
         use(rt::deadline_after(time_point{1s}, i % 2 == 0 ? -1ns : rt::for_ever));
       });
     }},
    {"nanoseconds_of", "a time",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(rt::nanoseconds_of(time_point{value_of(i)})); });
     }},

    {"counter::add", "always",
     [](real_time& rt) { rt.calls_on(rt.make<counter>(), [](auto& c, auto) { c.add(); }); }},
    {"counter::set", "always",
     [](real_time& rt) { rt.calls_on(rt.make<counter>(), [](auto& c, auto i) { c.set(i); }); }},
    {"counter::get", "always",
     [](real_time& rt) { rt.calls_on(rt.make<counter>(), [](auto& c, auto) { return c.get(); }); }},

    {"histogram::record", "values of every size, saturated and negative ones too",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 0), [](auto& h, auto i) { h.record(value_of(i) - 1ms); });
     }},
    {"histogram::record", "a value many times",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 0), [](auto& h, auto i) { h.record(value_of(i), 100); });
     }},
    {"histogram::clear", "a filled one",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { h.clear(); }); }},
    {"histogram::add", "one of the same precision",
     [](real_time& rt) {
       histogram& h = histogram_with(rt, 1000);
       const histogram& other = histogram_with(rt, 1000);
       rt.calls([&](std::uint64_t) { use(h.add(other)); });
     }},
    {"histogram::add", "one of another precision",
     [](real_time& rt) {
       histogram& h = histogram_with(rt, 1000);
       const histogram& other = rt.make<rt::inline_histogram<5>>();
       rt.calls([&](std::uint64_t) { use(h.add(other)); });
     }},
    {"histogram::percentile", "of an empty one",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 0), [](auto& h, auto) { return h.percentile(99.9); });
     }},
    {"histogram::percentile", "of a filled one",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 1000),
                   [](auto& h, auto i) { return h.percentile(static_cast<double>(i % 101)); });
     }},
    {"histogram::count", "always",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { return h.count(); }); }},
    {"histogram::saturated", "always",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { return h.saturated(); });
     }},
    {"histogram::min", "always",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { return h.min(); }); }},
    {"histogram::max", "always",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { return h.max(); }); }},
    {"histogram::mean", "of an empty one",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 0), [](auto& h, auto) { return h.mean(); }); }},
    {"histogram::mean", "of a filled one",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 1000), [](auto& h, auto) { return h.mean(); }); }},
    {"histogram::precision_bits", "always",
     [](real_time& rt) {
       rt.calls_on(histogram_with(rt, 0), [](auto& h, auto) { return h.precision_bits(); });
     }},
    {"histogram::counters", "always",
     [](real_time& rt) { rt.calls_on(histogram_with(rt, 0), [](auto& h, auto) { return h.counters(); }); }},
    {"histogram::index_of", "every value",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::index_of(i << (i % 40), 7)); }); }},
    {"histogram::lowest_of", "every counter",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::lowest_of(i % 3808, 7)); }); }},
    {"histogram::highest_of", "every counter",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::highest_of(i % 3808, 7)); }); }},

    {"basic_periodic::stop", "a loop that runs, and one that is stopped",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { loop.stop(); }); }},
    {"basic_periodic::stopped", "before stop()",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.stopped(); }); }},
    {"basic_periodic::stopped", "after stop()",
     [](real_time& rt) {
       auto& loop = rt.make<periodic>(1ms);
       loop.stop();
       rt.calls([&](std::uint64_t) { use(loop.stopped()); });
     }},
    {"basic_periodic::period", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.period(); }); }},
    {"basic_periodic::cycles", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.cycles(); }); }},
    {"basic_periodic::overruns", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.overruns(); }); }},
    {"basic_periodic::next_deadline", "before the first wait()",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.next_deadline(); }); }},
    {"basic_periodic::next_deadline", "between two waits",
     [](real_time& rt) {
       auto& loop = rt.make<periodic>(1ms);
       (void)loop.wait();
       (void)loop.wait();
       rt.calls([&](std::uint64_t) { use(loop.next_deadline()); });
     }},
    {"basic_periodic::lateness", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.lateness().count(); }); }},
    {"basic_periodic::grants", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.grants().complete(); }); }},
    {"basic_periodic::clock", "always",
     [](real_time& rt) { with_loop(rt, [](auto& loop) { return loop.clock(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_time() { return list; }

} // namespace rowe::contract
