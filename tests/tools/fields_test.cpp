// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/plot/fields.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include <rowe/types.hpp>

#include "tools/rowe/text/json_values.hpp"

namespace rowe::tools::fields_test {

struct inner {
  std::chrono::milliseconds age{};
  double metres = 0;
};
struct outer {
  std::array<inner, 2> all{};
  inner one{};
};

} // namespace rowe::tools::fields_test

template <>
inline constexpr auto rowe::schema<rowe::tools::fields_test::inner> =
    rowe::fields<&rowe::tools::fields_test::inner::age, &rowe::tools::fields_test::inner::metres>{};
template <>
inline constexpr auto rowe::schema<rowe::tools::fields_test::outer> =
    rowe::fields<&rowe::tools::fields_test::outer::all, &rowe::tools::fields_test::outer::one>{};

namespace rowe::tools {
namespace fields_test {
namespace {

std::vector<std::string> names(const std::vector<std::string>& given) {
  std::string wrong;
  const auto read = fields_of(given, wrong);
  std::vector<std::string> all;
  if (!read) return {wrong};
  for (const field_wish& one : *read) all.push_back(std::to_string(one.lane) + " " + one.name());
  return all;
}
using words = std::vector<std::string>;

TEST(fields, of_one_option_share_an_axis) {
  EXPECT_EQ(names({"/odom:pose.x,pose.y", "/power:volts"}),
            (words{"0 /odom:pose.x", "0 /odom:pose.y", "1 /power:volts"}));
  EXPECT_EQ(names({"odom:a"}), (words{"0 /odom:a"}));
}

TEST(fields, are_drawn_once) { EXPECT_EQ(names({"/a:x,x", "/a:x", "/b:x"}), (words{"0 /a:x", "1 /b:x"})); }

TEST(fields, may_have_commas_and_points_in_their_names) {
  EXPECT_EQ(names({"/a:['x,y'].z,r[2],[\"a]b\"]"}), (words{"0 /a:['x,y'].z", "0 /a:r[2]", "0 /a:[\"a]b\"]"}));
}

TEST(fields, that_are_none_are_named) {
  for (const char* const text : {"/odom", "/odom:", ":x", "", "/a:x,", "/a:,x", "/a:x[", "/a:x..y"}) {
    const words said = names({text});
    ASSERT_EQ(said.size(), 1U);
    EXPECT_TRUE(said[0].starts_with("--field ")) << said[0];
  }
}

TEST(a_path_of_two_fields, is_y_over_x) {
  std::string wrong;
  const auto read = paths_of({"/odom:pose.x,pose.y"}, wrong);
  ASSERT_TRUE(read);
  EXPECT_EQ((*read)[0].x_path, "pose.x");
  EXPECT_EQ((*read)[0].path, "pose.y");
  for (const char* const text : {"/odom:x", "/odom:x,y,z"}) {
    EXPECT_FALSE(paths_of({text}, wrong));
    EXPECT_TRUE(wrong.starts_with("--xy needs two fields")) << wrong;
  }
}

std::string hint(std::string_view path) {
  return hint_of_path(path,
                      read_json(R"({"pose":{"x":1,"y":2},"name":"n","volts":[3,4],"deep":{"speed":5}})"));
}

TEST(a_hint, names_the_nearest_number) {
  EXPECT_EQ(hint("pose.z"), "; did you mean pose.x?");
  EXPECT_EQ(hint("speed"), "; did you mean deep.speed?");
  EXPECT_EQ(hint("pose"), "; there is pose.x, pose.y");
  EXPECT_EQ(hint("volts"), "; there is volts[0], volts[1]");
  EXPECT_EQ(hint("something.else.altogether"), "; there is pose.x, pose.y, volts[0], volts[1], deep.speed");
  EXPECT_EQ(hint_of_path("x", read_json(R"({"a":"b"})")), "; it has no numbers");
}

TEST(a_unit, is_what_the_schema_of_the_type_says) {
  const std::string schema = json_schema(describe<outer>());
  EXPECT_EQ(unit_in(schema, "one.age"), "ms");
  EXPECT_EQ(unit_in(schema, "all[1].age"), "ms");
  EXPECT_EQ(unit_in(schema, "one.metres"), "");
  EXPECT_EQ(unit_in(schema, "one.nothing"), "");
  EXPECT_EQ(unit_in("", "one.age"), "");
  EXPECT_EQ(unit_in("no schema", "one.age"), "");
  EXPECT_EQ(unit_in(R"({"properties":{"v":{"type":"number","unit":"m/s"}}})", "v"), "m/s");
  EXPECT_EQ(unit_in(R"({"properties":{"v":{"anyOf":[{"type":"null"},{"unit":"V"}]}}})", "v"), "V");
  EXPECT_EQ(unit_in(R"({"properties":{"v":{"description":"a speed"}}})", "['v']"), "");
}

} // namespace
} // namespace fields_test
} // namespace rowe::tools
