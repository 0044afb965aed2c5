// SPDX-License-Identifier: Apache-2.0
// The decoder for tests: what it reads, and its errors, must be what a plain reference says.
#pragma once
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "encoded.hpp"
#include "padded.hpp"
#include "slow_decoder.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"

namespace rowe::tests {

template <class T>
const json::decoder& decoder_of() {
  static const json::decoder d = json::decoder::compile(describe<T>()).value();
  return d;
}

inline bool is_valid(std::string_view text) {
  static json::reader r = json::reader::create(1 << 20).value();
  return r.validate(padded{text}.text()).has_value();
}

// Reads from exactly so many bytes of the heap, into memory that held something else.
template <class T>
status decode(std::string_view text, T& into) {
  EXPECT_TRUE(is_valid(text)) << text;
  const auto exact = std::make_unique<char[]>(text.size());
  text.copy(exact.get(), text.size());
  std::memset(static_cast<void*>(&into), 0x5a, sizeof into);
  const status s = decoder_of<T>().decode({exact.get(), text.size()}, &into);
  auto other = std::make_unique<T>();
  const status expected = slow_decoder::decode(describe<T>(), text, other.get());
  EXPECT_EQ(s.has_value(), expected.has_value()) << text;
  if (!s && !expected) {
    EXPECT_EQ(s.error(), expected.error()) << text;
  }
  if (s && expected) {
    EXPECT_EQ(encoded(into), encoded(*other)) << text;
  }
  return s;
}

template <class T>
T decoded(std::string_view text) {
  T x;
  const status s = decode(text, x);
  EXPECT_TRUE(s) << s.error().name() << " in " << text;
  return x;
}

template <class T>
error refused(std::string_view text) {
  T x;
  const status s = decode(text, x);
  EXPECT_FALSE(s) << text;
  return s ? error{errc::misuse} : s.error();
}

// What is said of a text that is refused.
template <class T>
std::string diagnosis_of(std::string_view text) {
  auto storage = std::make_unique<T>();
  json::decoder::diagnosis why;
  const status s = decoder_of<T>().decode(text, storage.get(), &why);
  EXPECT_FALSE(s);
  EXPECT_EQ(s.error(), refused<T>(text)); // the same with and without
  std::array<char, json::decoder::diagnosis::text_bytes_max> words;
  return std::string{why.text(words)};
}

} // namespace rowe::tests
