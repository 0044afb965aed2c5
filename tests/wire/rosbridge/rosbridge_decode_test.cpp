// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>

#include "wire/decoded.hpp"
#include "wire/rosbridge/rosbridge.hpp"

namespace rowe::wire::rosbridge {
namespace rosbridge_decode_test {
namespace {

// The texts of roslib 2.1.0

TEST(rosbridge_decode, reads_roslibs_subscribe) {
  const decoded d{
      R"({"op":"subscribe","id":"subscribe:/probe/chatter:2b401030-0001","type":"std_msgs/msg/String",)"
      R"("topic":"/probe/chatter","compression":"none","throttle_rate":50,"queue_length":1})"};
  EXPECT_EQ(d->what, verb::subscribe);
  EXPECT_EQ(d->verb_text, "subscribe");
  EXPECT_EQ(d->id_raw, R"("subscribe:/probe/chatter:2b401030-0001")");
  EXPECT_EQ(d->type, "std_msgs/msg/String");
  EXPECT_EQ(d->topic, "/probe/chatter");
  EXPECT_EQ(d->throttle_ms, 50);
  EXPECT_EQ(d->queue_length, 1);
  EXPECT_TRUE(d->has_queue_length);
  EXPECT_EQ(d->lifespan_ns, unlimited);
}

TEST(rosbridge_decode, names_what_nobody_knows) {
  const decoded d{R"({"id":7,"op":"subscribee","topic":"/x"})"};
  EXPECT_EQ(d->what, verb::unknown);
  EXPECT_EQ(d->verb_text, "subscribee");
  EXPECT_EQ(d->id_raw, "7");
  std::array<char, refusal::text_bytes_max> buffer{};
  EXPECT_EQ(refuse_op(*d).text(buffer),
            R"(the operation "subscribee" is unknown; offered are )"
            "subscribe, unsubscribe, advertise, unadvertise, publish, call_service, service_response, "
            "advertise_service, unadvertise_service, advertise_action, unadvertise_action, "
            "send_action_goal, cancel_action_goal, action_feedback, action_result, fragment and set_level");
}

// Everything optional

TEST(rosbridge_decode, understands_escapes_in_names_and_values) {
  const decoded d{R"({"\u006fp":"pub\u006cish","\u0074opic":"\/\u00e9\ud83d\ude00","m\u0073g":{}})"};
  EXPECT_EQ(d->what, verb::publish);
  EXPECT_EQ(d->verb_text, "publish");
  EXPECT_EQ(d->topic, "/\xc3\xa9\xf0\x9f\x98\x80");
}

TEST(rosbridge_decode, takes_a_fragment_size_and_says_which_is_the_least) {
  const auto with = [](std::string_view size) {
    return R"({"op":"subscribe","topic":"/t","fragment_size":)" + std::string{size} + "}";
  };
  EXPECT_EQ(read(with("1000"))->fragment_size, 1000);
  EXPECT_EQ(read(with("256"))->fragment_size, 256);
  EXPECT_EQ(read(with("2147483647"))->fragment_size, 2147483647); // as some clients always say
  EXPECT_EQ(read(R"({"op":"subscribe","topic":"/t"})")->fragment_size, 0);
  for (const std::string_view small : {"255", "1", "0", "-1", "-0"}) {
    EXPECT_EQ(diagnostic_for(with(small)),
              R"(subscribe: the member "fragment_size" must be at least 256; it is )" + std::string{small});
  }
  EXPECT_EQ(diagnostic_for(with(R"("1000")")),
            R"(subscribe: the member "fragment_size" must be an integer; it is "1000")");
  EXPECT_EQ(diagnostic_for(with("1000.5")),
            R"(subscribe: the member "fragment_size" must be an integer; it is 1000.5)");
  EXPECT_EQ(read(with("null"))->fragment_size, 0);
}

TEST(rosbridge_decode, takes_a_throttle_rate_below_0_for_none) {
  for (const std::string_view rate : {"-5", "-0.5", "-1e9", "0"}) {
    const std::string text = R"({"op":"subscribe","topic":"/t","throttle_rate":)" + std::string{rate} + "}";
    EXPECT_EQ(read(text)->throttle_ms, 0) << rate;
  }
}

TEST(rosbridge_decode, takes_fragments) {
  const decoded ours{R"({"op":"fragment","id":"a","data":"{\"op\":","num":2,"total":3})"};
  EXPECT_EQ(ours->what, verb::fragment);
  EXPECT_EQ(ours->id_raw, R"("a")");
  EXPECT_EQ(ours->body_raw, R"("{\"op\":")");
  EXPECT_EQ(ours->fragment_number, 2U);
  EXPECT_EQ(ours->fragment_count, 3U);
  EXPECT_TRUE(ours->fragment_count_exact);
  const decoded reference{R"({"op":"fragment","id":0,"data":"x","num":0,"total":3.90625})"};
  EXPECT_EQ(reference->id_raw, "0");
  EXPECT_EQ(reference->fragment_count, 3U);
  EXPECT_FALSE(reference->fragment_count_exact);
  EXPECT_FALSE(read(R"({"op":"fragment","id":0,"data":"x","num":0,"total":3.0})")->fragment_count_exact);
}

TEST(rosbridge_decode, refuses_fragments_that_lack_something) {
  const std::string_view rows[][2] = {
      {R"({"op":"fragment","data":"","num":0,"total":1})", R"(the member "id" is missing)"},
      {R"({"op":"fragment","id":null,"data":"","num":0,"total":1})", R"(the member "id" is missing)"},
      {R"({"op":"fragment","id":1,"num":0,"total":1})", R"(the member "data" is missing)"},
      {R"({"op":"fragment","id":1,"data":"","total":1})", R"(the member "num" is missing)"},
      {R"({"op":"fragment","id":1,"data":"","num":0})", R"(the member "total" is missing)"},
      {R"({"op":"fragment","id":1,"data":{},"num":0,"total":1})",
       R"(the member "data" must be a string; it is {})"},
      {R"({"op":"fragment","id":1,"data":"","num":0.5,"total":1})",
       R"(the member "num" must be an integer; it is 0.5)"},
      {R"({"op":"fragment","id":1,"data":"","num":-1,"total":1})",
       R"(the member "num" must not be negative; it is -1)"},
      {R"({"op":"fragment","id":1,"data":"","num":0,"total":"1"})",
       R"(the member "total" must be a number; it is "1")"},
      {R"({"op":"fragment","id":1,"data":"","num":0,"total":0.5})",
       R"(the member "total" must be at least 1; it is 0.5)"},
      {R"({"op":"fragment","id":1,"data":"","num":0,"total":1e300})",
       R"(the member "total" must be at most 4294967295; it is 1e300)"},
      {R"({"op":"fragment","id":1,"data":"","data":"","num":0,"total":1})",
       R"(the member "data" is there twice)"},
  };
  for (const auto& [text, why] : rows) EXPECT_EQ(diagnostic_for(std::string{text}).substr(10), why) << text;
}

// Quality of service

request with_qos(const std::string& qos, std::string_view verb_text = "subscribe",
                 std::string_view more = "") {
  const decoded d{R"({"op":")" + std::string{verb_text} + R"(","topic":"/t","qos":{)" + qos + "}" +
                  std::string{more} + "}"};
  return *d; // its numbers only; the views end with the text
}

TEST(rosbridge_decode, takes_durations_that_no_clock_can_hold_as_for_ever) {
  for (const char* lifespan : {"1e300", "9300000000", R"({"secs":9223372036854775807,"nsecs":0})",
                               R"({"secs":9223372036,"nsecs":854775808})"}) {
    EXPECT_EQ(with_qos("\"lifespan\":" + std::string{lifespan}).lifespan_ns, unlimited) << lifespan;
  }
  EXPECT_EQ(with_qos(R"("lifespan":{"secs":9223372036,"nsecs":854775807})").lifespan_ns, INT64_MAX);
}

TEST(rosbridge_decode, takes_the_other_policies_as_far_as_rowe_has_them) {
  const request all = with_qos(R"("history":"keep_all","depth":7,"reliability":"best_effort",)"
                               R"("durability":"transient_local","deadline":0.5,"other":1)");
  EXPECT_TRUE(all.keep_all);
  EXPECT_EQ(all.queue_length, 7);
  EXPECT_TRUE(all.has_queue_length);
  EXPECT_TRUE(all.latch);
  EXPECT_EQ(all.deadline_ns, 500'000'000);
  const request other =
      with_qos(R"("history":"KEEP_LAST","durability":"volatile","deadline":"best_available")");
  EXPECT_FALSE(other.keep_all || other.latch || other.has_queue_length);
  EXPECT_EQ(other.deadline_ns, unlimited);
  EXPECT_TRUE(with_qos(R"("durability":"transient_local")", "advertise").latch);
  EXPECT_FALSE(with_qos(R"("durability":"best_available")", "advertise").latch);
  EXPECT_EQ(with_qos(R"("depth":3)", "subscribe", R"(,"queue_length":9)").queue_length, 3);
  EXPECT_EQ(with_qos("", "subscribe", R"(,"queue_length":9)").queue_length, 9);
}

// Refusals

TEST(rosbridge_decode, refuses_with_a_diagnostic_that_names_member_value_and_limit) {
  constexpr wrong table[] = {
      {"[]", "a message must be one JSON object"},
      {"7", "a message must be one JSON object"},
      {R"("op")", "a message must be one JSON object"},
      {"{}",
       R"(the member "op" is missing; it says what to do, for example {"op":"subscribe","topic":"/odom"})"},
      {R"({"op":7})", R"(the member "op" must be a string; it is 7)"},
      {R"({"op":null})", R"(the member "op" must be a string; it is null)"},
      {R"({"op":"subscribe"})", R"(subscribe: the member "topic" is missing)"},
      {R"({"op":"unsubscribe","id":"a"})", R"(unsubscribe: the member "topic" is missing)"},
      {R"({"op":"advertise","type":"a/B"})", R"(advertise: the member "topic" is missing)"},
      {R"({"op":"unadvertise"})", R"(unadvertise: the member "topic" is missing)"},
      {R"({"op":"publish","msg":{}})", R"(publish: the member "topic" is missing)"},
      {R"({"op":"publish","topic":"/t"})", R"(publish: the member "msg" is missing)"},
      {R"({"op":"status","level":"info"})", R"(status: the member "msg" is missing)"},
      {R"({"op":"status","msg":"x"})", R"(status: the member "level" is missing)"},
      {R"({"op":"set_level"})", R"(set_level: the member "level" is missing)"},
      {R"({"op":"subscribe","topic":["/t"]})",
       R"(subscribe: the member "topic" must be a string; it is ["/t"])"},
      {R"({"op":"subscribe","topic":""})", R"(subscribe: the member "topic" must not be empty)"},
      {R"({"op":"subscribe","topic":"a\nb"})",
       R"(subscribe: the member "topic" must have no control characters; it is "a\nb")"},
      {R"({"op":"subscribe","topic":"/t","type":1})",
       R"(subscribe: the member "type" must be a string; it is 1)"},
      {R"({"op":"subscribe","topic":"/t","id":1.5})",
       R"(subscribe: the member "id" must be a string or an integer; it is 1.5)"},
      {R"({"op":"subscribe","topic":"/t","id":{}})",
       R"(subscribe: the member "id" must be a string or an integer; it is {})"},
      {R"({"op":"subscribe","topic":"/t","throttle_rate":"50"})",
       R"(subscribe: the member "throttle_rate" must be an integer; it is "50")"},
      {R"({"op":"subscribe","topic":"/t","throttle_rate":1.5})",
       R"(subscribe: the member "throttle_rate" must be an integer; it is 1.5)"},
      {R"({"op":"subscribe","topic":"/t","throttle_rate":"-5"})",
       R"(subscribe: the member "throttle_rate" must be an integer; it is "-5")"},
      {R"({"op":"subscribe","topic":"/t","throttle_rate":9223372036855})",
       R"(subscribe: the member "throttle_rate" must be at most 9223372036854; it is 9223372036855)"},
      {R"({"op":"subscribe","topic":"/t","queue_length":-1})",
       R"(subscribe: the member "queue_length" must not be negative; it is -1)"},
      {R"({"op":"subscribe","topic":"/t","queue_length":99999999999999999999})",
       R"(subscribe: the member "queue_length" must be at most 9223372036854775807; it is )"
       R"(99999999999999999999)"},
      {R"({"op":"subscribe","topic":"/t","queue_length":null})",
       R"(subscribe: the member "queue_length" must be an integer; it is null)"},
      {R"({"op":"subscribe","topic":"/t","compression":"bson"})",
       R"(subscribe: the member "compression" asks for "bson", which is not offered; use "none", "png", )"
       R"("cbor", "cbor-raw" or leave it out)"},
      {R"({"op":"subscribe","topic":"/t","compression":1})",
       R"(subscribe: the member "compression" must be a string; it is 1)"},
      {R"({"op":"advertise","topic":"/t","latch":1})",
       R"(advertise: the member "latch" must be true or false; it is 1)"},
      {R"({"op":"advertise","topic":"/t","queue_size":-1})",
       R"(advertise: the member "queue_size" must not be negative; it is -1)"},
      {R"({"op":"publish","topic":"/t","msg":[1]})",
       R"(publish: the member "msg" must be an object; it is [1])"},
      {R"({"op":"publish","topic":"/t","msg":{},"latch":"yes"})",
       R"(publish: the member "latch" must be true or false; it is "yes")"},
      {R"({"op":"status","level":"info","msg":1})", R"(status: the member "msg" must be a string; it is 1)"},
      {R"({"op":"set_level","level":"loud"})",
       R"(set_level: the member "level" must be "none", "error", "warning" or "info"; it is "loud")"},
      {R"({"op":"set_level","level":2})",
       R"(set_level: the member "level" must be "none", "error", "warning" or "info"; it is 2)"},
      {R"({"op":"subscribe","topic":"/t","qos":[]})",
       R"(subscribe: the member "qos" must be an object; it is [])"},
      {R"({"op":"subscribe","topic":"/t","qos":{"depth":-1}})",
       R"(subscribe: the member "qos.depth" must not be negative; it is -1)"},
      {R"({"op":"subscribe","topic":"/t","qos":{"history":"keep"}})",
       R"(subscribe: the member "qos.history" must be "keep_last" or "keep_all"; it is "keep")"},
      {R"({"op":"subscribe","topic":"/t","qos":{"reliability":1}})",
       R"(subscribe: the member "qos.reliability" must be "reliable", "best_effort" or )"
       R"("best_available"; it is 1)"},
      {R"({"op":"subscribe","topic":"/t","qos":{"durability":"x"}})",
       R"(subscribe: the member "qos.durability" must be "volatile", "transient_local" or )"
       R"("best_available"; it is "x")"},
      {R"({"op":"subscribe","topic":"/t","qos":{"lifespan":-0.5}})",
       R"(subscribe: the member "qos.lifespan" must not be negative; it is -0.5)"},
      {R"({"op":"subscribe","topic":"/t","qos":{"lifespan":"soon"}})",
       R"(subscribe: the member "qos.lifespan" must be seconds, {"secs":s,"nsecs":n} or "infinite"; )"
       R"(it is "soon")"},
      {R"({"op":"subscribe","topic":"/t","qos":{"lifespan":{"secs":1}}})",
       R"(subscribe: the member "qos.lifespan" must be seconds, {"secs":s,"nsecs":n} or "infinite"; )"
       R"(it is {"secs":1})"},
      {R"({"op":"advertise","topic":"/t","qos":{"deadline":{"secs":1,"nsecs":-1}}})",
       R"(advertise: the member "qos.deadline" must not be negative; it is {"secs":1,"nsecs":-1})"},
      {R"({"op":"subscribe","topic":"/t","qos":{"depth":1,"depth":2}})",
       R"(subscribe: the member "qos.depth" is there twice)"},
  };
  expect_refused(table);
}

TEST(rosbridge_decode, refuses_every_known_member_that_stands_there_twice) {
  for (const std::string name : {"topic", "msg", "type", "level", "throttle_rate", "queue_length",
                                 "fragment_size", "latch", "queue_size", "qos", "service", "action", "args",
                                 "values", "result", "compression", "timeout", "id"}) {
    const std::string twice = "\"" + name + "\":1,\"" + name + "\":1";
    EXPECT_EQ(diagnostic_for("{\"op\":\"publish\"," + twice + "}"),
              "publish: the member \"" + name + "\" is there twice");
  }
  EXPECT_EQ(diagnostic_for(R"({"op":"publish","\u006fp":"subscribe"})"), R"(the member "op" is there twice)");
}

TEST(rosbridge_decode, refuses_names_that_are_too_long) {
  const std::string most(32, 'x');
  EXPECT_EQ(read(R"({"op":"subscribe","topic":")" + most + R"("})")->topic, most);
  EXPECT_EQ(diagnostic_for(R"({"op":"subscribe","topic":")" + most + R"(y"})"),
            R"(subscribe: the member "topic" is 33 bytes long; the limit is 32)");
  EXPECT_EQ(diagnostic_for(R"({"op":"subscribe","topic":"/t","type":")" + most + R"(y"})"),
            R"(subscribe: the member "type" is 33 bytes long; the limit is 32)");
  EXPECT_EQ(diagnostic_for(R"({"op":"subscribe","topic":"/t","id":")" + std::string(63, 'i') + R"("})"),
            R"(subscribe: the member "id" is 65 bytes long; the limit is 64)");
  EXPECT_EQ(diagnostic_for(R"({"op":")" + std::string(65, 'o') + R"("})"),
            R"(the member "op" is 65 bytes long; the limit is 64)");
}

TEST(rosbridge_decode, counts_names_after_their_escapes_are_resolved) {
  std::string topic, type;
  for (int i = 0; i < 32; ++i) topic += "\\u0061", type += "\\/";
  const decoded d{R"({"op":"subs\u0063ribe","topic":")" + topic + R"(","type":")" + type + R"("})"};
  EXPECT_EQ(d->topic, std::string(32, 'a'));
  EXPECT_EQ(d->type, std::string(32, '/'));
  EXPECT_EQ(d->verb_text, "subscribe");
  EXPECT_NE(diagnostic_for(R"({"op":"subscribe","topic":")" + topic + R"(\u0061"})").find("the limit is 32"),
            std::string::npos);
}

TEST(rosbridge_decode, shortens_long_values_between_characters) {
  std::string value;
  for (int i = 0; i < 40; ++i) value += "\xc3\xa9";
  const std::string diagnostic =
      diagnostic_for(R"({"op":"subscribe","topic":"/t","throttle_rate":")" + value + R"("})");
  EXPECT_EQ(diagnostic, R"(subscribe: the member "throttle_rate" must be an integer; it is ")" +
                            value.substr(0, 62) + "...");
}

TEST(rosbridge_decode, never_cuts_a_diagnostic_within_the_room_it_asks_for) {
  const std::string long_text(200, 'v');
  for (int kind = 0; kind <= static_cast<int>(refusal::kind::unknown_op); ++kind) {
    const refusal worst{.what = static_cast<refusal::kind>(kind),
                        .verb_text = long_text,
                        .member = "qos.reliability",
                        .value = long_text,
                        .expected = R"("reliable", "best_effort" or "best_available")",
                        .bytes = SIZE_MAX / 2,
                        .limit = INT64_MAX};
    std::array<char, refusal::text_bytes_max> buffer{};
    std::array<char, 4096> plenty{};
    EXPECT_EQ(worst.text(buffer), worst.text(plenty));
    EXPECT_EQ(worst.text(std::span{buffer}.first(10)).size(), 10U);
  }
}

} // namespace
} // namespace rosbridge_decode_test
} // namespace rowe::wire::rosbridge
