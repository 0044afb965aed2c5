// SPDX-License-Identifier: Apache-2.0
// The real-time contract as a test: each function marked ROWE_RT is called 100,000 times in each state it can
// be in, under the tripwire, and must make no system call, touch no heap and no lock, and cause no page
// fault.
// ROWE_CONTRACT_CALLS sets how often; a million times with tools/test --all.
//
// An exercise names the function, the state, and how to reach it; it arranges that state in a real-time
// thread of its own and then hands the call to `calls`. completeness.py compares the names with the headers.
#pragma once
#include <pthread.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/counter.hpp>
#include <rowe/rt/tripwire.hpp>
#include <rowe/rt/waker.hpp>

#include "rt/asked.hpp"

namespace rowe::contract {

inline const std::uint64_t calls_made = tests::asked_of("ROWE_CONTRACT_CALLS", 100'000);
// Where each call enters the kernel, through the trap, which takes microseconds.
inline constexpr std::uint64_t trapped_calls_made = 10'000;
// Of another thread meanwhile, at least.
inline constexpr std::uint64_t other_turns_made = 1'000;

// What the calls are made under.
enum class circumstance : std::uint8_t {
  ordinary,
  // fork() makes private pages copy-on-write, so that they fault once more: those of the library must not be
  // private.
  beside_a_forked_child,
  // A clock source without a vDSO: whoever reads the clock makes a system call, and nobody but the loop may.
  with_a_clock_in_the_kernel,
  // Under idle::wake: whatever is handed to the service thread is told it, by one write to one descriptor
  // while it sleeps, and by none while it does not.
  beside_a_sleeping_service_thread,
  beside_one_that_is_told_and_awake,
};

// Keeps the compiler from leaving a call out.
template <class T>
void use(T&& value) noexcept {
  asm volatile("" : : "r"(&value) : "memory");
}

// What the real-time thread, which may start nothing itself, has the main thread do for it. They return when
// it is done.
class starter {
 public:
  virtual void fork_a_child() = 0;
  virtual void start_a_thread(std::function<void()> body) = 0;
  virtual void join_the_thread() = 0;

 protected:
  ~starter() = default;
};

// The memory of an exercise, and the measured calls. Lives in the real-time thread.
class real_time {
 public:
  // `wake_descriptor`: a descriptor that may be written to; -1: none.
  real_time(circumstance under, std::uint64_t count, starter& by, int wake_descriptor);

  // In memory as the library's own: shared, present, never destroyed.
  template <class T, class... Arguments>
  T& make(Arguments&&... arguments) {
    const std::span<std::byte> storage = memory_.carve_bytes(sizeof(T), alignof(T));
    if (storage.empty()) throw std::length_error{"the exercise's memory is too small"};
    return *std::construct_at(reinterpret_cast<T*>(storage.data()), std::forward<Arguments>(arguments)...);
  }
  template <class T>
  std::span<T> array(std::size_t count) {
    const std::span<T> made = memory_.carve<T>(count);
    if (made.size() != count) throw std::length_error{"the exercise's memory is too small"};
    return made;
  }

  // Another thread that does `turn` again and again while the calls are made; they go on until it has done so
  // a thousand times. Before calls().
  void beside(std::function<void()> turn) { other_turn_ = std::move(turn); }

  // Makes the calls: call(i) for i from 0 on.
  template <class Call>
  void calls(Call&& call) {
    const other_thread other{*this};
    std::uint64_t i = 0;
    for (; i < warming_calls; ++i) call(i);
    if (under_ != circumstance::beside_a_sleeping_service_thread) return measure(call, i);
    const std::uint64_t before = handed_over();
    waker_->sleep([] { return true; }, [&] { measure(call, i); });
    told_ = handed_over() - before;
  }

  // The same on what the exercise has made: call(on, i), and what that returns is used.
  template <class On, class Call>
  void calls_on(On&& on, Call call) {
    calls([&](std::uint64_t i) {
      if constexpr (std::is_void_v<decltype(call(on, i))>)
        call(on, i);
      else
        use(call(on, i));
    });
  }

  // The waker of a queue pair, and its count of submissions. Null except under idle::wake.
  rt::waker<>* waker_for(const rt::counter& handed_over) {
    if (!waker_) return nullptr;
    handed_over_.push_back(&handed_over);
    return &*waker_;
  }

  const rt::tripwire::report& seen() const noexcept { return seen_; }
  bool measured() const noexcept { return measured_; }
  // What the calls handed to the service thread, where they tell it while it sleeps; else 0.
  std::uint64_t told() const noexcept { return told_; }

 private:
  static constexpr std::uint64_t warming_calls =
      16; // code and constants are paged in by them; not an exercise's data

  template <class Call>
  void measure(Call& call, std::uint64_t i) {
    before_measuring();
    const std::uint64_t turns_enough = other_turn_ ? turns() + other_turns_made : 0;
    auto wire = rt::tripwire::arm();
    bool enough = false;
    for (const std::uint64_t end = i + count_; i < end || !enough; ++i) {
      enough = turns() >= turns_enough; // before the call: the last one has seen what they brought
      call(i);
    }
    seen_ = wire.disarm();
    measured_ = true;
  }
  // Runs as long as this lives, if there is one: what it uses is the exercise's.
  class other_thread {
   public:
    explicit other_thread(real_time& of);
    ~other_thread();
    other_thread(const other_thread&) = delete;
    other_thread& operator=(const other_thread&) = delete;

   private:
    real_time& of_;
  };
  std::uint64_t turns() const noexcept {
    return shared_.turns.load(std::memory_order_relaxed); // relaxed: only counted
  }
  std::uint64_t handed_over() const noexcept;
  void before_measuring();
  void write_to_own_stack() noexcept;

  rt::arena memory_;
  circumstance under_;
  std::uint64_t count_;
  starter& starter_;
  struct words {
    std::atomic<std::uint64_t> turns{0};
    std::atomic<bool> stop{false};
  };
  words& shared_;
  std::function<void()> other_turn_;
  char* stack_end_ = nullptr;
  std::optional<rt::waker<>> waker_;
  std::vector<const rt::counter*> handed_over_;
  std::uint64_t told_ = 0;
  rt::tripwire::report seen_;
  bool measured_ = false;
};

// What an exercise works on, newly made.
template <class T>
T& made(real_time& rt) {
  return rt.make<T>();
}

// The exercise that makes its calls on what `Make` makes: call(it), or call(it, i).
template <auto Make, class Call>
constexpr auto calls_on(Call) {
  return [](real_time& rt) {
    rt.calls_on(Make(rt), [](auto& it, auto i) {
      if constexpr (std::is_invocable_v<Call, decltype(it)>)
        return Call{}(it);
      else
        return Call{}(it, i);
    });
  };
}

struct exercise {
  const char* function; // as completeness.py names it: without rowe:: and rt::
  const char* state;
  void (*run)(real_time&);
  bool reads_clock = false; // says so in its documentation
};

// From exercises_*.cpp.
std::span<const exercise> exercises_of_rings();
std::span<const exercise> exercises_of_slots();
std::span<const exercise> exercises_of_time();
std::span<const exercise> exercises_of_the_wheel();
std::span<const exercise> exercises_of_values();
std::span<const exercise> exercises_of_json();
std::span<const exercise> exercises_of_handles();
std::span<const exercise> exercises_of_messages();
std::span<const exercise> exercises_of_lanes();
std::span<const exercise> exercises_of_callers();
std::span<const exercise> exercises_of_responders();
std::span<const exercise> exercises_of_typed_subscribers();
std::span<const exercise> exercises_of_the_stop();
std::span<const exercise> exercises_of_parameters();
std::span<const exercise> exercises_of_c();
std::span<const exercise> exercises_of_c_in_trouble();
std::span<const exercise> exercises_of_structs_in_c();
std::span<const exercise> exercises_between_two_threads();
std::vector<exercise> all_exercises();

// Runs one in a real-time thread of its own. `seen` is meaningless where `trouble` says what went wrong.
struct outcome {
  rt::tripwire::report seen;
  std::uint64_t told = 0; // as in real_time
  std::string trouble;
};
outcome perform(const exercise& one, circumstance under);

// From clock_in_the_kernel.cpp: whether clock_gettime() is a system call from now on. Any thread.
void put_clock_into_the_kernel(bool there) noexcept;

} // namespace rowe::contract
