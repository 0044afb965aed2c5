// SPDX-License-Identifier: Apache-2.0
// What is written of a value, into rooms that suffice and into smaller ones.
#pragma once
#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/schema.hpp>

#include "json/structs/encoder.hpp"
#include "json/writing/writer.hpp"

namespace rowe::tests {

inline std::string encoded_by(const json::encoder& e, const void* value) {
  std::string buffer(e.bytes_max(), '\0');
  json::writer w{buffer};
  e.encode(value, w);
  EXPECT_FALSE(w.overflowed()) << "bytes_max() is too small";
  return std::string{w.text()};
}

template <json::encoding Into = json::encoding::json, class T>
std::string encoded(const T& value) {
  static const json::encoder e = json::encoder::compile(describe<T>(), Into).value();
  return encoded_by(e, &value);
}

// Into a room of so many bytes `write` writes the whole, or says that it does not fit; and nothing beyond.
template <class Write>
void expect_written_within(std::size_t room, std::string_view whole, Write write) {
  constexpr char canary = '#';
  constexpr std::ptrdiff_t canaries = 64;
  std::vector<char> buffer(room + canaries, canary);
  json::writer w{std::span{buffer}.first(room)};
  write(w);
  EXPECT_EQ(w.overflowed(), room < whole.size()) << room;
  if (!w.overflowed()) {
    EXPECT_EQ(w.text(), whole) << room;
  }
  EXPECT_EQ(std::count(buffer.end() - canaries, buffer.end(), canary), canaries) << room;
}

} // namespace rowe::tests
