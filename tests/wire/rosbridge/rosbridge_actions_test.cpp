// SPDX-License-Identifier: Apache-2.0
// Actions in rosbridge's words: read, refused, and written to be read again.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

#include "wire/decoded.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_actions_test {
namespace {

TEST(rosbridge_actions, writes_what_it_reads) {
  std::array<char, 512> buffer{};
  json::writer goal{buffer};
  write_goal_head(goal, "/fib", "a/Fib", "1.a", true);
  goal.raw("{}");
  goal.end_object();
  EXPECT_EQ(goal.text(), R"({"op":"send_action_goal","id":"1.a","action":"/fib","action_type":"a/Fib",)"
                         R"("feedback":true,"args":{}})");
  json::writer cancel{buffer};
  write_cancel_goal(cancel, "/fib", "1.a");
  EXPECT_EQ(cancel.text(), R"({"op":"cancel_action_goal","id":"1.a","action":"/fib"})");
  json::writer feedback{buffer};
  write_feedback_head(feedback, "/fib", R"("g")");
  feedback.raw("{}");
  feedback.end_object();
  EXPECT_EQ(feedback.text(), R"({"op":"action_feedback","id":"g","action":"/fib","values":{}})");
  json::writer result{buffer};
  write_action_result_head(result, "/fib", "", 5, true);
  result.raw("null");
  result.end_object();
  EXPECT_EQ(result.text(),
            R"({"op":"action_result","action":"/fib","status":5,"result":true,"values":null})");
}

} // namespace
} // namespace rosbridge_actions_test
} // namespace rowe::wire::rosbridge
