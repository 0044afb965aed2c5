// SPDX-License-Identifier: Apache-2.0
#include "api/local_stops.hpp"

#include <algorithm>

#include <rowe/endpoint.hpp>

#include "api/endpoint_state.hpp"
#include "json/text/utf8.hpp"

namespace rowe {
namespace detail {
namespace {

// Assigns as much of the text as fits.
template <std::size_t Bytes>
void assign_cut(fixed_string<Bytes>& to, std::string_view from) noexcept {
  (void)to.assign(json::utf8_prefix(from, Bytes)); // so it fits
}

error timed_out(duration after) noexcept { return {errc::timed_out, 0, after.count()}; }

} // namespace

void local_stops::stop_loops() noexcept {
  shared_.request();
  transport_.wake();
}

// Sleeps until `is(answered)` is true, the service thread has ended, or `deadline` has come. Whichever thread
// comes first reads the answers for all that wait, so each thread looks at what any of them has read. Returns
// whether `is(answered)` is true.
template <class Is>
bool local_stops::wait_answer(time_point deadline, answered& into, Is&& is) noexcept {
  bool came = false;
  // Its result is not needed: it is also true when the service thread has ended.
  (void)queue_.wait_room(deadline, [&] {
    const bool over = ended(); // before looking: what was answered before it ended is still there
    const std::lock_guard lock{answers_mutex_};
    shared_.read_answers(answered_);
    came = is(answered_);
    if (came) into = answered_;
    return came || over;
  });
  return came;
}

result<emergency_stop_result> local_stops::stop(const emergency_stop_request& what, duration timeout) {
  if (!begun()) return queue_.is_closed() ? errc::closed : errc::no_service;
  const duration wait = timeout < duration::zero() ? observe_timeout_ : std::min(timeout, observe_timeout_);
  const time_point deadline = rt::deadline_after(rt::monotonic_clock::now(), wait);
  std::unique_lock lock{requests_mutex_, std::try_to_lock};
  if (!lock) { // another thread is just handing in its reason: ours may wait for that, the stop may not
    stop_loops();
    lock.lock();
  }
  const std::uint64_t mine = ++asked_.stops;
  assign_cut(asked_.source, what.source);
  assign_cut(asked_.reason, what.reason);
  shared_.write_request(asked_);
  lock.unlock();
  stop_loops();

  answered all;
  if (wait_answer(deadline, all, [&](const answered& newest) { return newest.stops >= mine; }))
    return emergency_stop_result{all.stop_number, all.acknowledged};
  return ended() ? error{errc::closed} : timed_out(wait);
}

// Only one thread at a time may call this. `resets` is 0 if the service thread has ended without an answer.
local_stops::answered local_stops::reset_alone(std::uint64_t number, time_point deadline) {
  std::uint64_t mine = 0;
  {
    const std::lock_guard lock{requests_mutex_};
    mine = ++asked_.resets;
    asked_.number = number;
    asked_.count_before_reset = shared_.count();
    asked_.until = deadline;
    shared_.write_request(asked_);
  }
  transport_.wake();
  answered all;
  if (!wait_answer(rt::never, all, [&](const answered& newest) { return newest.resets >= mine; })) return {};
  return all;
}

// The service thread carries the reset out before `deadline` or not at all, and always says which. So nobody
// gets `timed_out` while the loops move.
result<emergency_stop_reset_result> local_stops::reset(const emergency_stop_reset_request& what,
                                                       duration timeout) {
  if (queue_.is_closed()) return errc::closed;
  if (!begun()) return errc::no_service;
  const time_point deadline = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  if (!queue_.wait_room(deadline, [&] { return resetting_.try_lock(); })) return timed_out(timeout);
  const answered all = reset_alone(what.number, deadline);
  resetting_.unlock();
  queue_.notify_room(); // the next one
  if (all.resets == 0) return errc::closed;
  if (all.reset_outcome) return emergency_stop_reset_result{all.reset_number};
  if (all.reset_outcome.code() == errc::timed_out) return timed_out(timeout);
  return all.reset_outcome.error();
}

} // namespace detail

result<emergency_stop_result> endpoint::emergency_stop(const emergency_stop_request& what, duration timeout) {
  if (const status mine = usable(); !mine) return mine.error();
  return state_->stops().stop(what, timeout);
}

result<emergency_stop_reset_result> endpoint::reset_emergency_stop(const emergency_stop_reset_request& what,
                                                                   duration timeout) {
  if (const status mine = usable(); !mine) return mine.error();
  return state_->stops().reset(what, timeout);
}

} // namespace rowe
