// SPDX-License-Identifier: Apache-2.0
// /api/v1/topics: values that are longer than message_bytes_max. They are read out of their chunks, some of
// them at a time, and take no room from messages.
#include "service/core/access_fixture.hpp"
#include "service/core/core_fixtures.hpp"

#include <random>

namespace topic_pages_long_test {
namespace {

using namespace harness;
using rowe::service::http_answer;

constexpr std::string_view map_path = "/api/v1/topics/map";

rowe::endpoint_options with_long_ones(rowe::endpoint_options options, std::uint32_t slots) {
  options.relay = true;
  options.limits.long_message_bytes_max = 64 * 1024; // 4 chunks
  options.limits.long_slots = slots;
  return options;
}

std::string map_of(std::size_t bytes, int seed = 1) {
  std::mt19937 random{static_cast<std::uint32_t>(seed)};
  std::string made = R"({"data":[0)";
  while (made.size() + 6 < bytes) made += "," + std::to_string(random() % 100);
  return made + "]}";
}

struct long_pages : core_test {
  explicit long_pages(const rowe::endpoint_options& options = with_long_ones(small_options(), 8))
      : core_test{options} {
    on.cycle();
  }
  http_answer get(std::string_view path = map_path) { return on.net.get({path, {}, false}, on.core); }
  http_answer again(const http_answer& waits) {
    return on.net.get({.path = {}, .if_none_match = {}, .awaited = &waits.awaited}, on.core);
  }
  // A body, which is read to its end.
  static std::string body_of(const http_answer& answer) {
    std::string text;
    const auto& body = answer.in_pieces;
    if (body.from == nullptr) return "no long body";
    while (text.size() < body.bytes) {
      const auto piece = body.from->read_body(body.which, text.size());
      if (piece.empty()) {
        text += "...cut";
        break;
      }
      text.append(reinterpret_cast<const char*>(piece.data()), piece.size());
    }
    body.from->end_body(body.which);
    return text;
  }
  static std::string text_of(const http_answer& answer) {
    return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
  }
  void publish(peer& by, std::string_view msg, std::string_view topic = "/map", bool latch = false) {
    by.tell(R"({"op":"publish","topic":")" + std::string{topic} + "\"" + (latch ? R"(,"latch":true)" : "") +
                R"(,"msg":)" + std::string{msg} + "}",
            60);
  }
  void advertise(peer& by, std::string_view topic = "/map") {
    by.tell(R"({"op":"advertise","type":"a/Map","topic":")" + std::string{topic} + "\"}", 2);
  }
  void TearDown() override { EXPECT_EQ(on.core.inconsistency(), ""); }
};

TEST_F(long_pages, have_all_of_a_latched_value) {
  peer robot{on};
  const std::string map = map_of(40'000);
  advertise(robot);
  publish(robot, map, "/map", true);
  const http_answer answer = get();
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.content_type, "application/json");
  EXPECT_EQ(answer.cache_control, "no-store");
  EXPECT_GE(answer.age_ms, 0);
  EXPECT_EQ(answer.in_pieces.bytes, map.size());
  EXPECT_TRUE(body_of(answer) == map);
}

TEST_F(long_pages, give_what_they_keep_back_when_nobody_has_asked_for_a_minute) {
  peer robot{on};
  advertise(robot);
  ASSERT_TRUE(get().later);
  publish(robot, map_of(40'000));
  EXPECT_NE(on.core.chunks_in_use(), 0U);
  on.cycles(70, 1s);
  EXPECT_EQ(on.core.chunks_in_use(), 0U);
}

TEST_F(long_pages, are_two_at_a_time) {
  peer robot{on};
  advertise(robot);
  const std::string map = map_of(40'000);
  publish(robot, map, "/map", true);
  const http_answer first = get();
  const http_answer second = get();
  const http_answer third = get();
  EXPECT_EQ(third.status, 503);
  EXPECT_EQ(third.retry_after_s, 1);
  EXPECT_EQ(text_of(third), "2 long values are being sent over HTTP, which is the limit\n"
                            "ask again in a second, or subscribe to the topic\n");
  EXPECT_TRUE(body_of(first) == map);
  EXPECT_TRUE(body_of(get()) == map);
  EXPECT_TRUE(body_of(second) == map);
}

TEST_F(long_pages, end_when_the_endpoint_closes) {
  peer robot{on};
  advertise(robot);
  publish(robot, map_of(40'000), "/map", true);
  const http_answer answer = get();
  EXPECT_FALSE(answer.in_pieces.from->read_body(answer.in_pieces.which, 0).empty());
  on.core.close_all(on.now);
  EXPECT_EQ(body_of(answer), "...cut");
}

// Whoever publishes, or is sent, long messages finds the room that it would find without them.
TEST_F(long_pages, make_way_for_messages) {
  peer robot{on};
  advertise(robot);
  advertise(robot, "/image");
  ASSERT_TRUE(get().later);
  publish(robot, map_of(60'000));
  const http_answer reading = get();
  publish(robot, map_of(60'000, 2));
  ASSERT_EQ(body_of(get()).size(), map_of(60'000, 2).size());
  const std::uint32_t kept = on.core.chunks_in_use();
  EXPECT_EQ(kept, 8U) << "what is being read, and what is kept";
  peer slow = subscriber(on, "/image");
  on.net.link_of(slow.id()).capacity_bytes = 1000;
  for (int i = 0; i < 12; ++i) publish(robot, map_of(60'000, i), "/image");
  EXPECT_TRUE(get().later) << "what was kept made way";
  EXPECT_EQ(on.count(counter::no_chunks), 0U);
  EXPECT_TRUE(body_of(reading) == map_of(60'000)) << "while evicting is enough";
}

struct few_long_pages : long_pages { // a quarter of the chunks is one value
  few_long_pages() : long_pages{with_long_ones(small_options(), 4)} {}
};

TEST_F(few_long_pages, of_two_values_have_a_quarter_of_the_room) {
  peer robot{on};
  advertise(robot);
  advertise(robot, "/image");
  ASSERT_TRUE(get().later);
  const std::string map = map_of(60'000);
  publish(robot, map);
  const http_answer first = get();
  ASSERT_TRUE(get("/api/v1/topics/image").later);
  publish(robot, map_of(30'000), "/image");
  const http_answer other = get("/api/v1/topics/image");
  EXPECT_EQ(other.status, 503);
  EXPECT_EQ(other.retry_after_s, 1);
  EXPECT_TRUE(text_of(other).find("more than a quarter of the room for long ones") != std::string::npos);
  EXPECT_TRUE(body_of(first) == map);
  EXPECT_TRUE(body_of(get("/api/v1/topics/image")) == map_of(30'000));
}

struct fewest_long_pages : long_pages { // a quarter of the chunks is less than one value
  fewest_long_pages() : long_pages{with_long_ones(small_options(), 2)} {}
};

TEST_F(fewest_long_pages, say_how_long_a_value_is_for_which_there_is_no_room) {
  auto& pair = on.offer_now(rowe::detail::pair_kind::publish_text, "/map", 64 * 1024);
  const http_answer waits = get();
  on.cycle();
  ASSERT_TRUE(publish_text(on, pair, map_of(60'000)));
  on.cycles(60);
  const http_answer answer = again(waits);
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(text_of(answer), "the last value has " + std::to_string(map_of(60'000).size()) +
                                 " bytes, and there was no room to keep it\nraise long_slots (2), or "
                                 "subscribe to the topic, as `rowe echo URL /map --json --once` does\n");
  ASSERT_TRUE(publish_text(on, pair, map_of(30'000)));
  on.cycles(60);
  EXPECT_TRUE(body_of(get()) == map_of(30'000));
}

struct long_pages_with_roles : long_pages {
  long_pages_with_roles() : long_pages{with_long_ones(access_fixture::with_roles(), 8)} {}
};

TEST_F(long_pages_with_roles, end_when_the_rights_change) {
  auto& pair = on.offer_now(rowe::detail::pair_kind::publish_text, "/arm/a", 64 * 1024);
  const std::string token = access_fixture::token_of("arm");
  const auto who =
      static_cast<rowe::service::transport_sink&>(on.core)
          .may_read({.address = access_fixture::far, .path = "/api/v1/topics/arm/a", .token = token})
          .who;
  const http_answer waits = on.net.get({"/api/v1/topics/arm/a", {}, false, who}, on.core);
  ASSERT_TRUE(waits.later);
  const std::string map = map_of(40'000);
  ASSERT_TRUE(publish_text(on, pair, map));
  on.cycles(60);
  const http_answer answer = again(waits);
  ASSERT_FALSE(answer.in_pieces.from->read_body(answer.in_pieces.which, 0).empty());
  on.set_access(access_fixture::with_roles().access);
  on.cycle();
  EXPECT_EQ(body_of(answer), "...cut");
}

} // namespace
} // namespace topic_pages_long_test
