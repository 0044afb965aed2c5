// SPDX-License-Identifier: Apache-2.0
// Where a writer's bytes go, and where a reader's come from: a file, or memory in tests.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

namespace rowe::mcap {

class sink {
 public:
  virtual ~sink() = default;
  // All of it, behind what was written before. False: not all was written, and nothing can be from now on.
  virtual bool write(std::string_view bytes) = 0;
};

class source {
 public:
  virtual ~source() = default;
  virtual std::uint64_t bytes() const = 0;
  // Fills all of `into` from `at` on. False: the source ends before, or cannot be read.
  virtual bool read(std::uint64_t at, std::span<char> into) = 0;
};

} // namespace rowe::mcap
