// SPDX-License-Identifier: Apache-2.0
// The frame parser, by section of RFC 6455; the streams are written by frames.hpp, which shares nothing with
// it.
#include "wire/websocket/frame_parser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "wire/frames.hpp"

namespace rowe::wire::test {
namespace frame_parser_test {
namespace {

using namespace std::string_view_literals;

std::string close_body(unsigned code, std::string_view reason = {}) {
  std::string body{static_cast<char>(code >> 8U), static_cast<char>(code & 0xffU)};
  return body.append(reason);
}

// The one event that a stream causes, with the code.
::testing::AssertionResult violates(const std::string& stream, std::uint16_t code, role ours = role::server,
                                    std::vector<event> before = {}) {
  receiver whole{ours};
  const std::vector<event> events = whole.feed(stream);
  if (events.size() != before.size() + 1) return ::testing::AssertionFailure() << events.size() << " events";
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (events[i] != before[i]) return ::testing::AssertionFailure() << "event " << i << " is " << events[i];
  }
  if (events.back().what != frame_event::violation || events.back().code != code ||
      events.back().reason.empty()) {
    return ::testing::AssertionFailure() << "it ends in " << events.back();
  }
  receiver slow{ours};
  if (slow.feed_in_pieces(stream, [](std::size_t) { return 1; }) != events) {
    return ::testing::AssertionFailure() << "byte by byte it differs";
  }
  return whole.consistent() && slow.consistent() ? ::testing::AssertionSuccess()
                                                 : ::testing::AssertionFailure() << "check() fails";
}

// 5.2 Base framing

TEST(frame_parser, refuses_lengths_that_are_not_in_their_shortest_form) {
  for (const length_form form : {length_form::two_bytes, length_form::eight_bytes}) {
    EXPECT_TRUE(violates(bytes_of(frame{.payload = "x", .form = form}), 1002));
    EXPECT_TRUE(violates(bytes_of(frame{.payload = std::string(125, 'x'), .form = form}), 1002));
  }
  EXPECT_TRUE(violates(header_of({.form = length_form::eight_bytes}, 126), 1002));
  EXPECT_TRUE(violates(header_of({.form = length_form::eight_bytes}, 65535), 1002));
}

TEST(frame_parser, refuses_a_length_with_its_top_bit_set) {
  EXPECT_TRUE(violates(header_of({}, std::uint64_t{1} << 63U), 1002));
  EXPECT_TRUE(violates(header_of({}, ~std::uint64_t{0}), 1002));
}

TEST(frame_parser, refuses_reserved_opcodes) {
  for (const unsigned code : {3U, 4U, 5U, 6U, 7U, 11U, 12U, 13U, 14U, 15U}) {
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .payload = "x"}), 1002)) << code;
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .final = false}), 1002)) << code;
  }
}

// 5.1 and 5.3 Masking

TEST(frame_parser, refuses_unmasked_frames_as_a_server) {
  EXPECT_TRUE(violates(bytes_of(frame{.payload = "x", .masked = false}), 1002, role::server));
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = ping_frame, .masked = false}), 1002, role::server));
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = close_frame, .masked = false}), 1002, role::server));
}

constexpr frame_limits lax{.message_bytes_max = 4096, .fragments_max = 16, .unmasked_accepted = true};

TEST(frame_parser, takes_unmasked_frames_as_a_server_where_asked) {
  receiver peer{role::server, lax};
  const std::vector<frame> stream = {
      {.payload = "plain", .masked = false},
      {.payload = "masked"},
      {.opcode = ping_frame, .payload = "p", .masked = false},
      {.payload = std::string(300, 'x'), .masked = false},
      {.opcode = ping_frame, .payload = "q"},
      {.payload = "ab", .final = false},
      {.opcode = continuation, .payload = "cd", .final = false, .masked = false},
      {.opcode = continuation, .payload = "ef"}};
  const std::vector<event> expected = {text("plain"), text("masked"), ping("p"), text(std::string(300, 'x')),
                                       ping("q"),     text("abcdef")};
  EXPECT_EQ(peer.feed(bytes_of(stream)), expected);
  receiver slow{role::server, lax};
  EXPECT_EQ(slow.feed_in_pieces(bytes_of(stream), [](std::size_t) { return 1; }), expected);
}

TEST(frame_parser, refuses_all_else_where_unmasked_frames_are_taken) {
  receiver server{role::server, lax};
  EXPECT_EQ(server.feed("\xc1\x01x")[0].what, frame_event::violation);
  receiver client{role::client, lax};
  EXPECT_EQ(client.feed(bytes_of(frame{.payload = "x"}))[0].what, frame_event::violation);
}

// 5.4 Fragmentation

TEST(frame_parser, refuses_more_fragments_than_its_limit_and_none_fewer) {
  const auto fragmented = [](int count) {
    std::string stream;
    for (int i = 0; i < count; ++i) {
      stream += bytes_of(
          frame{.opcode = i == 0 ? binary_frame : continuation, .payload = "", .final = i == count - 1});
    }
    return stream;
  };
  receiver enough{role::server, {.message_bytes_max = 10, .fragments_max = 5}};
  EXPECT_EQ(enough.feed(fragmented(5)), std::vector{binary("")});
  EXPECT_EQ(enough.feed(fragmented(5)), std::vector{binary("")}); // the count begins anew with each message
  const std::vector<event> events = enough.feed(fragmented(6));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].what, frame_event::violation);
  EXPECT_EQ(events[0].code, 1008);
}

// 5.5 Control frames

TEST(frame_parser, refuses_control_frames_that_are_fragmented) {
  for (const unsigned code : {close_frame, ping_frame, pong_frame}) {
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .final = false}), 1002)) << code;
  }
}

// 5.5.1 and 7.4 Close

TEST(frame_parser, reports_a_close_without_a_code_as_1005) {
  receiver peer;
  EXPECT_EQ(peer.feed(bytes_of(frame{.opcode = close_frame})),
            (std::vector{event{frame_event::close, "", 1005, ""}}));
}

TEST(frame_parser, accepts_exactly_the_close_codes_that_may_be_sent) {
  for (unsigned code = 0; code < 65536; ++code) {
    const bool valid =
        (code >= 1000 && code <= 1003) || (code >= 1007 && code <= 1014) || (code >= 3000 && code <= 4999);
    receiver peer{role::client, {.message_bytes_max = 1, .fragments_max = 1}};
    const auto events =
        peer.feed(bytes_of(frame{.opcode = close_frame, .payload = close_body(code), .masked = false}));
    ASSERT_EQ(events.size(), 1U);
    ASSERT_EQ(events[0].what, valid ? frame_event::close : frame_event::violation) << code;
    ASSERT_EQ(events[0].code, valid ? code : 1002U) << code;
    ASSERT_EQ(close_code_is_valid(static_cast<std::uint16_t>(code)), valid) << code;
  }
}

TEST(frame_parser, consumes_what_stands_behind_a_close_or_a_violation) {
  for (const frame& last : {frame{.opcode = close_frame}, frame{.opcode = 3, .payload = "x"}}) {
    std::string stream = bytes_of({last, {.payload = "behind"}});
    frame_parser parser;
    parser.reset(role::server, {.message_bytes_max = 0, .fragments_max = 1}, {});
    EXPECT_EQ(parser.next({reinterpret_cast<std::byte*>(stream.data()), stream.size()}).consumed,
              stream.size());
  }
}

TEST(frame_parser, looks_at_a_message_in_many_pieces_in_many_steps) {
  std::string stream = bytes_of({{.payload = "a", .final = false}});
  for (int i = 0; i < 999; ++i) stream += bytes_of({{.opcode = 0, .payload = "b", .final = i == 998}});
  std::vector<std::byte> assembly(2000);
  frame_parser parser;
  parser.reset(role::server, {.message_bytes_max = 1000, .fragments_max = 1000}, assembly);
  std::span<std::byte> rest{reinterpret_cast<std::byte*>(stream.data()), stream.size()};
  std::size_t frames = 0, messages = 0;
  while (!rest.empty()) {
    const frame_step step = parser.next(rest);
    ASSERT_LE(step.frames, frame_parser::frames_in_step_max);
    ASSERT_NE(step.consumed, 0U);
    rest = rest.subspan(step.consumed);
    frames += step.frames;
    messages += step.event == frame_event::text;
  }
  EXPECT_EQ(frames, 1000U);
  EXPECT_EQ(messages, 1U);
}

// 8.1 UTF-8

TEST(frame_parser, refuses_bad_utf8_before_its_fragment_is_complete) {
  const std::string stream = bytes_of(frame{.payload = "\xce\xba\xf4\x90" + std::string(1000, 'x')});
  receiver peer;
  EXPECT_EQ(peer.feed(stream.substr(0, 8 + 3)), std::vector<event>{}); // header, three bytes
  const auto events = peer.feed(stream.substr(8 + 3, 1)); // f4 90: beyond U+10FFFF, whatever follows
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].code, 1007);
}

// 10.4 Limits

TEST(frame_parser, refuses_a_message_larger_than_its_limit_at_the_header) {
  receiver peer{role::server, {.message_bytes_max = 300, .fragments_max = 4}};
  EXPECT_EQ(peer.feed(bytes_of(frame{.payload = std::string(300, 'x')})),
            std::vector{text(std::string(300, 'x'))});
  const auto events = peer.feed(header_of({}, 301));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].what, frame_event::violation);
  EXPECT_EQ(events[0].code, 1009);
  EXPECT_EQ(events[0].reason, "a message of 301 bytes exceeds the limit message_bytes_max of 300: send less, "
                              "or raise it");
}

TEST(frame_parser, adds_fragments_up_against_the_limit) {
  receiver peer{role::server, {.message_bytes_max = 10, .fragments_max = 4}};
  EXPECT_EQ(peer.feed(bytes_of(
                {{.payload = "123456", .final = false}, {.opcode = continuation, .payload = "7890"}})),
            std::vector{text("1234567890")});
  EXPECT_EQ(peer.feed(bytes_of(frame{.payload = "123456", .final = false})), std::vector<event>{});
  const auto events = peer.feed(header_of({.opcode = continuation, .final = false}, 5));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].code, 1009);
  EXPECT_EQ(events[0].reason, "a message of 11 bytes or more exceeds the limit message_bytes_max of 10: send "
                              "less, or raise it");
}

TEST(frame_parser, is_mid_message_from_the_first_byte_to_the_last) {
  const std::string stream =
      bytes_of({{.payload = "ab", .final = false}, {.opcode = ping_frame}, {.opcode = continuation}});
  receiver peer;
  EXPECT_FALSE(peer.parser().mid_message());
  for (std::size_t i = 0; i < stream.size(); ++i) {
    (void)peer.feed(stream.substr(i, 1));
    EXPECT_EQ(peer.parser().mid_message(), i + 1 < stream.size()) << i;
  }
}

// However a stream is cut into reads

TEST(frame_parser, gives_the_same_events_for_random_streams_in_random_reads) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random{seed};
  const auto below = [&random](std::size_t bound) { return random() % bound; };
  for (int round = 0; round < 3000; ++round) {
    const role ours = below(2) == 0 ? role::server : role::client;
    std::string stream;
    bool open = false;
    for (std::size_t i = 0; i < 1 + below(8); ++i) {
      static constexpr unsigned control[] = {ping_frame, pong_frame, close_frame};
      frame f{.masked = ours == role::server};
      for (char& c : f.key) c = static_cast<char>(random() & 0xff);
      if (below(4) == 0) {
        f.opcode = below(10) == 0 ? control[2] : control[below(2)];
        f.payload = std::string(below(126), 'c');
      } else {
        f.opcode = open ? continuation : below(2) == 0 ? text_frame : binary_frame;
        f.final = below(2) == 0;
        open = !f.final;
        f.payload = std::string(below(3) == 0 ? below(3000) : below(20), 'd');
        if (below(3) == 0) f.payload += "\xe2\x82\xac";
      }
      if (below(40) == 0) f.opcode = static_cast<unsigned>(below(16));
      stream += bytes_of(f);
    }
    if (below(4) == 0) stream[below(stream.size())] ^= static_cast<char>(1U << below(8));
    receiver whole{ours};
    const auto expected = whole.feed(stream);
    receiver cut{ours};
    const std::size_t most = 1 + below(64);
    ASSERT_EQ(cut.feed_in_pieces(stream, [&](std::size_t left) { return std::min(left, 1 + below(most)); }),
              expected);
    ASSERT_TRUE(whole.consistent() && cut.consistent());
  }
}

} // namespace
} // namespace frame_parser_test
} // namespace rowe::wire::test
