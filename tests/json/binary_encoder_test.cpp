// SPDX-License-Identifier: Apache-2.0
// CBOR and ROS 1, byte for byte where that matters: typed arrays, times, texts, and what ROS does not have.
// (encoder_test.cpp compares the CBOR of each of its types with the JSON.)
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <rowe/ros.hpp>
#include <rowe/schema.hpp>

#include "cbor_text.hpp"
#include "decodable.hpp"
#include "encoded.hpp"
#include "json/structs/encoder.hpp"
#include "json/text/digits.hpp"
#include "json/writing/cbor.hpp"
#include "json/writing/writer.hpp"

namespace binary_test {

enum class gear : std::int16_t { reverse = -1, neutral, forward };

struct picture {
  std::uint32_t width = 2;
  rowe::bounded_array<std::uint8_t, 300> data;
};
struct scan {
  std::array<float, 2> ranges{0.5f, 1.5f};
  std::int16_t levels[3]{-1, 0, 1};
  std::uint8_t raw[2]{1, 255};
  bool flags[2]{true, false};
};
struct forms {
  std::uint64_t serial = 18446744073709551615u;
  gear by_name = gear::reverse;
  gear unnamed = static_cast<gear>(7);
  std::chrono::nanoseconds age{-1'500'000'000};
  double angle = 3.14159;
};
struct nested_arrays {
  std::array<std::array<std::int32_t, 2>, 2> rows{};
};
struct path {
  rowe::bounded_array<rowe::ros::vector3, 4> points;
  rowe::fixed_string<8> name = "a";
};

} // namespace binary_test

template <>
inline constexpr auto rowe::names<binary_test::gear> =
    rowe::enumerators<binary_test::gear::reverse, binary_test::gear::neutral, binary_test::gear::forward>{};
template <>
inline constexpr auto rowe::schema<binary_test::picture> =
    rowe::fields<&binary_test::picture::width, &binary_test::picture::data>{};
template <>
inline constexpr auto rowe::schema<binary_test::scan> =
    rowe::fields<&binary_test::scan::ranges, &binary_test::scan::levels, &binary_test::scan::raw,
                 &binary_test::scan::flags>{};
template <>
inline constexpr auto rowe::schema<binary_test::forms> = rowe::fields<
    rowe::field<&binary_test::forms::serial>.as_string(), rowe::field<&binary_test::forms::by_name>.by_name(),
    rowe::field<&binary_test::forms::unnamed>.by_name(), rowe::field<&binary_test::forms::age>.as_seconds(),
    rowe::field<&binary_test::forms::angle>.decimals(2)>{};
template <>
inline constexpr auto rowe::schema<binary_test::nested_arrays> =
    rowe::fields<&binary_test::nested_arrays::rows>{};
template <>
inline constexpr auto rowe::schema<binary_test::path> =
    rowe::fields<&binary_test::path::points, &binary_test::path::name>{};

namespace rowe::json {
namespace binary_test {
using namespace ::binary_test;
namespace {

using tests::encoded;

std::string hex(std::string_view bytes) {
  std::string all;
  for (const char c : bytes) {
    all += hex_digits[static_cast<std::uint8_t>(c) >> 4];
    all += hex_digits[static_cast<std::uint8_t>(c) & 15];
  }
  return all;
}

TEST(cbor_encoder, writes_arrays_of_numbers_as_typed_arrays) {
  EXPECT_EQ(hex(encoded<encoding::cbor>(scan{})), "a4"
                                                  "6672616e676573" // ranges: 85, two floats
                                                  "d855480000003f0000c03f"
                                                  "666c6576656c73" // levels: 77
                                                  "d84d46ffff00000100"
                                                  "63726177" // raw: a byte string
                                                  "4201ff"
                                                  "65666c616773" // flags: a plain array
                                                  "82f5f4");
}

TEST(cbor_encoder, says_how_many_bytes_are_in_use) {
  picture p;
  EXPECT_EQ(hex(encoded<encoding::cbor>(p)), "a26577696474680264"
                                             "6461746140");
  for (int i = 0; i < 256; ++i) ASSERT_TRUE(p.data.push_back(7));
  EXPECT_EQ(hex(encoded<encoding::cbor>(p)).substr(0, 30), "a265776964746802646461746159"
                                                           "01");
}

TEST(cbor_encoder, says_the_same_as_json_in_every_form) {
  const std::string json = encoded<encoding::json>(forms{});
  EXPECT_EQ(json,
            R"({"serial":"18446744073709551615","by_name":"reverse","unnamed":7,"age":-1.5,"angle":3.14})");
  EXPECT_EQ(tests::cbor_text(encoded<encoding::cbor>(forms{})), json);
}

TEST(cbor_encoder, keeps_what_is_no_number) {
  ros::vector3 v{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -0.0};
  EXPECT_EQ(hex(encoded<encoding::cbor>(v)),
            "a36178fb7ff80000000000006179fb7ff0000000000000617afb8000000000000000");
  const encoder e = encoder::compile(describe<ros::vector3>(), encoding::cbor).value();
  std::array<char, 128> buffer;
  writer w{buffer};
  e.encode(&v, w);
  EXPECT_EQ(w.nonfinite(), 0u); // nothing was lost
}

TEST(cbor_encoder, writes_every_text_as_utf_8) {
  ros::header h;
  h.frame_id = "m\xc3\xb6\xff";
  EXPECT_EQ(hex(encoded<encoding::cbor>(h)), "a363736571006573"
                                             "74616d70a264736563730065"
                                             "6e73656373006866"
                                             "72616d655f6964666dc3b6efbfbd");
}

// As roscpp serialises a Header, a string, and a sequence.
TEST(ros1_encoder, writes_little_endian_without_names) {
  ros::header h{.seq = 1, .stamp = {2, 3}, .frame_id = "map"};
  EXPECT_EQ(hex(encoded<encoding::ros1>(h)), "010000000200000003000000030000006d6170");
  EXPECT_EQ(hex(encoded<encoding::ros1>(scan{})), "0000003f0000c03f"
                                                  "ffff00000100"
                                                  "01ff"
                                                  "0100");
  path p;
  ASSERT_TRUE(p.points.push_back({1, 0, 0}));
  EXPECT_EQ(hex(encoded<encoding::ros1>(p)), "01000000"
                                             "000000000000f03f"
                                             "0000000000000000"
                                             "0000000000000000"
                                             "0100000061");
}

// ROS text says that these members are strings and seconds, so their bytes are, too.
TEST(ros1_encoder, writes_forms_as_ros_message_describes_them) {
  EXPECT_EQ(hex(encoded<encoding::ros1>(forms{})), "140000003138343436373434303733373039353531363135"
                                                   "0700000072657665727365"
                                                   "0100000037"
                                                   "000000000000f8bf"
                                                   "1f85eb51b81e0940");
}

TEST(ros1_encoder, writes_an_odometry_of_its_known_length) {
  ros::odometry o;
  o.header.frame_id = "odom";
  o.child_frame_id = "base_link";
  EXPECT_EQ(encoded<encoding::ros1>(o).size(), 4 + 8 + 4 + 4 + 4 + 9 + (7 + 36 + 6 + 36) * 8u);
}

TEST(ros1_encoder, refuses_what_ros_does_not_have) {
  EXPECT_EQ(encoder::compile(describe<tests::anything>(), encoding::ros1).code(), errc::bad_argument);
  EXPECT_EQ(encoder::compile(describe<nested_arrays>(), encoding::ros1).code(), errc::bad_argument);
  EXPECT_TRUE(encoder::compile(describe<tests::anything>(), encoding::cbor));
}

} // namespace
} // namespace binary_test
} // namespace rowe::json
