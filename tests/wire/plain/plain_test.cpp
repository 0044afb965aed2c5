// SPDX-License-Identifier: Apache-2.0
#include "wire/plain/plain.hpp"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "wire/codec/object_form.hpp"
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
    op_member op{};
    wrong_ = decode(text_, scratch_, limits, request_, op);
  }
  decoded(const decoded&) = delete;

  const request* operator->() const {
    EXPECT_FALSE(wrong_) << text_ << ": " << diagnostic();
    return &request_;
  }
  std::string diagnostic() const {
    std::array<char, refusal::text_bytes_max> buffer{};
    return wrong_ ? std::string{wrong_->text(buffer)} : "it is not refused";
  }

 private:
  std::string text_;
  std::array<char, scratch_bytes(limits)> scratch_{};
  request request_;
  std::optional<refusal> wrong_;
};

decoded read(std::string text) { return decoded{std::move(text)}; }
std::string diagnostic_for(std::string text) { return read(std::move(text)).diagnostic(); }

// Reading

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

} // namespace
} // namespace plain_test
} // namespace rowe::wire::plain
