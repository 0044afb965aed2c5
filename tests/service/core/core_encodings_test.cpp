// SPDX-License-Identifier: Apache-2.0
// Topics' messages in the encodings that rosbridge's `compression` asks for: beside each other, by each name,
// relayed, latched, and as the stop's state.
#include "core_fixtures.hpp"

#include <rowe/ros.hpp>

#include "wire/png_text.hpp"
#include "json/cbor_text.hpp"

namespace core_encodings_test {
namespace {

using namespace harness;
using rowe::tests::cbor_text;
using rowe::tests::png_text;

struct encodings : core_test {
  encodings() : core_test{unguarded_hub_options()} {}

  peer subscriber(std::string_view compression, std::string_view topic = "/pose",
                  std::string_view subprotocol = {}) {
    peer made{on, rowe::service::side::server, "127.0.0.1:1", "/", subprotocol};
    subscribe(made, compression, topic);
    return made;
  }
  void subscribe(peer& by, std::string_view compression, std::string_view topic = "/pose",
                 std::string_view id = "1") {
    by.tell(R"({"op":"subscribe","id":")" + std::string{id} + R"(","topic":")" + std::string{topic} +
            R"(","compression":")" + std::string{compression} + R"("})");
  }
  // What came in a PNG, as JSON.
  static texts from_png(const texts& heard) {
    texts all;
    constexpr std::string_view before = R"({"op":"png","data":")";
    for (const std::string_view one : heard) {
      if (!one.starts_with(before) || !one.ends_with("\"}")) return {"no PNG: " + std::string{one}};
      all.push_back(png_text(one.substr(before.size(), one.size() - before.size() - 2)).value_or("bad PNG"));
    }
    return all;
  }
  static texts from_cbor(const texts& heard) {
    texts all;
    for (const std::string& one : heard) all.push_back(cbor_text(one).value_or("not CBOR: " + one));
    return all;
  }
};

TEST_F(encodings, are_sent_side_by_side) {
  auto& pair = advertise_pose(on);
  peer plain = subscriber("none");
  peer cbor = subscriber("cbor");
  peer second = subscriber("cbor");
  peer png = subscriber("png");
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_EQ(plain.hear(), texts{message(1)});
  EXPECT_EQ(from_cbor(cbor.hear()), texts{message(1)});
  EXPECT_EQ(cbor.binaries, 1);
  EXPECT_EQ(from_cbor(second.hear()), texts{message(1)});
  EXPECT_EQ(from_png(png.hear()), texts{message(1)});
  EXPECT_EQ(png.binaries, 0);
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(encodings, need_one_slot_for_all_who_share_one) {
  auto& pair = advertise_pose(on);
  peer a = subscriber("cbor");
  peer b = subscriber("cbor");
  for (peer* const slow : {&a, &b}) on.net.link_of(slow->id()).capacity_bytes = 0;
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_EQ(on.core.slots_in_use(), 1U) << "no JSON is written that nobody wants";
}

TEST_F(encodings, use_the_name_by_which_a_peer_subscribed) {
  auto& pair = advertise_pose(on);
  peer cbor = subscriber("cbor", "pose");
  peer png = subscriber("png", "pose");
  peer both = subscriber("cbor");
  subscribe(both, "cbor", "pose");
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  const std::string unslashed = R"({"op":"publish","topic":"pose","msg":{"x":1,"y":0}})";
  EXPECT_EQ(from_cbor(cbor.hear()), texts{unslashed});
  EXPECT_EQ(from_png(png.hear()), texts{unslashed});
  texts heard = from_cbor(both.hear());
  std::sort(heard.begin(), heard.end());
  EXPECT_EQ(heard, (texts{message(1), unslashed}));
}

TEST_F(encodings, relay_every_digit) {
  peer cbor = subscriber("cbor", "/big");
  peer png = subscriber("png", "/big");
  peer raw = subscriber("cbor-raw", "/big");
  (void)raw.hear(); // the warning
  peer other{on};
  const std::string numbers = R"({"id":9223372036854775807,"low":-9223372036854775808,"x":0.1,"name":")";
  const std::string body = numbers + R"(\u00f6\/"})";
  other.tell(R"({"op":"publish","topic":"/big","msg":)" + body + "}", 2);
  const std::string said = R"({"op":"publish","topic":"/big","msg":)" + numbers + R"(ö/"}})";
  EXPECT_EQ(from_cbor(cbor.hear()), texts{said});
  EXPECT_EQ(from_cbor(raw.hear()), texts{said}) << "as cbor, where no struct is published";
  EXPECT_EQ(from_png(png.hear()), texts{R"({"op":"publish","topic":"/big","msg":)" + body + "}"});
}

TEST_F(encodings, raw_has_the_time_and_ros_bytes) {
  auto& pair = advertise_pose_now(on);
  peer raw = subscriber("cbor-raw");
  EXPECT_EQ(raw.hear(), texts{}) << "nothing to warn of";
  ASSERT_TRUE(publish_now(on, pair, {1, -2}));
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(on.now.time_since_epoch()).count();
  const auto nanoseconds = (on.now - 1ms).time_since_epoch().count() % 1'000'000'000;
  const std::string heard = only(raw.hear());
  const std::string_view bytes = heard;
  const std::size_t at = bytes.find("bytes");
  ASSERT_NE(at, std::string_view::npos);
  EXPECT_EQ(bytes.substr(at + 5, 5), std::string_view("\x5a\0\0\0\x10", 5));
  EXPECT_EQ(bytes.substr(at + 10), std::string_view("\0\0\0\0\0\0\xf0\x3f\0\0\0\0\0\0\0\xc0", 16));
  std::string readable{bytes.substr(0, at + 5)};
  readable[0] = '\xa3';
  EXPECT_TRUE(has(bytes, "secs"));
  EXPECT_EQ(cbor_text(readable + "\x01").value_or("no"), R"({"op":"publish","topic":"/pose","msg":{"secs":)" +
                                                             std::to_string(seconds) + R"(,"nsecs":)" +
                                                             std::to_string(nanoseconds) + R"(,"bytes":1}})");
}

TEST_F(encodings, raw_warns_where_there_is_no_type) {
  peer raw{on};
  subscribe(raw, "cbor-raw", "/nothing");
  const std::string warning =
      R"({"op":"status","level":"warning","id":"1","msg":"subscribe /nothing: \"compression\":\"cbor-raw\" )"
      R"(needs a struct that this endpoint publishes, of a type that ROS has; )"
      R"(its messages come as \"cbor\""})";
  EXPECT_EQ(raw.hear(), texts{warning});
  peer told_less{on};
  told_less.say(R"({"op":"set_level","level":"error"})");
  subscribe(told_less, "cbor-raw", "/nothing");
  EXPECT_EQ(told_less.hear(), texts{}) << "this level does not want warnings";
}

TEST_F(encodings, are_those_of_latched_values_too) {
  auto& pair = advertise_pose_now(on, {.latched = true});
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  peer cbor = subscriber("cbor");
  peer png = subscriber("png", "pose");
  on.cycle();
  EXPECT_EQ(from_cbor(cbor.hear()), texts{message(1)});
  EXPECT_EQ(from_png(png.hear()), texts{R"({"op":"publish","topic":"pose","msg":{"x":1,"y":0}})"});
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

// As rosbridge: raw before CBOR before PNG before JSON.
TEST_F(encodings, of_several_requests_the_highest_counts) {
  auto& pair = advertise_pose(on);
  peer p = subscriber("none");
  const auto heard = [&] {
    EXPECT_TRUE(publish(on, pair, {1, 0}));
    return p.hear_after(1);
  };
  EXPECT_EQ(heard(), texts{message(1)});
  subscribe(p, "cbor", "/pose", "2");
  EXPECT_EQ(from_cbor(heard()), texts{message(1)});
  subscribe(p, "png", "/pose", "3");
  EXPECT_EQ(from_cbor(heard()), texts{message(1)});
  p.tell(R"({"op":"unsubscribe","topic":"/pose","id":"2"})");
  EXPECT_EQ(from_png(heard()), texts{message(1)});
  p.tell(R"({"op":"unsubscribe","topic":"/pose","id":"3"})");
  EXPECT_EQ(heard(), texts{message(1)});
}

TEST_F(encodings, change_only_what_is_not_queued_yet) {
  auto& pair = advertise_pose(on);
  peer p = subscriber("none", "pose");
  on.net.link_of(p.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  subscribe(p, "cbor", "pose", "2");
  ASSERT_TRUE(publish_now(on, pair, {2, 0}));
  on.net.link_of(p.id()).capacity_bytes = 4096;
  const texts heard = p.hear_after(2);
  ASSERT_EQ(heard.size(), 2U);
  EXPECT_EQ(heard[0], R"({"op":"publish","topic":"pose","msg":{"x":1,"y":0}})");
  EXPECT_EQ(cbor_text(heard[1]), R"({"op":"publish","topic":"pose","msg":{"x":2,"y":0}})");
}

TEST_F(encodings, expire_as_any_message) {
  auto& pair = advertise_pose(on, {.ttl = 5ms});
  peer p = subscriber("cbor", "/pose", "rowe.v1");
  ASSERT_TRUE(publish(on, pair, {1, 0}));
  EXPECT_EQ(from_cbor(p.hear_after(1)), texts{message(1)}) << "no time to live is told";
  on.net.link_of(p.id()).capacity_bytes = 0;
  ASSERT_TRUE(publish(on, pair, {2, 0}));
  on.cycles(10);
  on.net.link_of(p.id()).capacity_bytes = 4096;
  EXPECT_EQ(p.hear_after(2), texts{});
  EXPECT_EQ(on.core.slots_in_use(), 0U);
}

TEST_F(encodings, are_those_of_the_stops_state) {
  on.offer_now({.kind = rowe::detail::pair_kind::stop_latch, .name = "loop"});
  peer cbor = subscriber("cbor", "/rowe/stop/state");
  peer png = subscriber("png", "rowe/stop/state");
  on.cycles(300);
  const texts as_cbor = from_cbor(cbor.hear());
  const texts as_png = from_png(png.hear());
  ASSERT_FALSE(as_cbor.empty());
  ASSERT_FALSE(as_png.empty());
  EXPECT_TRUE(as_cbor[0].starts_with(R"({"op":"publish","topic":"/rowe/stop/state","msg":{"state":)"))
      << as_cbor[0];
  EXPECT_TRUE(as_png[0].starts_with(R"({"op":"publish","topic":"rowe/stop/state","msg":{"state":)"))
      << as_png[0];
}

TEST_F(encodings, are_not_asked_for_by_calls) {
  peer p =
      peer_saying(on, R"({"op":"call_service","id":"c","service":"/rosapi/topics","compression":"cbor"})", 2);
  const std::string heard = only(p.hear());
  EXPECT_TRUE(heard.starts_with(R"({"op":"service_response")")) << heard;
}

TEST_F(encodings, throttle_and_queues_hold_for_all) {
  auto& pair = advertise_pose(on);
  peer p = peer_saying(on, R"({"op":"subscribe","topic":"/pose","compression":"cbor","throttle_rate":100})");
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(publish_now(on, pair, {1, 0}));
  EXPECT_EQ(from_cbor(p.hear()), texts{message(1)});
  EXPECT_EQ(on.count(counter::throttled), 49U);
}

} // namespace
} // namespace core_encodings_test
