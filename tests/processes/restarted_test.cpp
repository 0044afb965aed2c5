// SPDX-License-Identifier: Apache-2.0
// A process that is killed and started again: the one that stayed finds it by itself, and everything between
// the two is as it was, but for what was under way.
#include "sides.hpp"

namespace restarted_test {
namespace {

using namespace sides;

// Of that process, behind those of the one before it.
bool hear_beat(rowe::subscriber<part::beat>& from, const side& there) {
  return eventually([&] {
    const auto beat = from.take(timeout);
    return beat && beat->value().process == there.process();
  });
}

// A server that can be away.
class restarted_server : public testing::Test {
 protected:
  void SetUp() override {
    there_.emplace("listen", "0");
    port_ = there_->port();
    here_.emplace(endpoint::connect(url_of(port_), part::quick_options()).value());
    ASSERT_TRUE(here_->wait_peer(timeout));
  }
  endpoint& here() { return *here_; }
  process_side& there() { return *there_; }
  void kill() {
    there_->kill();
    ASSERT_TRUE(eventually([&] { return here_->peers() == 0; }));
  }
  void start() { there_.emplace("listen", std::to_string(port_)); }

 private:
  std::optional<process_side> there_;
  std::optional<endpoint> here_;
  std::uint16_t port_ = 0;
};

TEST_F(restarted_server, is_subscribed_to_and_told_of_our_services_again) {
  auto beats = here().subscribe<part::beat>("/actor/beat", {.keep = rowe::keep::newest}).value();
  auto orders = here().advertise<json_text>("/orders").value();
  auto ours = here().serve<part::numbers, part::total>("/base/add").value();
  auto add = here().client<part::numbers, part::total>("/actor/add").value();
  auto mail = here().open_lane().value();
  for (int round = 0; round < 3; ++round) {
    if (round > 0) {
      kill();
      start();
    }
    ASSERT_TRUE(hear_beat(beats, there()));
    ASSERT_TRUE(eventually([&] {
      (void)orders.publish(message("round", round).text());
      return !there().told("order ").empty();
    }));
    EXPECT_EQ(there().line("order "), "order " + std::string{message("round", round).text()});
    expect_total(add.call({38, 4}, timeout), 42);
    be_asked(mail, ours, there());
  }
  EXPECT_EQ(count_of(here(), "peers_joined"), 3U);
}

TEST_F(restarted_server, gets_the_messages_that_waited_but_for_those_that_are_out_of_date) {
  auto mail = here().open_lane().value();
  kill();
  ASSERT_TRUE(mail.try_send(R"({"n":1})", rowe::rt::for_ever, clock_now()));
  ASSERT_TRUE(mail.try_send(R"({"stale":1})", 20ms, clock_now()));
  ASSERT_TRUE(mail.try_send(R"({"stale":2})", 0ns, clock_now()));
  ASSERT_TRUE(mail.try_send(R"({"n":2})", timeout, clock_now()));
  EXPECT_EQ(mail.send(R"({"stale":3})", 20ms).code(), errc::expired);
  ASSERT_TRUE(eventually([&] { return count_of(here(), "expired") == 3; }));
  start();
  ASSERT_TRUE(mail.send(R"({"n":3})", rowe::rt::for_ever));
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ(there().line("message ", static_cast<std::size_t>(i)),
              "message " + std::string{message("n", i).text()});
  }
  EXPECT_EQ(there().told("message ").size(), 3U);
}

TEST_F(restarted_server, gets_the_calls_that_wait_for_it_and_none_that_gave_up) {
  auto mute = here().client<json_text, json_text>("/actor/mute").value();
  auto lane = here().open_lane({.receive = false}).value();
  kill();
  EXPECT_EQ(mute.call(R"({"stale":1})", 20ms).code(), errc::timed_out);
  EXPECT_EQ(lane.invoke(message("service", "/something", "stale", 2), 20ms).code(), errc::timed_out);
  ASSERT_TRUE(lane.start(message("service", "/something", "fresh", 3), timeout, clock_now()));
  start();
  const auto ended = next_completion(lane);
  ASSERT_TRUE(ended);
  EXPECT_TRUE(ended->reply) << ended->reply.error().name();
  ASSERT_TRUE(mute.start(R"({"fresh":4})", timeout, clock_now())); // behind all the others
  EXPECT_EQ(there().line("mute "), R"(mute {"fresh":4})");
  EXPECT_EQ(there().told("mute ").size(), 1U);
  EXPECT_EQ(there().told("call ").size(), 1U);
}

TEST_F(restarted_server, is_another_connection) {
  auto mail = here().open_lane().value();
  ASSERT_EQ(here().connections().size(), 1U);
  const rowe::connection before = here().connections()[0].id;
  ASSERT_TRUE(mail.send(R"({"to":"the first"})", rowe::rt::for_ever, before));
  kill();
  EXPECT_EQ(mail.send(R"({"to":"the dead"})", rowe::rt::for_ever, before).code(), errc::peer_lost);
  start();
  ASSERT_TRUE(here().wait_peer(timeout));
  EXPECT_EQ(mail.send(R"({"to":"the dead"})", rowe::rt::for_ever, before).code(), errc::peer_lost);
  EXPECT_EQ(mail.invoke(message("service", "/something"), timeout, before).code(), errc::peer_lost);
  ASSERT_TRUE(mail.send(R"({"to":"the second"})", rowe::rt::for_ever));
  EXPECT_EQ(there().line("message "), R"(message {"to":"the second"})");
}

TEST(restarted_client, provides_its_services_and_gets_its_messages_again) {
  auto here = endpoint::listen(0, part::quick_options()).value();
  auto add = here.client<part::numbers, part::total>("/actor/add").value();
  auto beats = here.subscribe<part::beat>("/actor/beat", {.keep = rowe::keep::newest}).value();
  auto ours = here.serve<part::numbers, part::total>("/base/add").value();
  auto mail = here.open_lane().value();
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(mail.try_send(R"({"stale":true})", 0ns, clock_now()));
    ASSERT_TRUE(mail.try_send(message("echo", round), rowe::rt::for_ever, clock_now())); // nobody is there
    process_side there{"connect", url_of(here.port())};
    EXPECT_EQ(there.line("message "), "message " + std::string{message("echo", round).text()});
    const auto back = mail.receive(timeout);
    ASSERT_TRUE(back) << back.error().name();
    EXPECT_EQ(back->value(), message("echo", round).text());
    expect_total(call_when_there(add, {38, 4}), 42);
    ASSERT_TRUE(hear_beat(beats, there));
    be_asked(mail, ours, there);
    there.kill();
    ASSERT_TRUE(eventually([&] { return here.peers() == 0; }));
  }
}

} // namespace
} // namespace restarted_test
