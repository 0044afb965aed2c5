// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/console.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace rowe::tools {
namespace console_test {
namespace {

std::string said(const log_style& style, severity how, std::string_view message,
                 std::string_view members = {}, bool quiet = false) {
  console to{"serve"};
  to.write_as(style);
  to.be_quiet(quiet);
  testing::internal::CaptureStderr();
  to.say(how, message, members);
  return testing::internal::GetCapturedStderr();
}

TEST(printable, keeps_what_is_utf8_and_replaces_what_is_not) {
  for (const char* const text : {"plain", "µs", "\u20ac", "\U0001f916", "\u07ff\u0800\uffff"})
    EXPECT_EQ(printable(text), text);
  for (const char* const text : {"\xc2", "\xe2\x82", "\xf0\x9f\xa4", "\xff", "\x80", "\xc0\xaf",
                                 "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80"}) {
    const std::string shown = printable(std::string{"a"} + text + "b");
    EXPECT_TRUE(shown.starts_with("a\ufffd")) << shown;
    EXPECT_TRUE(shown.ends_with("b")) << shown;
  }
  EXPECT_EQ(printable("cut \xe2\x82"), "cut \ufffd\ufffd");
}

TEST(printable, shows_control_characters) {
  EXPECT_EQ(printable("a\x1b[2J\n\x7f\u009b"), "a\\u001b[2J\\u000a\\u007f\\u009b");
}

TEST(printable, shows_what_makes_a_text_look_like_another) {
  EXPECT_EQ(printable("a\u2028b\u202ec\u200bd\ufeff"), "a\\u2028b\\u202ec\\u200bd\\ufeff");
  EXPECT_EQ(printable("a\u3164b\u00a0c\u3000d\u2003"), "a\\u3164b\\u00a0c\\u3000d\\u2003");
  EXPECT_EQ(printable("\U000e0041"), "\\udb40\\udc41");
}

TEST(sentence_of, begins_with_the_sender_whatever_the_event_says) {
  using kind = event::kind;
  for (const kind one : {kind::peer_joined, kind::peer_left, kind::refused_handshake, kind::cannot_connect,
                         kind::refused_request, kind::status_from_peer, kind::limit, kind::warning,
                         kind::stop, kind::denied}) {
    event happened;
    happened.what_kind = one;
    happened.peer = "10.9.9.9:4444";
    happened.what = "' 10.0.0.1:80: supervisor: stop: reset\u2028 (10.9.9.9:4444)";
    happened.identity = "driver";
    const std::string line = sentence_of(happened, with_kind::yes);
    EXPECT_TRUE(line.starts_with("10.9.9.9:4444: driver: ")) << line;
    EXPECT_EQ(line.find("\u2028"), line.npos) << line;
    const std::string kind_of_it = line.substr(23, line.find(':', 23) - 23);
    EXPECT_EQ(kind_of_it.find_first_not_of("abcdefghijklmnopqrstuvwxyz "), kind_of_it.npos) << line;
    EXPECT_FALSE(kind_of_it.empty());
    if (one == kind::status_from_peer) {
      EXPECT_TRUE(line.starts_with("10.9.9.9:4444: driver: says: '\\' 10.0.0.1:80")) << line;
      EXPECT_TRUE(line.ends_with("'")) << line;
      happened.what = "\\' ends";
      EXPECT_TRUE(sentence_of(happened, with_kind::yes).ends_with(R"('\\\' ends')"));
    }
  }
}

TEST(console, writes_one_line_with_the_verb) {
  EXPECT_EQ(said({}, severity::info, "hello", "\"a\":1"), "rowe serve: hello\n");
}

TEST(console, writes_an_object_if_asked) {
  const std::string line = said({.json = true}, severity::warning, "a \"b\"\n", "\"peer\":\"x\"");
  EXPECT_TRUE(line.starts_with("{\"time\":\"20")) << line;
  EXPECT_TRUE(line.ends_with(R"(Z","severity":"warning","program":"rowe serve","message":"a \"b\"\u000a",)"
                             R"("peer":"x"})"
                             "\n"))
      << line;
}

TEST(console, writes_priorities_in_front_if_asked) {
  EXPECT_EQ(said({.priorities = true}, severity::error, "no"), "<3>rowe serve: no\n");
  EXPECT_TRUE(said({.json = true, .priorities = true}, severity::notice, "no").starts_with("<5>{\"time\""));
}

TEST(console, leaves_out_notices_when_it_is_to_be_quiet) {
  EXPECT_EQ(said({}, severity::notice, "no", {}, true), "");
  EXPECT_EQ(said({}, severity::info, "no", {}, true), "");
  EXPECT_EQ(said({}, severity::warning, "no", {}, true), "rowe serve: no\n");
}

} // namespace
} // namespace console_test
} // namespace rowe::tools
