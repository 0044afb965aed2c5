// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gtest/gtest.h>

#include <rowe/types.hpp>

#include "describe/robot.hpp"

namespace rowe {
namespace json_schema_test {
namespace {

TEST(json_schema, says_what_a_struct_is_written_as) {
  EXPECT_EQ(json_schema<robot::place>(),
            R"({"$schema":"https://json-schema.org/draft/2020-12/schema","type":"object","properties":)"
            R"({"x":{"type":"number"},"y":{"type":"number"}},"required":["x","y"]})");
  EXPECT_NE(json_schema<ros::vector3>().find(R"("title":"geometry_msgs/Vector3")"), std::string::npos);
}

TEST(json_schema, has_the_form_that_each_member_is_given) {
  const std::string text = json_schema<robot::state>();
  const auto has = [&](const char* piece) { return text.find(piece) != std::string::npos; };
  EXPECT_TRUE(has(R"("stamp":{"type":"number","description":"seconds since 1970"})")) << text;
  EXPECT_TRUE(
      has(R"("uptime":{"type":"integer","minimum":-9223372036854775808,"maximum":9223372036854775807,)"
          R"("description":"milliseconds"})"));
  EXPECT_TRUE(has(R"("mode":{"type":"string","enum":["off","manual","auto"]})"));
  EXPECT_TRUE(has(R"("wanted":{"type":"integer","oneOf":[{"title":"off","const":0},)"
                  R"({"title":"manual","const":1},{"title":"auto","const":7}]})"));
  EXPECT_TRUE(has(R"("serial":{"type":"string","pattern":"^[0-9]+$"})"));
  EXPECT_TRUE(has(R"("load":{"type":"integer","minimum":-32768,"maximum":32767})"));
  EXPECT_TRUE(has(R"("a \"name\"":{"type":"string","maxLength":12})"));
  EXPECT_TRUE(has(R"("axes":{"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3})"));
  EXPECT_TRUE(has(R"("cells":{"type":"string","contentEncoding":"base64","maxLength":12})"));
  EXPECT_TRUE(has(R"("items":{"anyOf":[{"type":"integer","minimum":-2147483648,"maximum":2147483647},)"
                  R"({"type":"null"}]})"));
  EXPECT_TRUE(has(R"("frames":{"type":"number","description":"units of 1/30 seconds"})"));
  EXPECT_TRUE(text.ends_with(R"("required":["stamp","uptime","mode","wanted","serial","load","moving",)"
                             R"("a \"name\"","where","axes","path","cells","hits","speed"]})"));
}

} // namespace
} // namespace json_schema_test
} // namespace rowe
