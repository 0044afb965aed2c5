// SPDX-License-Identifier: Apache-2.0
// In which order peers are heard: one message of each in turn, a bounded amount in one cycle, and a stop
// before all of it.
#include "core_stage.hpp"

#include <rowe/stop_latch.hpp>

#include <optional>

namespace core_reading_test {
namespace {

using namespace stage;

constexpr const char* stop_call = R"({"op":"call_service","id":"1","service":"/rowe/stop"})";

rowe::endpoint_options roomy() {
  rowe::endpoint_options options = small_options();
  options.limits.lane_bytes = 8 * 1024 * 1024;
  return options;
}

struct reading : testing::Test {
  reading() {
    for (int i = 0; i < 4; ++i)
      peers.push_back(
          std::make_unique<peer>(on, rowe::service::side::server, "127.0.0.1:" + std::to_string(i)));
    // As sockets are read when several have something to say.
    for (const auto& p : peers)
      on.net.weather_of(p->id()).chunk_bytes_max = rowe::service::transport_sink::read_bytes_in_turn;
    on.cycle();
  }
  ~reading() override { EXPECT_TRUE(on.core.check()); }

  // Hears who said what, by one letter each, in the order in which it was carried out.
  std::string order() {
    std::string seen;
    while (const auto text = take(*heard)) seen += text->substr(9, 1);
    return seen;
  }
  void listen() {
    heard = &on.offer(rowe::detail::lane_kind::subscribe_text, "/heard", 8000, {.depth = 512});
    on.cycle();
  }
  static std::string say(char who, std::size_t bytes = 0) {
    return R"({"op":"publish","topic":"/heard","msg":{"data":")" + std::string(1, who) +
           std::string(bytes, '.') + "\"}}";
  }

  theatre on{roomy()};
  std::vector<std::unique_ptr<peer>> peers;
  rowe::detail::lane* heard = nullptr;
};

TEST_F(reading, hears_one_message_of_each_peer_in_turn) {
  listen();
  for (const char who : {'a', 'b', 'c'})
    for (int i = 0; i < 3; ++i) peers[static_cast<std::size_t>(who - 'a')]->say(say(who));
  on.cycle();
  EXPECT_EQ(order(), "abcabcabc");
}

TEST_F(reading, does_a_bounded_amount_in_one_cycle_and_wants_the_next_at_once) {
  listen();
  for (std::size_t who = 0; who < 3; ++who)
    for (int i = 0; i < 50; ++i) peers[who]->say(say(static_cast<char>('a' + who)));
  on.cycle();
  EXPECT_EQ(order().size(), 100U);
  EXPECT_EQ(on.next_wake, on.now);
  on.cycles(2, 0ms);
  EXPECT_EQ(order().size(), 50U);
  EXPECT_GT(on.next_wake, on.now);
}

TEST_F(reading, counts_the_size_of_messages_as_work) {
  listen();
  for (std::size_t who = 0; who < 4; ++who)
    for (int i = 0; i < 40; ++i) peers[who]->say(say(static_cast<char>('a' + who), 3000));
  int cycles = 0;
  for (std::size_t all = 0; all < 160 && cycles < 100; ++cycles) {
    on.cycle();
    const std::size_t now = order().size();
    EXPECT_LE(now, 26U + 1U);
    all += now;
  }
  EXPECT_LT(cycles, 100);
}

TEST_F(reading, reads_no_more_of_a_peer_before_it_has_heard_what_it_read) {
  listen();
  for (int i = 0; i < 2000; ++i) peers[0]->say(say('a'));
  for (std::size_t all = 0; all < 2000;) {
    on.cycle();
    const std::size_t now = order().size();
    ASSERT_GT(now, 0U);
    all += now;
  }
}

TEST_F(reading, carries_out_a_stop_before_everything_that_was_read_with_it) {
  listen();
  rowe::detail::lane& lane = on.offer(rowe::detail::latch_request({}));
  on.cycle();
  rowe::stop_latch latch{theatre::handle_of(lane)};
  for (const char* text : {stop_call, R"({"service":"/rowe/stop","message_id":1})",
                           R"({"op":"publish","topic":"\/rowe\/stop","msg":{}})"}) {
    const auto before = on.count(counter::stops);
    for (std::size_t who = 0; who < 3; ++who)
      for (int i = 0; i < 100; ++i) peers[who]->say(say(static_cast<char>('a' + who), 20));
    peers[3]->say(text);
    on.cycle();
    EXPECT_EQ(on.count(counter::stops), before + 1) << text;
    EXPECT_LE(order().size(), 101U);
    for (int i = 0; i < 4; ++i) on.cycle();
    (void)order();
  }
}

TEST_F(reading, finds_a_stop_behind_other_messages_of_its_own_peer) {
  listen();
  rowe::detail::lane& lane = on.offer(rowe::detail::latch_request({}));
  on.cycle();
  rowe::stop_latch latch{theatre::handle_of(lane)};
  for (int i = 0; i < 10; ++i) peers[0]->say(say('a'));
  peers[0]->say(stop_call);
  for (int i = 0; i < 10; ++i) peers[0]->say(say('b'));
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
  EXPECT_EQ(order(), "aaaaaaaaaabbbbbbbbbb");
}

TEST_F(reading, finds_it_there_although_others_flood) {
  listen();
  rowe::detail::lane& lane = on.offer(rowe::detail::latch_request({}));
  on.cycle();
  rowe::stop_latch latch{theatre::handle_of(lane)};
  for (std::size_t who = 1; who < 4; ++who)
    for (int i = 0; i < 60; ++i) peers[who]->say(say(static_cast<char>('a' + who)));
  for (int i = 0; i < 40; ++i) peers[0]->say("{}");
  peers[0]->say(stop_call);
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
}

TEST_F(reading, finds_a_stop_behind_a_frame_that_came_in_two_reads) {
  listen();
  rowe::detail::lane& lane = on.offer(rowe::detail::latch_request({}));
  on.cycle();
  rowe::stop_latch latch{theatre::handle_of(lane)};
  for (std::size_t who = 1; who < 4; ++who)
    for (int i = 0; i < 40; ++i) peers[who]->say(say(static_cast<char>('a' + who), 3000));
  peers[0]->say(say('a', 4200)); // more than one read
  peers[0]->say(stop_call);
  on.cycle();
  on.cycle();
  EXPECT_EQ(on.count(counter::stops), 1U);
}

TEST_F(reading, forgets_what_a_peer_said_that_was_closed_before_its_turn) {
  listen();
  for (int i = 0; i < 300; ++i) peers[0]->say(say('a'));
  on.cycle();
  peers[0]->leave(rowe::service::close_cause::reset);
  on.cycle();
  auto again = std::make_unique<peer>(on);
  on.cycle();
  (void)order();
  again->say(say('z'));
  on.cycles(3);
  EXPECT_EQ(order(), "z");
}

} // namespace
} // namespace core_reading_test
