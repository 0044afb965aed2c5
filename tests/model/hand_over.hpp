// SPDX-License-Identifier: Apache-2.0
// The smallest structure that can be wrong: one datum, handed over once by one flag. On it explorer_test.cpp
// shows that the mutation test finds what it should; two of its orders are therefore not as they would be in
// rowe.
#pragma once
#include <atomic>

namespace rowe::model {

template <class Atomics>
class hand_over {
 public:
  void give(int datum) {
    datum_.store(datum);
    given_.store(true, std::memory_order_seq_cst); // stronger than needed: release would do
  }
  // Nothing yet: 0.
  int take() { return given_.load(std::memory_order_acquire) ? datum_.load() : 0; } // pairs with give()
  bool given() const { return given_.load(std::memory_order_relaxed); } // relaxed: no scenario calls it

 private:
  typename Atomics::template plain<int> datum_;
  typename Atomics::template variable<bool> given_{false};
};

} // namespace rowe::model
