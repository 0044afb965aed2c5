// SPDX-License-Identifier: Apache-2.0
#include "wire/websocket/websocket.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "wire/frames.hpp"

namespace rowe::wire::test {
namespace frame_writer_test {
namespace {

constexpr mask_key a_key{std::byte{0x12}, std::byte{0x34}, std::byte{0x56},
                         std::byte{0x78}}; // frames.hpp's default

std::string_view view_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(frame_writer, writes_the_header_the_rfc_demands_at_every_boundary) {
  for (const std::uint64_t length :
       {0ULL, 1ULL, 125ULL, 126ULL, 65535ULL, 65536ULL, 0xffff'ffffULL, 1ULL << 62U}) {
    for (const bool masked : {false, true}) {
      const std::string expected = header_of({.masked = masked}, length);
      std::array<std::byte, frame_header_bytes_max> out{};
      const std::size_t size = masked ? write_frame_header(out.data(), opcode::text, length, a_key)
                                      : write_frame_header(out.data(), opcode::text, length);
      EXPECT_EQ(view_of(std::span{out}.first(size)), expected) << length;
      EXPECT_EQ(frame_header_bytes(length, masked ? role::client : role::server), size) << length;
    }
  }
}

TEST(mask, is_the_rfcs_rule_for_every_length_offset_and_alignment) {
  std::vector<std::byte> plain(100);
  for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = static_cast<std::byte>(i * 7 + 3);
  for (std::size_t start = 0; start < 9; ++start) {
    for (std::size_t length = 0; start + length <= plain.size(); ++length) {
      for (std::size_t offset = 0; offset < 5; ++offset) {
        std::vector<std::byte> expected = plain;
        for (std::size_t i = 0; i < length; ++i) expected[start + i] ^= a_key[(i + offset) % 4];
        std::vector<std::byte> masked = plain;
        mask(std::span{masked}.subspan(start, length), a_key, offset);
        ASSERT_EQ(masked, expected) << start << ' ' << length << ' ' << offset;
        std::vector<std::byte> copy(length);
        mask_copy(copy, std::span{plain}.subspan(start, length), a_key, offset);
        ASSERT_EQ(view_of(copy), view_of(std::span{expected}.subspan(start, length)))
            << length << ' ' << offset;
      }
    }
  }
}

TEST(mask, tells_where_nothing_but_ascii_comes_out) {
  for (std::size_t length = 1; length <= 70; ++length) {
    std::vector<std::byte> data(length, std::byte{0x7f});
    (void)mask(data, a_key);
    std::vector<std::byte> copy(length);
    EXPECT_TRUE(mask_copy(copy, data, a_key));
    for (std::size_t at = 0; at < length; ++at) {
      data[at] ^= std::byte{0x80};
      EXPECT_FALSE(mask_copy(copy, data, a_key)) << length << ' ' << at;
      data[at] ^= std::byte{0x80};
    }
    EXPECT_TRUE(mask(data, a_key)) << length;
  }
}

TEST(close_payload, is_empty_where_no_code_was_given) {
  std::array<std::byte, control_bytes_max> out{};
  EXPECT_EQ(close_payload(close_code::none_given, "ignored", out), 0U);
}

TEST(close_payload, is_cut_between_characters) {
  std::array<std::byte, control_bytes_max> out{};
  EXPECT_EQ(close_payload(1000, std::string(123, 'a'), out), 125U);
  EXPECT_EQ(close_payload(1000, std::string(124, 'a'), out), 125U);
  EXPECT_EQ(close_payload(1000, std::string(122, 'a') + "\xc3\xa9", out), 2U + 122U);
  EXPECT_EQ(close_payload(1000, std::string(121, 'a') + "\xc3\xa9", out), 2U + 123U);
  EXPECT_EQ(close_payload(1000, std::string(120, 'a') + "\xf0\x9f\x98\x80", out), 2U + 120U);
}

} // namespace
} // namespace frame_writer_test
} // namespace rowe::wire::test
