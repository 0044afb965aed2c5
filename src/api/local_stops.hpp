// SPDX-License-Identifier: Apache-2.0
// endpoint::emergency_stop() and reset_emergency_stop(): the side of the threads that ask. What they share
// with the service thread is service/threads/local_stop.hpp. No stop waits for a mutex. Threads sleep in
// submission_queue::wait_room(), where the service thread wakes all that wait for it.
#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>

#include <rowe/emergency_stop.hpp>
#include <rowe/options.hpp>
#include <rowe/result.hpp>

#include "service/base/transport.hpp"
#include "service/threads/local_stop.hpp"
#include "service/threads/submission_queue.hpp"

namespace rowe::detail {

// Any threads, at the same time. Allocates nothing.
class local_stops {
 public:
  // `observe_timeout`: the option.
  local_stops(service::local_stop<>& shared, service::submission_queue& queue, service::transport& sockets,
              duration observe_timeout) noexcept
      : shared_{shared}, queue_{queue}, transport_{sockets}, observe_timeout_{observe_timeout} {}

  // There is a latch, and so a stop, from now on.
  void begin() noexcept { begun_.store(true, std::memory_order_release); } // release: pairs with begun()
  // The service thread has ended. The queue is to be finished afterwards, which wakes those who wait.
  void end() noexcept { ended_.store(true, std::memory_order_release); } // release: pairs with ended()

  result<emergency_stop_result> stop(const emergency_stop_request& what, duration timeout);
  result<emergency_stop_reset_result> reset(const emergency_stop_reset_request& what, duration timeout);

 private:
  using answered = service::local_stop_answered;

  // acquire, both: pair with begin() and end()
  bool begun() const noexcept { return begun_.load(std::memory_order_acquire); }
  bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }
  void stop_loops() noexcept;
  answered reset_alone(std::uint64_t number, time_point deadline);
  template <class Is>
  bool wait_answer(time_point deadline, answered& into, Is&& is) noexcept;

  service::local_stop<>& shared_;
  service::submission_queue& queue_;
  service::transport& transport_;
  const duration observe_timeout_;
  std::atomic<bool> begun_{false};
  std::atomic<bool> ended_{false};

  std::mutex requests_mutex_; // never held while waiting
  service::local_stop_asked asked_;
  std::mutex answers_mutex_; // likewise
  answered answered_;
  std::mutex resetting_; // by one thread at a time, from its asking to its answer
};

} // namespace rowe::detail
