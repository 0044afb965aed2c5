// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/arguments/values.hpp"

#include <gtest/gtest.h>

#include <string>

namespace rowe::tools {
namespace values_test {
namespace {

using namespace std::chrono_literals;

TEST(values, read_durations_with_every_unit) {
  EXPECT_EQ(duration_of("7ns"), 7ns);
  EXPECT_EQ(duration_of("200us"), 200us);
  EXPECT_EQ(duration_of("200µs"), 200us); // as it is printed
  EXPECT_EQ(duration_of("50ms"), 50ms);
  EXPECT_EQ(duration_of("2s"), 2s);
  EXPECT_EQ(duration_of("10m"), 10min);
  EXPECT_EQ(duration_of("1h"), 1h);
  EXPECT_EQ(duration_of("1.5s"), 1500ms);
  EXPECT_EQ(duration_of("0"), 0s);
}

TEST(values, refuse_what_is_not_wholly_a_duration) {
  for (const char* text : {"", "5", "ms", "-5ms", "+5ms", " 5ms", "5ms ", "5 ms", "1e3ms", "nan", "inf s",
                           "300000h0", "1e30s"}) {
    EXPECT_EQ(duration_of(text), std::nullopt) << text;
  }
  EXPECT_EQ(duration_of("2562047h"), 2562047h);
  EXPECT_EQ(duration_of("2562048h"), rowe::rt::for_ever);
}

TEST(values, read_rates_in_hertz_and_kilohertz) {
  EXPECT_EQ(rate_of("250"), 250);
  EXPECT_EQ(rate_of("250Hz"), 250);
  EXPECT_EQ(rate_of("2kHz"), 2000);
  EXPECT_EQ(rate_of("0.5"), 0.5);
}

TEST(values, refuse_what_is_no_rate) {
  for (const char* text : {"", "0", "0Hz", "-1Hz", "1MHz", "1 kHz", "fast"})
    EXPECT_EQ(rate_of(text), std::nullopt) << text;
}

TEST(values, read_whole_numbers_and_nothing_else) {
  EXPECT_EQ(integer_of("-12"), -12);
  EXPECT_EQ(integer_of("9223372036854775807"), INT64_MAX);
  for (const char* text : {"", "+1", "1.0", "0x10", "9223372036854775808", "1 "})
    EXPECT_EQ(integer_of(text), std::nullopt) << text;
}

TEST(values, count_slips_of_the_keyboard) {
  EXPECT_EQ(slips_between("serve", "serve"), 0U);
  EXPECT_EQ(slips_between("serv", "serve"), 1U);
  EXPECT_EQ(slips_between("servve", "serve"), 1U);
  EXPECT_EQ(slips_between("sarve", "serve"), 1U);
  EXPECT_EQ(slips_between("sevre", "serve"), 1U);
  EXPECT_EQ(slips_between("", "echo"), 4U);
  EXPECT_EQ(slips_between(std::string(140, 'a'), std::string(140, 'a')), 140U);
}

} // namespace
} // namespace values_test
} // namespace rowe::tools
