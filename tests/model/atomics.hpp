// SPDX-License-Identifier: Apache-2.0
// What code under the explorer is given instead of std::atomic and the kernel: the atomics policy, and an
// eventfd and a futex to wait on. Usable only between the construction of a scenario and the end of its run.
#pragma once
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <rowe/rt/clock.hpp>

#include "model/explorer.hpp"

namespace rowe::model {

// The policy. As rowe::rt::std_atomics, within a run of an explorer.
struct atomics {
  template <class T>
  class variable {
   public:
    variable() : variable{T{}} {}
    explicit variable(T value) : word_{explorer::active()->make_word(bits_of(value))} {}
    variable(const variable&) = delete;
    variable& operator=(const variable&) = delete;

    T load(order o, site where = site::here()) const noexcept {
      return value_of(explorer::active()->load(word_, o, where));
    }
    void store(T value, order o, site where = site::here()) noexcept {
      explorer::active()->store(word_, bits_of(value), o, where);
    }
    T exchange(T value, order o, site where = site::here()) noexcept {
      return value_of(explorer::active()->exchange(word_, bits_of(value), o, where));
    }
    T fetch_add(T value, order o, site where = site::here()) noexcept {
      return value_of(explorer::active()->exchange(word_, bits_of(value), o, where, true));
    }

   private:
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(std::uint64_t));
    static std::uint64_t bits_of(T value) noexcept {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof value);
      return bits;
    }
    static T value_of(std::uint64_t bits) noexcept {
      T value;
      std::memcpy(&value, &bits, sizeof value);
      return value;
    }
    std::size_t word_;
  };

  // load() returns a copy where std_atomics returns a reference: a reference kept across somebody's store
  // would escape the check for races.
  template <class T>
  class plain {
   public:
    plain(site where = site::here()) : datum_{explorer::active()->make_plain(where)} {}
    explicit plain(const T& data, site where = site::here())
        : datum_{explorer::active()->make_plain(where)}, data_{data} {}
    plain(const plain&) = delete;
    plain& operator=(const plain&) = delete;

    T load(site where = site::here()) const noexcept {
      explorer::active()->read_plain(datum_, where);
      return data_;
    }
    void store(const T& data, site where = site::here()) noexcept {
      explorer::active()->write_plain(datum_, where);
      data_ = data;
    }

   private:
    std::size_t datum_;
    T data_{};
  };
};

// An eventfd, as far as sleeping goes: signal() ends the next wait(), or the one under way, unless poll()
// takes it before. A run in which everybody left waits has failed: somebody was not woken.
class event_fd {
 public:
  void signal() {
    explorer& e = *explorer::active();
    e.enter_kernel(this);
    e.note("signals");
    signalled_ = true;
    e.wake(this);
    e.leave_kernel(this);
  }
  void wait() {
    explorer& e = *explorer::active();
    e.enter_kernel(this);
    while (!signalled_) {
      e.leave_kernel(this);
      e.note("waits for the event_fd");
      (void)e.wait_for(this);
      e.enter_kernel(this);
    }
    signalled_ = false;
    e.leave_kernel(this);
  }
  // Takes a signal that is there, without waiting: as epoll_wait(2) without a time-out, by an edge.
  void poll() {
    explorer& e = *explorer::active();
    e.enter_kernel(this);
    signalled_ = false;
    e.leave_kernel(this);
  }

 private:
  bool signalled_ = false;
};

// As rowe::rt::futex: compares and begins to wait in one step, and may return early for no reason. A deadline
// other than `never` may come at any moment.
struct futex {
  using word = atomics::variable<std::uint32_t>;

  static bool wait(word& w, std::uint32_t expected, rt::time_point deadline) noexcept {
    explorer& e = *explorer::active();
    e.enter_kernel(&w);
    const bool waits = w.load(order::relaxed) == expected;
    e.leave_kernel(&w);
    if (!waits || e.returns_early()) return true;
    e.note("waits in the kernel");
    return e.wait_for(&w, deadline != rt::never);
  }

  static void wake(word& w) noexcept {
    explorer& e = *explorer::active();
    e.enter_kernel(&w);
    e.note("wakes");
    e.wake(&w);
    e.leave_kernel(&w);
  }
};

} // namespace rowe::model
