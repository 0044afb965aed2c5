// SPDX-License-Identifier: Apache-2.0
// Each kind of breach of the real-time contract, planted and found; and that a watched thread otherwise works
// as ever. Every test runs in a thread of its own, because watching system calls is for life.
#include <rowe/rt/thread.hpp>
#include <rowe/rt/tripwire.hpp>

#include "watchdog.hpp"

#include <gtest/gtest.h>

#include <linux/futex.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <thread>

namespace {

namespace tripwire = rowe::rt::tripwire;
using rowe::rt::thread;

// Runs `body` in a thread that is watched.
template <class Body>
void in_a_watched_thread(Body body) {
  thread t{{.name = "watched"}, [&] {
             ASSERT_TRUE(tripwire::watch_system_calls()) << std::strerror(errno);
             (void)tripwire::arm().disarm(); // the scope's own first faults
             body();
           }};
  ASSERT_EQ(t.error(), 0);
}

// What an armed scope sees of `call`, in such a thread.
template <class Call>
tripwire::report seen(Call call) {
  tripwire::report report;
  in_a_watched_thread([&] {
    auto wire = tripwire::arm();
    call();
    report = wire.disarm();
  });
  return report;
}

std::string text(const tripwire::report& report) {
  char buffer[300];
  return std::string{report.text(buffer)};
}

template <class T>
void keep(T&& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

TEST(tripwire, is_silent_about_work_that_keeps_the_contract) {
  std::atomic<int> word{0};
  const tripwire::report report = seen([&] {
    for (int i = 0; i < 1000; ++i) word.fetch_add(i, std::memory_order_release);
  });
  EXPECT_TRUE(report.clean()) << text(report);
  EXPECT_EQ(text(report), "clean");
}

TEST(tripwire, sees_new_and_delete) {
  const tripwire::report report = seen([] { keep(std::make_unique<int>(1)); });
  EXPECT_EQ(report.allocations, 2u);
  EXPECT_STREQ(report.last_call, "free");
  EXPECT_FALSE(report.clean());
}

TEST(tripwire, sees_a_string_that_does_not_fit_itself) {
  EXPECT_EQ(seen([] { keep(std::string(10, 'x')); }).allocations, 0u);
  EXPECT_EQ(seen([] { keep(std::string(40, 'x')); }).allocations, 2u);
}

TEST(tripwire, sees_every_function_of_the_heap) {
  const auto one = [](auto call) {
    void* memory = nullptr;
    const tripwire::report report = seen([&] { memory = call(); });
    std::free(memory);
    EXPECT_EQ(report.allocations, 1u);
    return std::string{report.last_call};
  };
  EXPECT_EQ(one([] { return std::malloc(10); }), "malloc");
  EXPECT_EQ(one([] { return std::calloc(10, 10); }), "calloc");
  EXPECT_EQ(one([] {
              void* volatile none = nullptr; // volatile: else the compiler calls malloc
              return std::realloc(none, 10);
            }),
            "realloc");
  EXPECT_EQ(one([] { return ::reallocarray(nullptr, 10, 10); }), "reallocarray");
  EXPECT_EQ(one([] { return std::aligned_alloc(64, 128); }), "aligned_alloc");
  EXPECT_EQ(one([] { return ::memalign(64, 128); }), "memalign");
  EXPECT_EQ(one([] { return ::valloc(10); }), "valloc");
  EXPECT_EQ(one([] { return ::pvalloc(10); }), "pvalloc");
  EXPECT_EQ(one([] {
              void* memory = nullptr;
              EXPECT_EQ(::posix_memalign(&memory, 64, 128), 0);
              return memory;
            }),
            "posix_memalign");
  EXPECT_EQ(one([] { return static_cast<void*>(::strdup("a text of the C library's")); }), "malloc");
  EXPECT_EQ(seen([] { std::free(nullptr); }).allocations, 0u);
}

TEST(tripwire, leaves_the_heap_as_the_c_library_defines_it) {
  void* memory = nullptr;
  EXPECT_EQ(::posix_memalign(&memory, 3, 8), EINVAL);
  EXPECT_EQ(::posix_memalign(&memory, 0, 8), EINVAL);
  EXPECT_EQ(::posix_memalign(&memory, 4096, 8), 0);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 4096, 0u);
  std::free(memory);
  const volatile std::size_t many = SIZE_MAX / 2; // volatile: the compiler need not know that it overflows
  errno = 0;
  EXPECT_EQ(::reallocarray(nullptr, many, 16), nullptr);
  EXPECT_EQ(errno, ENOMEM);
}

TEST(tripwire, sees_a_mutex_that_nobody_contends) {
  std::mutex mutex;
  const tripwire::report report = seen([&] { const std::lock_guard lock{mutex}; });
  EXPECT_EQ(report.locks, 1u);
  EXPECT_EQ(report.system_calls, 0u);
  EXPECT_STREQ(report.last_call, "pthread_mutex_lock");
  EXPECT_EQ(text(report), "1 lock (last: pthread_mutex_lock)");
}

TEST(tripwire, sees_every_kind_of_lock) {
  std::shared_mutex shared;
  std::timed_mutex timed;
  std::condition_variable changed;
  pthread_spinlock_t spin;
  ::pthread_spin_init(&spin, 0);
  sem_t semaphore;
  ::sem_init(&semaphore, 0, 1);
  EXPECT_STREQ(seen([&] {
                 shared.lock();
                 shared.unlock();
               }).last_call,
               "pthread_rwlock_wrlock");
  EXPECT_STREQ(seen([&] {
                 shared.lock_shared();
                 shared.unlock_shared();
               }).last_call,
               "pthread_rwlock_rdlock");
  EXPECT_STREQ(seen([&] {
                 if (shared.try_lock()) shared.unlock();
               }).last_call,
               "pthread_rwlock_trywrlock");
  EXPECT_STREQ(seen([&] {
                 if (timed.try_lock()) timed.unlock();
               }).last_call,
               "pthread_mutex_trylock");
  EXPECT_STREQ(seen([&] { changed.notify_all(); }).last_call, "pthread_cond_broadcast");
  EXPECT_STREQ(seen([&] {
                 ::pthread_spin_lock(&spin);
                 ::pthread_spin_unlock(&spin);
               }).last_call,
               "pthread_spin_lock");
  EXPECT_STREQ(seen([&] { ::sem_wait(&semaphore); }).last_call, "sem_wait");
  EXPECT_STREQ(seen([&] { ::sem_post(&semaphore); }).last_call, "sem_post");
  ::sem_destroy(&semaphore);
  ::pthread_spin_destroy(&spin);
}

TEST(tripwire, lets_condition_variables_work) {
  const rowe::tests::watchdog guard{"a condition variable behind the tripwire"};
  std::mutex mutex;
  std::condition_variable changed;
  bool ready = false;
  std::thread notifier{[&] {
    const std::lock_guard lock{mutex};
    ready = true;
    changed.notify_one();
  }};
  {
    std::unique_lock lock{mutex};
    changed.wait(lock, [&] { return ready; });
    EXPECT_FALSE(changed.wait_for(lock, std::chrono::milliseconds{1}, [] { return false; }));
  }
  notifier.join();
}

TEST(tripwire, sees_a_system_call_and_makes_it) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ssize_t written = 0;
  const tripwire::report report = seen([&] { written = ::write(ends[1], "!", 1); });
  EXPECT_EQ(report.system_calls, 1u);
  EXPECT_EQ(report.last_system_call, SYS_write);
  EXPECT_EQ(written, 1);
  char byte = 0;
  EXPECT_EQ(::read(ends[0], &byte, 1), 1);
  EXPECT_EQ(byte, '!');
  EXPECT_EQ(text(report), "1 system call (last: write)");
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(tripwire, gives_a_failed_system_call_its_errno) {
  int error = 0;
  EXPECT_EQ(seen([&] { error = ::write(-1, "!", 1) == -1 ? errno : 0; }).system_calls, 1u);
  EXPECT_EQ(error, EBADF);
}

TEST(tripwire, passes_all_six_arguments_of_a_system_call) {
  void* memory = MAP_FAILED;
  const tripwire::report report = seen([&] {
    memory = ::mmap(nullptr, 8192, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    static_cast<volatile char*>(memory)[4096] = 1;
  });
  ASSERT_NE(memory, MAP_FAILED);
  EXPECT_EQ(report.last_system_call, SYS_mmap);
  EXPECT_EQ(report.page_faults, 1u);
  ::munmap(memory, 8192);
}

TEST(tripwire, sees_futex_calls_and_yields) {
  std::uint32_t word = 0;
  EXPECT_EQ(seen([&] { ::syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1); }).last_system_call, SYS_futex);
  EXPECT_EQ(seen([] { ::sched_yield(); }).last_system_call, SYS_sched_yield);
}

TEST(tripwire, sees_a_page_that_nobody_has_touched) {
  constexpr std::size_t pages = 4;
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  void* const fresh =
      ::mmap(nullptr, pages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ::madvise(fresh, pages * page, MADV_NOHUGEPAGE);
  const tripwire::report report = seen([&] {
    for (std::size_t i = 0; i < pages; ++i) static_cast<volatile char*>(fresh)[i * page] = 1;
  });
  EXPECT_EQ(report.page_faults, pages);
  EXPECT_EQ(report.system_calls, 0u);
  EXPECT_FALSE(report.clean());
  ::munmap(fresh, pages * page);
}

TEST(tripwire, counts_nothing_outside_its_scope) {
  in_a_watched_thread([] {
    keep(std::make_unique<int>(1));
    ::sched_yield();
    auto wire = tripwire::arm();
    const tripwire::report first = wire.disarm();
    keep(std::make_unique<int>(1));
    ::sched_yield();
    EXPECT_TRUE(first.clean()) << text(first);
    EXPECT_TRUE(wire.disarm().clean()) << "a second disarm says the same again";
  });
}

TEST(tripwire, counts_only_its_own_thread) {
  const rowe::tests::watchdog guard{"an allocating neighbour"};
  std::atomic<bool> done{false};
  std::atomic<int> rounds{0};
  std::thread neighbour{[&] {
    while (!done) {
      keep(std::make_unique<int>(1));
      ::sched_yield();
      ++rounds;
    }
  }};
  tripwire::report report;
  in_a_watched_thread([&] {
    auto wire = tripwire::arm();
    for (const int until = rounds + 100; rounds < until;) continue;
    report = wire.disarm();
  });
  done = true;
  neighbour.join();
  EXPECT_TRUE(report.clean()) << text(report);
}

TEST(tripwire, counts_allocations_of_all_threads) {
  const std::uint64_t before = tripwire::process_allocations();
  std::thread other{[] {
    for (int i = 0; i < 100; ++i) keep(std::make_unique<int>(1));
  }};
  other.join();
  EXPECT_GE(tripwire::process_allocations() - before, 100u);
}

TEST(tripwire, sees_no_system_calls_of_a_thread_that_is_not_watched) {
  const thread t{{}, [] {
                   EXPECT_FALSE(tripwire::watches_system_calls());
                   auto wire = tripwire::arm();
                   ::sched_yield();
                   keep(std::make_unique<int>(1));
                   const tripwire::report report = wire.disarm();
                   EXPECT_EQ(report.system_calls, 0u);
                   EXPECT_EQ(report.allocations, 2u);
                 }};
}

TEST(tripwire, lets_a_watched_thread_sleep_lock_allocate_and_change_its_signal_mask) {
  const rowe::tests::watchdog guard{"a watched thread's own business"};
  in_a_watched_thread([] {
    EXPECT_TRUE(tripwire::watches_system_calls());
    EXPECT_TRUE(tripwire::watch_system_calls()) << "a second time is no error";
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
    keep(std::string(1 << 20, 'x')); // large enough for mmap
    sigset_t usr1, before, now;
    ::sigemptyset(&usr1);
    ::sigaddset(&usr1, SIGUSR1);
    ::pthread_sigmask(SIG_UNBLOCK, &usr1, &before);
    ::pthread_sigmask(SIG_BLOCK, nullptr, &now);
    EXPECT_TRUE(::sigismember(&before, SIGUSR1));
    EXPECT_FALSE(::sigismember(&now, SIGUSR1)) << "the change outlives the trap";
    ::sigfillset(&usr1);
    ::pthread_sigmask(SIG_SETMASK, &usr1, nullptr);
    EXPECT_GT(::getppid(), 0) << "trapped with every signal blocked";
  });
}

TEST(tripwire, forbids_a_watched_thread_to_start_threads_and_processes) {
  in_a_watched_thread([] {
    const thread other{{}, [] { ADD_FAILURE(); }};
    EXPECT_EQ(other.error(), EPERM);
    EXPECT_EQ(::fork(), -1);
    EXPECT_EQ(errno, EPERM);
  });
}

TEST(tripwire, leaves_other_threads_their_freedom) {
  in_a_watched_thread([] {});
  const pid_t child = ::fork();
  if (child == 0) ::_exit(7);
  ASSERT_GT(child, 0);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST(tripwire, says_everything_it_saw) {
  const tripwire::report report{.allocations = 2,
                                .locks = 1,
                                .system_calls = 3,
                                .page_faults = 1,
                                .waits = 1,
                                .last_system_call = SYS_futex,
                                .last_call = "pthread_mutex_lock"};
  EXPECT_EQ(text(report), "2 heap calls, 1 lock (last: pthread_mutex_lock), 3 system calls (last: futex), "
                          "1 page fault, 1 wait");
  char buffer[8];
  EXPECT_EQ(report.text(buffer), "2 heap c");
}

// The mode for dev builds. Each breach ends a child process; the message goes to its stderr.
template <class Call>
void stopping(Call call) {
  in_a_watched_thread([&] {
    auto wire = tripwire::arm(tripwire::on_violation::stop);
    call();
    (void)wire.disarm();
  });
  std::_Exit(0);
}

TEST(tripwire_death_test, stops_the_program_with_the_name_of_the_call) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(stopping([] { keep(std::make_unique<int>(1)); }), testing::KilledBySignal(SIGABRT),
              "real-time contract broken in thread watched: malloc");
  EXPECT_EXIT(stopping([] {
                std::mutex m;
                m.lock();
              }),
              testing::KilledBySignal(SIGABRT),
              "real-time contract broken in thread watched: pthread_mutex_lock");
  EXPECT_EXIT(stopping([] { ::sched_yield(); }), testing::KilledBySignal(SIGABRT),
              "real-time contract broken in thread watched: system call [0-9]+ sched_yield");
  EXPECT_EXIT(stopping([] {
                void* fresh =
                    ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
                keep(fresh);
              }),
              testing::KilledBySignal(SIGABRT), "in thread watched: system call [0-9]+ mmap");
  EXPECT_EXIT(stopping([] {}), testing::ExitedWithCode(0), "");
}

TEST(tripwire_death_test, stops_the_program_at_the_end_of_a_scope_with_a_page_fault) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        void* const fresh = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        stopping([&] { *static_cast<volatile char*>(fresh) = 1; });
      },
      testing::KilledBySignal(SIGABRT), "in thread watched: page fault");
}

} // namespace
