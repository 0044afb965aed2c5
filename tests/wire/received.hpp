// SPDX-License-Identifier: Apache-2.0
// What the other end makes of a message, by a protocol's own decoder.
#pragma once
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "wire/protocols/protocols.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::test {

// Of a text.
struct received {
  received(const protocol& by, std::string said, const name_limits& limits = {}, list_place from = {})
      : text{std::move(said)}, scratch(decode_scratch_bytes(limits)) {
    const std::size_t bytes = text.size();
    text.append(json::reader::tailroom_bytes, '\xff');
    auto reader = json::reader::create(64 * 1024);
    EXPECT_TRUE(reader->validate({text.data(), bytes})) << text;
    is = by.reads.decode(reader->last(),
                         {.scratch = scratch, .diagnostic = buffer, .limits = limits, .from = from}, request,
                         why);
  }
  received(const received&) = delete;

  std::string text;
  std::vector<char> scratch;
  std::array<char, refusal::text_bytes_max> buffer{};
  wire::request request;
  diagnostic why;
  decoded is = decoded::refused;
};

// Of a binary message.
struct received_binary {
  received_binary(const protocol& by, std::string bytes, const name_limits& limits = {})
      : message{std::move(bytes)} {
    is = by.reads.decode_binary(std::as_bytes(std::span{message}),
                                {.scratch = {}, .diagnostic = buffer, .limits = limits}, request, why);
  }
  received_binary(const received_binary&) = delete;

  std::string message;
  std::array<char, refusal::text_bytes_max> buffer{};
  wire::request request;
  diagnostic why;
  decoded is = decoded::refused;
};

} // namespace rowe::wire::test
