// SPDX-License-Identifier: Apache-2.0
// How threads of this process that have no loop ask the service thread for a stop or a reset, and get its
// answers. One count says how often a stop was asked for. Raising it needs no space and waits for nobody. The
// source and the reason go beside it through a window, and the answers come back through another. So neither
// side ever waits for the other.
//
// Requests are numbered. Only the newest source and reason stay. An answer holds for all requests up to its
// number. A reset carries the count of stops at its time; a higher count later means a newer stop.
//
// The threads use their ends of the windows one at a time (api/local_stops.hpp); any of them may raise the
// count.
#pragma once
#include <cstdint>
#include <utility>

#include <rowe/fixed_string.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/clock.hpp>
#include <rowe/rt/window.hpp>

#include "service/base/service_limits.hpp"

namespace rowe::service {

// What threads of this process have asked for so far.
struct local_stop_asked {
  std::uint64_t stops = 0;
  fixed_string<stop_source_bytes_max> source; // of the last stop
  fixed_string<stop_reason_bytes_max> reason;
  std::uint64_t resets = 0;
  std::uint64_t number = 0;             // the stop that the last reset is to end; 0: any
  std::uint32_t count_before_reset = 0; // local_stop::count() when the last reset was asked for
  rt::time_point until{};               // after this the last reset must not be carried out
};

// The answers to these requests.
struct local_stop_answered {
  std::uint64_t stops = 0;       // the loops have acknowledged all up to this one
  std::uint64_t stop_number = 0; // the number by which peers know it
  rt::time_point acknowledged{}; // when
  std::uint64_t resets = 0;
  std::uint64_t reset_number = 0; // reported to peers while the loops may move
  status reset_outcome;           // good, refused or timed_out
};

template <class Atomics = rt::std_atomics>
class local_stop {
 public:
  // ---- Any thread. Never waits, never allocates.

  // Asks for a stop. The caller then wakes the service thread. What was given to write_request() before is
  // seen with it.
  void request() noexcept {
    count_.fetch_add(1, std::memory_order_release); // release: pairs with the load in take()
  }
  // How often request() was called, modulo 2^32.
  std::uint32_t count() const noexcept {
    return count_.load(std::memory_order_relaxed); // relaxed: nothing is read after it
  }

  // ---- Threads, one at a time each.

  void write_request(const local_stop_asked& all) noexcept { asked_writer_->write(all); }
  // Reads the newest answers; `into` is not changed if it has them already.
  void read_answers(local_stop_answered& into) noexcept { (void)answered_reader_->read(into); }

  // ---- The service thread.

  // Whether somebody has asked since the last call.
  bool take() noexcept {
    const std::uint32_t count = count_.load(std::memory_order_acquire); // acquire: pairs with request()
    return std::exchange(taken_, count) != count;
  }
  // The count as of the last take().
  std::uint32_t taken() const noexcept { return taken_; }
  // Reads what write_request() wrote last; `into` is not changed if it has that already.
  void read_requests(local_stop_asked& into) noexcept { (void)asked_reader_->read(into); }
  // Publishes the answers. The caller then wakes the threads that wait.
  void write_answers(const local_stop_answered& all) noexcept { answered_writer_->write(all); }

 private:
  using asked_window = rt::window<local_stop_asked, Atomics>;
  using answered_window = rt::window<local_stop_answered, Atomics>;

  typename Atomics::template variable<std::uint32_t> count_{0};
  std::uint32_t taken_ = 0; // the service thread's
  asked_window asked_;
  answered_window answered_;
  typename asked_window::writer* asked_writer_ = asked_.take_writer();
  typename asked_window::reader* asked_reader_ = asked_.take_reader();
  typename answered_window::writer* answered_writer_ = answered_.take_writer();
  typename answered_window::reader* answered_reader_ = answered_.take_reader();
};

} // namespace rowe::service
