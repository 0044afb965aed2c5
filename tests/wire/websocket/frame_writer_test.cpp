// SPDX-License-Identifier: Apache-2.0
#include "wire/websocket/websocket.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>
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

TEST(frame_writer, writes_every_opcode) {
  for (const opcode what :
       {opcode::continuation, opcode::text, opcode::binary, opcode::close, opcode::ping, opcode::pong}) {
    std::array<std::byte, frame_header_bytes_max> out{};
    EXPECT_EQ(write_frame_header(out.data(), what, 5), 2U);
    EXPECT_EQ(std::to_integer<unsigned>(out[0]), 0x80U | static_cast<unsigned>(what));
    EXPECT_EQ(std::to_integer<unsigned>(out[1]), 5U);
  }
}

TEST(frame_writer, writes_a_header_in_front_of_a_payload_within_the_headroom) {
  for (const std::size_t length : {5U, 126U, 65536U}) {
    for (const bool masked : {false, true}) {
      std::vector<std::byte> slot(frame_headroom_bytes + length, std::byte{'x'});
      std::byte* const payload = slot.data() + frame_headroom_bytes;
      const auto key = masked ? std::optional{a_key} : std::nullopt;
      std::byte* const start = write_frame_header_before(payload, opcode::text, length, key);
      ASSERT_GE(start, slot.data());
      if (key) mask({payload, length}, *key);
      const std::string expected = bytes_of(frame{.payload = std::string(length, 'x'), .masked = masked});
      EXPECT_EQ(view_of({start, slot.data() + slot.size()}), expected) << length;
    }
  }
}

TEST(frame_writer, round_trips_through_the_parser_at_every_boundary) {
  for (const std::size_t length : {0U, 125U, 126U, 65535U, 65536U}) {
    for (const role theirs : {role::server, role::client}) {
      std::vector<std::byte> slot(frame_headroom_bytes + length, std::byte{'y'});
      std::byte* const payload = slot.data() + frame_headroom_bytes;
      const auto key = theirs == role::client ? std::optional{a_key} : std::nullopt;
      std::byte* const start = write_frame_header_before(payload, opcode::text, length, key);
      if (key) mask({payload, length}, *key);
      receiver ours{theirs == role::client ? role::server : role::client,
                    {.message_bytes_max = 65536, .fragments_max = 1}};
      EXPECT_EQ(ours.feed(view_of({start, slot.data() + slot.size()})),
                std::vector{text(std::string(length, 'y'))});
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

TEST(mask, undoes_itself_and_leaves_data_alone_with_a_key_of_zeros) {
  std::vector<std::byte> data(33, std::byte{'z'});
  const auto before = data;
  mask(data, {});
  EXPECT_EQ(data, before);
  mask(data, a_key, 1);
  EXPECT_NE(data, before);
  mask(data, a_key, 1);
  EXPECT_EQ(data, before);
  std::vector<std::byte> copy(33);
  mask_copy(copy, data, {});
  EXPECT_EQ(copy, before);
}

TEST(close_payload, is_the_code_and_the_reason) {
  std::array<std::byte, control_bytes_max> out{};
  EXPECT_EQ(view_of(std::span{out}.first(close_payload(1001, "bye", out))), "\x03\xe9"
                                                                            "bye");
  EXPECT_EQ(close_payload(close_code::normal, "", out), 2U);
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

TEST(close_payload, is_taken_back_by_the_parser) {
  std::array<std::byte, control_bytes_max> out{};
  const std::size_t size = close_payload(1008, std::string(100, '\xc3'), out);
  EXPECT_LE(size, control_bytes_max);
  const std::string body{view_of(std::span{out}.first(close_payload(1011, "tired", out)))};
  receiver peer{role::client};
  const auto events = peer.feed(bytes_of(frame{.opcode = 8, .payload = body, .masked = false}));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].what, frame_event::close);
  EXPECT_EQ(events[0].code, 1011);
  EXPECT_EQ(events[0].reason, "tired");
}

} // namespace
} // namespace frame_writer_test
} // namespace rowe::wire::test
