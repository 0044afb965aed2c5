// SPDX-License-Identifier: Apache-2.0
// Which commands count: what no loop can read neither takes control nor keeps it.
#include "long_fixtures.hpp"

#include <rowe/subscriber.hpp>

#include "service/base/service_limits.hpp"

namespace core_control_counts_test {

struct speed {
  double linear = 0;
};

} // namespace core_control_counts_test
template <>
inline constexpr auto rowe::schema<core_control_counts_test::speed> =
    rowe::fields<&core_control_counts_test::speed::linear>{}.type("test/Speed");

namespace core_control_counts_test {
namespace {

using namespace harness;
using rowe::detail::pair_kind;

struct counting : testing::TestWithParam<bool> { // whether peers hear each other
  core_harness on{options()};
  rowe::subscriber<speed> loop =
      on.open<rowe::subscriber<speed>>(rowe::detail::subscribe_request<speed>("/cmd_vel", {.lease = 300ms}));
  rowe::detail::queue_pair& logs = on.offer_now(pair_kind::subscribe_text, "/cmd_vel", 32 * 1024);
  peer anna{on};

  static rowe::endpoint_options options() {
    rowe::endpoint_options made = long_fixtures::options_with(32 * 1024);
    made.relay = GetParam();
    return made;
  }
  std::string control(peer& by, const std::string& args = "") {
    (void)by.hear();
    by.tell(R"({"op":"call_service","id":"c","service":"/rowe/control","args":{)" + args + "}}", 2);
    for (const std::string& text : by.hear())
      if (member(text, "id") == R"("c")") return member(text, "values");
    return "no answer";
  }
  void command(const std::string& msg) {
    anna.tell(R"({"op":"publish","topic":"/cmd_vel","msg":)" + msg + R"(,"tick":)" +
                  member(control(anna), "tick") + "}",
              2);
  }
  bool moves() { return loop.latest_within(on.now).has_value(); }
};

TEST_P(counting, a_command_that_no_loop_can_read_takes_no_control) {
  for (const char* const msg : {R"({"linear":"fast"})", R"({"linear":null})", "{}"}) {
    command(msg);
    EXPECT_EQ(member(control(anna), "driver"), "null") << msg;
  }
  EXPECT_EQ(on.count(counter::undecodable), 3U);
  EXPECT_TRUE(take_all(logs).empty());
  command(R"({"linear":0.5})");
  EXPECT_TRUE(moves());
  EXPECT_EQ(member(control(anna), "yours"), "true");
  EXPECT_EQ(take_all(logs).size(), 1U);
}

TEST_P(counting, nor_does_it_keep_control) {
  command(R"({"linear":0.5})");
  ASSERT_EQ(member(control(anna), "yours"), "true");
  for (int i = 0; i < 11; ++i) {
    on.cycle(200ms);
    command("{}");
  }
  EXPECT_EQ(member(control(anna), "driver"), "null");
}

TEST_P(counting, a_long_command_is_none_and_its_sender_is_told_so) {
  const std::string padding(20'000, 'x');
  command(R"({"linear":0.5,"more":")" + padding + "\"}");
  on.cycles(20);
  EXPECT_TRUE(has(anna.hear_as_one(), "its subscriber takes"));
  EXPECT_FALSE(moves());
  EXPECT_EQ(member(control(anna), "driver"), "null");
  EXPECT_EQ(on.count(counter::too_big), 1U);
  EXPECT_TRUE(take_all(logs).empty());
}

TEST_P(counting, a_long_value_of_this_process_is_no_command_either) {
  rowe::detail::queue_pair& own =
      on.offer_now(pair_kind::publish_text, "/cmd_vel", 32 * 1024, {.shared = true});
  const std::string text = R"({"linear":0.5,"more":")" + std::string(20'000, 'x') + "\"}";
  EXPECT_TRUE(rowe::detail::publish_into(own, text.size(), on.now, [&](std::byte* slot) {
    text.copy(reinterpret_cast<char*>(slot), text.size());
  }));
  on.cycles(40);
  EXPECT_FALSE(moves());
  EXPECT_EQ(member(control(anna), "driver"), "null");
  EXPECT_EQ(on.count(counter::too_big), 1U);
  EXPECT_EQ(take_all(logs).size(), 1U); // who has no lease gets what this process publishes
}

TEST_P(counting, the_first_loop_with_a_latch_ends_what_is_in_force) {
  command(R"({"linear":0.5})");
  ASSERT_TRUE(moves());
  (void)on.offer_now(rowe::detail::latch_request({.name = "loop"}));
  EXPECT_FALSE(moves());
}

TEST_P(counting, where_no_loop_has_a_lease_any_more_nobody_is_shown_as_the_driver) {
  command(R"({"linear":0.5})");
  anna.tell(R"({"op":"subscribe","topic":"/rowe/control/state"})", 2);
  ASSERT_TRUE(has(anna.hear_as_one(), R"("topic":"/cmd_vel")"));
  for (rowe::detail::queue_pair& one : on.pairs)
    if (one.lease != rowe::duration{}) one.lifecycle.close();
  on.cycles(3);
  EXPECT_TRUE(has(anna.hear_as_one(), R"("topics":[])"));
}

INSTANTIATE_TEST_SUITE_P(peers, counting, testing::Bool(),
                         [](const auto& one) { return one.param ? "of_a_hub" : "of_no_hub"; });

} // namespace
} // namespace core_control_counts_test
