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

// Hand-made schemas, whose member "a" is a byte within so many arrays of one element.
class nested_arrays {
 public:
  explicit nested_arrays(std::size_t depth_max) : values_(depth_max + 1), members_(depth_max + 1) {
    for (std::size_t i = 0; i <= depth_max; ++i) {
      values_[i] = {.kind = i == 0 ? value_kind::uint8 : value_kind::array, .bytes = 1};
      if (i != 0) values_[i].element = &values_[i - 1];
      values_[i].count_max = 1;
      values_[i].elements = itself;
      members_[i] = {.name = "a", .type = &values_[i], .address = itself};
    }
  }
  schema_description schema(std::size_t depth) const {
    return {.type_name = {},
            .bytes = 1,
            .alignment = 1,
            .members = {&members_[depth], 1},
            .set_default = [](void* storage) noexcept { *static_cast<char*>(storage) = 0; },
            .decodable = true};
  }

 private:
  static const void* itself(const void* at) noexcept { return at; }

  std::vector<value_description> values_;
  std::vector<member_description> members_;
};

} // namespace rowe::tests
