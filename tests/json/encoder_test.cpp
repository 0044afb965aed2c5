// SPDX-License-Identifier: Apache-2.0
#include "json/structs/encoder.hpp"
#include "json/structs/encoder_pieces.hpp"

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <rowe/ros.hpp>
#include <rowe/schema.hpp>

#include "cbor_text.hpp"
#include "decodable.hpp"
#include "encoded.hpp"
#include "texts.hpp"

namespace encoder_test {
namespace {

using rowe::tests::gear;
using rowe::tests::numbers;
using rowe::tests::point;

struct nested {
  point a, b{3, 4};
  std::array<point, 2> path{};
  point corners[2];
};

struct arrays {
  std::array<double, 3> covariance{1, 0, 0.5};
  std::int32_t c_array[2]{-1, 1};
  std::array<std::array<float, 2>, 2> matrix{{{1, 2}, {3, 4}}};
  bool flags[2]{true, false};
  gear gears[2]{gear::reverse, gear::first};
  rowe::fixed_string<8> names[2]{"left", "right"};
};

struct sequences {
  rowe::bounded_array<double, 4> ranges;
  rowe::bounded_array<point, 2> points;
  std::uint16_t samples[4]{10, 20, 30, 40};
  int sample_count = 2;
};

struct maybe {
  std::optional<double> a;
  std::optional<point> b;
  std::optional<rowe::fixed_string<8>> c;
  std::array<std::optional<int>, 2> d{};
};

struct maybe_first {
  std::optional<int> a;
  point p;
  std::optional<int> z;
};

struct formed {
  std::int64_t serial = 9007199254740993;
  std::uint64_t ids[2]{1, 2};
  double angle = 3.14159265;
  float angles[2]{0.33333f, -0.0001f};
  std::optional<double> rounded = 2.71828;
};

struct empty {};

template <class T>
struct pair_of {
  T first{}, second{};
};

struct base {
  int inherited = 1;
};
struct derived : base {
  int own = 2;
};

} // namespace
} // namespace encoder_test

// clang-format off
template <> inline constexpr auto rowe::schema<encoder_test::nested> =
    rowe::fields<&encoder_test::nested::a, rowe::field<&encoder_test::nested::b, "the \"b\"">,
                 &encoder_test::nested::path, &encoder_test::nested::corners>{};
template <> inline constexpr auto rowe::schema<encoder_test::arrays> =
    rowe::fields<&encoder_test::arrays::covariance, &encoder_test::arrays::c_array,
                 &encoder_test::arrays::matrix, &encoder_test::arrays::flags,
                 &encoder_test::arrays::gears, &encoder_test::arrays::names>{};
template <> inline constexpr auto rowe::schema<encoder_test::sequences> =
    rowe::fields<&encoder_test::sequences::ranges, &encoder_test::sequences::points,
                 rowe::counted<&encoder_test::sequences::samples, &encoder_test::sequences::sample_count>>{};
template <> inline constexpr auto rowe::schema<encoder_test::maybe> =
    rowe::fields<&encoder_test::maybe::a, &encoder_test::maybe::b, &encoder_test::maybe::c,
                 &encoder_test::maybe::d>{};
template <> inline constexpr auto rowe::schema<encoder_test::maybe_first> =
    rowe::fields<&encoder_test::maybe_first::a, &encoder_test::maybe_first::p,
                 &encoder_test::maybe_first::z>{};
template <> inline constexpr auto rowe::schema<encoder_test::formed> =
    rowe::fields<rowe::field<&encoder_test::formed::serial>.as_string(),
                 rowe::field<&encoder_test::formed::ids>.as_string(),
                 rowe::field<&encoder_test::formed::angle>.decimals(4),
                 rowe::field<&encoder_test::formed::angles, "a">.decimals(3),
                 rowe::field<&encoder_test::formed::rounded>.decimals(2)>{};
template <> inline constexpr auto rowe::schema<encoder_test::empty> = rowe::fields<>{};
template <> inline constexpr auto rowe::schema<encoder_test::pair_of<int>> =
    rowe::fields<&encoder_test::pair_of<int>::first, &encoder_test::pair_of<int>::second>{};
template <> inline constexpr auto rowe::schema<encoder_test::derived> =
    rowe::fields<&encoder_test::derived::inherited, &encoder_test::derived::own>{};
// clang-format on

namespace rowe::json {
namespace encoder_test {
using namespace ::encoder_test;
namespace {

// What it writes in pieces of so many bytes.
template <class T>
std::string in_pieces(const encoder& e, const T& object, std::size_t window) {
  std::string all;
  encoder_pieces pieces;
  pieces.begin(e, &object);
  for (bool ends = false; !ends;) {
    std::vector<char> buffer(window);
    writer out{buffer};
    ends = pieces.write(out);
    EXPECT_FALSE(out.overflowed());
    EXPECT_TRUE(ends || out.bytes() == window);
    all += out.text();
  }
  return all;
}

// What the encoder writes; checked to be the same, and never to exceed the room, in rooms of every size.
template <class T>
std::string written(const T& object, encoding into) {
  const encoder e = encoder::compile(describe<T>(), into).value();
  std::string whole = tests::encoded_by(e, &object);
  for (std::size_t room = 0; room <= whole.size() + 80; ++room) {
    tests::expect_written_within(room, whole, [&](writer& w) { e.encode(&object, w); });
  }
  if (is_text(into)) {
    for (const std::size_t window : {1U, 2U, 7U, 64U, 4096U})
      EXPECT_EQ(in_pieces(e, object, window), whole) << window;
  }
  return whole;
}

// The text of an object. Its CBOR says the same.
template <class T>
std::string text_of(const T& object) {
  const std::string text = written(object, encoding::json);
  EXPECT_EQ(tests::cbor_text(written(object, encoding::cbor), false), text);
  return text;
}

TEST(encoder, writes_numbers_of_every_type) {
  const numbers all{.yes = true,
                    .i8 = -8,
                    .i16 = -16,
                    .i32 = -32,
                    .i64 = std::numeric_limits<std::int64_t>::min(),
                    .u8 = 8,
                    .u16 = 16,
                    .u32 = 32,
                    .u64 = std::numeric_limits<std::uint64_t>::max(),
                    .f = 0.1f,
                    .d = 0.1,
                    .g = gear::reverse};
  EXPECT_EQ(text_of(all),
            R"({"yes":true,"i8":-8,"i16":-16,"i32":-32,"i64":-9223372036854775808,"u8":8,"u16":16,)"
            R"("u32":32,"u64":18446744073709551615,"f":0.1,"d":0.1,"g":-1})");
}

TEST(encoder, writes_structs_inside_structs) {
  EXPECT_EQ(text_of(nested{}),
            R"({"a":{"x":1,"y":2},"the \"b\"":{"x":3,"y":4},)"
            R"("path":[{"x":1,"y":2},{"x":1,"y":2}],"corners":[{"x":1,"y":2},{"x":1,"y":2}]})");
}

TEST(encoder, writes_arrays_of_every_sort) {
  EXPECT_EQ(text_of(arrays{}), R"({"covariance":[1,0,0.5],"c_array":[-1,1],"matrix":[[1,2],[3,4]],)"
                               R"("flags":[true,false],"gears":[-1,1],"names":["left","right"]})");
}

TEST(encoder, writes_only_the_elements_in_use) {
  sequences s;
  EXPECT_EQ(text_of(s), R"({"ranges":[],"points":[],"samples":[10,20]})");
  ASSERT_TRUE(s.ranges.push_back(0.5) && s.ranges.push_back(1.5) && s.points.push_back({}));
  s.sample_count = 4;
  EXPECT_EQ(text_of(s), R"({"ranges":[0.5,1.5],"points":[{"x":1,"y":2}],"samples":[10,20,30,40]})");
}

TEST(encoder, takes_a_count_out_of_range_for_none_or_all) {
  sequences s;
  s.sample_count = -1;
  EXPECT_EQ(text_of(s), R"({"ranges":[],"points":[],"samples":[]})");
  s.sample_count = 1000;
  EXPECT_EQ(text_of(s), R"({"ranges":[],"points":[],"samples":[10,20,30,40]})");
}

TEST(encoder, leaves_missing_members_out) {
  maybe m;
  EXPECT_EQ(text_of(m), R"({"d":[null,null]})");
  m.a = 1.5;
  m.d[1] = 7;
  EXPECT_EQ(text_of(m), R"({"a":1.5,"d":[null,7]})");
  m.b = point{};
  m.c = "here";
  EXPECT_EQ(text_of(m), R"({"a":1.5,"b":{"x":1,"y":2},"c":"here","d":[null,7]})");
}

TEST(encoder, places_commas_right_whichever_members_are_missing) {
  EXPECT_EQ(text_of(maybe_first{}), R"({"p":{"x":1,"y":2}})");
  EXPECT_EQ(text_of(maybe_first{.a = 1, .p = {}, .z = 2}), R"({"a":1,"p":{"x":1,"y":2},"z":2})");
}

TEST(encoder, obeys_the_form_that_a_member_is_given) {
  EXPECT_EQ(text_of(formed{}), R"({"serial":"9007199254740993","ids":["1","2"],"angle":3.1416,"a":[0.333,0],)"
                               R"("rounded":2.72})");
}

TEST(encoder, writes_an_empty_object_for_no_members) { EXPECT_EQ(text_of(empty{}), "{}"); }

TEST(encoder, names_members_of_templates_and_bases) {
  EXPECT_EQ(text_of(pair_of<int>{1, 2}), R"({"first":1,"second":2})");
  EXPECT_EQ(text_of(derived{}), R"({"inherited":1,"own":2})");
}

TEST(encoder, writes_what_is_no_number_as_null_and_counts_it) {
  point p{std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()};
  EXPECT_EQ(text_of(p), R"({"x":null,"y":null})");
  const encoder e = encoder::compile(describe<point>()).value();
  std::array<char, 128> buffer;
  writer w{buffer};
  e.encode(&p, w);
  EXPECT_EQ(w.nonfinite(), 2u);
}

TEST(encoder, writes_one_value_among_others) {
  const encoder e = encoder::compile(describe<point>()).value();
  const point p;
  std::array<char, 256> buffer;
  writer w{buffer};
  w.begin_array();
  w.number(1);
  e.encode(&p, w);
  e.encode(&p, w);
  w.number(2);
  w.end_array();
  EXPECT_EQ(w.text(), R"([1,{"x":1,"y":2},{"x":1,"y":2},2])");
}

TEST(encoder, spells_ros_odometry_as_ros_does) {
  ros::odometry o;
  o.header = {.seq = 7, .stamp = {1700000000, 5}, .frame_id = "odom"};
  o.child_frame_id = "base_link";
  o.pose.pose.position = {1.5, -2, 0};
  o.pose.covariance[35] = 0.25;
  o.twist.twist.linear.x = 0.1;
  const std::string zeros = "0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,";
  EXPECT_EQ(text_of(o), R"({"header":{"seq":7,"stamp":{"secs":1700000000,"nsecs":5},"frame_id":"odom"},)"
                        R"("child_frame_id":"base_link","pose":{"pose":{"position":{"x":1.5,"y":-2,"z":0},)"
                        R"("orientation":{"x":0,"y":0,"z":0,"w":1}},"covariance":[)" +
                            zeros + R"(0.25]},"twist":{"twist":{"linear":{"x":0.1,"y":0,"z":0},)" +
                            R"("angular":{"x":0,"y":0,"z":0}},"covariance":[)" + zeros + "0]}}");
  EXPECT_EQ(describe<ros::odometry>().type_name, "nav_msgs/Odometry");
}

TEST(encoder, escapes_strings) {
  ros::header h;
  h.frame_id = "a\"b\n\xff";
  EXPECT_EQ(text_of(h), "{\"seq\":0,\"stamp\":{\"secs\":0,\"nsecs\":0},\"frame_id\":\"a\\\"b\\n\uFFFD\"}");
}

// Hand-made descriptions, for what no type of reasonable size can provoke.
const void* same_address(const void* at) noexcept { return at; }

TEST(encoder, refuses_schemas_that_nest_too_deeply) {
  const rowe::tests::nested_arrays arrays{encoder::depth_max};
  EXPECT_TRUE(encoder::compile(arrays.schema(encoder::depth_max - 1)));
  const auto refused = encoder::compile(arrays.schema(encoder::depth_max));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), (error{errc::bad_argument, encoder::depth_max + 1, encoder::depth_max}));
}

TEST(encoder, refuses_schemas_whose_text_could_be_too_long) {
  const value_description byte{.kind = value_kind::uint8, .bytes = 1};
  const value_description row{.kind = value_kind::array,
                              .bytes = 1u << 20,
                              .count_max = 1u << 20,
                              .element = &byte,
                              .elements = same_address};
  const value_description table{.kind = value_kind::array,
                                .bytes = 1u << 30,
                                .count_max = 1u << 10,
                                .element = &row,
                                .elements = same_address};
  const auto compile = [](const value_description& type) {
    const member_description m{.name = "a", .type = &type, .address = same_address};
    return encoder::compile({.type_name = {}, .bytes = 64, .alignment = 8, .members = {&m, 1}});
  };
  EXPECT_TRUE(compile(row));
  EXPECT_EQ(compile(table).code(), errc::bad_argument);
  const schema_description huge{
      .type_name = {}, .bytes = encoder::bytes_limit + 1, .alignment = 1, .members = {}};
  EXPECT_EQ(encoder::compile(huge).code(), errc::bad_argument);
}

TEST(schema, says_what_a_type_looks_like) {
  const schema_description& d = describe<numbers>();
  EXPECT_EQ(&d, &describe<numbers>());
  EXPECT_EQ(d.bytes, sizeof(numbers));
  EXPECT_EQ(d.alignment, alignof(numbers));
  EXPECT_TRUE(d.type_name.empty());
  EXPECT_EQ(describe<nested>().members[2].type->element->object, &describe<point>());
  static_assert(described<point> && !described<int>);
}

} // namespace
} // namespace encoder_test
} // namespace rowe::json
