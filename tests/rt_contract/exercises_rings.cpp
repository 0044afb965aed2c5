// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>

namespace rowe::contract {
namespace {

using number_ring = rt::spsc_ring<std::uint64_t>;
using free_ring = rt::free_ring<>;
constexpr std::size_t places = 8192; // its entries span sixteen pages, more than the warming calls touch

struct ring_ends {
  number_ring& ring;
  number_ring::producer& in = *ring.take_producer();
  number_ring::consumer& out = *ring.take_consumer();
};

// With `waiting` items in it, its indices about to wrap.
ring_ends ring_with(real_time& rt, std::size_t waiting) {
  ring_ends ends{rt.make<number_ring>(rt.array<number_ring::entry>(places), ~std::uint64_t{0} - 1000)};
  while (waiting-- > 0) use(ends.in.try_push(waiting));
  return ends;
}
ring_ends empty_ring(real_time& rt) { return ring_with(rt, 0); }
ring_ends half_full_ring(real_time& rt) { return ring_with(rt, places / 2); }
ring_ends full_ring(real_time& rt) { return ring_with(rt, places); }

struct free_ends {
  free_ring& numbers;
  free_ring::producer& borrower = *numbers.take_producer();
  free_ring::consumer& owner = *numbers.take_consumer();
};

free_ends free_with(real_time& rt, std::uint32_t slots_out) {
  free_ends ends{rt.make<free_ring>(rt.array<free_ring::entry>(places), static_cast<std::uint32_t>(places))};
  while (slots_out-- > 0) use(ends.owner.try_take());
  return ends;
}
free_ends all_free(real_time& rt) { return free_with(rt, 0); }
free_ends none_free(real_time& rt) { return free_with(rt, places); }

struct odometry {
  double member[13];
};
using odometry_window = rt::window<odometry>;

struct window_ends {
  odometry_window& window;
  odometry_window::writer& writer = *window.take_writer();
  odometry_window::reader& reader = *window.take_reader();
};

struct core_ends {
  rt::window_core<>& core;
  rt::window_core<>::writer& writer = *core.take_writer();
  rt::window_core<>::reader& reader = *core.take_reader();
};

window_ends new_window(real_time& rt) { return {rt.make<odometry_window>()}; }
core_ends new_core(real_time& rt) { return {rt.make<rt::window_core<>>()}; }

constexpr exercise list[] = {
    {"ring_producer::try_push", "into a ring with room, over the wrap of its indices",
     calls_on<empty_ring>([](auto& r, auto i) {
       use(r.in.try_push(i));
       use(r.out.try_pop());
     })},
    {"ring_producer::try_push", "into a ring that fills up and empties",
     calls_on<empty_ring>([](auto& r, auto i) {
       if (!r.in.try_push(i)) r.out.drain([](std::uint64_t item) { use(item); }, places);
     })},
    {"ring_producer::try_push", "into a full ring",
     calls_on<full_ring>([](auto& r, auto i) { return r.in.try_push(i); })},
    {"ring_producer::room_at_least", "of an empty ring",
     calls_on<empty_ring>([](auto& r) { return r.in.room_at_least(); })},
    {"ring_producer::room_at_least", "of a full ring",
     calls_on<full_ring>([](auto& r) { return r.in.room_at_least(); })},
    {"ring_consumer::try_pop", "from an empty ring",
     calls_on<empty_ring>([](auto& r) { return r.out.try_pop(); })},
    {"ring_consumer::try_pop", "from a ring that empties and fills up", calls_on<full_ring>([](auto& r) {
       if (r.out.try_pop()) return;
       for (std::uint64_t item = 0; r.in.try_push(item);) ++item;
     })},
    {"ring_consumer::drain", "an empty ring",
     calls_on<empty_ring>([](auto& r) { return r.out.drain([](std::uint64_t item) { use(item); }, 64); })},
    {"ring_consumer::drain", "a part of a ring", calls_on<half_full_ring>([](auto& r, auto i) {
       use(r.in.try_push(i));
       use(r.out.drain([](std::uint64_t item) { use(item); }, 1));
     })},
    {"ring_consumer::drain", "a full ring", calls_on<empty_ring>([](auto& r) {
       for (std::uint64_t item = 0; item < 64; ++item) use(r.in.try_push(item));
       use(r.out.drain([](std::uint64_t item) { use(item); }, places));
     })},
    {"ring_consumer::pending_at_least", "in an empty ring",
     calls_on<empty_ring>([](auto& r) { return r.out.pending_at_least(); })},
    {"ring_consumer::pending_at_least", "in a full ring",
     calls_on<full_ring>([](auto& r) { return r.out.pending_at_least(); })},
    {"spsc_ring::capacity", "always", calls_on<empty_ring>([](auto& r) { return r.ring.capacity(); })},
    {"spsc_ring::approximate_size", "of a half full ring",
     calls_on<half_full_ring>([](auto& r) { return r.ring.approximate_size(); })},

    {"free_producer::release", "each number in turn",
     calls_on<all_free>([](auto& h) { h.borrower.release(*h.owner.try_take()); })},
    {"free_producer::release", "after all were out",
     [](real_time& rt) {
       const auto h = none_free(rt);
       std::uint32_t next = 0;
       rt.calls([&](std::uint64_t) {
         if (next < places) {
           h.borrower.release(next++);
         } else {
           while (h.owner.try_take()) next = 0;
         }
       });
     }},
    {"free_consumer::try_take", "when all are out",
     calls_on<none_free>([](auto& h) { return h.owner.try_take(); })},
    {"free_consumer::try_take", "until all are out", calls_on<all_free>([](auto& h) {
       if (h.owner.try_take()) return;
       for (std::uint32_t number = 0; number < places; ++number) h.borrower.release(number);
     })},
    {"free_consumer::free_at_least", "when all are out",
     calls_on<none_free>([](auto& h) { return h.owner.free_at_least(); })},
    {"free_ring::slot_count", "always", calls_on<all_free>([](auto& h) { return h.numbers.slot_count(); })},

    {"core_writer::begin_write", "before and after reads", calls_on<new_core>([](auto& w, auto i) {
       w.writer.end_write(w.writer.begin_write());
       if (i % 3 == 0) use(w.reader.begin_read());
     })},
    {"core_writer::end_write", "without a reader",
     calls_on<new_core>([](auto& w) { w.writer.end_write(w.writer.begin_write()); })},
    {"core_writer::sequence", "always", calls_on<new_core>([](auto& w) { return w.writer.sequence(); })},
    {"core_reader::begin_read", "before the first write",
     calls_on<new_core>([](auto& w) { return w.reader.begin_read(); })},
    {"core_reader::begin_read", "of what was read already",
     [](real_time& rt) {
       const auto w = new_core(rt);
       w.writer.end_write(w.writer.begin_write());
       rt.calls([&](std::uint64_t) { use(w.reader.begin_read()); });
     }},
    {"core_reader::begin_read", "of something new", calls_on<new_core>([](auto& w) {
       w.writer.end_write(w.writer.begin_write());
       use(w.reader.begin_read());
     })},
    {"core_reader::sequence", "always", calls_on<new_core>([](auto& w) { return w.reader.sequence(); })},
    {"window_writer::write", "without a reader",
     calls_on<new_window>([](auto& w, auto i) { w.writer.write({{static_cast<double>(i)}}); })},
    {"window_writer::sequence", "always", calls_on<new_window>([](auto& w) { return w.writer.sequence(); })},
    {"window_reader::read", "before the first write",
     [](real_time& rt) {
       const auto w = new_window(rt);
       odometry value;
       rt.calls([&](std::uint64_t) { use(w.reader.read(value)); });
     }},
    {"window_reader::read", "of what was read already",
     [](real_time& rt) {
       const auto w = new_window(rt);
       w.writer.write({});
       odometry value;
       rt.calls([&](std::uint64_t) { use(w.reader.read(value)); });
     }},
    {"window_reader::read", "of something new",
     [](real_time& rt) {
       const auto w = new_window(rt);
       odometry value;
       rt.calls([&](std::uint64_t i) {
         w.writer.write({{static_cast<double>(i)}});
         use(w.reader.read(value));
       });
     }},
    {"window_reader::sequence", "always", calls_on<new_window>([](auto& w) { return w.reader.sequence(); })},

    {"producer_epoch::advance", "always",
     calls_on<made<rt::producer_epoch<>>>([](auto& epoch) { epoch.advance(); })},
    {"waker::wake", "while nobody sleeps", // and while somebody does: by the handles, under idle::wake
     [](real_time& rt) {
       auto& waker = rt.make<rt::waker<>>(rt::eventfd_signal{});
       auto& epoch = rt.make<rt::producer_epoch<>>();
       rt.calls([&](std::uint64_t) { waker.wake(epoch); });
     }},
};

} // namespace

std::span<const exercise> exercises_of_rings() { return list; }

} // namespace rowe::contract
