// SPDX-License-Identifier: Apache-2.0
// Foxglove's protocol as its clients see it: what they say, and what they are told.
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/schema.hpp>

#include "wire/foxglove/foxglove_schema.hpp"
#include "wire/protocols/protocols.hpp"
#include "wire/received.hpp"
#include "json/reading/reader.hpp"

struct foxglove_point {
  double x = 0;
  float y = 0;
};
template <>
inline constexpr auto
    rowe::schema<foxglove_point> = rowe::fields<&foxglove_point::x, &foxglove_point::y>{}.type("test/Point");
struct foxglove_shape {
  std::array<std::array<double, 2>, 3> matrix{};
  std::array<foxglove_point, 2> points{};
  std::optional<std::int32_t> number{};
  std::uint64_t big = 0;
  bool closed = false;
};
template <>
inline constexpr auto rowe::schema<foxglove_shape> =
    rowe::fields<&foxglove_shape::matrix, &foxglove_shape::points, &foxglove_shape::number,
                 rowe::field<&foxglove_shape::big, "a\"b">.as_string(), &foxglove_shape::closed>{};

namespace foxglove_codec_test {
namespace {

using namespace rowe::wire;
namespace json = rowe::json;
using namespace std::string_literals;

constexpr name_limits limits{.name_bytes_max = 32};

const protocol& spoken() {
  return protocols_of(rowe::websocket_profile::standard).find("foxglove.websocket.v1");
}
const codec& speaks() { return spoken().topics; }

struct received : test::received {
  explicit received(std::string said, list_place from = {})
      : test::received{spoken(), std::move(said), limits, from} {}
};
struct received_binary : test::received_binary {
  explicit received_binary(std::string bytes) : test::received_binary{spoken(), std::move(bytes), limits} {}
};

template <class Write>
std::string written(message_kind kind, Write&& write) {
  std::vector<char> buffer(64 * 1024);
  json::writer out{buffer};
  EXPECT_EQ(write(out), kind);
  EXPECT_FALSE(out.overflowed());
  std::string text{out.text()};
  if (kind == message_kind::text) {
    auto reader = json::reader::create(64 * 1024);
    std::string padded = text + std::string(json::reader::tailroom_bytes, '\xff');
    EXPECT_TRUE(reader->validate({padded.data(), text.size()})) << text;
  }
  return text;
}

// ---- what clients say

TEST(foxglove_codec, reads_subscriptions_one_after_the_other) {
  const std::string two =
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":7},{"channelId":8,"id":1}]})";
  const received first{two};
  ASSERT_EQ(first.is, decoded::request);
  EXPECT_EQ(first.request.what, verb::subscribe);
  EXPECT_TRUE(first.request.by_number);
  EXPECT_FALSE(first.request.channel_is_peers);
  EXPECT_EQ(first.request.tag, 0U);
  EXPECT_EQ(first.request.channel, 7U);
  EXPECT_EQ(first.request.next.index, 1U);
  const received second{two, first.request.next};
  EXPECT_EQ(second.request.tag, 1U);
  EXPECT_EQ(second.request.channel, 8U);
  EXPECT_FALSE(second.request.next);
  const received ends{R"({"op":"unsubscribe","subscriptionIds":[3]})"};
  ASSERT_EQ(ends.is, decoded::request);
  EXPECT_EQ(ends.request.what, verb::unsubscribe);
  EXPECT_EQ(ends.request.tag, 3U);
  EXPECT_EQ(ends.request.channel, no_number);
}

TEST(foxglove_codec, refuses_with_a_diagnostic_what_is_not_as_it_should_be) {
  for (const char* text :
       {R"({})",
        R"({"op":7})",
        R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":7})",
        R"({"op":"subscribe","subscriptions":[]})",
        R"({"op":"subscribe","subscriptions":[7]})",
        R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967295}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"","encoding":"json"}]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/a\u0001","encoding":"json"}]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/a","encoding":"json","schemaName":7}]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/a","encoding":"ros1"}]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/a"}]})",
        R"({"op":"advertise","channels":[{"id":1,"topic":"/of_more_than_32_bytes_that_are_allowed",)"
        R"("encoding":"json"}]})",
        R"({"op":"getParameters"})",
        R"({"op":"getParameters","parameterNames":["/a",7]})",
        R"({"op":"getParameters","parameterNames":[],"id":7})",
        R"({"op":"setParameters","parameters":["/a"]})",
        R"({"op":"setParameters","parameters":[{"value":1}]})",
        R"({"op":"setParameters","parameters":[{"name":"/a","value":"AA==","type":"byte_array"}]})",
        R"({"op":"subscribeParameterUpdates","parameterNames":{}})",
        R"({"op":"unsubscribeParameterUpdates","parameterNames":[null]})",
        R"({"op":"fetchAsset","uri":"file:///etc/passwd"})",
        R"({"op":"publish","topic":"/a","msg":{}})"}) {
    const received heard{text};
    EXPECT_EQ(heard.is, decoded::refused) << text;
    EXPECT_FALSE(heard.why.text.empty()) << text;
    EXPECT_FALSE(heard.request.by_number) << text;
  }
  EXPECT_EQ(received{R"({"op":"fetchAsset","uri":"a"})"}.why.text,
            R"(no such operation: "fetchAsset"; serverInfo says what this server is capable of)");
  const std::string two = R"({"op":"unsubscribe","subscriptionIds":[1,"2"]})";
  const received second{two, received{two}.request.next};
  EXPECT_EQ(second.why.text,
            "unsubscribe: element 1 of `subscriptionIds` must be a number below 4294967295; it is \"2\"");
  EXPECT_EQ(received{"[1]"}.is, decoded::malformed);
  const std::string call = "\x02\x01\x00\x00\x00\x09\x00\x00\x00\x04\x00\x00\x00json{}"s;
  for (const std::string& bytes : {""s, "\x00"s,
                                   "\x03"
                                   "abcd{}"s,
                                   "\x01"s,
                                   "\x01"
                                   "abcd"s,
                                   call.substr(0, 1), call.substr(0, 8)})
    EXPECT_EQ(received_binary{bytes}.is, decoded::malformed) << bytes.size();
  // From here on its caller is known, and must be answered.
  for (const std::size_t bytes : {9U, 12U, 13U, 16U}) {
    const received_binary cut{call.substr(0, bytes)};
    EXPECT_EQ(cut.is, decoded::malformed) << bytes;
    EXPECT_EQ(cut.request.what, verb::call);
    EXPECT_EQ(cut.request.id_raw.size(), 8U);
    EXPECT_EQ(cut.request.service_number, 1U);
  }
  const received_binary of_ros{"\x02\x01\x00\x00\x00\x09\x00\x00\x00\x04\x00\x00\x00ros1{}"s};
  EXPECT_EQ(of_ros.is, decoded::refused);
  EXPECT_EQ(of_ros.request.id_raw.size(), 8U);
  const received_binary endless{"\x02\x01\x00\x00\x00\x09\x00\x00\x00\xff\xff\xff\xffjson{}"s};
  EXPECT_EQ(endless.is, decoded::malformed);
}

TEST(foxglove_codec, sees_what_may_be_a_stop_by_its_beginning) {
  const message_decoder& reads = spoken().reads;
  EXPECT_TRUE(reads.may_be_stop(opcode::binary, "\x02\x01\x00\x00\x00\x09"s));
  EXPECT_FALSE(reads.may_be_stop(opcode::text, "\x02\x01\x00\x00\x00\x09"s));
  EXPECT_FALSE(reads.may_be_stop(opcode::binary, "\x02\x02\x00\x00\x00\x09"s));
  EXPECT_FALSE(reads.may_be_stop(opcode::binary, "\x01\x01\x00\x00\x00\x09"s));
}

// ---- what they are told

TEST(foxglove_codec, says_who_it_is_and_what_it_is_capable_of) {
  EXPECT_EQ(written(message_kind::text,
                    [](json::writer& out) {
                      return speaks().write_hello(out, {.name = "a\"b", .epoch = 18446744073709551615U});
                    }),
            R"({"op":"serverInfo","name":"a\"b",)"
            R"("capabilities":["clientPublish","services","parameters","parametersSubscribe",)"
            R"("connectionGraph","time"],)"
            R"("supportedEncodings":["json"],"metadata":{},"sessionId":"18446744073709551615"})");
}

TEST(foxglove_codec, lists_topics_with_the_schemas_that_are_known) {
  const std::array<listed, 2> two{
      listed{.number = 3, .name = "/p", .type = "t/P", .schema = &rowe::describe<foxglove_point>()},
      listed{.number = 4, .name = "/q"}};
  EXPECT_EQ(
      written(message_kind::text, [&](json::writer& out) { return speaks().write_topics(out, two, true); }),
      R"({"op":"advertise","channels":[{"id":3,"topic":"/p","encoding":"json","schemaName":"test/Point",)"
      R"("schemaEncoding":"jsonschema","schema":"{\"title\":\"test/Point\",\"type\":\"object\",)"
      R"(\"properties\":{\"x\":{\"type\":\"number\"},\"y\":{\"type\":\"number\"}}}"},)"
      R"({"id":4,"topic":"/q","encoding":"json","schemaName":"","schemaEncoding":"jsonschema",)"
      R"("schema":"{\"type\":\"object\",\"properties\":{}}"}]})");
  EXPECT_EQ(
      written(message_kind::text, [&](json::writer& out) { return speaks().write_topics(out, two, false); }),
      R"({"op":"unadvertise","channelIds":[3,4]})");
  EXPECT_EQ(written(message_kind::text,
                    [&](json::writer& out) { return speaks().write_services(out, two, false); }),
            R"({"op":"unadvertiseServices","serviceIds":[3,4]})");
}

TEST(foxglove_codec, says_at_most_as_much_of_a_listed_one_as_it_is_counted_to_take) {
  for (const rowe::schema_description* schema :
       {static_cast<const rowe::schema_description*>(nullptr), &rowe::describe<foxglove_point>(),
        &rowe::describe<foxglove_shape>()}) {
    const std::array<listed, 1> one{
        listed{.number = 4294967294, .name = "/name", .type = "a/Type", .schema = schema, .request = schema}};
    constexpr std::size_t others = 128 + 5 + 6; // listings.cpp: bytes_of()
    const std::size_t counted = speaks().schema_bytes(one[0]) + others;
    EXPECT_LE(
        written(message_kind::text, [&](json::writer& out) { return speaks().write_topics(out, one, true); })
            .size(),
        counted);
    EXPECT_LE(written(message_kind::text,
                      [&](json::writer& out) { return speaks().write_services(out, one, true); })
                  .size(),
              counted);
  }
}

// Foxglove's reader of schemas throws at lists of types, at alternatives, and at arrays of arrays.
TEST(foxglove_codec, writes_schemas_that_foxglove_reads) {
  std::vector<char> buffer(4096);
  json::writer out{buffer};
  write_foxglove_schema(out, &rowe::describe<foxglove_shape>(), foxglove_times::sec_nsec);
  EXPECT_EQ(out.bytes(), foxglove_schema_bytes(&rowe::describe<foxglove_shape>(), foxglove_times::sec_nsec));
  std::string padded{out.text()};
  padded.append(json::reader::tailroom_bytes, '\xff');
  std::vector<char> plain(4096);
  const auto schema =
      json::to_string({.type = json::kind::string, .raw = {padded.data(), out.bytes()}}, plain);
  ASSERT_TRUE(schema);
  EXPECT_EQ(*schema,
            R"({"type":"object","properties":{)"
            R"("matrix":{"type":"array","items":{"type":"object","properties":{}}},)"
            R"("points":{"type":"array","items":{"title":"test/Point","type":"object","properties":{)"
            R"("x":{"type":"number"},"y":{"type":"number"}}}},"number":{"type":"integer"},)"
            R"("a\"b":{"type":"string"},"closed":{"type":"boolean"}}})");
}

TEST(foxglove_codec, heads_a_message_with_its_subscription_and_the_wall_clocks_time) {
  const message_head head =
      speaks().head_of({.tag = 0x01020304, .published_ns = 5, .wall_ns = 0x1122334455667788});
  ASSERT_EQ(head.as, message_kind::binary);
  EXPECT_EQ(head.from, 0);
  const std::string bytes{reinterpret_cast<const char*>(head.bytes.data()), head.size};
  EXPECT_EQ(bytes, "\x01\x04\x03\x02\x01\x88\x77\x66\x55\x44\x33\x22\x11"s);
}

TEST(foxglove_codec, answers_a_call_under_its_numbers) {
  const std::string id = "\x01\x00\x00\x00\x09\x00\x00\x00"s;
  const call_origin call{.service = "/s", .id_raw = id};
  EXPECT_EQ(written(message_kind::binary,
                    [&](json::writer& out) { return speaks().write_reply(out, call, body{R"({"a":1})"}); }),
            "\x03" + id + "\x04\x00\x00\x00json{\"a\":1}"s);
  EXPECT_EQ(written(message_kind::text,
                    [&](json::writer& out) {
                      return speaks().write_failure(out, call, {.code = "refused", .text = "not \"now\""});
                    }),
            R"({"op":"serviceCallFailure","serviceId":1,"callId":9,"message":"not \"now\""})");
  EXPECT_EQ(written(message_kind::text,
                    [&](json::writer& out) {
                      return speaks().write_failure(out, {}, {.code = "refused", .text = "no"});
                    }),
            R"({"op":"status","level":2,"message":"no"})")
      << "a call that has no numbers";
}

TEST(foxglove_codec, relates_an_error_to_its_request_where_the_id_is_a_text) {
  const auto told = [](std::string_view id) {
    return written(message_kind::text, [&](json::writer& out) {
      return speaks().write_error(out, {.id_raw = id}, {.code = "c", .text = "no"});
    });
  };
  EXPECT_EQ(told(R"("q7")"), R"({"op":"status","level":2,"message":"no","id":"q7"})");
  EXPECT_EQ(told(R"("sixsix")"), R"({"op":"status","level":2,"message":"no","id":"sixsix"})");
  for (const std::string& id :
       {"\x22\0\0\0\1\0\0\x22"s, "\x22\x22\x22\x22\x22\x22\x22\x22"s, "\1\0\0\0\1\0\0\0"s})
    EXPECT_EQ(told(id), R"({"op":"status","level":2,"message":"no"})") << "that of a call";
}

TEST(foxglove_codec, says_how_bad_an_error_is) {
  for (const auto& [how, level] :
       {std::pair{severity::error, "2"}, std::pair{severity::warning, "1"}, std::pair{severity::info, "0"}}) {
    EXPECT_EQ(written(message_kind::text,
                      [&, as = how](json::writer& out) {
                        return speaks().write_error(out, {.how = as}, {.code = "c", .text = "no"});
                      }),
              R"({"op":"status","level":)" + std::string{level} + R"(,"message":"no"})");
  }
}

} // namespace
} // namespace foxglove_codec_test
