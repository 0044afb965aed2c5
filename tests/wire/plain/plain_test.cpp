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

TEST(plain_decode, takes_ids_of_either_kind_as_they_stand) {
  for (const std::string raw : {R"("a\/\u0062\"")", "0", "-5", "9223372036854775807", "18446744073709551615",
                                R"("")", R"("0123456789012345678901")"}) {
    EXPECT_EQ(read("{\"message_id\":" + raw + "}")->id_raw, raw);
    EXPECT_EQ(read("{ \"in_reply_to\" : " + raw + " }")->id_raw, raw);
  }
}

std::int64_t ttl_of(const std::string& milliseconds) {
  return read("{\"ttl_ms\":" + milliseconds + "}")->ttl_ns;
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

} // namespace
} // namespace plain_test
} // namespace rowe::wire::plain
