// SPDX-License-Identifier: Apache-2.0
// Times as {"sec","nsec"}: by the encoder of a struct, and by rewriting its JSON. Both say the same.
#include "json/structs/times.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <rowe/ros.hpp>
#include <rowe/schema.hpp>

#include "encoded.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder.hpp"

namespace times_test {

using std::chrono::system_clock;
template <class Unit>
using sys = std::chrono::time_point<system_clock, Unit>;

struct inner {
  double x = 0;
  sys<std::chrono::milliseconds> at{};
};
struct sample {
  std::uint32_t seq = 0;
  sys<std::chrono::nanoseconds> stamp{};
  sys<std::chrono::microseconds> quoted{};
  sys<std::chrono::milliseconds> in_seconds{};
  std::chrono::nanoseconds age{};
  rowe::ros::time one;
  rowe::ros2::time two;
  std::array<inner, 2> many{};
  std::array<sys<std::chrono::seconds>, 3> seconds{};
  std::optional<sys<std::chrono::seconds>> perhaps{};
};
struct stamped {
  rowe::ros::time one;
  rowe::ros2::time two;
  sys<std::chrono::milliseconds> at{};
};
struct lone {
  std::int32_t secs = 0;
  double nsecs = 0; // no time of ROS
};

} // namespace times_test

template <>
inline constexpr auto rowe::schema<times_test::inner> =
    rowe::fields<&times_test::inner::x, &times_test::inner::at>{};
template <>
inline constexpr auto rowe::schema<times_test::sample> =
    rowe::fields<&times_test::sample::seq, &times_test::sample::stamp,
                 rowe::field<&times_test::sample::quoted>.as_string(),
                 rowe::field<&times_test::sample::in_seconds>.as_seconds(), &times_test::sample::age,
                 &times_test::sample::one, &times_test::sample::two, &times_test::sample::many,
                 &times_test::sample::seconds, &times_test::sample::perhaps>{};
template <>
inline constexpr auto rowe::schema<times_test::stamped> =
    rowe::fields<&times_test::stamped::one, &times_test::stamped::two, &times_test::stamped::at>{};
template <>
inline constexpr auto rowe::schema<times_test::lone> =
    rowe::fields<&times_test::lone::secs, &times_test::lone::nsecs>{};

namespace times_test {
namespace {

namespace json = rowe::json;
using namespace std::chrono_literals;
using rowe::tests::encoded;

std::string rewritten(std::string text, const rowe::schema_description& type) {
  const std::size_t bytes = text.size();
  text.append(json::reader::tailroom_bytes, '\xff');
  auto reader = json::reader::create(128 * 1024);
  EXPECT_TRUE(reader->validate({text.data(), bytes})) << text;
  std::vector<char> buffer(2 * text.size() + 8192);
  json::writer out{buffer};
  json::write_sec_nsec(out, {text.data(), bytes}, type);
  EXPECT_FALSE(out.overflowed());
  return std::string{out.text()};
}

std::string of_count(std::int64_t count, bool is_signed, int decimals) {
  std::array<char, json::sec_nsec_bytes_max> text;
  return {text.data(), json::write_sec_nsec(text.data(), count, is_signed, decimals)};
}

sample some() {
  sample one;
  one.seq = 7;
  one.stamp = sys<std::chrono::nanoseconds>{1'700'000'000'123'456'789ns};
  one.quoted = sys<std::chrono::microseconds>{-1us};
  one.in_seconds = sys<std::chrono::milliseconds>{1500ms};
  one.age = 5ns;
  one.one = {3, 4};
  one.two = {-5, 6};
  one.many[1] = {0.5, sys<std::chrono::milliseconds>{2001ms}};
  one.seconds[2] = sys<std::chrono::seconds>{9s};
  return one;
}

constexpr const char* some_text =
    R"({"seq":7,"stamp":{"sec":1700000000,"nsec":123456789},"quoted":{"sec":-1,"nsec":999999000},)"
    R"("in_seconds":{"sec":1,"nsec":500000000},"age":5,"one":{"sec":3,"nsec":4},"two":{"sec":-5,"nsec":6},)"
    R"("many":[{"x":0,"at":{"sec":0,"nsec":0}},{"x":0.5,"at":{"sec":2,"nsec":1000000}}],)"
    R"("seconds":[{"sec":0,"nsec":0},{"sec":0,"nsec":0},{"sec":9,"nsec":0}]})";

TEST(times, are_objects_of_seconds_and_nanoseconds) {
  EXPECT_EQ(encoded<json::encoding::sec_nsec>(some()), some_text);
}

TEST(times, of_a_text_are_those_of_its_struct) {
  sample one = some();
  const auto& type = rowe::describe<sample>();
  EXPECT_EQ(rewritten(encoded(one), type), some_text);
  EXPECT_EQ(rewritten(some_text, type), some_text) << "what is in this form already stays so";
  one.perhaps = sys<std::chrono::seconds>{-2s};
  EXPECT_EQ(rewritten(encoded(one), type), encoded<json::encoding::sec_nsec>(one));
}

TEST(times, fit_whatever_they_are) {
  sample one;
  one.stamp = sys<std::chrono::nanoseconds>{std::chrono::nanoseconds{INT64_MIN}};
  one.quoted = sys<std::chrono::microseconds>{std::chrono::microseconds{INT64_MIN}};
  one.in_seconds = sys<std::chrono::milliseconds>{std::chrono::milliseconds{INT64_MIN}};
  one.seconds.fill(sys<std::chrono::seconds>{std::chrono::seconds{INT64_MIN}});
  one.perhaps = one.seconds[0];
  for (inner& each : one.many) each = {-1.7976931348623157e308, one.in_seconds};
  one.one = {UINT32_MAX, UINT32_MAX};
  one.two = {INT32_MIN, UINT32_MAX};
  (void)encoded<json::encoding::sec_nsec>(one);
}

TEST(times, count_nanoseconds_forwards) {
  EXPECT_EQ(of_count(0, true, 9), R"({"sec":0,"nsec":0})");
  EXPECT_EQ(of_count(-1, true, 9), R"({"sec":-1,"nsec":999999999})");
  EXPECT_EQ(of_count(-1'000'000'000, true, 9), R"({"sec":-1,"nsec":0})");
  EXPECT_EQ(of_count(INT64_MIN, true, 0), R"({"sec":-9223372036854775808,"nsec":0})");
  EXPECT_EQ(of_count(-1, false, 9), R"({"sec":18446744073,"nsec":709551615})");
  EXPECT_EQ(of_count(15, true, 1), R"({"sec":1,"nsec":500000000})");
}

TEST(times, are_copied_where_a_text_is_not_as_its_type_says) {
  const auto& type = rowe::describe<sample>();
  for (const char* text :
       {"[1]", "7", R"({"stamp":"soon"})", R"({"stamp":1.5})", R"({"stamp":null})", R"({"stamp":1e300})",
        R"({"stamp":9223372036854775808})", R"({"quoted":5})", R"({"quoted":"x"})", R"({"in_seconds":"1"})",
        R"({"many":[7,{"at":[]}]})", R"({"many":{"at":5}})", R"({"one":[1]})", R"({"unknown":{"secs":1}})",
        R"({"a\"b\\":[1,{}]})"})
    EXPECT_EQ(rewritten(text, type), text);
  EXPECT_EQ(rewritten(R"({"one":{"secs":1,"more":2}})", type), R"({"one":{"sec":1,"more":2}})");
}

TEST(times, are_looked_for_in_names_that_nobody_has_only_so_long) {
  const auto& type = rowe::describe<sample>();
  const auto behind = [&](std::size_t others) {
    std::string text = "{";
    for (std::size_t i = 0; i < others; ++i) text += R"("x":0,)";
    return text + R"("one":{"secs":1,"nsecs":2}})";
  };
  const std::size_t few = 800; // each is compared with each of the ten
  const std::size_t many = 12'000;
  ASSERT_LT(few * type.members.size(), json::sec_nsec_comparisons(behind(few).size()));
  ASSERT_GT(many * type.members.size(), json::sec_nsec_comparisons(behind(many).size()));
  EXPECT_TRUE(rewritten(behind(few), type).ends_with(R"("one":{"sec":1,"nsec":2}})"));
  EXPECT_EQ(rewritten(behind(many), type), behind(many));
}

TEST(times, are_read_in_each_form) {
  const auto decoder = json::decoder::compile(rowe::describe<stamped>());
  ASSERT_TRUE(decoder);
  const auto read = [&](const std::string& one, const std::string& two, const std::string& at) {
    stamped into;
    const auto done =
        decoder->decode(R"({"one":)" + one + R"(,"two":)" + two + R"(,"at":)" + at + "}", &into);
    return done ? std::to_string(into.one.secs) + "." + std::to_string(into.one.nsecs) + " " +
                      std::to_string(into.two.sec) + "." + std::to_string(into.two.nanosec) + " " +
                      std::to_string(into.at.time_since_epoch().count())
                : std::string{done.error().name()};
  };
  const std::string foxglove = R"({"sec":1,"nsec":2000000})";
  const std::string ros_1 = R"({"secs":1,"nsecs":2000000})";
  const std::string ros_2 = R"({"nanosec":2000000,"sec":1})";
  for (const std::string& one : {foxglove, ros_1, ros_2})
    EXPECT_EQ(read(one, one, one), "1.2000000 1.2000000 1002") << one;
  EXPECT_EQ(read(foxglove, ros_1, "7"), "1.2000000 1.2000000 7");
  EXPECT_EQ(read(foxglove, ros_1, R"({"sec":-1,"nsec":999999999})"), "1.2000000 1.2000000 -1")
      << "nanoseconds count forwards";
  EXPECT_EQ(read(foxglove, ros_1, R"({"sec":-0,"nsec":0})"), "1.2000000 1.2000000 0");
  EXPECT_EQ(read(R"({"sec":1,"secs":1,"nsec":2})", ros_1, "7"), "duplicate_member");
  for (const char* wrong :
       {"{}", R"({"sec":1})", R"({"nsec":1})", R"({"sec":1,"nsec":1000000000})", R"({"sec":1,"nsec":-1})",
        R"({"sec":1.5,"nsec":0})", R"({"sec":"1","nsec":0})", R"({"sec":1,"secs":1,"nsec":0})", "[1,2]"})
    EXPECT_EQ(read(foxglove, ros_1, wrong), "wrong_type") << wrong;
  for (const char* beyond : {R"({"sec":9223372036854776,"nsec":0})", R"({"sec":1e300,"nsec":0})",
                             R"({"sec":18446744073709551615,"nsec":0})"})
    EXPECT_EQ(read(foxglove, ros_1, beyond), "out_of_range") << beyond;
}

TEST(times, are_found_wherever_they_are) {
  EXPECT_TRUE(json::holds_time(rowe::describe<rowe::ros::odometry>()));
  EXPECT_TRUE(json::holds_time(rowe::describe<rowe::ros2::header>()));
  EXPECT_TRUE(json::holds_time(rowe::describe<inner>()));
  EXPECT_FALSE(json::holds_time(rowe::describe<rowe::ros::twist>()));
  EXPECT_FALSE(json::holds_time(rowe::describe<lone>()));
  EXPECT_EQ(encoded<json::encoding::sec_nsec>(lone{1, 2}), R"({"secs":1,"nsecs":2})");
}

} // namespace
} // namespace times_test
