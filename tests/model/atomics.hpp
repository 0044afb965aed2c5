// SPDX-License-Identifier: Apache-2.0
// What code under the explorer is given instead of std::atomic and the kernel: the atomics policy, and a bell
// to wait on. Usable only between the construction of a scenario and the end of its run.
#pragma once
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "model/explorer.hpp"

namespace rowe::model {

// The policy. As rowe::rt::std_atomics, within a run of an explorer.
struct atomics {
  template <class T>
  class variable {
   public:
    variable() : variable{T{}} {}
    explicit variable(T value) : word_{explorer::active().make_word(bits_of(value))} {}
    variable(const variable&) = delete;
    variable& operator=(const variable&) = delete;

    T load(order o, site where = site::here()) const noexcept {
      return value_of(explorer::active().load(word_, o, where));
    }
    void store(T value, order o, site where = site::here()) noexcept {
      explorer::active().store(word_, bits_of(value), o, where);
    }
    T exchange(T value, order o, site where = site::here()) noexcept {
      return value_of(explorer::active().exchange(word_, bits_of(value), o, where));
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
    plain(site where = site::here()) : datum_{explorer::active().make_plain(where)} {}
    plain(const plain&) = delete;
    plain& operator=(const plain&) = delete;

    T load(site where = site::here()) const noexcept {
      explorer::active().read_plain(datum_, where);
      return data_;
    }
    void store(const T& data, site where = site::here()) noexcept {
      explorer::active().write_plain(datum_, where);
      data_ = data;
    }

   private:
    std::size_t datum_;
    T data_{};
  };
};

// What an eventfd or a futex is to a structure: ring() makes the next wait() return, or the one under way. A
// run in which everybody left waits has failed: somebody was not woken. Orders memory as the kernel's locks
// inside do, ring before the wait that it ends.
class bell {
 public:
  void ring() {
    explorer& e = explorer::active();
    e.point();
    e.note("ring");
    rung_ = true;
    e.words().release_into(e.running(), carried_);
    e.wake(this);
  }
  void wait() {
    explorer& e = explorer::active();
    e.point();
    while (!rung_) e.block_on(this);
    e.note("woken");
    rung_ = false;
    e.words().acquire_from(e.running(), carried_);
  }

 private:
  bool rung_ = false;
  knowledge carried_;
};

} // namespace rowe::model
