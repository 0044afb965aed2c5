// SPDX-License-Identifier: Apache-2.0
// A fuzzer's input as a script: bytes that choose, and texts.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "sim/swarm_choices.hpp"

namespace rowe::fuzz {

// What is left of the input.
class script {
 public:
  script(const std::uint8_t* data, std::size_t size) : data_{data}, size_{size} {}
  bool over() const { return size_ == 0; }
  std::uint8_t byte() {
    if (size_ == 0) return 0;
    --size_;
    return *data_++;
  }
  // A length byte and so many bytes.
  std::string text() {
    const std::size_t bytes = std::min<std::size_t>(byte(), size_);
    std::string made(reinterpret_cast<const char*>(data_), bytes);
    data_ += bytes;
    size_ -= bytes;
    return made;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

// A script's bytes as choices.
class input_choices final : public swarm::choices {
 public:
  explicit input_choices(script& from) : from_{from} {}
  std::uint64_t below(std::uint64_t bound) override {
    std::uint64_t value = from_.byte();
    if (bound > 256) value = value << 8 | from_.byte();
    return value % bound;
  }

 private:
  script& from_;
};

// One byte of set-up, and a script. What it acts on is checked by itself.
template <class On>
int run(const std::uint8_t* data, std::size_t size, std::size_t bytes_max) {
  if (size == 0 || size > bytes_max) return 0;
  script s{data + 1, size - 1};
  On on{data[0]};
  while (!s.over()) on.act(s);
  on.end();
  return 0;
}

} // namespace rowe::fuzz
