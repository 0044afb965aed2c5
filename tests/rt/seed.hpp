// SPDX-License-Identifier: Apache-2.0
// The seed of a randomised test: a new one each run, told when the test fails, given again by ROWE_TEST_SEED.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace rowe::tests {

// Named in every failure of the scope it stands in.
class test_seed {
 public:
  explicit test_seed(std::uint64_t value = chosen(), int line = __builtin_LINE())
      : value_{value},
        named_{__FILE__, line, ::testing::Message() << "again with ROWE_TEST_SEED=" << value} {}
  operator std::uint64_t() const { return value_; }

 protected:
  static std::uint64_t chosen() {
    if (const char* const given = std::getenv("ROWE_TEST_SEED")) return std::strtoull(given, nullptr, 10);
    return std::random_device{}();
  }

 private:
  std::uint64_t value_;
  ::testing::ScopedTrace named_;
};

// Random numbers from such a seed.
class seeded : test_seed, public std::mt19937_64 {
 public:
  explicit seeded(int line = __builtin_LINE())
      : test_seed{chosen(), line}, mersenne_twister_engine{std::uint64_t{*this}} {}
};

} // namespace rowe::tests
