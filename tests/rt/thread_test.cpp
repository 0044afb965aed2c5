// SPDX-License-Identifier: Apache-2.0
// What a machine permits differs; these tests hold on one that permits everything and on one that permits
// nothing.
#include <rowe/rt/thread.hpp>

#include "watchdog.hpp"

#include <gtest/gtest.h>

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <limits>
#include <memory>
#include <string>

namespace thread_test {
namespace {

using rowe::rt::grant;
using rowe::rt::grants;
using rowe::rt::prepare_this_thread;
using rowe::rt::thread;

std::string text_of(const grants& given) {
  char buffer[400];
  return std::string{given.text(buffer)};
}

// A cpu that this process may use.
int some_cpu() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  ::sched_getaffinity(0, sizeof allowed, &allowed);
  for (int cpu = CPU_SETSIZE - 1; cpu > 0; --cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) return cpu;
  }
  return 0;
}

TEST(thread, runs_its_function_and_is_joined_on_destruction) {
  bool ran = false;
  {
    const thread t{{}, [&] { ran = true; }};
  }
  EXPECT_TRUE(ran);
}

TEST(thread, carries_its_name_cut_to_what_the_kernel_keeps) {
  char name[32]{};
  thread t{{.name = "a-name-that-is-too-long"},
           [&] { ::pthread_getname_np(::pthread_self(), name, sizeof name); }};
  EXPECT_TRUE(t.grants().named);
  t.join();
  EXPECT_STREQ(name, "a-name-that-is-");
}

TEST(thread, is_pinned_to_the_cpu_it_asks_for) {
  const int cpu = some_cpu();
  cpu_set_t allowed;
  thread t{{.cpu = cpu}, [&] { ::sched_getaffinity(0, sizeof allowed, &allowed); }};
  EXPECT_TRUE(t.grants().pinned);
  t.join();
  EXPECT_EQ(CPU_COUNT(&allowed), 1);
  EXPECT_TRUE(CPU_ISSET(static_cast<std::size_t>(cpu), &allowed));
}

TEST(thread, runs_unpinned_and_says_why_when_the_cpu_does_not_exist) {
  for (const int cpu : {-1, CPU_SETSIZE - 1, CPU_SETSIZE, 1 << 30}) {
    bool ran = false;
    thread t{{.cpu = cpu}, [&] { ran = true; }};
    EXPECT_EQ(t.grants().pinned.error, EINVAL);
    EXPECT_FALSE(t.grants().complete());
    t.join();
    EXPECT_TRUE(ran);
  }
}

TEST(thread, runs_under_sched_fifo_or_says_that_it_may_not) {
  int policy = -1;
  sched_param parameters{};
  thread t{{.priority = 7}, [&] {
             policy = ::sched_getscheduler(0);
             ::sched_getparam(0, &parameters);
           }};
  const grant fifo = t.grants().fifo;
  t.join();
  EXPECT_TRUE(fifo.asked);
  if (fifo) {
    EXPECT_EQ(policy & ~SCHED_RESET_ON_FORK, SCHED_FIFO);
    EXPECT_EQ(parameters.sched_priority, 7);
  } else {
    EXPECT_EQ(fifo.error, EPERM);
    EXPECT_EQ(policy, SCHED_OTHER);
  }
}

TEST(thread, of_priority_zero_is_ordinary_even_when_a_fifo_thread_starts_it) {
  int policy = -1;
  {
    const thread t{{.priority = 7}, [&] {
                     const thread inner{{}, [&] { policy = ::sched_getscheduler(0); }};
                   }};
  }
  EXPECT_EQ(policy, SCHED_OTHER);
}

TEST(thread, refuses_a_priority_that_does_not_exist) {
  const thread t{{.priority = 100}, [] {}};
  EXPECT_EQ(t.grants().fifo.error, EINVAL);
}

TEST(thread, blocks_every_signal_that_no_fault_raises) {
  sigset_t blocked;
  thread t{{}, [&] { ::pthread_sigmask(SIG_BLOCK, nullptr, &blocked); }};
  t.join();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGALRM, SIGUSR1, SIGPIPE, SIGRTMAX}) {
    EXPECT_TRUE(::sigismember(&blocked, signal)) << signal;
  }
  for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS}) {
    EXPECT_FALSE(::sigismember(&blocked, fault)) << fault;
  }
  sigset_t own;
  ::pthread_sigmask(SIG_BLOCK, nullptr, &own);
  EXPECT_FALSE(::sigismember(&own, SIGINT)) << "the starting thread keeps its mask";
}

TEST(thread, fires_timers_without_slack) {
  int slack = 0;
  thread t{{}, [&] { slack = ::prctl(PR_GET_TIMERSLACK); }};
  EXPECT_TRUE(t.grants().slack);
  t.join();
  EXPECT_EQ(slack, 1);
}

// Sanitizers keep shadow memory beside the stack, which faults in its own time.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
long minor_faults() {
  rusage used{};
  ::getrusage(RUSAGE_THREAD, &used);
  return used.ru_minflt;
}

[[gnu::noinline]] void use_stack() {
  volatile char buffer[200 * 1024];
  for (std::size_t at = 0; at < sizeof buffer; at += 1024) buffer[at] = 1;
}

TEST(thread, has_touched_its_stack_before_it_runs) {
  long faults = -1;
  thread t{{.stack_bytes = 256 * 1024}, [&] {
             const long before = minor_faults();
             use_stack();
             faults = minor_faults() - before;
           }};
  t.join();
  EXPECT_EQ(faults, 0);
}
#endif

TEST(thread, reports_that_it_could_not_be_started) {
  bool ran = false;
  const auto alive = std::make_shared<int>(0);
  thread t{{.stack_bytes = std::size_t{1} << 60}, [&ran, alive] { ran = true; }};
  EXPECT_FALSE(t.joinable());
  EXPECT_NE(t.error(), 0);
  EXPECT_EQ(alive.use_count(), 1) << "the function is destroyed without having run";
  t.join();
  EXPECT_FALSE(ran);
}

TEST(thread, takes_a_function_that_can_only_be_moved) {
  int seen = 0;
  {
    const thread t{{}, [number = std::make_unique<int>(5), &seen] { seen = *number; }};
  }
  EXPECT_EQ(seen, 5);
}

TEST(thread, tells_its_function_what_was_granted) {
  grants told;
  thread t{{.name = "curious"}, [&](const grants& given) { told = given; }};
  t.join();
  EXPECT_TRUE(told.named);
  EXPECT_EQ(text_of(told), text_of(t.grants()));
}

TEST(thread, moves_with_what_it_was_granted) {
  const rowe::tests::watchdog guard{"a moved thread"};
  std::atomic<bool> go{false};
  thread first{{.name = "mover"}, [&] {
                 while (!go) ::sched_yield();
               }};
  thread second{std::move(first)};
  EXPECT_FALSE(first.joinable());
  EXPECT_TRUE(second.joinable());
  EXPECT_TRUE(second.grants().named);
  go = true;
  second = thread{};
  EXPECT_FALSE(second.joinable());
}

TEST(prepare_this_thread, leaves_signals_and_scheduling_as_they_are) {
  thread t{{}, [] {
             sigset_t usr1;
             ::sigemptyset(&usr1);
             ::sigaddset(&usr1, SIGUSR1);
             ::pthread_sigmask(SIG_UNBLOCK, &usr1, nullptr);
             const int policy = ::sched_getscheduler(0);
             const grants given = prepare_this_thread({.name = "prepared", .stack_bytes = 64 * 1024});
             EXPECT_TRUE(given.named);
             EXPECT_FALSE(given.pinned.asked);
             EXPECT_FALSE(given.fifo.asked);
             EXPECT_EQ(::sched_getscheduler(0), policy);
             sigset_t blocked;
             ::pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
             EXPECT_FALSE(::sigismember(&blocked, SIGUSR1));
           }};
}

TEST(lock_process_memory, locks_it_or_says_why_not) {
  const grant locked = rowe::rt::lock_process_memory();
  ::munlockall();
  EXPECT_TRUE(locked.asked);
  EXPECT_TRUE(locked || locked.error == ENOMEM || locked.error == EPERM) << locked.error;
}

TEST(grants, say_what_was_granted) {
  EXPECT_EQ(text_of({.pinned = {true, 0}, .fifo = {true, 0}, .cpu = 2, .priority = 80}),
            "pinned to cpu 2, SCHED_FIFO 80");
  EXPECT_EQ(text_of({.fifo = {true, 0}, .priority = 80}), "SCHED_FIFO 80");
  EXPECT_EQ(text_of({}), "ordinary scheduling");
}

TEST(grants, say_what_was_refused_why_and_what_to_do) {
  EXPECT_EQ(text_of({.fifo = {true, EPERM}, .priority = 80}),
            "SCHED_FIFO 80 not permitted (rtprio limit 0): raise `ulimit -r` or run as root");
  EXPECT_EQ(text_of({.pinned = {true, EINVAL}, .cpu = 9}),
            "cpu 9 does not exist or is not allowed to this process: see `taskset -p`");
  EXPECT_EQ(text_of({.pinned = {true, 0}, .fifo = {true, EINVAL}, .cpu = 2, .priority = 100}),
            "pinned to cpu 2; SCHED_FIFO has no priority 100: 1 to 99");
  EXPECT_EQ(text_of({.stack_locked = {true, ENOMEM}, .locked_bytes_limit = 65'536}),
            "ordinary scheduling; stack not locked (memlock limit 65536 bytes): raise `ulimit -l`");
  EXPECT_EQ(text_of({.named = {true, 5}, .slack = {true, 6}}),
            "ordinary scheduling; name not set (errno 5); timer slack not set (errno 6)");
  EXPECT_EQ(text_of({.pinned = {true, EPERM}, .cpu = 1}), "not pinned to cpu 1 (errno 1)");
}

TEST(grants, say_all_they_have_to_in_a_buffer_of_the_length_that_they_name) {
  constexpr int least = std::numeric_limits<int>::min();
  constexpr long longest = std::numeric_limits<long>::min();
  constexpr rowe::rt::grant refused{true, least};
  for (const int error : {least, EINVAL}) {
    const grants all{.named = refused,
                     .pinned = {true, error},
                     .fifo = refused,
                     .slack = refused,
                     .stack_locked = refused,
                     .cpu = least,
                     .priority = least,
                     .priority_limit = longest,
                     .locked_bytes_limit = longest};
    char buffer[grants::text_bytes_max];
    EXPECT_TRUE(all.text(buffer).ends_with(" (errno -2147483648)")) << all.text(buffer);
  }
}

TEST(thread, knows_whether_it_has_a_real_time_priority) {
  bool has = true;
  {
    const thread ordinary{{}, [&] { has = rowe::rt::this_thread_is_real_time(); }};
  }
  EXPECT_FALSE(has);
  thread asked{{.priority = 1}, [&] { has = rowe::rt::this_thread_is_real_time(); }};
  asked.join();
  EXPECT_EQ(has, static_cast<bool>(asked.grants().fifo));
}

TEST(grants, cut_their_text_where_the_buffer_ends) {
  char buffer[10];
  EXPECT_EQ((grants{.pinned = {true, 0}, .cpu = 2}).text(buffer), "pinned to ");
  EXPECT_EQ(grants{}.text({}), "");
}

} // namespace
} // namespace thread_test
