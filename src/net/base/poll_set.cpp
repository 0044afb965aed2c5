// SPDX-License-Identifier: Apache-2.0
#include "net/base/poll_set.hpp"

#include <sys/timerfd.h>

#include <cerrno>
#include <utility>

namespace rowe::net {

namespace {

timespec to_timespec(rt::duration duration) noexcept {
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(duration);
  timespec spec{};
  spec.tv_sec = whole.count();
  spec.tv_nsec = (duration - whole).count();
  return spec;
}

// A kernel before 5.11 answers ENOSYS; a sandbox that does not know the call may answer EPERM.
bool has_epoll_pwait2(int epoll) noexcept {
  const timespec zero{};
  epoll_event event{};
  return ::epoll_pwait2(epoll, &event, 1, &zero, nullptr) >= 0;
}

} // namespace

poll_set::poll_set(descriptor epoll, descriptor timer, bool has_pwait2) noexcept
    : epoll_{std::move(epoll)}, timer_{std::move(timer)}, has_pwait2_{has_pwait2} {}

result<poll_set> poll_set::open(sleeping_by how) noexcept {
  descriptor epoll{::epoll_create1(EPOLL_CLOEXEC)};
  if (!epoll) return error{errc::no_memory};
  descriptor timer{::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)};
  if (!timer) return error{errc::no_memory};
  const bool by_pwait2 = how == sleeping_by::epoll_pwait2 && has_epoll_pwait2(epoll.get());
  poll_set set{std::move(epoll), std::move(timer), by_pwait2};
  // Edge triggered: setting the timer again clears its readiness, so nobody needs to read it.
  if (!set.add(set.timer_.get(), EPOLLIN | EPOLLET, {source::timer})) return error{errc::no_memory};
  return set;
}

bool poll_set::add(int fd, std::uint32_t events, event_token token) noexcept {
  epoll_event event{};
  event.events = events;
  event.data.u64 = token.packed();
  return ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) == 0;
}

void poll_set::modify(int fd, std::uint32_t events, event_token token) noexcept {
  epoll_event event{};
  event.events = events;
  event.data.u64 = token.packed();
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, fd, &event); // fails only for a descriptor that is not in the set
}

void poll_set::remove(int fd) noexcept { ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr); }

void poll_set::keep(int count) noexcept {
  waiting_ = count > 0 ? static_cast<std::size_t>(count) : 0; // a signal counts as nothing found
  for (std::size_t i = 0; i < waiting_; ++i) {
    batch_[i] = {event_token::unpack(ready_[i].data.u64), ready_[i].events};
    if (batch_[i].token.from == source::timer) timer_ends_ = rt::never;
  }
}

std::span<const socket_event> poll_set::take() noexcept {
  if (!std::exchange(looked_, false))
    keep(::epoll_wait(epoll_.get(), ready_.data(), static_cast<int>(batch_max), 0));
  return {batch_.data(), std::exchange(waiting_, 0)};
}

void poll_set::wait(rt::time_point now, rt::time_point until) noexcept {
  if (waiting_ != 0 || until <= now) return;
  const auto capacity = static_cast<int>(batch_max);
  looked_ = true;
  if (!has_pwait2_ || until - now <= short_sleep) {
    keep(::epoll_wait(epoll_.get(), ready_.data(), capacity, timer_by(now, until) ? -1 : 0));
    return;
  }
  const timespec spec = to_timespec(until - now);
  keep(::epoll_pwait2(epoll_.get(), ready_.data(), capacity, &spec, nullptr));
}

// Makes sure that the timer goes off by then. False: the kernel refuses.
bool poll_set::timer_by(rt::time_point now, rt::time_point until) noexcept {
  if (timer_ends_ <= until) return true; // it is running already
  itimerspec once{};
  once.it_value = to_timespec(until - now);
  if (::timerfd_settime(timer_.get(), 0, &once, nullptr) != 0) return false;
  timer_ends_ = until;
  return true;
}

} // namespace rowe::net
