// SPDX-License-Identifier: Apache-2.0
#include "wire/plain/plain.hpp"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "wire/codec/object_form.hpp"
#include "json/encoded.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire::plain {
namespace plain_test {
namespace {

constexpr name_limits limits{.name_bytes_max = 16, .id_bytes_max = 24};

bool is_json(std::string_view text) {
  std::string padded{text};
  padded.append(json::reader::tailroom_bytes, '\xff');
  auto reader = json::reader::create(4096);
  return reader->validate(std::string_view{padded}.substr(0, text.size())).has_value();
}

// A text with what became of it.
class decoded {
 public:
  explicit decoded(std::string text) : text_{std::move(text)} {
    EXPECT_TRUE(is_json(text_)) << text_;
    wrong_ = decode(text_, scratch_, limits, request_, op_);
  }
  decoded(const decoded&) = delete;

  const request* operator->() const {
    EXPECT_FALSE(wrong_) << text_ << ": " << diagnostic();
    return &request_;
  }
  const request& as_far_as_read() const { return request_; }
  op_member op() const { return op_; }
  std::string diagnostic() const {
    std::array<char, refusal::text_bytes_max> buffer{};
    return wrong_ ? std::string{wrong_->text(buffer)} : "it is not refused";
  }

 private:
  std::string text_;
  std::array<char, scratch_bytes(limits)> scratch_{};
  request request_;
  op_member op_{};
  std::optional<refusal> wrong_;
};

decoded read(std::string text) { return decoded{std::move(text)}; }
std::string diagnostic_for(std::string text) { return read(std::move(text)).diagnostic(); }

// Reading

TEST(plain_decode, reads_the_papers_invocation_and_its_reply) {
  const decoded invocation{R"({"service":"add-two-numbers","a":38,"b":4,"message_id":"7.a"})"};
  EXPECT_EQ(invocation->what, verb::call);
  EXPECT_EQ(invocation->id_raw, R"("7.a")");
  EXPECT_EQ(invocation->service, "add-two-numbers");
  EXPECT_EQ(invocation->ttl_ns, unlimited);
  const decoded reply{R"({"result":42,"in_reply_to":"7.a"})"};
  EXPECT_EQ(reply->what, verb::reply);
  EXPECT_EQ(reply->id_raw, R"("7.a")");
  EXPECT_FALSE(reply->failed);
}

TEST(plain_decode, takes_everything_else_for_a_message) {
  for (const char* text :
       {"{}", R"({"x":1,"service":"/lamp"})", "[]", "7", "\"message_id\"", "null", R"([{"message_id":1}])",
        R"({"x":{"message_id":1,"in_reply_to":2,"ttl_ms":-1}})"}) {
    const decoded d{text};
    EXPECT_EQ(d->what, verb::message) << text;
    EXPECT_EQ(d->id_raw, "");
    EXPECT_EQ(d->service, "");
    EXPECT_EQ(d->ttl_ns, unlimited);
  }
}

TEST(plain_decode, says_what_the_first_member_named_op_is) {
  const std::pair<const char*, op_member> texts[] = {{R"({"x":1,"op":"publish"})", op_member::text},
                                                     {R"({"x":1,"\u006fp":"publish"})", op_member::text},
                                                     {R"( {"op":"publish","op":1} )", op_member::text},
                                                     {R"({"op":1,"op":"publish"})", op_member::other},
                                                     {R"({"op":null,"message_id":1})", op_member::other},
                                                     {R"({"x":{"op":"publish"}})", op_member::none},
                                                     {R"(["op"])", op_member::none},
                                                     {R"("op")", op_member::none}};
  for (const auto& [text, op] : texts) EXPECT_EQ(decoded{text}.op(), op) << text;
}

TEST(plain_decode, takes_an_object_with_both_ids_for_a_reply) {
  const decoded d{R"({"message_id":2,"in_reply_to":1,"service":"/s"})"};
  EXPECT_EQ(d->what, verb::reply);
  EXPECT_EQ(d->id_raw, "1");
  EXPECT_EQ(d->service, "");
}

TEST(plain_decode, takes_ids_of_either_kind_as_they_stand) {
  for (const std::string raw : {R"("a\/\u0062\"")", "0", "-5", "9223372036854775807", "18446744073709551615",
                                R"("")", R"("0123456789012345678901")"}) {
    EXPECT_EQ(read("{\"message_id\":" + raw + "}")->id_raw, raw);
    EXPECT_EQ(read("{ \"in_reply_to\" : " + raw + " }")->id_raw, raw);
  }
}

TEST(plain_decode, understands_escapes_in_names_and_services) {
  const decoded d{R"({"m\u0065ssage_id":1,"s\u0065rvice":"\/caf\u00e9","ttl\u005fms":1})"};
  EXPECT_EQ(d->id_raw, "1");
  EXPECT_EQ(d->service, "/caf\xc3\xa9");
  EXPECT_EQ(d->ttl_ns, 1'000'000);
}

TEST(plain_decode, leaves_a_service_that_is_no_string_to_the_users) {
  EXPECT_EQ(read(R"({"message_id":1,"service":{"name":"x"}})")->service, "");
  EXPECT_EQ(read(R"({"message_id":1,"service":7})")->service, "");
}

TEST(plain_decode, looks_at_a_service_only_in_an_invocation) {
  for (const char* text : {R"({"service":"012345678901234567"})", R"({"service":"","service":1})",
                           R"({"in_reply_to":1,"service":"a\nb"})"}) {
    EXPECT_EQ(read(text)->service, "") << text;
  }
}

std::int64_t ttl_of(const std::string& milliseconds) {
  return read("{\"ttl_ms\":" + milliseconds + "}")->ttl_ns;
}

TEST(plain_decode, takes_a_time_to_live_in_milliseconds) {
  EXPECT_EQ(ttl_of("0"), 0);
  EXPECT_EQ(ttl_of("-0.0"), 0);
  EXPECT_EQ(ttl_of("250"), 250'000'000);
  EXPECT_EQ(ttl_of("0.5"), 500'000);
  EXPECT_EQ(ttl_of("1e-9"), 0);
  EXPECT_EQ(ttl_of("9e12"), 9'000'000'000'000'000'000);
}

TEST(plain_decode, takes_a_time_to_live_that_no_clock_can_hold_for_none) {
  EXPECT_EQ(ttl_of("9.3e12"), unlimited);
  EXPECT_EQ(ttl_of("1e300"), unlimited);
  EXPECT_EQ(ttl_of("99999999999999999999"), unlimited);
}

TEST(plain_decode, tells_a_refusal_from_an_ordinary_reply) {
  const decoded failed{
      R"({"error":{"code":"no_s\u0065rvice","text":"there is \"none\""},"in_reply_to":"7"})"};
  EXPECT_TRUE(failed->failed);
  EXPECT_EQ(failed->code, "no_service");
  EXPECT_EQ(failed->body_raw, R"("there is \"none\"")");
  const decoded wordless{R"({"in_reply_to":1,"error":{"code":"x"}})"};
  EXPECT_TRUE(wordless->failed);
  EXPECT_EQ(wordless->body_raw, "");
  EXPECT_EQ(read(R"({"in_reply_to":1,"error":{"code":"x","text":7}})")->body_raw, "");
}

TEST(plain_decode, leaves_other_errors_to_the_users) {
  const std::string long_code(code_bytes_max + 1, 'c');
  for (const std::string& error : {std::string{"null"}, std::string{R"("code")"}, std::string{"{}"},
                                   std::string{R"(["code"])"}, std::string{R"({"code":404,"text":"x"})"},
                                   std::string{R"({"code":""})"}, R"({"code":")" + long_code + "\"}"}) {
    const decoded d{"{\"in_reply_to\":1,\"error\":" + error + "}"};
    EXPECT_EQ(d->what, verb::reply);
    EXPECT_FALSE(d->failed) << error;
  }
  EXPECT_FALSE(read(R"({"error":{"code":"x","text":"y"}})")->failed);
  EXPECT_FALSE(read(R"({"message_id":1,"error":{"code":"x"},"error":1})")->failed);
}

struct wrong {
  const char* text;
  const char* diagnostic;
};

TEST(plain_decode, refuses_with_a_diagnostic_that_names_member_value_and_limit) {
  constexpr wrong table[] = {
      {R"({"message_id":1.5})", R"(the member "message_id" must be a string or an integer; it is 1.5)"},
      {R"({"message_id":null})", R"(the member "message_id" must be a string or an integer; it is null)"},
      {R"({"message_id":{}})", R"(the member "message_id" must be a string or an integer; it is {})"},
      {R"({"message_id":99999999999999999999})",
       R"(the member "message_id" must be a string or an integer; it is 99999999999999999999)"},
      {R"({"in_reply_to":true})", R"(the member "in_reply_to" must be a string or an integer; it is true)"},
      {R"({"in_reply_to":1,"message_id":[]})",
       R"(the member "message_id" must be a string or an integer; it is [])"},
      {R"({"message_id":"01234567890123456789012"})",
       R"(the member "message_id" is 25 bytes long; the limit is 24)"},
      {R"({"in_reply_to":"01234567890123456789012"})",
       R"(the member "in_reply_to" is 25 bytes long; the limit is 24)"},
      {R"({"message_id":1,"message_id":1})", R"(the member "message_id" is there twice)"},
      {R"({"message_id":1,"m\u0065ssage_id":2})", R"(the member "message_id" is there twice)"},
      {R"({"in_reply_to":1,"x":1,"in_reply_to":1})", R"(the member "in_reply_to" is there twice)"},
      {R"({"ttl_ms":1,"ttl_ms":1})", R"(the member "ttl_ms" is there twice)"},
      {R"({"message_id":1,"service":"a","service":"b"})", R"(the member "service" is there twice)"},
      {R"({"in_reply_to":1,"error":{},"error":1})", R"(the member "error" is there twice)"},
      {R"({"message_id":1,"service":""})", R"(the member "service" must not be empty)"},
      {R"({"message_id":1,"service":"01234567890123456"})",
       R"(the member "service" is 17 bytes long; the limit is 16)"},
      {R"({"message_id":1,"service":"a\tb"})",
       R"(the member "service" must have no control characters; it is "a\tb")"},
      {R"({"op":7,"message_id":1})", R"(the member "op" must be a string)"},
      {R"({"ttl_ms":-1})", R"(the member "ttl_ms" must not be negative; it is -1)"},
      {R"({"ttl_ms":"5"})", R"(the member "ttl_ms" must be a number of milliseconds; it is "5")"},
      {R"({"message_id":1,"ttl_ms":null})",
       R"(the member "ttl_ms" must be a number of milliseconds; it is null)"},
  };
  for (const wrong& row : table) EXPECT_EQ(diagnostic_for(row.text), row.diagnostic) << row.text;
}

TEST(plain_decode, keeps_the_id_for_the_answer_to_a_refusal) {
  const decoded service{R"({"service":"","message_id":"a"})"};
  EXPECT_EQ(service.as_far_as_read().what, verb::call);
  EXPECT_EQ(service.as_far_as_read().id_raw, R"("a")");
  const decoded twice{R"({"ttl_ms":1,"ttl_ms":1,"message_id":5})"};
  EXPECT_EQ(twice.as_far_as_read().id_raw, "5");
  const decoded reply{R"({"in_reply_to":1,"message_id":2,"ttl_ms":-1})"};
  EXPECT_EQ(reply.as_far_as_read().what, verb::reply);
  EXPECT_EQ(reply.as_far_as_read().id_raw, "");
  const decoded which{R"({"message_id":5,"message_id":6})"};
  EXPECT_EQ(which.as_far_as_read().what, verb::call);
  EXPECT_EQ(which.as_far_as_read().id_raw, "");
}

TEST(plain_decode, never_cuts_a_diagnostic_within_the_room_it_asks_for) {
  const std::string long_text(200, 'v');
  for (int kind = 0; kind <= static_cast<int>(refusal::kind::bad_characters); ++kind) {
    const refusal worst{.what = static_cast<refusal::kind>(kind),
                        .member = "in_reply_to",
                        .value = long_text,
                        .expected = "a string or an integer",
                        .bytes = SIZE_MAX / 2,
                        .limit = SIZE_MAX / 2};
    std::array<char, refusal::text_bytes_max> buffer{};
    std::array<char, 4096> plenty{};
    EXPECT_EQ(worst.text(buffer), worst.text(plenty));
    EXPECT_EQ(worst.text(std::span{buffer}.first(10)).size(), 10U);
  }
}

TEST(plain_reserved, finds_the_member_that_a_user_may_not_use) {
  EXPECT_EQ(find_reserved(R"({"a":1,"op":2})"), 7U);
  EXPECT_EQ(find_reserved(R"( { "message_id":1})"), 3U);
  EXPECT_EQ(find_reserved(R"({"in_reply_to":1})"), 1U);
  EXPECT_EQ(find_reserved(R"({"\u006fp":1})"), 1U);
}

TEST(plain_reserved, finds_nothing_in_what_is_free_to_use) {
  for (const char* text : {"{}", R"({"service":"x","ttl_ms":1,"error":1,"Op":1,"opp":1})",
                           R"({"x":{"op":1}})", R"(["op"])", R"("op")", "7"}) {
    EXPECT_FALSE(find_reserved(text)) << text;
  }
}

// Writing

template <class Write>
std::string written(Write write) {
  std::array<char, 1024> buffer{};
  json::writer w{buffer};
  write(w);
  EXPECT_FALSE(w.overflowed());
  EXPECT_TRUE(is_json(w.text())) << w.text();
  return std::string{w.text()};
}

std::string invocation(std::string_view object, std::string_view id) {
  return written([&](json::writer& w) { write_invocation(w, object, id); });
}

TEST(plain_write, adds_an_id_to_an_object) {
  EXPECT_EQ(invocation(R"({"service":"add","a":38})", "7"), R"({"service":"add","a":38,"message_id":"7"})");
  EXPECT_EQ(invocation("{}", "7"), R"({"message_id":"7"})");
  EXPECT_EQ(invocation("{ \n}", "7"), R"({"message_id":"7"})");
  EXPECT_EQ(invocation("{ \"a\" : {} \n}", "7"), R"({ "a" : {},"message_id":"7"})");
  EXPECT_EQ(invocation("[1]", "7"), R"({"args":[1],"message_id":"7"})");
}

std::string call(std::string_view body) {
  return written([&](json::writer& w) { write_call(w, "/a\"dd", "7.1", {.text = body}); });
}

TEST(plain_write, writes_a_call_around_its_body) {
  EXPECT_EQ(call(R"({"a":1,"b":[2]})"), R"({"service":"/a\"dd","a":1,"b":[2],"message_id":"7.1"})");
  EXPECT_EQ(call("{}"), R"({"service":"/a\"dd","message_id":"7.1"})");
  EXPECT_EQ(call("5"), R"({"service":"/a\"dd","args":5,"message_id":"7.1"})");
}

TEST(plain_write, writes_a_reply_around_its_body) {
  const auto reply = [](std::string_view value) {
    return written([value](json::writer& w) { write_reply(w, R"("i\/d")", body{value}); });
  };
  EXPECT_EQ(reply(R"({"sum":42})"), R"({"sum":42,"in_reply_to":"i\/d"})");
  EXPECT_EQ(reply("{}"), R"({"in_reply_to":"i\/d"})");
  EXPECT_EQ(reply("42"), R"({"result":42,"in_reply_to":"i\/d"})");
  EXPECT_EQ(reply("[{}]"), R"({"result":[{}],"in_reply_to":"i\/d"})");
  EXPECT_EQ(written([](json::writer& w) {
              write_reply(w, "7", body{[](json::writer& into) {
                            into.begin_object();
                            into.member("sum", 42);
                            into.end_object();
                          }});
            }),
            R"({"sum":42,"in_reply_to":7})");
}

TEST(plain_write, writes_an_error_with_and_without_an_id) {
  EXPECT_EQ(written([](json::writer& w) { write_error(w, "7", "no_service", "a \"b\""); }),
            R"({"error":{"code":"no_service","text":"a \"b\""},"in_reply_to":7})");
  EXPECT_EQ(written([](json::writer& w) { write_error(w, "", "malformed", "x"); }),
            R"({"error":{"code":"malformed","text":"x"}})");
}

std::string delivered(std::string_view args) {
  return written([args](json::writer& w) { write_delivered_call(w, "/add", args, "7"); });
}

TEST(plain_write, delivers_a_rosbridge_call_as_an_invocation) {
  EXPECT_EQ(delivered(R"({"a":1,"b":2})"), R"({"service":"/add","a":1,"b":2,"message_id":"7"})");
  EXPECT_EQ(delivered("{}"), R"({"service":"/add","message_id":"7"})");
  EXPECT_EQ(delivered(""), R"({"service":"/add","message_id":"7"})");
  EXPECT_EQ(delivered("[1,2]"), R"({"service":"/add","args":[1,2],"message_id":"7"})");
}

TEST(plain_write, keeps_arguments_apart_that_would_be_mistaken_for_the_envelope) {
  for (const std::string name : {"service", "op", "message_id", "in_reply_to", "m\\u0065ssage_id"}) {
    const std::string args = R"({"a":1,")" + name + R"(":2})";
    EXPECT_EQ(delivered(args), R"({"service":"/add","args":)" + args + R"(,"message_id":"7"})");
  }
}

TEST(plain_write, keeps_bodies_apart_that_have_its_own_members) {
  for (const std::string name : {"service", "op", "message_id", "in_reply_to", "m\\u0065ssage_id"}) {
    const std::string object = R"({"a":1,")" + name + R"(":2})";
    EXPECT_EQ(call(object), R"({"service":"/a\"dd","args":)" + object + R"(,"message_id":"7.1"})");
    const std::string replied = written([&](json::writer& w) { write_reply(w, "7", body{object}); });
    EXPECT_EQ(replied, name == "service" ? R"({"a":1,"service":2,"in_reply_to":7})"
                                         : R"({"result":)" + object + R"(,"in_reply_to":7})");
  }
}

TEST(plain_write, writes_what_it_can_read) {
  const std::string service = "/\xc3\xa9\"\\/x";
  const decoded called{
      written([&](json::writer& w) { write_call(w, service, "i\"d", {.text = R"({"ttl_ms":5})"}); })};
  EXPECT_EQ(called->what, verb::call);
  EXPECT_EQ(called->service, service);
  EXPECT_EQ(called->id_raw, R"("i\"d")");
  EXPECT_EQ(called->ttl_ns, 5'000'000);
  const decoded answered{
      written([&](json::writer& w) { write_error(w, called->id_raw, "expired", "late"); })};
  EXPECT_EQ(answered->what, verb::reply);
  EXPECT_EQ(answered->id_raw, called->id_raw);
  EXPECT_EQ(answered->code, "expired");
  EXPECT_EQ(answered->body_raw, R"("late")");
}

TEST(plain_write, writes_all_or_says_that_it_does_not_fit) {
  const auto all = [](json::writer& w) {
    w.begin_array();
    write_invocation(w, R"({"a":1})", "7");
    write_call(w, "/s", "7", {.text = R"({"a":1})"});
    write_reply(w, "7", body{"42"});
    write_error(w, "7", "a", "b");
    write_delivered_call(w, "/s", R"({"a":1})", "7");
    w.end_array();
  };
  const std::string whole = written(all);
  for (std::size_t bytes = 0; bytes < whole.size() + 2; ++bytes)
    tests::expect_written_within(bytes, whole, all);
}

} // namespace
} // namespace plain_test
} // namespace rowe::wire::plain
