// SPDX-License-Identifier: Apache-2.0
// What a robot and the fleet of its clients, which are another process, show each other: a page of memory
// that both have. Each number is written by one of the two, and is no more than a number.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <new>

#include <poll.h>
#include <sys/mman.h>

namespace rowe::load {

// What hostile clients do, again and again.
enum class misdeed : std::uint32_t {
  reads_nothing,  // subscribes to everything, and reads none of it
  half_handshake, // begins a handshake, and waits
  takes_new_keys, // more often than is allowed
  wrong_record,   // sends bytes that are no record
  cut,            // leaves without close_notify
  wrong_token,    // is nobody
};
inline constexpr std::size_t misdeeds = 6;

struct plan {
  std::uint32_t healthy = 36;      // clients that must lose nothing
  std::uint32_t fast = 4;          // of those, which take every value of the loop; the others some
  std::uint32_t hostile = 6;       // clients
  std::uint32_t visits_per_s = 20; // clients that connect, upgrade and leave in good order
  std::uint32_t values_per_s = 10; // that all healthy clients take
};

template <class T>
class number {
 public:
  T get() const noexcept { return value_.load(std::memory_order_relaxed); }  // pairs with the store below
  void set(T now) noexcept { value_.store(now, std::memory_order_relaxed); } // pairs with the load above
  void add(T more = 1) noexcept { set(static_cast<T>(get() + more)); }

 private:
  static_assert(std::atomic<T>::is_always_lock_free);
  std::atomic<T> value_{};
};

struct board {
  // The robot writes these.
  number<std::uint32_t> port;
  number<bool> disturbed; // hostile clients and visitors come
  number<bool> over;

  // The fleet writes these.
  number<std::uint32_t> open;      // healthy clients that have subscribed
  number<std::uint64_t> lost;      // values that a healthy client did not get between two others
  number<std::uint64_t> wrong;     // values in another order, or twice
  number<std::uint64_t> broken;    // healthy connections that ended
  number<std::uint64_t> all_have;  // the last of the values for all that every healthy client has
  number<std::uint64_t> fast_have; // the last of the loop's values that each has which takes all
  number<std::uint64_t> heard;     // values
  number<std::uint64_t> visits;    // that came to their end
  number<std::uint64_t> visits_failed;
  number<std::uint32_t> strangers; // hostile clients and visitors that have a connection
  std::array<number<std::uint64_t>, misdeeds> done;
};

// Lets others run, where there is nothing to wait for but a number.
inline void rest(int milliseconds) {
  (void)::poll(nullptr, 0, milliseconds); // a signal may end it early
}

// Before the processes part.
inline board* make_board() {
  void* const page =
      ::mmap(nullptr, sizeof(board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return page == MAP_FAILED ? nullptr : new (page) board;
}

} // namespace rowe::load
