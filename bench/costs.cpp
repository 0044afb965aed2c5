// SPDX-License-Identifier: Apache-2.0
#include "costs.hpp"

#include <cstdlib>
#include <new>

#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

thread_local std::uint64_t called = 0;
thread_local std::uint64_t allocated = 0;

template <class... Arguments>
long call(long number, Arguments... arguments) noexcept {
  ++called;
  return ::syscall(number, arguments...);
}

void* take(std::size_t bytes) {
  ++allocated;
  void* const taken = std::malloc(bytes);
  if (taken == nullptr) std::abort();
  return taken;
}

} // namespace

namespace rowe::bench::costs {

std::uint64_t calls() noexcept { return called; }
std::uint64_t allocations() noexcept { return allocated; }

} // namespace rowe::bench::costs

extern "C" {

ssize_t send(int fd, const void* bytes, size_t count, int how) {
  return call(SYS_sendto, fd, bytes, count, how, nullptr, 0);
}
ssize_t sendmsg(int fd, const msghdr* message, int how) { return call(SYS_sendmsg, fd, message, how); }
ssize_t recv(int fd, void* into, size_t count, int how) {
  return call(SYS_recvfrom, fd, into, count, how, nullptr, nullptr);
}
int epoll_wait(int epoll, epoll_event* into, int count, int timeout) {
  return static_cast<int>(call(SYS_epoll_pwait, epoll, into, count, timeout, nullptr, 8));
}
int epoll_ctl(int epoll, int what, int fd, epoll_event* event) noexcept {
  return static_cast<int>(call(SYS_epoll_ctl, epoll, what, fd, event));
}

} // extern "C"

void* operator new(std::size_t bytes) { return take(bytes); }
void operator delete(void* taken) noexcept { std::free(taken); }
void operator delete(void* taken, std::size_t) noexcept { std::free(taken); }
