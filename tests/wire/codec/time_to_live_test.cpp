// SPDX-License-Identifier: Apache-2.0
#include "wire/codec/time_to_live.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "wire/plain/plain_codec.hpp"

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

TEST(time_to_live, stands_first_in_a_plain_message) {
  const plain_codec codec{codec_id{0}};
  EXPECT_EQ(text_of(codec.head_of({.ttl_ns = 7'500'000})), R"({"ttl_ms":7.500,)");
  EXPECT_EQ(text_of(codec.head_of({.empty = true, .ttl_ns = 7'000'000})), R"({"ttl_ms":7)");
  EXPECT_EQ(codec.head_of({.ttl_ns = 7'000'000}).from, 1) << "the text goes on behind its brace";
  EXPECT_EQ(text_of(codec.head_of({})), "{");
}

} // namespace
} // namespace time_to_live_test
