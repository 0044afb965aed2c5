// SPDX-License-Identifier: Apache-2.0
// Every codec that is registered: what one end writes, the other one reads; what is refused, and how.
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "wire/numbers_codec.hpp"
#include "wire/protocols/protocols.hpp"
#include "wire/received.hpp"
#include "json/reading/reader.hpp"

namespace codec_test {
namespace {

using namespace rowe::wire;
namespace json = rowe::json;
using rowe::websocket_profile;
using test::received;

constexpr name_limits limits{};

const protocol_set& standard() { return protocols_of(websocket_profile::standard); }

struct named_set {
  const char* name;
  const protocol_set& set;
};
// Those of every profile, and the one that only tests have.
std::vector<named_set> all_sets() {
  return {{"standard", standard()},
          {"hop", protocols_of(websocket_profile::hop)},
          {"hop_2014", protocols_of(websocket_profile::hop_2014)},
          {"numbers", numbers::protocols()}};
}

// What `write(writer)` writes.
template <class Write>
std::string written(Write&& write) {
  std::vector<char> buffer(64 * 1024);
  json::writer out{buffer};
  const message_kind kind = write(out);
  EXPECT_FALSE(out.overflowed());
  EXPECT_EQ(kind == message_kind::none, out.bytes() == 0);
  return std::string{out.text()};
}

// The codec that reads what another writes: an encoding of topics' messages answers in its format's own.
codec_id read_as(const codec& one) { return one.writes_whole() ? standard().envelope.id() : one.id(); }

// Each codec of each set that both ends may write, with the protocol that a peer without a subprotocol has.
template <class Check>
void for_each_codec(Check&& check) {
  for (const auto& [name, set] : all_sets()) {
    for (const codec* const one : set.codecs) {
      if (one->id() == numbers::id || one->name().starts_with("foxglove"))
        continue; // only a server writes it
      SCOPED_TRACE(std::string{one->name()} + " of " + name);
      check(*one, set.find(""));
    }
  }
}
// Each that a server may write.
template <class Check>
void for_each_server_codec(Check&& check) {
  for (const auto& [name, set] : all_sets()) {
    for (const codec* const one : set.codecs) {
      SCOPED_TRACE(std::string{one->name()} + " of " + name);
      check(*one);
    }
  }
}

TEST(codec, writes_calls_that_the_other_end_reads) {
  for_each_codec([](const codec& one, const protocol& by) {
    const std::string_view service = "/a\"\\b";
    const received call{by, written([&](json::writer& out) {
                          return one.write_call(out, service, "n.1", {.text = R"({"a":[1,"}"]})"});
                        })};
    ASSERT_EQ(call.is, decoded::request) << call.text;
    EXPECT_EQ(call.request.what, verb::call);
    EXPECT_EQ(call.request.codec, read_as(one));
    EXPECT_EQ(call.request.service, service);
    EXPECT_EQ(call.request.id_raw, R"("n.1")");
    const auto args = json::find(json::root(call.request.body_raw).raw, "a");
    ASSERT_TRUE(args);
    EXPECT_EQ(args->raw, R"([1,"}"])");
  });
}

TEST(codec, writes_the_object_form_of_a_call_with_its_id) {
  for_each_codec([](const codec& one, const protocol& by) {
    const received call{by, written([&](json::writer& out) {
                          return one.write_call(
                              out, "/add", "n.1",
                              {.is = call_args::form::object, .text = R"({"service":"/add","a":1,"b":2})"});
                        })};
    EXPECT_EQ(call.request.what, verb::call);
    EXPECT_EQ(call.request.service, "/add");
    EXPECT_EQ(call.request.id_raw, R"("n.1")");
    const std::string_view args = json::root(call.request.body_raw).raw;
    EXPECT_TRUE(json::find(args, "a") && json::find(args, "b"));
    const bool apart = call.request.form == call_args::form::args;
    EXPECT_EQ(json::find(args, "service").has_value(), !apart) << "its own members are no arguments";
  });
}

TEST(codec, announces_what_the_other_end_reads) {
  const auto check = [](const codec& one, const protocol& by, auto write, verb begins, verb ends) {
    for (const bool on : {true, false}) {
      const announcement what{.name = "/pose", .type = "a/Pose", .latch = true, .begins = on};
      const std::string text = written([&](json::writer& out) { return (one.*write)(out, what); });
      if (text.empty()) continue; // it knows no topics
      const received heard{by, text};
      EXPECT_EQ(heard.is, decoded::request) << text;
      EXPECT_EQ(heard.request.what, on ? begins : ends);
      const bool service = begins == verb::advertise_service;
      EXPECT_EQ(service ? heard.request.service : heard.request.topic, "/pose");
      if (on) {
        EXPECT_EQ(heard.request.type, "a/Pose");
      }
    }
  };
  for_each_codec([&](const codec& one, const protocol& by) {
    check(one, by, &codec::write_subscription, verb::subscribe, verb::unsubscribe);
    check(one, by, &codec::write_advertisement, verb::advertise, verb::unadvertise);
    check(one, by, &codec::write_provision, verb::advertise_service, verb::unadvertise_service);
  });
}

TEST(codec, has_room_for_the_longest_error) {
  const std::string worst(refusal::text_bytes_max, '\x01');
  const std::string id(limits.id_bytes_max, '7');
  for_each_server_codec([&](const codec& one) {
    std::vector<char> buffer(error_bytes_max);
    json::writer out{buffer};
    (void)one.write_error(out, {.id_raw = id}, {.code = "a_code_of_some_length", .text = worst});
    EXPECT_FALSE(out.overflowed());
  });
}

// ---- texts of two codecs

TEST(json_decoder, says_why_it_does_not_offer_an_operation) {
  for (const std::string op : {"png", "action_status", "auth"}) {
    const received one{standard().find(""), R"({"op":")" + op + R"(","id":1})"};
    EXPECT_EQ(one.is, decoded::request);
    EXPECT_EQ(one.request.what, verb::unsupported);
    EXPECT_TRUE(one.why.text.starts_with("the operation \"" + op + "\" is not offered here")) << one.why.text;
  }
  const received unknown{standard().find(""), R"({"op":"sing"})"};
  EXPECT_EQ(unknown.request.what, verb::unknown);
  EXPECT_TRUE(unknown.why.text.starts_with(R"(the operation "sing" is unknown)")) << unknown.why.text;
}

TEST(json_decoder, guesses_the_codec_of_a_text_that_is_no_json) {
  const message_decoder& reads = standard().find("").reads;
  const codec_id plain = standard().messages.id();
  const codec_id rosbridge = standard().calls_to_server.id();
  for (const codec_id last : {plain, rosbridge}) {
    EXPECT_EQ(reads.guess(R"({"op":"publish","msg":NaN})", last), rosbridge);
    EXPECT_EQ(reads.guess(R"({"a":NaN,"message_id":7})", last), plain);
    EXPECT_EQ(reads.guess(R"({"a":NaN})", last), last);
  }
}

TEST(json_decoder, sees_what_may_be_a_stop_by_its_beginning) {
  const message_decoder& reads = standard().find("").reads;
  for (const std::string_view text :
       {R"({"op":"call_service","service":"/rowe/stop","args":{)", R"({"service":"rowe\/stop","mess)",
        R"({"service":"/rowe/stop#7"})", R"({"a":{"b":[1]},"topic":"/rowe/stop")"}) {
    EXPECT_TRUE(reads.may_be_stop(opcode::text, text)) << text;
  }
  for (const std::string_view text :
       {R"({"service":"/rowe/stop/reset"})", R"({"x":{"service":"/rowe/stop"}})", R"({"name":"/rowe/stop"})",
        R"({"topic":"/rowe/stop#7"})", R"(["service","/rowe/stop"])", R"({"service":"/rowe/st)"}) {
    EXPECT_FALSE(reads.may_be_stop(opcode::text, text)) << text;
  }
  EXPECT_FALSE(reads.may_be_stop(opcode::binary, R"({"service":"/rowe/stop"})"));
}

} // namespace
} // namespace codec_test
