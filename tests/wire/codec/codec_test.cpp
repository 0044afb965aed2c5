// SPDX-License-Identifier: Apache-2.0
// Every codec that is registered: what one end writes, the other one reads; what is refused, and how.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "wire/codec/own_names.hpp"
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
using test::received_binary;

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

TEST(codec, is_found_by_its_number) {
  for (const auto& [name, set] : all_sets()) {
    for (std::size_t i = 0; i < set.codecs.size(); ++i)
      EXPECT_EQ(&set.of(codec_id{static_cast<std::uint8_t>(i)}), set.codecs[i]);
    for (const codec* const used : {&set.messages, &set.calls_to_server, &set.envelope})
      EXPECT_EQ(&set.of(used->id()), used);
    for (const protocol& one : set.protocols) {
      EXPECT_EQ(&set.of(one.first.id()), &one.first);
      EXPECT_EQ(&set.of(one.topics.id()), &one.topics);
    }
  }
}

TEST(codec, of_a_connection_is_chosen_by_its_subprotocol) {
  EXPECT_FALSE(standard().find("").can.takes_messages);
  EXPECT_FALSE(standard().find("another.v1").can.takes_messages);
  EXPECT_TRUE(standard().find("rowe.v1").can.takes_messages);
  EXPECT_TRUE(protocols_of(websocket_profile::hop).find("").can.takes_messages);
  EXPECT_TRUE(numbers::protocols().find(numbers::subprotocol).can.listing);
  EXPECT_FALSE(numbers::protocols().find("").can.binary);
  EXPECT_TRUE(protocols_of(websocket_profile::hop).offers.empty());
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

TEST(codec, writes_replies_that_the_other_end_reads) {
  for_each_codec([](const codec& one, const protocol& by) {
    for (const std::string_view id_raw : {R"("7\/\u0061")", "7", "-3"}) {
      const call_origin asked{.service = "/add", .id_raw = id_raw};
      const std::string text =
          written([&](json::writer& out) { return one.write_reply(out, asked, body{R"({"sum":3})"}); });
      const std::string in_place = written([&](json::writer& out) {
        return one.write_reply(out, asked, body{[](json::writer& value) { value.raw(R"({"sum":3})"); }});
      });
      EXPECT_EQ(text, in_place);
      const received reply{by, text};
      ASSERT_EQ(reply.is, decoded::request) << text;
      EXPECT_EQ(reply.request.what, verb::reply);
      EXPECT_EQ(reply.request.codec, read_as(one));
      EXPECT_EQ(reply.request.id_raw, id_raw);
      EXPECT_FALSE(reply.request.failed);
      const auto sum = json::find(json::root(reply.request.body_raw).raw, "sum");
      EXPECT_TRUE(sum && sum->raw == "3");
    }
  });
}

TEST(codec, keeps_a_value_with_members_of_its_own_apart) {
  for_each_codec([](const codec& one, const protocol& by) {
    const received reply{by, written([&](json::writer& out) {
                           return one.write_reply(out, {.service = "/s", .id_raw = "7"},
                                                  body{R"({"in_reply_to":1,"op":2})"});
                         })};
    ASSERT_EQ(reply.is, decoded::request) << reply.text;
    EXPECT_EQ(reply.request.what, verb::reply);
    EXPECT_EQ(reply.request.id_raw, "7");
  });
}

TEST(codec, writes_failures_that_the_other_end_tells_apart) {
  for_each_codec([](const codec& one, const protocol& by) {
    std::array<char, no_service_bytes_max> buffer;
    const std::string_view unknown = no_service_diagnostic("/add", buffer);
    const std::pair<diagnostic, bool> cases[] = {{{.code = "no_service", .text = unknown}, true},
                                                 {{.code = "refused", .text = "not \"now\""}, false}};
    for (const auto& [why, unknown_service] : cases) {
      const received failure{by, written([&, w = why](json::writer& out) {
                               return one.write_failure(out, {.service = "/add", .id_raw = "7"}, w);
                             })};
      EXPECT_EQ(failure.request.what, verb::reply);
      EXPECT_EQ(failure.request.id_raw, "7");
      EXPECT_TRUE(failure.request.failed);
      std::array<char, 256> plain;
      const auto diagnostic = json::to_string(json::root(failure.request.body_raw), plain);
      ASSERT_TRUE(diagnostic);
      EXPECT_EQ(*diagnostic, why.text);
      EXPECT_EQ(one.means_no_service(failure.request, *diagnostic, "add"), unknown_service)
          << "with a slash or without";
    }
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

TEST(codec, has_room_for_the_longest_announcement) {
  const std::string worst(255, '\x01');
  for_each_server_codec([&](const codec& one) {
    for (const auto write :
         {&codec::write_subscription, &codec::write_advertisement, &codec::write_provision}) {
      std::vector<char> buffer(announcement_bytes_max);
      json::writer out{buffer};
      (one.*write)(out, {.name = worst, .type = worst});
      EXPECT_FALSE(out.overflowed());
    }
  });
}

TEST(codec, says_errors_to_clients_and_answers_servers_calls_only) {
  for_each_server_codec([](const codec& one) {
    const auto said = [&](const error_context& to) {
      return written(
          [&](json::writer& out) { return one.write_error(out, to, {.code = "refused", .text = "no"}); });
    };
    EXPECT_NE(said({.id_raw = "7"}), "");
    EXPECT_NE(said({}), "");
    EXPECT_EQ(said({.to_server = true}), "");
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

// ---- topics

struct enveloped {
  explicit enveloped(const protocol_set& of, std::string_view topic, std::string_view body) {
    std::vector<char> buffer(topic_head_bytes_max(topic.size()));
    json::writer head{buffer};
    of.envelope.write_topic_head(head, topic);
    EXPECT_FALSE(head.overflowed()) << topic.size();
    text.append(head.text()).append(body).append(of.envelope.topic_tail());
  }
  std::string text;
};

TEST(codec, puts_a_topics_message_into_the_shared_envelope) {
  for (const auto& [name, set] : all_sets()) {
    const received message{set.find(""), enveloped{set, "/a\"b", R"({"x":1})"}.text};
    ASSERT_EQ(message.is, decoded::request) << message.text;
    EXPECT_EQ(message.request.what, verb::publish);
    EXPECT_EQ(message.request.topic, "/a\"b");
    EXPECT_EQ(message.request.body_raw, R"({"x":1})");
  }
}

TEST(codec, has_room_for_the_longest_head) {
  for (const std::size_t bytes : {0U, 1U, 128U, 256U})
    (void)enveloped{standard(), std::string(bytes, '"'), "{}"};
}

TEST(codec, leaves_the_slash_of_a_topic_out_where_its_subscriber_does) {
  const std::string shared = enveloped{standard(), "/pose", R"({"x":1})"}.text;
  for (const bool unslashed : {false, true}) {
    const message_head head = standard().envelope.head_of({.unslashed = unslashed});
    ASSERT_LE(head.size, head.bytes.size());
    ASSERT_NE(head.from, 0);
    std::string text(head.size, '\0');
    std::memcpy(text.data(), head.bytes.data(), head.size);
    text += shared.substr(head.from);
    const received message{standard().find(""), text};
    EXPECT_EQ(message.request.topic, unslashed ? "pose" : "/pose");
    EXPECT_EQ(message.request.body_raw, R"({"x":1})");
  }
}

// ---- texts of two codecs

TEST(json_decoder, tells_codecs_apart_by_the_member_op) {
  const codec_id plain = standard().messages.id();
  const codec_id rosbridge = standard().calls_to_server.id();
  ASSERT_NE(plain, rosbridge);
  const std::pair<const char*, codec_id> texts[] = {{R"({"op":"subscribe","topic":"/t"})", rosbridge},
                                                    {R"({"topic":"/t","op":"subscribe"})", rosbridge},
                                                    {R"({"\u006fp":"subscribe","topic":"/t"})", rosbridge},
                                                    {R"({"a":1,"op":"nonsense"})", rosbridge},
                                                    {R"({"op":7})", plain},
                                                    {R"({"x":{"op":"publish"}})", plain},
                                                    {R"({"message_id":1})", plain},
                                                    {"{}", plain},
                                                    {"[1]", plain}};
  for (const auto& [text, codec] : texts)
    EXPECT_EQ(received(standard().find(""), text).request.codec, codec) << text;
}

TEST(json_decoder, refuses_with_a_code_a_diagnostic_and_the_id_of_the_answer) {
  struct refused {
    const char* text;
    decoded is;
    const char* code;
    const char* diagnostic;
    const char* id_raw;
  };
  constexpr refused table[] = {
      {"[1]", decoded::malformed, "not_an_object", "a message must be one JSON object", ""},
      {R"({"op":7,"message_id":3})", decoded::refused, "bad_request", R"(the member "op" must be a string)",
       "3"},
      {R"({"message_id":3,"ttl_ms":-1})", decoded::refused, "bad_request",
       R"(the member "ttl_ms" must not be negative; it is -1)", "3"},
      {R"({"in_reply_to":3,"ttl_ms":-1})", decoded::refused, "bad_request",
       R"(the member "ttl_ms" must not be negative; it is -1)", ""},
      {R"({"op":"subscribe","id":"s"})", decoded::refused, "bad_request",
       R"(subscribe: the member "topic" is missing)", R"("s")"},
  };
  for (const refused& row : table) {
    const received heard{standard().find(""), row.text};
    EXPECT_EQ(heard.is, row.is) << row.text;
    EXPECT_EQ(heard.why.code, row.code) << row.text;
    EXPECT_EQ(heard.why.text, row.diagnostic) << row.text;
    EXPECT_EQ(heard.request.id_raw, row.id_raw) << row.text;
  }
}

TEST(json_decoder, says_why_it_does_not_offer_an_operation) {
  const received png{standard().find(""), R"({"op":"png","id":1})"};
  EXPECT_EQ(png.is, decoded::request);
  EXPECT_EQ(png.request.what, verb::unsupported);
  EXPECT_TRUE(png.why.text.starts_with(R"(the operation "png" is not offered here)")) << png.why.text;
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

TEST(json_decoder, knows_no_binary_messages) {
  request into;
  diagnostic why;
  std::array<char, refusal::text_bytes_max> buffer;
  EXPECT_EQ(standard().find("").reads.decode_binary({}, {.scratch = {}, .diagnostic = buffer, .limits = {}},
                                                    into, why),
            decoded::unsupported);
}

// ---- a codec with numbers and binary messages

const protocol& by_number() { return numbers::protocols().find(numbers::subprotocol); }
const codec& numbered() { return numbers::protocols().of(numbers::id); }

TEST(numbers_codec, reads_what_its_clients_write) {
  const std::string id{"\0\xff\"\\", 4};
  const received_binary call{by_number(), "c" + numbers::four(70) + id + R"({"a":1})"};
  EXPECT_EQ(call.is, decoded::request);
  EXPECT_EQ(call.request.what, verb::call);
  EXPECT_EQ(call.request.codec, numbers::id);
  EXPECT_TRUE(call.request.by_number);
  EXPECT_EQ(call.request.service_number, 70U);
  EXPECT_EQ(call.request.id_raw, id);
  EXPECT_EQ(call.request.body_raw, R"({"a":1})");

  const received_binary published{by_number(), "p" + numbers::four(5) + "{}"};
  EXPECT_EQ(published.request.what, verb::publish);
  EXPECT_EQ(published.request.channel, 5U);
  EXPECT_TRUE(published.request.channel_is_peers);
  EXPECT_EQ(published.request.body_raw, "{}");

  const received subscribed{by_number(), R"({"want":[[7,300]]})"};
  EXPECT_EQ(subscribed.request.what, verb::subscribe);
  EXPECT_TRUE(subscribed.request.by_number);
  EXPECT_EQ(subscribed.request.tag, 7U);
  EXPECT_EQ(subscribed.request.channel, 300U);
  EXPECT_FALSE(subscribed.request.next);

  const received advertised{by_number(), R"({"offer":[[5,"\/cmd"],[6,"/b"]]})"};
  EXPECT_EQ(advertised.request.what, verb::advertise);
  EXPECT_FALSE(advertised.request.by_number);
  EXPECT_EQ(advertised.request.tag, 5U);
  EXPECT_EQ(advertised.request.topic, "/cmd");
  EXPECT_EQ(advertised.request.next.index, 1U) << "there is another one";
}

TEST(numbers_codec, refuses_what_nobody_understands) {
  for (const char* bytes : {"", "q", "p1234", "c1234567", "x"}) {
    const received_binary message{by_number(), bytes};
    EXPECT_EQ(message.is, decoded::malformed) << bytes;
    EXPECT_EQ(message.request.codec, numbers::id);
    EXPECT_FALSE(message.why.text.empty());
  }
  for (const char* text : {"{}", R"({"want":[]})", R"({"want":[[1]]})", R"({"want":[[1,-1]]})"}) {
    const received message{by_number(), text};
    EXPECT_EQ(message.is, decoded::refused) << text;
    EXPECT_FALSE(message.why.text.empty());
  }
  EXPECT_EQ((received{by_number(), "[1]"}.is), decoded::malformed);
}

TEST(numbers_codec, writes_binary_messages_that_its_clients_can_take_apart) {
  const auto frame = [](auto&& write) {
    std::array<char, 256> buffer;
    json::writer out{buffer};
    EXPECT_EQ(write(out), message_kind::binary);
    return std::string{out.text()};
  };
  const call_origin call{.service = "/add", .id_raw = "abcd"};
  EXPECT_EQ(frame([&](json::writer& out) { return numbered().write_reply(out, call, body{"{}"}); }),
            "rabcd{}");
  EXPECT_EQ(frame([&](json::writer& out) {
              return numbered().write_failure(out, call, {.code = "", .text = "no"});
            }),
            "fabcdno");
  EXPECT_EQ(frame([&](json::writer& out) { return numbered().write_hello(out, {.name = "robot"}); }),
            "hrobot");
  const listed two[] = {{.number = 1, .name = "/a"}, {.number = 300, .name = "/bc"}};
  EXPECT_EQ(frame([&](json::writer& out) { return numbered().write_topics(out, two, true); }),
            "T" + numbers::four(1) + numbers::four(2) + "/a" + numbers::four(300) + numbers::four(3) + "/bc");

  const message_head head = numbered().head_of({.tag = 7, .published_ns = 0x0102030405060708});
  EXPECT_EQ(head.as, message_kind::binary);
  EXPECT_EQ(head.from, 0) << "the body alone follows";
  const std::string_view bytes{reinterpret_cast<const char*>(head.bytes.data()), head.size};
  EXPECT_EQ(bytes, "m" + numbers::four(7) + "\x08\x07\x06\x05\x04\x03\x02\x01");
}

TEST(numbers_codec, sees_a_stop_by_its_number) {
  const message_decoder& reads = by_number().reads;
  EXPECT_TRUE(reads.may_be_stop(opcode::binary, "c" + numbers::four(1) + "abcd"));
  EXPECT_FALSE(reads.may_be_stop(opcode::binary, "c" + numbers::four(2) + "abcd"));
  EXPECT_FALSE(reads.may_be_stop(opcode::text, "c" + numbers::four(1) + "abcd"));
}

} // namespace
} // namespace codec_test
