// SPDX-License-Identifier: Apache-2.0
// A window that is wrong on purpose: its four seq_cst accesses are relaxed, so nothing orders the writing of
// a payload before its reading. ThreadSanitizer must report the payload's bytes; if it does not, it does not
// see how they are copied, and then no report about the real window means nothing. gcc expands a memcpy of
// known size to instructions that TSan does not see, unless told not to (-fno-builtin-memcpy); so there are
// two plants, one for each way of copying, chosen by the argument `assign` or `memcpy`. Built and run in TSan
// builds only; a test passes when the report names copy_payload.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <thread>

#include <rowe/rt/window.hpp>

namespace {

// As large as odometry with its covariances.
struct payload {
  std::array<double, 85> values;
};

bool by_memcpy = false; // set before the second thread starts

__attribute__((noinline)) void copy_payload(payload& to, const payload& from) {
  if (by_memcpy)
    std::memcpy(&to, &from, sizeof to);
  else
    to = from;
}

struct weakened_atomics {
  template <class T>
  class variable {
   public:
    variable() noexcept = default;
    explicit variable(T value) noexcept : word_{value} {}
    T load(std::memory_order order) const noexcept { return word_.load(weakened(order)); }
    void store(T value, std::memory_order order) noexcept { word_.store(value, weakened(order)); }
    T exchange(T value, std::memory_order order) noexcept { return word_.exchange(value, weakened(order)); }

   private:
    static std::memory_order weakened(std::memory_order order) {
      return order == std::memory_order_seq_cst ? std::memory_order_relaxed : order;
    }
    std::atomic<T> word_{};
  };

  // Words of the window itself are left out of the report by being atomic: only the payload may be what it
  // names.
  template <class T>
  class plain {
   public:
    T load() const noexcept { return data_.load(std::memory_order_relaxed); }
    void store(const T& data) noexcept { data_.store(data, std::memory_order_relaxed); }

   private:
    std::atomic<T> data_{};
  };
};

template <>
class weakened_atomics::plain<payload> {
 public:
  payload load() const noexcept {
    payload copy;
    copy_payload(copy, data_);
    return copy;
  }
  void store(const payload& data) noexcept { copy_payload(data_, data); }

 private:
  payload data_{};
};

} // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  by_memcpy = std::string_view{arguments[1]} == "memcpy";
  constexpr std::uint64_t writes = 100'000;
  rowe::rt::window<payload, weakened_atomics> shared;
  std::thread writing{[in = shared.take_writer()] {
    payload value{};
    for (std::uint64_t number = 1; number <= writes; ++number) {
      value.values[0] = static_cast<double>(number);
      in->write(value);
    }
  }};
  auto* const out = shared.take_reader();
  payload value{};
  while (out->sequence() < writes)
    if (out->read(value) != rowe::rt::freshness::fresh) std::this_thread::yield();
  writing.join();
  std::printf("read up to value %.0f\n", value.values[0]);
  return 0;
}
