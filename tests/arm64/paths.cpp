// SPDX-License-Identifier: Apache-2.0
// What threads of a real-time program do to each other's memory, a function each, compiled for arm64
// (ARMv8.0) and read by orders.py. The line above a function names the ordering instructions that it is
// compiled to, no more and no fewer: an acquire or seq_cst load is one `ldar`, such a store one `stlr`, and
// between the two the processor keeps the order that window.hpp needs. So there is no barrier (`dmb`) on
// these paths, and no `ldaxr` with its `stlxr`, which is a loop. Where the order of the instructions is part
// of an argument, and no branch lets the compiler lay them out in another one, it is "in this order". What is
// no real-time path says so, and may exchange: by a function of the compiler's, which picks the instruction
// that the processor has.
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

// For orders.py to see that it would notice: every order that was asked for is dropped.
#ifdef WEAKENED
#define memory_order_acquire memory_order_relaxed
#define memory_order_release memory_order_relaxed
#define memory_order_seq_cst memory_order_relaxed
#endif

#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/stop_permit.hpp>
#include <rowe/lane.hpp>
#include <rowe/publisher.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/waker.hpp>
#include <rowe/rt/window.hpp>
#include <rowe/subscriber.hpp>

namespace rt = rowe::rt;

struct pose {
  double stamp, x, y, heading;
};
template <>
inline constexpr auto rowe::schema<pose> = rowe::fields<&pose::stamp, &pose::x, &pose::y, &pose::heading>{};

using ring = rt::spsc_ring<std::uint32_t>;
using window = rt::window<pose>;
using core = rt::window_core<>;

extern "C" {
void wait_for_the_signal();

// ---- rowe/rt/spsc_ring.hpp

// expects: ldar stlr
bool ring_try_push(ring::producer& end, const std::uint32_t& item) { return end.try_push(item); }
// expects: ldar
std::size_t ring_room(ring::producer& end) { return end.room_at_least(); }
// expects: ldar stlr
bool ring_try_pop(ring::consumer& end, std::uint32_t& item) {
  const auto popped = end.try_pop();
  if (popped) item = *popped;
  return popped.has_value();
}
// expects: ldar stlr
std::size_t ring_drain(ring::consumer& end, std::uint64_t& sum) {
  return end.drain([&](const std::uint32_t& item) { sum += item; }, 64);
}
// expects: ldar
std::size_t ring_waiting(ring::consumer& end) { return end.pending_at_least(); }
// expects: ldar
std::size_t ring_approximate_size(const ring& of) { return of.approximate_size(); }
// Not real-time: set-up.
// expects: call:__aarch64_swp1_acq_rel
ring::producer* ring_take_producer(ring& of) { return of.take_producer(); }

// ---- rowe/rt/free_ring.hpp

// expects: stlr
void free_release(rt::free_ring<>::producer& end, std::uint32_t slot) { end.release(slot); }
// expects: ldar
bool free_try_take(rt::free_ring<>::consumer& end, std::uint32_t& slot) {
  const auto taken = end.try_take();
  if (taken) slot = *taken;
  return taken.has_value();
}
// expects: ldar
std::size_t free_count(rt::free_ring<>::consumer& end) { return end.free_at_least(); }

// ---- rowe/rt/window.hpp

// expects: ldar
std::uint32_t window_begin_write(core::writer& end) { return end.begin_write(); }
// The newest slot of the pair, the pair, the number.
// expects in this order: stlr stlr stlr
void window_end_write(core::writer& end, std::uint32_t slot) { end.end_write(slot); }
// The number, the pair; the pair being read, before the newest slot of it.
// expects in this order: ldar ldar stlr ldar
core::view window_begin_read(core::reader& end) { return end.begin_read(); }
// expects in this order: ldar stlr stlr stlr
void window_write(window::writer& end, const pose& value) { end.write(value); }
// expects in this order: ldar ldar stlr ldar
rt::freshness window_read(window::reader& end, pose& value) { return end.read(value); }

// ---- rowe/rt/counter.hpp: a number, and nothing by it

// expects: nothing
void counter_add(rt::counter& of) { of.add(); }
// expects: nothing
std::uint64_t counter_get(const rt::counter& of) { return of.get(); }

// ---- rowe/rt/notification.hpp

// Not real-time: it may enter the kernel.
// expects: call:__aarch64_swp4_acq_rel call:_ZN4rowe2rt5futex4wakeERNS0_11std_atomics8variableIjEE
void notify(rt::notification<>& of) { of.notify(); }

// ---- rowe/rt/waker.hpp

// Its count, before it looks whether the other sleeps; the call of the kernel only if so.
// expects in this order: stlr ldar call:_ZNK4rowe2rt14eventfd_signal5raiseEv
void waker_wake(rt::waker<>& waker, rt::producer_epoch<>& epoch) { waker.wake(epoch); }
// That it sleeps, before it looks whether the count is as it was.
// expects in this order: stlr ldar call:wait_for_the_signal
void waker_sleep(rt::waker<>& waker, rt::producer_epoch<>& epoch) {
  waker.sleep([&] { return epoch.quiet(); }, [] { wait_for_the_signal(); });
}
// expects: ldar
void epoch_mark(rt::producer_epoch<>& epoch) { epoch.mark(); }

// ---- rowe/detail/stop_permit.hpp

// The permit; the number at which the loop is tripped. That it checked in is a time and no more.
// expects in this order: ldar stlr
bool stop_engaged(const rowe::detail::permit_word<>& granted, rowe::detail::latch_words<>& words,
                  rowe::detail::latch_memory& own, rowe::time_point now) {
  return rowe::detail::latch_engaged(granted, words, own, now);
}
// What the loop commanded stands before it.
// expects: stlr
void stop_acknowledge(rowe::detail::latch_words<>& words, rowe::detail::latch_memory& own,
                      rowe::time_point now) {
  rowe::detail::latch_acknowledge(words, own, now);
}
// expects: stlr
void stop_withdraw(rowe::detail::permit_word<>& granted, rowe::detail::latch_number number) {
  granted.withdraw(number);
}
// expects: stlr
void stop_grant(rowe::detail::permit_word<>& granted, rowe::detail::latch_number number,
                rowe::time_point until) {
  granted.grant(number, until);
}
// expects: ldar
std::uint64_t stop_acknowledged(const rowe::detail::latch_words<>& words, rowe::time_point now) {
  return words.acknowledged(now).number;
}

// ---- handles

// keep::newest: looks which pair is being read, and makes the value the newest. keep::all: takes a slot that
// came free and pushes its number, looking whether the ring is full. Then, under idle::wake, the signal.
// Whether somebody listens is advice.
// expects: ldar stlr stlr stlr ldar ldar stlr stlr ldar call:_ZNK4rowe2rt14eventfd_signal5raiseEv
std::uint32_t publish(rowe::publisher<pose>& to, const pose& value, rowe::time_point now) {
  return static_cast<std::uint32_t>(to.publish(value, now).code());
}
// Whether it is closed; then the window's read, or a pop, after which the slot is released (in two places:
// as the view that is destroyed, and as the one that was moved from). Where values have times to live, the
// time, and pops and releases of those whose is over.
// expects: 7*ldar 5*stlr 2*call:clock_gettime
std::uint32_t take(rowe::subscriber<pose>& from, pose& value) {
  auto taken = from.try_take();
  if (taken) value = taken->value();
  return static_cast<std::uint32_t>(taken.code());
}
// Whether it is closed; a slot that was released; its number into the ring, looking whether that is full; the
// signal. Twice: simply, and where half of the slots wait for room (post_barred()).
// expects: 9*ldar 4*stlr 2*call:memcpy 2*call:_ZNK4rowe2rt14eventfd_signal5raiseEv
std::uint32_t send(rowe::lane& to, std::string_view text, rowe::duration ttl, rowe::time_point now) {
  return static_cast<std::uint32_t>(to.try_send(text, ttl, now).code());
}
// Whether it is closed; pops, and what is out of date is released; so is what was taken, at the end.
// expects: ldar ldar ldar stlr stlr stlr
void receive(rowe::lane& from, rowe::time_point now, std::size_t& bytes) {
  const auto came = from.try_receive(now);
  if (came) bytes += came->value().size();
}

} // extern "C"
