// SPDX-License-Identifier: Apache-2.0
// The core with peers that asked for rosbridge's fragments: what is longer comes in them, complete and in its
// order, and other messages pass between them.
#include "core_fixtures.hpp"
#include "fragments.hpp"

namespace harness {
namespace core_fragments_out_test {
namespace {

rowe::endpoint_options options_with(std::uint32_t long_bytes, std::uint32_t large_slots = 4) {
  return with_limits(hub_options(), &limits::long_message_bytes_max, long_bytes, &limits::long_slots, 8,
                     &limits::large_slots, large_slots);
}

// Characters of each length, and escapes.
std::string map_of(std::size_t bytes, int shift = 0) {
  std::string made = R"({"data":")" + std::string(static_cast<std::size_t>(shift), 'x');
  while (made.size() + 20 < bytes) made += R"(aé€😀\"\n\\)";
  return made + R"("})";
}

struct fragments_out_test : core_test {
  explicit fragments_out_test(const rowe::endpoint_options& chosen = options_with(64 * 1024))
      : core_test{chosen} {}
  peer robot{on};
  peer browser{on};
  fragments::reassembly into;

  void subscribe(std::string_view topic, std::size_t size) {
    browser.tell(R"({"op":"subscribe","topic":")" + std::string{topic} + R"(","fragment_size":)" +
                 std::to_string(size) + "}");
  }
  // What the browser is told, put together.
  texts heard(int cycles = 60, std::size_t bytes_max = SIZE_MAX) {
    texts all;
    for (int i = 0; i < cycles; ++i) {
      on.cycle();
      for (const std::string& one : browser.hear(bytes_max)) {
        if (auto whole = into.take(one)) all.push_back(std::move(*whole));
      }
      EXPECT_EQ(on.core.inconsistency(), "");
    }
    return all;
  }
  void TearDown() override {
    EXPECT_EQ(into.wrong, "");
    EXPECT_EQ(browser.violated, "");
  }
};

TEST_F(fragments_out_test, are_no_longer_than_asked_and_never_cut_a_character) {
  for (const std::size_t size : {256U, 257U, 258U, 259U, 1000U, 8192U, 8195U, 20'000U}) {
    peer asks{on};
    fragments::reassembly whole;
    asks.tell(R"({"op":"subscribe","topic":"/map","fragment_size":)" + std::to_string(size) + "}");
    for (const std::size_t bytes : {200U, 300U, 5000U, 7900U, 9000U, 30'000U, 60'000U}) {
      for (int shift = 0; shift < 8; shift += bytes < 9000 ? 1 : 5) {
        const std::string text = published("/map", map_of(bytes, shift));
        robot.say(text);
        texts all;
        for (int i = 0; i < 100 && all.empty(); ++i) {
          on.cycle();
          for (const std::string& one : asks.hear()) {
            EXPECT_TRUE(one.size() <= size || one.starts_with(R"({"op":"fragment")"));
            if (auto made = whole.take(one)) all.push_back(std::move(*made));
          }
        }
        ASSERT_EQ(all, texts{text}) << bytes << " in " << size;
      }
    }
    EXPECT_EQ(whole.wrong, "");
    EXPECT_LE(whole.longest, std::min<std::size_t>(size, 8192));
    asks.leave();
    on.cycle();
  }
  EXPECT_EQ(on.core.slots_in_use(), 0U);
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
}

TEST_F(fragments_out_test, let_urgent_messages_and_others_pass) {
  auto& urgent = on.offer(rowe::detail::pair_kind::publish_text, "/alarm", 100,
                          {.keep = rowe::keep::all, .priority = rowe::priority::urgent});
  auto& normal = on.offer(rowe::detail::pair_kind::publish_text, "/odom", 100, {.keep = rowe::keep::all});
  subscribe("/map", 1000);
  subscribe("/alarm", 1000);
  subscribe("/odom", 1000);
  on.net.link_of(browser.id()).capacity_bytes = 2000;
  const std::string map = published("/map", map_of(60'000));
  robot.say(map);
  (void)heard(5);
  int sent = 0;
  texts all;
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(publish_text(on, urgent, R"({"alarm":1})"));
    EXPECT_TRUE(publish_text(on, normal, R"({"x":1})"));
    ++sent;
    for (std::string& one : heard(4, 1000)) all.push_back(std::move(one));
    EXPECT_GE(std::ranges::count(all, published("/alarm", R"({"alarm":1})")), sent - 1);
  }
  EXPECT_TRUE(into.under_way()); // all of that came before its end
  for (std::string& one : heard(400)) all.push_back(std::move(one));
  EXPECT_EQ(std::ranges::count(all, map), 1);
  EXPECT_EQ(std::ranges::count(all, published("/alarm", R"({"alarm":1})")), sent);
  EXPECT_EQ(std::ranges::count(all, published("/odom", R"({"x":1})")), sent);
}

TEST_F(fragments_out_test, let_the_answer_to_a_stop_pass) {
  on.offer(rowe::detail::latch_request({.name = "loop"}));
  subscribe("/map", 500);
  on.net.link_of(browser.id()).capacity_bytes = 2000;
  robot.say(published("/map", map_of(60'000)));
  (void)heard(5, 1000);
  browser.say(R"({"op":"call_service","id":"s","service":"/rowe/stop"})");
  bool answered = false;
  for (int i = 0; i < 60 && !answered; ++i) {
    for (const std::string& one : heard(2, 1000)) answered |= one.find(R"("id":"s")") != std::string::npos;
  }
  EXPECT_TRUE(answered);
  EXPECT_TRUE(into.under_way());
}

struct fragments_handed_over_test : fragments_out_test {
  fragments_handed_over_test() : fragments_out_test{options_with(64 * 1024, 16)} {}
};

// Two large messages are under way, so the transport is handed over what a socket did not take. It has taken
// a part of a pong, which goes on first.
TEST_F(fragments_handed_over_test, go_behind_a_frame_that_was_begun) {
  for (std::size_t part = 0; part < 700; part += 5) {
    peer other{on};
    subscribe("/map", 300);
    other.tell(R"({"op":"subscribe","topic":"/other","fragment_size":300})");
    auto& link = on.net.link_of(browser.id());
    auto& other_link = on.net.link_of(other.id());
    link.capacity_bytes = other_link.capacity_bytes = 600;
    robot.say(published("/other", map_of(3900)));
    (void)heard(30);
    const std::string map = published("/map", map_of(3900));
    robot.say(map);
    texts all;
    for (int i = 0; i < 30 && !into.under_way(); ++i) all = heard(1, 100);
    ASSERT_TRUE(into.under_way());
    for (const std::string& one : browser.hear()) {
      if (auto whole = into.take(one)) all.push_back(std::move(*whole));
    }
    browser.send(rowe::wire::opcode::ping, std::string(125, 'p')); // the pong goes first
    link.capacity_bytes = part;
    link.rest_bytes_max = SIZE_MAX;
    for (std::string& one : heard(1)) all.push_back(std::move(one));
    link.rest_bytes_max = 0;
    link.capacity_bytes = other_link.capacity_bytes = SIZE_MAX;
    for (std::string& one : heard(40)) all.push_back(std::move(one));
    EXPECT_EQ(std::ranges::count(all, map), 1) << part;
    ASSERT_EQ(browser.violated, "") << part;
    other.leave();
    on.cycle();
  }
}

TEST_F(fragments_out_test, of_one_subscription_keep_the_order_of_its_messages) {
  subscribe("/map", 500);
  texts expected;
  for (int i = 0; i < 6; ++i) {
    expected.push_back(published("/map", i % 2 == 0 ? map_of(5000, i) : R"({"i":1})"));
    robot.say(expected.back());
  }
  EXPECT_EQ(heard(), expected);
}

TEST_F(fragments_out_test, of_several_topics_go_one_message_after_the_other) {
  subscribe("/a", 300);
  subscribe("/b", 300);
  texts expected;
  texts all;
  for (int i = 0; i < 4; ++i) {
    for (const char* topic : {"/a", "/b"}) {
      expected.push_back(published(topic, map_of(3000, i)));
      robot.say(expected.back());
    }
    for (std::string& one : heard(10)) all.push_back(std::move(one));
  }
  EXPECT_EQ(all, expected);
}

TEST_F(fragments_out_test, carry_answers_too) {
  browser.say(R"({"op":"call_service","id":"c","service":"/rosapi/get_param_names","fragment_size":256})");
  const std::string answers = only(heard());
  EXPECT_TRUE(answers.starts_with(R"({"op":"service_response","id":"c")")) << answers;
  EXPECT_GT(answers.size(), 256U);
}

TEST_F(fragments_out_test, are_asked_for_anew_by_each_request_that_says_a_size) {
  subscribe("/map", 256);
  const std::string text = published("/map", map_of(900));
  robot.say(text);
  EXPECT_EQ(heard(), texts{text});
  EXPECT_LE(into.longest, 256U);
  EXPECT_GE(into.longest, 250U);
  subscribe("/other", 1000);
  robot.tell(text);
  EXPECT_EQ(browser.hear(), texts{text}); // whole
}

TEST_F(fragments_out_test, are_not_asked_for_by_a_request_that_is_refused) {
  const std::string told = only(browser.ask(R"({"op":"subscribe","topic":"/map","fragment_size":10})"));
  EXPECT_TRUE(has(told, "must be at least 256; it is 10"));
}

TEST_F(fragments_out_test, are_sent_under_the_name_without_a_slash_as_well) {
  subscribe("map", 300);
  const std::string msg = map_of(5000);
  robot.say(published("/map", msg));
  EXPECT_EQ(heard(), texts{published("map", msg)});
  const std::string longer = map_of(50'000);
  robot.say(published("/map", longer));
  EXPECT_EQ(heard(), texts{published("map", longer)});
}

TEST_F(fragments_out_test, are_not_made_of_binary_messages) {
  browser.tell(R"({"op":"subscribe","topic":"/map","compression":"cbor","fragment_size":300})");
  robot.tell(published("/map", map_of(3000)));
  EXPECT_EQ(browser.hear().size(), 1U);
  EXPECT_EQ(browser.binaries, 1);
}

TEST_F(fragments_out_test, go_on_whatever_a_socket_takes_of_them) {
  subscribe("/map", 300);
  subscribe("/pose", 300);
  for (const std::size_t capacity : {1U, 7U, 100U, 333U, 1000U}) {
    on.net.link_of(browser.id()).capacity_bytes = capacity;
    const std::string map = published("/map", map_of(capacity < 10 ? 600 : 9000));
    robot.say(map);
    int poses = 0;
    texts all;
    for (int i = 0; i < 4000 && std::ranges::count(all, map) == 0; ++i) {
      if (i % 50 == 0 && poses < 10) {
        robot.say(published("/pose", R"({"x":1})"));
        ++poses;
      }
      for (std::string& one : heard(1)) all.push_back(std::move(one));
    }
    on.net.link_of(browser.id()).capacity_bytes = SIZE_MAX;
    for (std::string& one : heard(20)) all.push_back(std::move(one));
    EXPECT_EQ(std::ranges::count(all, map), 1) << capacity;
    EXPECT_GE(std::ranges::count(all, published("/pose", R"({"x":1})")), 1) << capacity;
  }
}

TEST_F(fragments_out_test, of_a_peer_that_leaves_give_back_what_they_hold) {
  for (const std::size_t capacity : {200U, 2000U, 3111U}) {
    peer leaves{on};
    leaves.say(R"({"op":"subscribe","topic":"/map","fragment_size":300})");
    leaves.say(R"({"op":"subscribe","topic":"/pose","fragment_size":300})");
    on.cycle();
    on.net.link_of(leaves.id()).capacity_bytes = capacity;
    robot.say(published("/map", map_of(30'000)));
    for (int i = 0; i < 30; ++i) {
      robot.tell(published("/pose", R"({"x":1})"));
      if (i % 3 == 0) (void)leaves.hear(100);
    }
    leaves.leave();
    on.cycle();
    EXPECT_EQ(on.core.slots_in_use(), 0U);
    EXPECT_EQ(on.core.chunks_in_use(), 0U);
  }
}

TEST_F(fragments_out_test, go_to_a_peer_that_sends_them_back) {
  subscribe("/map", 400);
  const std::string map = published("/map", map_of(20'000));
  for (const std::string& one : fragments::cut(map, 900)) robot.say(one);
  EXPECT_EQ(heard(), texts{map});
}

} // namespace
} // namespace core_fragments_out_test
} // namespace harness
