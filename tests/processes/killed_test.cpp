// SPDX-License-Identifier: Apache-2.0
// A process that dies without a word in the middle of a call: the call is lost, which is no time-out.
#include "sides.hpp"

namespace killed_test {
namespace {

using namespace sides;

// One call of each kind that is never answered, and one of each that was out of time before.
void lose_calls(endpoint& here, process_side& there) {
  auto mute = here.client<json_text, json_text>("/actor/mute").value();
  auto lane = here.open_lane({.receive = false}).value();
  // Once it is known that somebody provides it.
  ASSERT_TRUE(eventually([&] { return mute.call(R"({"early":1})", 20ms).code() == errc::timed_out; }));
  EXPECT_EQ(lane.invoke(message("service", "/actor/mute", "early", 2), 20ms).code(), errc::timed_out);
  constexpr std::uint64_t timed_out = 2;
  ASSERT_TRUE(eventually([&] { return count_of(here, "calls_timed_out") == timed_out; }));

  ASSERT_TRUE(mute.start(R"({"last":1})", timeout, clock_now()));
  ASSERT_TRUE(lane.start(message("service", "/actor/mute", "last", 2), rowe::rt::for_ever, clock_now()));
  rowe::result<rowe::received> at_the_door{errc::empty};
  std::thread waits{[&] { at_the_door = here.invoke(message("service", "/actor/mute", "last", 3), -1ns); }};
  (void)there.line(R"(mute {"last":3)");
  (void)there.line(R"(mute {"last":2)");
  (void)there.line(R"(mute {"last":1)");
  EXPECT_EQ(mute.try_finish().code(), errc::empty);
  there.kill();

  const auto first = next_completion(mute);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->reply.code(), errc::peer_lost);
  const auto second = next_completion(lane);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->reply.code(), errc::peer_lost);
  waits.join();
  EXPECT_EQ(at_the_door.code(), errc::peer_lost);
  EXPECT_EQ(mute.try_finish().code(), errc::empty);
  EXPECT_EQ(lane.try_finish().code(), errc::empty);
  EXPECT_EQ(count_of(here, "calls_lost"), 3U);
  EXPECT_EQ(count_of(here, "calls_timed_out"), timed_out);
}

TEST(killed_server, ends_calls_with_peer_lost) {
  process_side there{"listen", "0"};
  auto here = endpoint::connect(url_of(there.port()), part::quick_options()).value();
  ASSERT_TRUE(here.wait_peer(timeout));
  lose_calls(here, there);
}

TEST(killed_client, ends_calls_with_peer_lost_and_takes_its_services_along) {
  auto here = endpoint::listen(0, part::quick_options()).value();
  process_side there{"connect", url_of(here.port())};
  lose_calls(here, there);
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  EXPECT_EQ(add.call({1, 2}, timeout).code(), errc::no_service);
}

TEST(killed_asker, needs_no_answer) {
  auto here = endpoint::listen(0, part::quick_options()).value();
  auto ours = here.serve<part::numbers, part::total>("/base/add").value();
  auto mail = here.open_lane().value();
  process_side there{"connect", url_of(here.port())};
  ASSERT_TRUE(mail.send(R"({"ask":true})", rowe::rt::for_ever));
  auto asked = ours.next(timeout);
  ASSERT_TRUE(asked);
  const rowe::connection who = asked->from();
  ASSERT_TRUE(who);
  there.kill();
  ASSERT_TRUE(eventually([&] { return here.peers() == 0; }));
  EXPECT_EQ(ours.reply(*asked, {42}).code(), errc::peer_lost);
  EXPECT_EQ(mail.send("{}", rowe::rt::for_ever, who).code(), errc::peer_lost);
}

TEST(killed_peer, leaves_others_untouched) {
  auto here = endpoint::listen(0, part::quick_options()).value();
  process_side stays{"connect", url_of(here.port())};
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  ASSERT_TRUE(call_when_there(add, {1, 2}));
  for (int i = 0; i < 3; ++i) {
    process_side goes{"connect", url_of(here.port())};
    ASSERT_TRUE(eventually([&] { return here.peers() == 2; }));
    goes.kill();
    expect_total(add.call({38, 4}, timeout), 42);
    ASSERT_TRUE(eventually([&] { return here.peers() == 1; }));
  }
}

} // namespace
} // namespace killed_test
