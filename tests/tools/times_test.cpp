// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/times.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <ctime>

namespace rowe::tools {
namespace times_test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t of_2025 = 1'764'475'798'123'456'789; // 2025-11-30T04:09:58.123456789Z

// As on a machine somewhere.
class zone {
 public:
  explicit zone(const char* name) {
    ::setenv("TZ", name, 1);
    ::tzset();
  }
  ~zone() {
    ::unsetenv("TZ");
    ::tzset();
  }
  zone(const zone&) = delete;
  zone& operator=(const zone&) = delete;
};

TEST(times, are_written_with_their_zone) {
  EXPECT_EQ(iso_text(of_2025, time_zone::utc), "2025-11-30T04:09:58.123Z");
  EXPECT_EQ(iso_text(of_2025, time_zone::utc, 9), "2025-11-30T04:09:58.123456789Z");
  EXPECT_EQ(iso_text(0, time_zone::utc, 0), "1970-01-01T00:00:00Z");
  const zone far{"AAA-5:45"};
  EXPECT_EQ(iso_text(of_2025, time_zone::local), "2025-11-30T09:54:58.123+05:45");
}

TEST(times, are_written_in_zones_west_of_utc) {
  const zone west{"AAA3:30"};
  EXPECT_EQ(iso_text(of_2025, time_zone::local), "2025-11-30T00:39:58.123-03:30");
}

TEST(times, are_read_as_they_are_written) {
  EXPECT_EQ(iso_time_of("2025-11-30T04:09:58.123456789Z"), of_2025);
  EXPECT_EQ(iso_time_of("2025-11-30 04:09:58,123456789123z"), of_2025);
  EXPECT_EQ(iso_time_of("2025-11-30T09:54:58.123456789+05:45"), of_2025);
  EXPECT_EQ(iso_time_of("2025-11-30T00:39:58.123456789-0330"), of_2025);
  EXPECT_EQ(iso_time_of("1970-01-01T00:01Z"), 60'000'000'000);
  const zone far{"AAA-1"};
  EXPECT_EQ(iso_time_of("2025-11-30T05:09:58.123456789"), of_2025);
}

TEST(times, that_are_none_are_refused) {
  for (const char* text :
       {"", "2025", "2025-11-30", "2025-11-30T", "2025-02-30T00:00:00Z", "2025-13-01T00:00Z",
        "2025-11-30T24:00:00Z", "2025-11-30T00:60:00Z", "2025-11-30T00:00:00Q", "2025-11-30T00:00:00Z.",
        "1969-12-31T23:59:59Z", "2525-01-01T00:00:00Z", "2025-11-30T00:00:00.Z", "x2025-11-30T00:00:00Z"})
    EXPECT_EQ(iso_time_of(text), std::nullopt) << text;
}

TEST(times, of_a_recording_are_written_as_a_clock_shows_them) {
  EXPECT_EQ(clock_text(0ns), "0:00.000");
  EXPECT_EQ(clock_text(83'456ms, 1), "1:23.4");
  EXPECT_EQ(clock_text(3723s, 0), "1:02:03");
  EXPECT_EQ(clock_text(-1500ms), "-0:01.500");
}

rt::duration offset_of(const std::string& text) {
  const auto place = place_in_time_of(text);
  EXPECT_TRUE(place) << text;
  if (!place) return {};
  if (const auto* const end = std::get_if<from_end>(&*place)) return -end->offset;
  return std::get<from_begin>(*place).offset;
}

TEST(times, of_places_count_from_the_begin_or_from_the_end) {
  EXPECT_EQ(offset_of("90s"), 90s);
  EXPECT_EQ(offset_of("1:30"), 90s);
  EXPECT_EQ(offset_of("1:02:03.5"), 3723'500ms);
  EXPECT_EQ(offset_of("0"), 0s);
  EXPECT_EQ(offset_of("-250ms"), -250ms);
  EXPECT_EQ(offset_of("-1:30"), -90s);
  EXPECT_EQ(std::get<absolute_time>(*place_in_time_of("1970-01-01T00:00:01Z")).since_1970_ns, 1'000'000'000);
  for (const char* text : {"", "-", "90", "1:3", "1:60", ":30", "1:00:00:00", "--1s", "soon"})
    EXPECT_EQ(place_in_time_of(text), std::nullopt) << text;
}

} // namespace
} // namespace times_test
} // namespace rowe::tools
