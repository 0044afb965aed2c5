// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/thread.hpp>

#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "net/base/descriptor.hpp"

namespace rowe::contract {
namespace {

constexpr std::size_t memory_bytes = 4 << 20;

// A child process that does nothing but exist. Only its parent's main thread can make it: the real-time
// thread is not allowed to.
class idle_child {
 public:
  void start() {
    pid_ = ::fork();
    if (pid_ == 0) {
      for (;;) ::pause();
    }
  }
  ~idle_child() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  bool alive() const { return pid_ > 0; }

 private:
  pid_t pid_ = 0;
};

class clock_put_into_the_kernel {
 public:
  explicit clock_put_into_the_kernel(bool there) { put_clock_into_the_kernel(there); }
  ~clock_put_into_the_kernel() { put_clock_into_the_kernel(false); }
};

// The starter of one real-time thread: main() does what ask() brings, until end().
class starting_main_thread final : public starter {
 public:
  void fork_a_child() override {
    ask([this] { child_.start(); });
    if (!child_.alive()) throw std::runtime_error{"no child could be forked"};
  }
  void start_a_thread(std::function<void()> body) override {
    ask([&] { other_ = rt::thread{{.name = "other"}, std::move(body)}; });
    if (other_.error() != 0) throw std::runtime_error{std::strerror(other_.error())};
  }
  void join_the_thread() override {
    ask([this] { other_.join(); });
  }
  void end() { proceed(phase::over); }

  void serve() {
    for (now_.wait(phase::running); now_ != phase::over; now_.wait(phase::running)) {
      asked_();
      proceed(phase::running);
    }
  }

 private:
  enum class phase { running, asking, over };

  void proceed(phase next) {
    now_ = next;
    now_.notify_all();
  }
  void ask(std::function<void()> errand) {
    asked_ = std::move(errand);
    proceed(phase::asking);
    now_.wait(phase::asking);
  }

  std::atomic<phase> now_{phase::running};
  std::function<void()> asked_;
  idle_child child_;
  rt::thread other_;
};

std::uint64_t count_for(const exercise& one, circumstance under) {
  const bool trapped = under == circumstance::beside_a_sleeping_service_thread ||
                       (under == circumstance::with_a_clock_in_the_kernel && one.reads_clock);
  return trapped ? trapped_calls_made : calls_made;
}

} // namespace

real_time::real_time(circumstance under, std::uint64_t count, starter& by, int wake_descriptor)
    : memory_{memory_bytes, rt::page_lock::none},
      under_{under},
      count_{count},
      starter_{by},
      shared_{make<words>()} {
  if (wake_descriptor >= 0) waker_.emplace(rt::eventfd_signal{wake_descriptor});
  rt::tripwire::expect_writes_to(wake_descriptor);
  pthread_attr_t attributes;
  void* lowest = nullptr;
  std::size_t bytes = 0;
  ::pthread_getattr_np(::pthread_self(), &attributes);
  ::pthread_attr_getstack(&attributes, &lowest, &bytes);
  ::pthread_attr_destroy(&attributes);
  stack_end_ = static_cast<char*>(lowest) + bytes;
}

real_time::other_thread::other_thread(real_time& of) : of_{of} {
  if (!of.other_turn_) return;
  of.starter_.start_a_thread([&of] {
    while (!of.shared_.stop) {
      of.other_turn_();
      of.shared_.turns.fetch_add(1, std::memory_order_relaxed); // relaxed: only counted
    }
  });
}

real_time::other_thread::~other_thread() {
  if (!of_.other_turn_) return;
  of_.shared_.stop = true;
  of_.starter_.join_the_thread();
}

std::uint64_t real_time::handed_over() const noexcept {
  std::uint64_t all = 0;
  for (const rt::counter* const one : handed_over_) all += one->get();
  return all;
}

void real_time::before_measuring() {
  if (under_ == circumstance::beside_a_forked_child) {
    starter_.fork_a_child();
    write_to_own_stack();
  }
  (void)rt::tripwire::arm().disarm(); // the scope's own first faults
}

// A stack is private memory by nature: after a fork each of its pages faults once. The thread's own variables
// lie at its end.
void real_time::write_to_own_stack() noexcept {
  constexpr std::size_t below = 32 * 1024;
  volatile char buffer[below];
  for (std::size_t i = 0; i < below; i += 1024) buffer[i] = 0;
  use(buffer);
  for (char* at = static_cast<char*>(__builtin_frame_address(0)); at < stack_end_; at += 1024) {
    volatile char* const byte = at;
    *byte = *byte;
  }
  volatile char* const last = stack_end_ - 1;
  *last = *last;
}

outcome perform(const exercise& one, circumstance under) {
  outcome result;
  starting_main_thread main;
  const clock_put_into_the_kernel clock{under == circumstance::with_a_clock_in_the_kernel};
  const bool tells = under == circumstance::beside_a_sleeping_service_thread ||
                     under == circumstance::beside_one_that_is_told_and_awake;
  const net::descriptor wakes{tells ? ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC) : -1};
  const rt::thread thread{{.name = "contract"}, [&] {
                            try {
                              if (!rt::tripwire::watch_system_calls())
                                throw std::runtime_error{std::strerror(errno)};
                              real_time here{under, count_for(one, under), main, wakes.get()};
                              one.run(here);
                              result.seen = here.seen();
                              result.told = here.told();
                              if (!here.measured()) result.trouble = "no call was measured";
                            } catch (const std::exception& e) {
                              result.trouble = e.what();
                            }
                            main.end();
                          }};
  if (thread.error() != 0) return {{}, 0, std::strerror(thread.error())};
  main.serve();
  return result;
}

std::vector<exercise> all_exercises() {
  std::vector<exercise> all;
  for (const auto part :
       {exercises_of_rings(), exercises_of_slots(), exercises_of_time(), exercises_of_the_wheel(),
        exercises_of_values(), exercises_of_json(), exercises_of_handles(), exercises_of_messages(),
        exercises_of_lanes(), exercises_of_callers(), exercises_of_responders(),
        exercises_of_typed_subscribers(), exercises_of_c(), exercises_of_c_in_trouble(),
        exercises_of_structs_in_c(), exercises_of_the_stop(), exercises_of_parameters(),
        exercises_between_two_threads()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

} // namespace rowe::contract
