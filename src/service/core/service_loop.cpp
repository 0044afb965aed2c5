// SPDX-License-Identifier: Apache-2.0
#include "service/core/service_loop.hpp"

#include <time.h>

#include "service/base/service_limits.hpp"

namespace rowe::service {
namespace {

using clock = rt::monotonic_clock;

// How long to wait for the answer to a call that was given to a handle, before anything else is done.
constexpr rt::duration answer_wait = std::chrono::microseconds{1};

void sleep_to_yield() noexcept {
  const timespec how_long{.tv_sec = 0, .tv_nsec = throttle_avoidance::yield_time.count()};
  (void)::clock_nanosleep(CLOCK_MONOTONIC, 0, &how_long,
                          nullptr); // a signal may end it early: the next one makes up for it
}

} // namespace

void service_loop::cycle() noexcept {
  const rt::time_point began = now_;
  next_ = core_.cycle(began);
  now_ = clock::now();
  core_.record_cycle(now_ - began);
}

// Looking at a handle takes a fraction of the time of polling the kernel. So the answer of a loop that
// answers without pause is taken first.
void service_loop::await_answer() noexcept {
  const rt::time_point until = now_ + answer_wait;
  while (!core_.has_answer()) {
    if (now_ >= until) return;
    now_ = clock::now();
  }
  next_ = core_.write_answer(now_);
  now_ = clock::now();
}

void service_loop::run(bool fifo) noexcept {
  now_ = clock::now();
  for (rt::time_point drain_until = rt::never;;) {
    if (drain_until != rt::never) core_.stop_loops(now_);
    cycle();
    if (policy_ == idle::spin && core_.awaits_answer() && next_ > now_) await_answer();
    if (drain_until != rt::never) {
      drained_ = core_.drained();
      if (drained_ || now_ >= drain_until) return close_peers();
      idle_until(std::min(next_, now_ + poll_period_), fifo);
      continue;
    }
    // acquire: pairs with the release in stop(). It is read after the cycle, because poll() may have consumed
    // the wake-up of stop(), and before the wait, because nothing else would end the wait. Whatever was
    // published before stop() is taken in a later cycle.
    drain_until = rt::time_point{rt::duration{drain_until_ns_.load(std::memory_order_acquire)}};
    if (drain_until == rt::never) idle_until(next_, fifo);
  }
}

void service_loop::idle_until(rt::time_point next, bool fifo) noexcept {
  if (fifo) {
    throttle_.awake_until(now_);
    if (throttle_.overdue()) {
      sleep_to_yield();
      now_ = clock::now();
      return throttle_.slept_until(now_);
    }
  }
  const rt::time_point until = std::min(next, now_ + core_.idle_time_max(poll_period_));
  switch (policy_) {
  case idle::poll: transport_.wait(now_, until); break;
  case idle::wake:
    if (until > now_)
      waker_.sleep([&] { return core_.nothing_submitted(); }, [&] { transport_.wait(now_, until); });
    break;
  case idle::phase: {
    const rt::time_point due = core_.predictor().wait_until(now_, poll_period_);
    if (due <= now_) return; // a value is due: poll until it has arrived
    transport_.wait(now_, std::min(until, due));
    if (due <= until) core_.predictor().woke(due, clock::now());
    break;
  }
  case idle::spin:
    if (!fifo || !throttle_.due()) return; // `now_` is the end of the last cycle
    transport_.wait(now_, now_ + throttle_avoidance::yield_time);
  }
  now_ = clock::now();
  if (fifo) throttle_.waited_until(now_);
}

void service_loop::close_peers() noexcept {
  const rt::time_point until = now_ + closing_time_max;
  core_.close_all(now_);
  while (core_.peers() != 0 && now_ < until) {
    cycle();
    transport_.wait(now_, std::min(until, now_ + closing_look_period));
    now_ = clock::now();
  }
}

void service_loop::stop(rt::time_point drain_until) noexcept {
  // release: pairs with the acquire in run(); what was published before is seen there
  drain_until_ns_.store(std::min(rt::nanoseconds_of(drain_until), rt::nanoseconds_of(rt::never) - 1),
                        std::memory_order_release);
  transport_.wake();
}

} // namespace rowe::service
