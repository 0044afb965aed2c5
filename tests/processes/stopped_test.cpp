// SPDX-License-Identifier: Apache-2.0
// A process that stands still, as under a debugger or on a machine whose kernel hangs: its sockets stay, and
// the kernel goes on acknowledging. What waits for it times out; what comes late is dropped; and what was
// meant for it never reaches the process that takes its place.
#include "sides.hpp"

namespace stopped_test {
namespace {

using namespace sides;

endpoint connected(side& there, const rowe::endpoint_options& options = part::quick_options()) {
  auto here = endpoint::connect(url_of(there.port()), options).value();
  EXPECT_TRUE(here.wait_peer(timeout));
  return here;
}

TEST(stopped_server, makes_calls_time_out_and_its_late_answers_are_dropped) {
  process_side there{"listen", "0"};
  auto here = connected(there);
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  ASSERT_TRUE(add.call({1, 2}, timeout));
  there.stop();
  const std::uint64_t before = count_of(here, "calls_out");
  ASSERT_TRUE(go_out(here, 3, [&] { return add.call({1, 100}, 30ms); }));
  EXPECT_EQ(count_of(here, "calls_lost"), 0U);
  there.go_on();
  ASSERT_TRUE(
      eventually([&] { return count_of(here, "replies_late") == count_of(here, "calls_out") - before; }));
  EXPECT_EQ(add.try_finish().code(), errc::empty);
  expect_total(add.call({38, 4}, timeout), 42);
}

TEST(stopped_server, is_cut_when_it_is_silent_too_long_and_met_again) {
  process_side there{"listen", "0"};
  auto options = part::quick_options();
  options.ping_period = 200ms;
  options.silence_max = 600ms;
  auto here = connected(there, options);
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  auto mute = here.client<json_text, json_text>("/actor/mute").value();
  // A slow machine may be silent by itself for so long, at any time: what met that is done again.
  const auto expect_answer = [&] {
    rowe::result<part::total> answer{errc::peer_lost};
    ASSERT_TRUE(eventually([&] {
      return (answer = add.call({38, 4}, timeout)).has_value() || answer.code() != errc::peer_lost;
    }));
    expect_total(answer, 42);
  };
  ASSERT_TRUE(eventually([&] {
    expect_answer();
    there.stop();
    const errc code = mute.call(R"({"n":1})", 5s).code();
    there.go_on();
    EXPECT_TRUE(code == errc::peer_lost || code == errc::timed_out); // it was cut just before: nobody there
    return code == errc::peer_lost;
  }));
  EXPECT_GE(count_of(here, "silent_peers"), 1U);
  expect_answer();
  EXPECT_EQ(count_of(here, "replies_foreign"), 0U); // the old connection took its answers along
}

TEST(stopped_server, leaves_nothing_to_the_one_that_takes_its_place) {
  std::optional<process_side> there{std::in_place, "listen", "0"};
  const std::uint16_t port = there->port();
  auto here = connected(*there);
  auto mute = here.client<json_text, json_text>("/actor/mute").value();
  auto lane = here.open_lane({.calls = 16, .receive = false}).value();
  ASSERT_EQ(mute.call(R"({"before":0})", 20ms).code(), errc::timed_out);
  there->stop();
  ASSERT_TRUE(go_out(here, 5, [&] { return mute.call(R"({"stale":1})", 20ms); }));
  const std::uint64_t before = count_of(here, "calls_out");
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(lane.start(message("service", "/actor/mute", "stale", 2), timeout, clock_now()));
  }
  // All of them are on their way: one that is taken up later would wait for the next server.
  ASSERT_TRUE(eventually([&] { return count_of(here, "calls_out") >= before + 5; }));
  there->kill();
  for (int i = 0; i < 5; ++i) {
    const auto ended = next_completion(lane);
    ASSERT_TRUE(ended);
    EXPECT_EQ(ended->reply.code(), errc::peer_lost);
  }
  there.emplace("listen", std::to_string(port));
  ASSERT_TRUE(mute.start(R"({"fresh":1})", timeout, clock_now()));
  EXPECT_EQ(there->line("mute "), R"(mute {"fresh":1})");
  ASSERT_TRUE(lane.start(message("service", "/actor/mute", "fresh", 2), timeout, clock_now()));
  EXPECT_EQ(there->line("mute ", 2), R"(mute {"fresh":2})");
  EXPECT_EQ(there->told("mute ").size(), 2U);
  EXPECT_EQ(lane.try_finish().code(), errc::empty);
}

TEST(stopped_client, makes_calls_of_its_services_time_out) {
  auto here = endpoint::listen(0, part::quick_options()).value();
  process_side there{"connect", url_of(here.port())};
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  ASSERT_TRUE(call_when_there(add, {1, 2}));
  there.stop();
  const std::uint64_t before = count_of(here, "calls_out");
  ASSERT_TRUE(go_out(here, 1, [&] { return add.call({1, 2}, 30ms); }));
  there.go_on();
  ASSERT_TRUE(
      eventually([&] { return count_of(here, "replies_late") == count_of(here, "calls_out") - before; }));
  expect_total(add.call({38, 4}, timeout), 42);
}

} // namespace
} // namespace stopped_test
