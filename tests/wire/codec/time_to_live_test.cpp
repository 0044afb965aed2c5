// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/time_to_live.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "wire/decoded.hpp"
#include "wire/plain/plain_codec.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "wire/rosbridge/rosbridge_codec.hpp"

namespace time_to_live_test {
namespace {

using namespace rowe::wire;

std::string written(std::int64_t ns) {
  std::array<std::byte, ttl_text_bytes_max> out;
  const std::size_t bytes = write_ttl(out, ns);
  return {reinterpret_cast<const char*>(out.data()), bytes};
}
std::string text_of(const message_head& head) {
  return {reinterpret_cast<const char*>(head.bytes.data()), head.size};
}

TEST(time_to_live, is_written_in_milliseconds_rounded_down_to_microseconds) {
  EXPECT_EQ(written(20'000'000), R"("ttl_ms":20)");
  EXPECT_EQ(written(19'873'999), R"("ttl_ms":19.873)");
  EXPECT_EQ(written(19'000'999), R"("ttl_ms":19)");
  EXPECT_EQ(written(5'000), R"("ttl_ms":0.005)");
  EXPECT_EQ(written(1'000), R"("ttl_ms":0.001)");
  EXPECT_EQ(written(1'050'000), R"("ttl_ms":1.050)");
  EXPECT_EQ(written(INT64_MAX), R"("ttl_ms":9223372036854.775)") << "the longest";
  EXPECT_EQ(written(INT64_MAX).size(), ttl_text_bytes_max);
}

// A hop loses less than a microsecond, and never gains any.
TEST(time_to_live, is_read_as_it_was_written) {
  for (const std::int64_t ns : {1'000LL, 999'999LL, 19'873'215LL, 50'000'000LL, 86'400'000'000'001LL}) {
    std::int64_t read = 0;
    const std::string text = written(ns);
    ASSERT_FALSE(read_ttl({.type = rowe::json::kind::number, .raw = std::string_view{text}.substr(9)}, read));
    EXPECT_EQ(read, ns / 1000 * 1000) << ns;
  }
}

TEST(time_to_live, stands_first_in_a_plain_message) {
  const plain_codec codec{codec_id{0}};
  EXPECT_EQ(text_of(codec.head_of({.ttl_ns = 7'500'000})), R"({"ttl_ms":7.500,)");
  EXPECT_EQ(text_of(codec.head_of({.empty = true, .ttl_ns = 7'000'000})), R"({"ttl_ms":7)");
  EXPECT_EQ(codec.head_of({.ttl_ns = 7'000'000}).from, 1) << "the text goes on behind its brace";
  EXPECT_EQ(text_of(codec.head_of({})), "{");
}

TEST(time_to_live, stands_behind_the_operation_of_a_publish) {
  const rosbridge_json_codec codec{codec_id{0}};
  EXPECT_EQ(text_of(codec.head_of({.ttl_ns = 7'500'000})), R"({"op":"publish","ttl_ms":7.500,"topic":")");
  EXPECT_EQ(codec.head_of({.ttl_ns = 1'000}).from, rosbridge::publish_begins.size());
  EXPECT_EQ(codec.head_of({.unslashed = true, .ttl_ns = 1'000}).from, rosbridge::publish_begins.size() + 1);
  EXPECT_EQ(text_of(codec.head_of({})), rosbridge::publish_begins);
}

} // namespace
} // namespace time_to_live_test
