// SPDX-License-Identifier: Apache-2.0
#include "service/service_loop.hpp"

#include <time.h>

#include <algorithm>

namespace rowe::service {
namespace {

using clock = rt::monotonic_clock;

constexpr rt::duration goodbye_max =
    std::chrono::milliseconds{1500}; // the transport cuts slow peers after 1 s

void sleep_for_a_nap() noexcept {
  const timespec how_long{.tv_sec = 0, .tv_nsec = nap_budget::nap.count()};
  (void)::clock_nanosleep(CLOCK_MONOTONIC, 0, &how_long, nullptr); // ended early by a signal: there is a next
}

} // namespace

void service_loop::cycle() noexcept {
  const rt::time_point began = clock::now();
  next_ = core_.cycle(began);
  core_.record_cycle(clock::now() - began);
}

void service_loop::run(bool fifo) noexcept {
  for (;;) {
    // acquire: pairs with the release in stop(). Looked at before the cycle, so that whatever was published
    // before stop() is taken in a cycle that comes after.
    const rt::time_point drain_until{rt::duration{drain_until_ns_.load(std::memory_order_acquire)}};
    if (drain_until != rt::never) core_.stop_loops(clock::now());
    cycle();
    if (drain_until != rt::never) {
      drained_ = core_.drained();
      if (drained_ || clock::now() >= drain_until) return say_goodbye();
    }
    idle_until(drain_until == rt::never ? next_ : std::min(next_, clock::now() + poll_period_), fifo);
  }
}

void service_loop::idle_until(rt::time_point next, bool fifo) noexcept {
  const rt::time_point now = clock::now();
  if (fifo) {
    naps_.awake_until(now);
    if (naps_.overdue()) {
      sleep_for_a_nap();
      return naps_.slept_until(clock::now());
    }
  }
  const rt::time_point until = std::min(next, now + core_.patience(poll_period_));
  switch (policy_) {
  case idle::poll: carrier_.wait(now, until); break;
  case idle::wake:
    if (until > now) bell_.sleep([&] { return core_.lanes_quiet(); }, [&] { carrier_.wait(now, until); });
    break;
  case idle::phase: {
    const rt::time_point due = core_.phases().wait_until(now, poll_period_);
    if (due <= now) return; // until a value comes that is due
    carrier_.wait(now, std::min(until, due));
    if (due <= until) core_.phases().woke(due, clock::now());
    break;
  }
  case idle::spin:
    if (!fifo || !naps_.due()) return;
    carrier_.wait(now, now + nap_budget::nap);
  }
  if (fifo) naps_.waited_until(clock::now());
}

void service_loop::say_goodbye() noexcept {
  const rt::time_point until = clock::now() + goodbye_max;
  core_.close_all(clock::now());
  while (core_.peers() != 0 && clock::now() < until) {
    cycle();
    carrier_.wait(clock::now(), std::min(until, clock::now() + std::chrono::milliseconds{10}));
  }
}

void service_loop::stop(rt::time_point drain_until) noexcept {
  // release: pairs with the acquire in run(); what was published before is seen there
  drain_until_ns_.store(std::min(rt::nanoseconds_of(drain_until), rt::nanoseconds_of(rt::never) - 1),
                        std::memory_order_release);
  carrier_.wake();
}

} // namespace rowe::service
