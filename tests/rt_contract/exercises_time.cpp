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

histogram& empty_histogram(real_time& rt) { return histogram_with(rt, 0); }
histogram& filled_histogram(real_time& rt) { return histogram_with(rt, 1000); }
periodic& loop_in(real_time& rt) { return rt.make<periodic>(1ms); }

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

    {"counter::add", "always", calls_on<made<counter>>([](auto& c) { c.add(); })},
    {"counter::set", "always", calls_on<made<counter>>([](auto& c, auto i) { c.set(i); })},
    {"counter::get", "always", calls_on<made<counter>>([](auto& c) { return c.get(); })},

    {"histogram::record", "values of every size, saturated and negative ones too",
     calls_on<empty_histogram>([](auto& h, auto i) { h.record(value_of(i) - 1ms); })},
    {"histogram::record", "a value many times",
     calls_on<empty_histogram>([](auto& h, auto i) { h.record(value_of(i), 100); })},
    {"histogram::clear", "a filled one", calls_on<filled_histogram>([](auto& h) { h.clear(); })},
    {"histogram::add", "one of the same precision",
     [](real_time& rt) {
       histogram& h = filled_histogram(rt);
       const histogram& other = filled_histogram(rt);
       rt.calls([&](std::uint64_t) { use(h.add(other)); });
     }},
    {"histogram::add", "one of another precision",
     [](real_time& rt) {
       histogram& h = filled_histogram(rt);
       const histogram& other = rt.make<rt::inline_histogram<5>>();
       rt.calls([&](std::uint64_t) { use(h.add(other)); });
     }},
    {"histogram::percentile", "of an empty one",
     calls_on<empty_histogram>([](auto& h) { return h.percentile(99.9); })},
    {"histogram::percentile", "of a filled one",
     calls_on<filled_histogram>([](auto& h, auto i) { return h.percentile(static_cast<double>(i % 101)); })},
    {"histogram::percentiles", "of a filled one", calls_on<filled_histogram>([](auto& h) {
       constexpr std::array percents{50.0, 99.0, 99.9};
       std::array<duration, percents.size()> found;
       h.percentiles(percents, found);
       return found.back();
     })},
    {"histogram::count", "always", calls_on<filled_histogram>([](auto& h) { return h.count(); })},
    {"histogram::saturated", "always", calls_on<filled_histogram>([](auto& h) { return h.saturated(); })},
    {"histogram::min", "always", calls_on<filled_histogram>([](auto& h) { return h.min(); })},
    {"histogram::max", "always", calls_on<filled_histogram>([](auto& h) { return h.max(); })},
    {"histogram::mean", "of an empty one", calls_on<empty_histogram>([](auto& h) { return h.mean(); })},
    {"histogram::mean", "of a filled one", calls_on<filled_histogram>([](auto& h) { return h.mean(); })},
    {"histogram::precision_bits", "always",
     calls_on<empty_histogram>([](auto& h) { return h.precision_bits(); })},
    {"histogram::counters", "always", calls_on<empty_histogram>([](auto& h) { return h.counters(); })},
    {"histogram::index_of", "every value",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::index_of(i << (i % 40), 7)); }); }},
    {"histogram::lowest_of", "every counter",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::lowest_of(i % 3808, 7)); }); }},
    {"histogram::highest_of", "every counter",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(histogram::highest_of(i % 3808, 7)); }); }},

    {"basic_periodic::stop", "a loop that runs, and one that is stopped",
     calls_on<loop_in>([](auto& loop) { loop.stop(); })},
    {"basic_periodic::stopped", "before stop()",
     calls_on<loop_in>([](auto& loop) { return loop.stopped(); })},
    {"basic_periodic::stopped", "after stop()",
     [](real_time& rt) {
       auto& loop = loop_in(rt);
       loop.stop();
       rt.calls([&](std::uint64_t) { use(loop.stopped()); });
     }},
    {"basic_periodic::period", "always", calls_on<loop_in>([](auto& loop) { return loop.period(); })},
    {"basic_periodic::cycles", "always", calls_on<loop_in>([](auto& loop) { return loop.cycles(); })},
    {"basic_periodic::overruns", "always", calls_on<loop_in>([](auto& loop) { return loop.overruns(); })},
    {"basic_periodic::next_deadline", "before the first wait()",
     calls_on<loop_in>([](auto& loop) { return loop.next_deadline(); })},
    {"basic_periodic::next_deadline", "between two waits",
     [](real_time& rt) {
       auto& loop = loop_in(rt);
       (void)loop.wait();
       (void)loop.wait();
       rt.calls([&](std::uint64_t) { use(loop.next_deadline()); });
     }},
    {"basic_periodic::lateness", "always",
     calls_on<loop_in>([](auto& loop) { return loop.lateness().count(); })},
    {"basic_periodic::grants", "always",
     calls_on<loop_in>([](auto& loop) { return loop.grants().complete(); })},
    {"basic_periodic::clock", "always", calls_on<loop_in>([](auto& loop) { return loop.clock(); })},
};

} // namespace

std::span<const exercise> exercises_of_time() { return list; }

} // namespace rowe::contract
