// SPDX-License-Identifier: Apache-2.0
// Actions in rosbridge's words: read, refused, and written to be read again.
#include <gtest/gtest.h>

#include <array>

#include "wire/decoded.hpp"
#include "wire/rosbridge/rosbridge.hpp"
#include "json/writing/writer.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_actions_test {
namespace {

TEST(rosbridge_actions, refuses_with_a_diagnostic_that_names_member_value_and_limit) {
  constexpr wrong table[] = {
      {R"({"op":"advertise_action"})", R"(advertise_action: the member "action" is missing)"},
      {R"({"op":"unadvertise_action","action":""})",
       R"(unadvertise_action: the member "action" must not be empty)"},
      {R"({"op":"send_action_goal","action":7})",
       R"(send_action_goal: the member "action" must be a string; it is 7)"},
      {R"({"op":"send_action_goal","action":"/a","action_type":3})",
       R"(send_action_goal: the member "action_type" must be a string; it is 3)"},
      {R"({"op":"send_action_goal","action":"/a","feedback":1})",
       R"(send_action_goal: the member "feedback" must be true or false; it is 1)"},
      {R"({"op":"send_action_goal","action":"/a","args":"x"})",
       R"(send_action_goal: the member "args" must be an object or an array; it is "x")"},
      {R"({"op":"cancel_action_goal","action":"/a"})", R"(cancel_action_goal: the member "id" is missing)"},
      {R"({"op":"action_feedback","action":"/a","id":"g"})",
       R"(action_feedback: the member "values" is missing)"},
      {R"({"op":"action_result","action":"/a","id":"g","status":-1})",
       R"(action_result: the member "status" must not be negative; it is -1)"},
      {R"({"op":"action_result","action":"/a","id":"g","action":"/b"})",
       R"(action_result: the member "action" is there twice)"},
  };
  expect_refused(table);
}

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
