// SPDX-License-Identifier: Apache-2.0
// The functions that take a lock or wait, defined in the executable like those of the heap. An uncontended
// mutex makes no system call, so the filter for those does not see it. Unlocking is not recorded: where it is
// called, a lock was taken.
#include "state.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>

#include <atomic>

namespace rowe::rt::tripwire {
namespace {

// The C library's own function, looked up on its first call; by several threads at once with the same
// outcome.
template <class Function>
Function* own(std::atomic<Function*>& found, const char* name) noexcept {
  Function* function =
      found.load(std::memory_order_relaxed); // relaxed: pairs with the store below; an address only
  if (function != nullptr) [[likely]]
    return function;
  function = reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
  found.store(function, std::memory_order_relaxed); // relaxed: pairs with the load above
  return function;
}

} // namespace
} // namespace rowe::rt::tripwire

using when = const timespec*;

// name, parameters, arguments, `noexcept` where the C library says so.
// clang-format off
#define ROWE_LOCKS(X)                                                                                        \
  X(pthread_mutex_lock, (pthread_mutex_t* m), (m), noexcept)                                                 \
  X(pthread_mutex_trylock, (pthread_mutex_t* m), (m), noexcept)                                              \
  X(pthread_mutex_timedlock, (pthread_mutex_t* m, when t), (m, t), noexcept)                                 \
  X(pthread_mutex_clocklock, (pthread_mutex_t* m, clockid_t c, when t), (m, c, t), noexcept)                 \
  X(pthread_spin_lock, (pthread_spinlock_t* s), (s), noexcept)                                               \
  X(pthread_spin_trylock, (pthread_spinlock_t* s), (s), noexcept)                                            \
  X(pthread_rwlock_rdlock, (pthread_rwlock_t* l), (l), noexcept)                                             \
  X(pthread_rwlock_tryrdlock, (pthread_rwlock_t* l), (l), noexcept)                                          \
  X(pthread_rwlock_timedrdlock, (pthread_rwlock_t* l, when t), (l, t), noexcept)                             \
  X(pthread_rwlock_clockrdlock, (pthread_rwlock_t* l, clockid_t c, when t), (l, c, t), noexcept)             \
  X(pthread_rwlock_wrlock, (pthread_rwlock_t* l), (l), noexcept)                                             \
  X(pthread_rwlock_trywrlock, (pthread_rwlock_t* l), (l), noexcept)                                          \
  X(pthread_rwlock_timedwrlock, (pthread_rwlock_t* l, when t), (l, t), noexcept)                             \
  X(pthread_rwlock_clockwrlock, (pthread_rwlock_t* l, clockid_t c, when t), (l, c, t), noexcept)             \
  X(pthread_cond_wait, (pthread_cond_t* v, pthread_mutex_t* m), (v, m), )                                    \
  X(pthread_cond_timedwait, (pthread_cond_t* v, pthread_mutex_t* m, when t), (v, m, t), )                    \
  X(pthread_cond_clockwait, (pthread_cond_t* v, pthread_mutex_t* m, clockid_t c, when t), (v, m, c, t), )    \
  X(pthread_cond_signal, (pthread_cond_t* v), (v), noexcept)                                                 \
  X(pthread_cond_broadcast, (pthread_cond_t* v), (v), noexcept)                                              \
  X(pthread_barrier_wait, (pthread_barrier_t* b), (b), noexcept)                                             \
  X(sem_wait, (sem_t* s), (s), )                                                                             \
  X(sem_trywait, (sem_t* s), (s), noexcept)                                                                  \
  X(sem_timedwait, (sem_t* s, when t), (s, t), )                                                             \
  X(sem_clockwait, (sem_t* s, clockid_t c, when t), (s, c, t), )                                             \
  X(sem_post, (sem_t* s), (s), noexcept)

extern "C" {
#define ROWE_DEFINE_LOCK(name, parameters, arguments, specifier)                                             \
  int name parameters specifier {                                                                            \
    static constinit std::atomic<int(*) parameters> found{nullptr};                                          \
    rowe::rt::tripwire::saw_lock(#name);                                                                     \
    return rowe::rt::tripwire::own(found, #name) arguments;                                                  \
  }
ROWE_LOCKS(ROWE_DEFINE_LOCK)
#undef ROWE_DEFINE_LOCK
}
// clang-format on
