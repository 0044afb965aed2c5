// SPDX-License-Identifier: Apache-2.0
// /api/v1: the statistics, and the last value of a topic; who may have them, and what they cost others.
#include "service/core/access_fixture.hpp"

#include <algorithm>

namespace topic_pages_test {
namespace {

using namespace harness;
using rowe::service::http_answer;

std::string text_of(const http_answer& answer) {
  return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
}

struct topic_pages : core_test {
  explicit topic_pages(const rowe::endpoint_options& options = relaying()) : core_test{options} {
    on.cycle();
  }
  static rowe::endpoint_options relaying() {
    rowe::endpoint_options options = small_options();
    options.relay = true;
    return options;
  }
  http_answer get(std::string_view path) { return on.net.get({path, {}, false}, on.core); }
  http_answer again(const http_answer& waits, bool last = false) {
    return on.net.get({.path = {}, .if_none_match = {}, .awaited = &waits.awaited, .last = last}, on.core);
  }
  // Asks once, so that the values that come are kept.
  void ask_for(std::string_view path) {
    EXPECT_TRUE(get(path).later);
    on.cycle();
  }
};

constexpr std::string_view pose_path = "/api/v1/topics/pose";

TEST_F(topic_pages, show_what_the_service_of_the_statistics_answers) {
  const http_answer answer = get("/api/v1/stats");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.content_type, "application/json");
  EXPECT_EQ(answer.cache_control, "no-store");
  const std::string text = text_of(answer);
  EXPECT_TRUE(text.starts_with(R"({"name":"robot","epoch":)")) << text;
  EXPECT_TRUE(text.ends_with("}\n"));
  for (const std::string_view member :
       {"\"counters\":{", "\"limits\":{", "\"topics\":[", "\"connections\":["})
    EXPECT_TRUE(has(text, member)) << member;
}

TEST_F(topic_pages, wait_for_the_next_value_of_a_topic_that_nobody_has_asked_for) {
  auto& pair = advertise_pose_now(on);
  EXPECT_EQ(publish(on, pair, {1, 0}).code(), rowe::errc::no_peer);
  const http_answer waits = get(pose_path);
  ASSERT_TRUE(waits.later);
  EXPECT_TRUE(again(waits).later);
  ASSERT_TRUE(publish(on, pair, {2, 0})) << "its publisher is heard now";
  on.cycle();
  EXPECT_EQ(on.next_wake, on.now) << "the page is answered at once";
  const http_answer answer = again(waits);
  ASSERT_FALSE(answer.later);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.content_type, "application/json");
  EXPECT_EQ(answer.cache_control, "no-store");
  EXPECT_EQ(text_of(answer), "{\"x\":2,\"y\":0}\n");
  on.cycle();
  EXPECT_GT(on.next_wake, on.now);
}

TEST_F(topic_pages, show_the_newest_value_at_once_to_who_asks_again_and_say_how_old_it_is) {
  auto& pair = advertise_pose_now(on);
  ask_for(pose_path);
  for (const int x : {1, 2, 3}) ASSERT_TRUE(publish(on, pair, {1.0 * x, 0}));
  on.cycle();
  EXPECT_EQ(get(pose_path).age_ms, 1);
  on.cycle(20ms);
  const http_answer answer = get(pose_path);
  EXPECT_EQ(text_of(answer), "{\"x\":3,\"y\":0}\n");
  EXPECT_EQ(answer.age_ms, 21);
}

TEST_F(topic_pages, are_not_there_for_what_is_no_topic) {
  advertise_pose_now(on);
  for (const std::string_view path :
       {"/api/v1/topics/poses", "/api/v1/topics/", "/api/v1/topics/po%se", "/api/v1/topics/pose%",
        "/api/v1/topics/pose%2", "/api/v1/topics/pose%00", "/api/v1/topics///pose", "/api/v1/topics/po+se",
        "/api/v1", "/api/v1/", "/api/v1/topics", "/api/v1/stats/"})
    EXPECT_EQ(get(path).status, 404) << path;
  EXPECT_EQ(text_of(get("/api/v1/topics/po%se")),
            "there is no topic /po%se\n/api/v1/stats has those that there are\n");
  const std::string longest = "/api/v1/topics/" + std::string(4000, 'a');
  EXPECT_EQ(get(longest).status, 404);
  EXPECT_LT(text_of(get(longest)).size(), 300U);
}

TEST_F(topic_pages, show_no_value_whose_time_to_live_is_over) {
  for (const bool latched : {false, true}) {
    core_harness with{relaying()};
    auto& pair = advertise_pose(with, {.ttl = 50ms, .latched = latched});
    with.cycle();
    const auto ask = [&] { return with.net.get({pose_path, {}, false}, with.core); };
    (void)ask();
    with.cycle();
    ASSERT_TRUE(publish(with, pair, {5, 0}));
    with.cycle(20ms);
    EXPECT_EQ(text_of(ask()), "{\"x\":5,\"y\":0}\n");
    with.cycle(29ms);
    EXPECT_EQ(ask().status, 200);
    with.cycle(1ms);
    EXPECT_TRUE(ask().later) << latched;
    EXPECT_TRUE(with.core.check());
  }
}

TEST_F(topic_pages, say_when_none_came_for_too_long) {
  advertise_pose_now(on);
  const http_answer waits = get(pose_path);
  on.cycle(2s);
  const http_answer answer = again(waits, true);
  EXPECT_FALSE(answer.later);
  EXPECT_EQ(answer.status, 404);
  EXPECT_TRUE(has(text_of(answer), "no value of the topic came within 2 s"));
}

TEST_F(topic_pages, let_publishers_rest_when_nobody_has_asked_for_a_minute) {
  auto& pair = advertise_pose_now(on);
  ask_for(pose_path);
  on.cycles(58, 1s);
  EXPECT_TRUE(publish(on, pair, {1, 0}));
  (void)get(pose_path); // whose minute begins again
  on.cycles(58, 1s);
  EXPECT_TRUE(publish(on, pair, {1, 0}));
  on.cycles(4, 1s);
  EXPECT_EQ(publish(on, pair, {1, 0}).code(), rowe::errc::no_peer);
}

TEST_F(topic_pages, hold_no_topic_whose_last_holder_leaves) {
  peer source = peer_saying(on, R"({"op":"advertise","topic":"/count","type":"a/B"})", 2);
  const http_answer waits = get("/api/v1/topics/count");
  ASSERT_TRUE(waits.later);
  source.tell(R"({"op":"unadvertise","topic":"/count"})");
  EXPECT_EQ(on.next_wake, on.now) << "the page hears of it at once";
  EXPECT_EQ(again(waits).status, 404);
  source.say(R"({"op":"advertise","topic":"/count","type":"a/B"})"); // in the same row, perhaps
  on.cycles(2);
  EXPECT_EQ(again(waits).status, 404) << "it is another topic";
  EXPECT_TRUE(get("/api/v1/topics/count").later);
}

TEST_F(topic_pages, show_the_statistics_and_the_state_of_the_stop_as_topics) {
  EXPECT_EQ(get("/api/v1/topics/rowe/stop/state").status, 404) << "nothing heeds it";
  access_fixture::stoppable_loop loop{on};
  const http_answer state = get("/api/v1/topics/rowe/stop/state");
  EXPECT_EQ(state.content_type, "application/json");
  EXPECT_TRUE(text_of(state).starts_with(R"({"state":"stopped")")) << text_of(state);
  const http_answer waits = get("/api/v1/topics/rowe/stats");
  ASSERT_TRUE(waits.later);
  on.cycles(12, 20ms);
  EXPECT_TRUE(text_of(again(waits)).starts_with(R"({"name":"robot")"));
}

TEST_F(topic_pages, say_that_the_endpoint_is_closing) {
  advertise_pose_now(on);
  const http_answer waits = get(pose_path);
  on.core.close_all(on.now);
  EXPECT_EQ(again(waits).status, 503);
  EXPECT_EQ(text_of(again(waits)), "the endpoint is closing\n");
}

// ---- what whoever asks may take

struct many_topics : topic_pages {
  many_topics()
      : topic_pages{with_limits(relaying(), &limits::topics_max, 256,
                                &limits::advertisements_per_connection_max, 40,
                                &limits::messages_per_second_max, 10'000)} {}
  static std::string path_of(int i) { return "/api/v1/topics/t" + std::to_string(i); }
  void advertise(peer& source, int count) {
    for (int i = 0; i < count; ++i)
      source.tell(R"({"op":"advertise","type":"a/B","topic":"/t)" + std::to_string(i) + "\"}");
    on.cycle();
  }
  void publish(peer& source, int i, std::size_t bytes) {
    source.tell(R"({"op":"publish","topic":"/t)" + std::to_string(i) + R"(","msg":{"v":")" +
                    std::string(bytes, 'x') + "\"}}",
                2);
  }
};

// Who has asked last comes first: those who asked before may have left.
TEST_F(many_topics, beyond_the_limit_replace_the_one_asked_for_longest_ago) {
  peer source{on};
  advertise(source, 34);
  std::vector<http_answer> waiting;
  for (int i = 0; i < 32; ++i) {
    waiting.push_back(get(path_of(i)));
    ASSERT_TRUE(waiting.back().later) << i;
    on.cycle();
  }
  publish(source, 7, 1); // nobody waits for that one any more
  const rowe::service::transport_sink& asks = on.core;
  const std::uint64_t came = asks.awaited_came();
  EXPECT_TRUE(get(path_of(32)).later);
  EXPECT_EQ(asks.awaited_came(), came) << "nobody lost a place";
  on.cycle();
  EXPECT_TRUE(get(path_of(33)).later);
  EXPECT_GT(asks.awaited_came(), came) << "who waits for the first of them is to ask again";
  EXPECT_TRUE(again(waiting[0]).later);
  publish(source, 0, 1);
  EXPECT_EQ(again(waiting[0]).status, 200);
  EXPECT_TRUE(on.core.check());
}

TEST_F(many_topics, share_memory_and_the_one_asked_for_longest_ago_makes_room) {
  constexpr std::size_t large = 8000; // of 8 KiB a message: two find room
  peer source{on};
  advertise(source, 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(get(path_of(i)).later);
    on.cycle();
  }
  for (int i = 0; i < 2; ++i) publish(source, i, large);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(get(path_of(i)).body.size(), large + 9) << i;
  on.cycle();
  EXPECT_EQ(get(path_of(0)).status, 200); // so that another one is the oldest
  publish(source, 2, large);
  EXPECT_EQ(get(path_of(2)).body.size(), large + 9);
  EXPECT_EQ(get(path_of(0)).status, 200);
  EXPECT_TRUE(get(path_of(1)).later);
  publish(source, 1, 1);
  EXPECT_EQ(get(path_of(1)).status, 200);
}

// ---- rights

struct topic_pages_with_roles : topic_pages {
  topic_pages_with_roles() : topic_pages{access_fixture::with_roles()} {}
  rowe::service::admit_answer may_read(std::string_view who, std::string_view path) {
    token_ = access_fixture::token_of(who);
    return static_cast<rowe::service::transport_sink&>(on.core).may_read(
        {.address = access_fixture::far, .path = path, .token = who.empty() ? std::string_view{} : token_});
  }
  http_answer get_as(std::string_view who, std::string_view path) {
    return on.net.get({path, {}, false, may_read(who, path).who}, on.core);
  }
  std::string token_;
};

TEST_F(topic_pages_with_roles, need_the_right_to_subscribe_to_the_topic) {
  EXPECT_EQ(may_read("", "/api/v1/topics/arm/a").status, 401);
  EXPECT_EQ(may_read("mallory", "/api/v1/topics/arm/a").status, 401);
  EXPECT_EQ(may_read("arm", "/api/v1/topics/arm/a").status, 0);
  EXPECT_EQ(may_read("observer", "/api/v1/topics/arm/a").status, 0);
  EXPECT_EQ(on.count(counter::denied), 0U);
  for (const std::string_view path :
       {"/api/v1/topics/pose", "/api/v1/topics/%61rms/a", "/api/v1/topics//pose"})
    EXPECT_EQ(may_read("arm", path).status, 403) << path;
  EXPECT_EQ(on.count(counter::denied), 3U);
  EXPECT_EQ(may_read("arm", "/api/v1/topics/pose").value, "arm, role arm, has no right to subscribe pose");
  EXPECT_EQ(may_read("guard", "/api/v1/topics/arm/a").status, 403);
  EXPECT_EQ(may_read("guard", "/api/v1/topics/rowe/stop/state").status, 0) << "everyone sees the stop";
  EXPECT_EQ(may_read("arm", "/api/v1/topics/rowe/stats").status, 403);
}

TEST_F(topic_pages_with_roles, say_the_same_of_a_hidden_topic_and_of_none) {
  advertise_pose_now(on);
  const auto there = may_read("arm", "/api/v1/topics/pose");
  const std::string what{there.what}, remedy{there.remedy};
  const auto nowhere = may_read("arm", "/api/v1/topics/nothing");
  EXPECT_EQ(there.status, nowhere.status);
  EXPECT_EQ(what, nowhere.what);
  EXPECT_EQ(remedy, nowhere.remedy);
}

TEST_F(topic_pages_with_roles, show_in_the_statistics_only_the_topics_that_a_role_may_see) {
  advertise_pose(on);
  on.offer(rowe::detail::pair_kind::publish_text, "/arm/a", 64);
  peer other{on, rowe::service::side::server,       access_fixture::far, "/",
             {}, access_fixture::token_of("driver")};
  on.cycles(2);
  EXPECT_EQ(may_read("guard", "/api/v1/stats").status, 403);
  rowe::access_options with = access_fixture::with_roles().access;
  with.roles[0].call = {"/rowe/stats"};
  on.set_access(with);
  const std::string all = text_of(get_as("observer", "/api/v1/stats"));
  EXPECT_TRUE(has(all, "\"/pose\""));
  EXPECT_TRUE(has(all, "\"driver\""));
  const std::string some = text_of(get_as("arm", "/api/v1/stats"));
  EXPECT_TRUE(has(some, "\"/arm/a\""));
  EXPECT_FALSE(has(some, "\"/pose\""));
  EXPECT_TRUE(has(some, "\"connections\":[]"));
}

TEST_F(topic_pages_with_roles, show_nothing_to_who_waits_when_the_rights_change) {
  auto& pair = on.offer_now(rowe::detail::pair_kind::publish_text, "/arm/a", 64);
  const http_answer waits = get_as("arm", "/api/v1/topics/arm/a");
  ASSERT_TRUE(waits.later);
  rowe::access_options with = access_fixture::with_roles().access;
  with.roles[0].subscribe.clear();
  on.set_access(with);
  ASSERT_TRUE(publish_text_now(on, pair, "{}"));
  const http_answer answer = again(waits);
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(text_of(answer), "the rights have just changed\nask again\n");
}

} // namespace
} // namespace topic_pages_test
