// SPDX-License-Identifier: Apache-2.0
// The functions by which rowe and libwebsockets enter the kernel, defined in the executable; each fails as
// its manual page says that it may when something runs out, and else passes on to the C library. Calls that
// cannot fail so are not here: reading clocks, changing the watches of a descriptor, signalling an eventfd.
#include "failures/injection.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <cerrno>
#include <cstdarg>

namespace {

template <class Function>
Function* own(const char* name) noexcept {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool fails(const char* call, int code) noexcept {
  if (!failures::fails(failures::kind::system_calls, call)) return false;
  errno = code;
  return true;
}

bool fails_on(int descriptor, const char* call, int code) noexcept {
  return !failures::spared(descriptor) && fails(call, code);
}

} // namespace

// name, result, parameters, arguments, whether it fails, what it then returns
// clang-format off
#define FAILING_CALLS(X)                                                                                     \
  X(socket, int, (int f, int t, int p), (f, t, p), fails("socket", EMFILE), -1, noexcept)                    \
  X(socketpair, int, (int f, int t, int p, int* s), (f, t, p, s), fails("socketpair", EMFILE), -1, noexcept) \
  X(bind, int, (int s, const sockaddr* a, socklen_t n), (s, a, n), fails("bind", ENOMEM), -1, noexcept)      \
  X(listen, int, (int s, int n), (s, n), fails("listen", EADDRINUSE), -1, noexcept)                          \
  X(getsockname, int, (int s, sockaddr* a, socklen_t* n), (s, a, n), fails("getsockname", ENOBUFS), -1,      \
    noexcept)                                                                                                \
  X(connect, int, (int s, const sockaddr* a, socklen_t n), (s, a, n), fails("connect", EADDRNOTAVAIL), -1, ) \
  X(accept4, int, (int s, sockaddr* a, socklen_t* n, int f), (s, a, n, f), fails("accept4", EMFILE), -1, )   \
  X(recv, ssize_t, (int s, void* b, size_t n, int f), (s, b, n, f), fails_on(s, "recv", ECONNRESET), -1, )   \
  X(send, ssize_t, (int s, const void* b, size_t n, int f), (s, b, n, f), fails_on(s, "send", ECONNRESET),   \
    -1, )                                                                                                    \
  X(dup3, int, (int a, int b, int f), (a, b, f), fails("dup3", EBUSY), -1, noexcept)                         \
  X(epoll_create1, int, (int f), (f), fails("epoll_create1", EMFILE), -1, noexcept)                          \
  X(epoll_ctl, int, (int e, int o, int s, epoll_event* v), (e, o, s, v),                                     \
    o == EPOLL_CTL_ADD && fails_on(s, "epoll_ctl", ENOSPC), -1, noexcept)                                    \
  X(epoll_wait, int, (int e, epoll_event* v, int n, int t), (e, v, n, t), fails("epoll_wait", EINTR), -1, )  \
  X(epoll_pwait2, int, (int e, epoll_event* v, int n, const timespec* t, const sigset_t* s),                 \
    (e, v, n, t, s), fails("epoll_pwait2", EINTR), -1, )                                                     \
  X(eventfd, int, (unsigned n, int f), (n, f), fails("eventfd", EMFILE), -1, noexcept)                       \
  X(timerfd_create, int, (clockid_t c, int f), (c, f), fails("timerfd_create", EMFILE), -1, noexcept)        \
  X(mmap, void*, (void* a, size_t n, int p, int f, int d, off_t o), (a, n, p, f, d, o),                      \
    fails("mmap", ENOMEM), MAP_FAILED, noexcept)                                                             \
  X(madvise, int, (void* a, size_t n, int c), (a, n, c), fails("madvise", ENOMEM), -1, noexcept)             \
  X(mlock, int, (const void* a, size_t n), (a, n), fails("mlock", ENOMEM), -1, noexcept)                     \
  X(getaddrinfo, int, (const char* h, const char* s, const addrinfo* w, addrinfo** r), (h, s, w, r),         \
    fails("getaddrinfo", ENOMEM), EAI_MEMORY, )                                                              \
  X(poll, int, (pollfd* p, nfds_t n, int t), (p, n, t), fails("poll", EINTR), -1, )                          \
  X(pthread_create, int, (pthread_t* t, const pthread_attr_t* a, void* (*f)(void*), void* p), (t, a, f, p),  \
    fails("pthread_create", EAGAIN), EAGAIN, noexcept)

extern "C" {
#define DEFINE_FAILING_CALL(name, result, parameters, arguments, failing, failure, specifier)                \
  result name parameters specifier {                                                                         \
    static auto* const real = own<result parameters>(#name);                                                 \
    if (failing) return failure;                                                                             \
    return real arguments;                                                                                   \
  }
FAILING_CALLS(DEFINE_FAILING_CALL)
#undef DEFINE_FAILING_CALL

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const auto mode = va_arg(more, mode_t);
  va_end(more);
  static auto* const real = own<int(const char*, int, ...)>("open");
  return fails("open", EMFILE) ? -1 : real(path, flags, mode);
}

int fcntl(int descriptor, int command, ...) {
  va_list more;
  va_start(more, command);
  void* const argument = va_arg(more, void*); // as wide as whatever the command takes
  va_end(more);
  static auto* const real = own<int(int, int, ...)>("fcntl");
  if (command == F_DUPFD_CLOEXEC && fails("fcntl(F_DUPFD_CLOEXEC)", EMFILE)) return -1;
  return real(descriptor, command, argument);
}
} // extern "C"
// clang-format on
