// SPDX-License-Identifier: Apache-2.0
// The frame parser, by section of RFC 6455; the streams are written by frames.hpp, which shares nothing with
// it.
#include "wire/websocket/frame_parser.hpp"

#include <gtest/gtest.h>

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

TEST(frame_parser, delivers_a_whole_message_where_it_lies) {
  std::vector<std::byte> assembly(64);
  frame_parser parser;
  parser.reset(role::server, {.message_bytes_max = 64, .fragments_max = 4}, assembly);
  std::string stream = bytes_of(frame{.payload = "hello"});
  const std::span<std::byte> read{reinterpret_cast<std::byte*>(stream.data()), stream.size()};
  const frame_step step = parser.next(read);
  EXPECT_EQ(step.event, frame_event::text);
  EXPECT_EQ(step.consumed, stream.size());
  EXPECT_EQ(step.payload.data(), read.data() + 6);
  EXPECT_EQ(stream.substr(6), "hello");
}

TEST(frame_parser, gathers_a_message_of_several_reads_in_the_assembly_buffer) {
  std::vector<std::byte> assembly(64);
  frame_parser parser;
  parser.reset(role::server, {.message_bytes_max = 64, .fragments_max = 4}, assembly);
  std::string stream = bytes_of(frame{.payload = "hello"});
  const std::span<std::byte> read{reinterpret_cast<std::byte*>(stream.data()), stream.size()};
  EXPECT_EQ(parser.next(read.first(8)).event, frame_event::need_more);
  const frame_step step = parser.next(read.subspan(8));
  EXPECT_EQ(step.event, frame_event::text);
  EXPECT_EQ(step.payload.data(), assembly.data());
  EXPECT_EQ(step.payload.size(), 5U);
}

TEST(frame_parser, reads_lengths_at_every_boundary_of_their_forms) {
  for (const std::size_t length : {0U, 1U, 125U, 126U, 127U, 65535U, 65536U, 70000U}) {
    for (const role ours : {role::server, role::client}) {
      const std::string payload(length, 'x');
      receiver peer{ours, {.message_bytes_max = 70000, .fragments_max = 1}};
      const std::string stream = bytes_of(frame{.payload = payload, .masked = ours == role::server});
      EXPECT_EQ(peer.feed(stream), std::vector{text(payload)}) << length;
      EXPECT_EQ(peer.feed(stream.substr(0, 1)), std::vector<event>{});
      EXPECT_EQ(peer.feed(stream.substr(1)), std::vector{text(payload)}) << length;
      EXPECT_TRUE(peer.consistent());
    }
  }
}

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

TEST(frame_parser, refuses_reserved_bits) {
  for (unsigned bits = 1; bits < 8; ++bits) {
    EXPECT_TRUE(violates(bytes_of(frame{.payload = "x", .reserved = bits}), 1002));
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = ping_frame, .reserved = bits}), 1002));
  }
}

TEST(frame_parser, refuses_reserved_opcodes) {
  for (const unsigned code : {3U, 4U, 5U, 6U, 7U, 11U, 12U, 13U, 14U, 15U}) {
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .payload = "x"}), 1002)) << code;
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .final = false}), 1002)) << code;
  }
}

TEST(frame_parser, delivers_binary_messages_whatever_their_bytes) {
  const std::string every_byte = [] {
    std::string all;
    for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
    return all;
  }();
  receiver peer;
  EXPECT_EQ(peer.feed(bytes_of(frame{.opcode = binary_frame, .payload = every_byte})),
            std::vector{binary(every_byte)});
}

TEST(frame_parser, delivers_several_messages_of_one_read_in_order) {
  receiver peer;
  const std::string stream = bytes_of({{.payload = "one"},
                                       {.opcode = ping_frame, .payload = "?"},
                                       {.payload = ""},
                                       {.opcode = pong_frame},
                                       {.opcode = binary_frame, .payload = "two"}});
  EXPECT_EQ(peer.feed(stream), (std::vector{text("one"), ping("?"), text(""), pong(""), binary("two")}));
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
  const std::vector<frame> stream = {{.payload = "plain", .masked = false},
                                     {.payload = "masked"},
                                     {.opcode = ping_frame, .payload = "p", .masked = false},
                                     {.payload = std::string(300, 'x'), .masked = false},
                                     {.opcode = ping_frame, .payload = "q"}};
  const std::vector<event> expected = {text("plain"), text("masked"), ping("p"), text(std::string(300, 'x')),
                                       ping("q")};
  EXPECT_EQ(peer.feed(bytes_of(stream)), expected);
  receiver slow{role::server, lax};
  EXPECT_EQ(slow.feed_in_pieces(bytes_of(stream), [](std::size_t) { return 1; }), expected);
}

TEST(frame_parser, takes_fragments_of_which_some_are_masked_where_asked) {
  receiver peer{role::server, lax};
  EXPECT_EQ(peer.feed(bytes_of({{.payload = "ab", .final = false},
                                {.opcode = continuation, .payload = "cd", .final = false, .masked = false},
                                {.opcode = continuation, .payload = "ef"}})),
            std::vector<event>{text("abcdef")});
}

TEST(frame_parser, refuses_all_else_where_unmasked_frames_are_taken) {
  receiver server{role::server, lax};
  EXPECT_EQ(server.feed("\xc1\x01x")[0].what, frame_event::violation);
  receiver client{role::client, lax};
  EXPECT_EQ(client.feed(bytes_of(frame{.payload = "x"}))[0].what, frame_event::violation);
}

TEST(frame_parser, refuses_masked_frames_as_a_client) {
  EXPECT_TRUE(violates(bytes_of(frame{.payload = "x"}), 1002, role::client));
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = pong_frame}), 1002, role::client));
}

TEST(frame_parser, unmasks_with_every_kind_of_key) {
  for (const std::string& key :
       {std::string(4, '\0'), std::string("\xff\xff\xff\xff"), std::string("\0\x01\0\x02", 4)}) {
    receiver peer;
    EXPECT_EQ(peer.feed(bytes_of(frame{.payload = "0123456789abcdefg", .key = key})),
              std::vector{text("0123456789abcdefg")});
  }
}

// 5.4 Fragmentation

TEST(frame_parser, puts_fragments_together_and_delivers_control_frames_between_them) {
  const std::string stream = bytes_of({{.payload = "con", .final = false},
                                       {.opcode = ping_frame, .payload = "p1"},
                                       {.opcode = continuation, .payload = "", .final = false},
                                       {.opcode = pong_frame},
                                       {.opcode = continuation, .payload = "trol", .final = false},
                                       {.opcode = ping_frame, .payload = "p2"},
                                       {.opcode = continuation, .payload = " loop"},
                                       {.payload = "next"}});
  receiver peer;
  EXPECT_EQ(peer.feed(stream),
            (std::vector{ping("p1"), pong(""), ping("p2"), text("control loop"), text("next")}));
}

TEST(frame_parser, delivers_an_empty_message_of_empty_fragments) {
  const std::string stream = bytes_of({{.opcode = binary_frame, .final = false},
                                       {.opcode = continuation, .final = false},
                                       {.opcode = continuation}});
  receiver peer;
  EXPECT_EQ(peer.feed(stream), std::vector{binary("")});
}

TEST(frame_parser, refuses_a_continuation_of_nothing) {
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = continuation, .payload = "x"}), 1002));
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = continuation, .final = false}), 1002));
  EXPECT_TRUE(violates(bytes_of({{.payload = "whole"}, {.opcode = continuation, .payload = "x"}}), 1002,
                       role::server, {text("whole")}));
  EXPECT_TRUE(violates(bytes_of({{.payload = "a", .final = false},
                                 {.opcode = continuation, .payload = "b"},
                                 {.opcode = continuation, .payload = "c"}}),
                       1002, role::server, {text("ab")}));
}

TEST(frame_parser, refuses_a_message_inside_a_fragmented_one) {
  for (const unsigned code : {text_frame, binary_frame}) {
    for (const bool final : {false, true}) {
      EXPECT_TRUE(violates(
          bytes_of({{.payload = "a", .final = false}, {.opcode = code, .payload = "b", .final = final}}),
          1002));
    }
  }
}

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

TEST(frame_parser, takes_whole_messages_however_few_fragments_are_allowed) {
  receiver peer{role::server, {.message_bytes_max = 10, .fragments_max = 0}};
  EXPECT_EQ(peer.feed(bytes_of(frame{.payload = "x"})), std::vector{text("x")});
}

// 5.5 Control frames

TEST(frame_parser, delivers_control_frames_of_up_to_125_bytes) {
  for (const std::size_t length : {0U, 1U, 124U, 125U}) {
    const std::string payload(length, '\xff');
    receiver peer;
    const std::string stream =
        bytes_of({{.opcode = ping_frame, .payload = payload}, {.opcode = pong_frame, .payload = payload}});
    EXPECT_EQ(peer.feed(stream), (std::vector{ping(payload), pong(payload)}));
    EXPECT_EQ(peer.feed_in_pieces(stream, [](std::size_t) { return 1; }),
              (std::vector{ping(payload), pong(payload)}));
  }
}

TEST(frame_parser, refuses_control_frames_that_are_longer) {
  for (const unsigned code : {close_frame, ping_frame, pong_frame}) {
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .payload = std::string(126, 'x')}), 1002)) << code;
    EXPECT_TRUE(violates(header_of({.opcode = code}, 65536), 1002)) << code;
  }
}

TEST(frame_parser, refuses_control_frames_that_are_fragmented) {
  for (const unsigned code : {close_frame, ping_frame, pong_frame}) {
    EXPECT_TRUE(violates(bytes_of(frame{.opcode = code, .final = false}), 1002)) << code;
  }
}

// 5.5.1 and 7.4 Close

event closed(std::uint16_t code, std::string body, std::string reason) {
  return {frame_event::close, std::move(body), code, std::move(reason)};
}

TEST(frame_parser, reports_a_close_without_a_code_as_1005) {
  receiver peer;
  EXPECT_EQ(peer.feed(bytes_of(frame{.opcode = close_frame})), std::vector{closed(1005, "", "")});
}

TEST(frame_parser, reports_a_close_with_its_code_and_reason) {
  receiver peer;
  const std::string body = close_body(1000, "gr\xc3\xbc\xc3\x9f"sv);
  EXPECT_EQ(peer.feed(bytes_of(frame{.opcode = close_frame, .payload = body})),
            std::vector{closed(1000, body, "gr\xc3\xbc\xc3\x9f")});
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

TEST(frame_parser, refuses_a_close_body_of_one_byte) {
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = close_frame, .payload = "\x03"}), 1002));
}

TEST(frame_parser, refuses_a_close_reason_that_is_not_utf8) {
  EXPECT_TRUE(violates(bytes_of(frame{.opcode = close_frame, .payload = close_body(1000, "\xff"sv)}), 1007));
  EXPECT_TRUE(
      violates(bytes_of(frame{.opcode = close_frame, .payload = close_body(1000, "\xe2\x82"sv)}), 1007));
}

TEST(frame_parser, delivers_nothing_after_a_close) {
  const std::string stream = bytes_of({{.payload = "before"},
                                       {.opcode = close_frame},
                                       {.payload = "after"},
                                       {.opcode = ping_frame},
                                       {.opcode = 3}});
  receiver peer;
  EXPECT_EQ(peer.feed(stream), (std::vector{text("before"), closed(1005, "", "")}));
  EXPECT_EQ(peer.feed(bytes_of(frame{.payload = "later"})), std::vector<event>{});
  EXPECT_FALSE(peer.parser().mid_message());
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

TEST(frame_parser, takes_a_close_between_fragments) {
  receiver peer;
  EXPECT_EQ(peer.feed(bytes_of(
                {{.payload = "a", .final = false}, {.opcode = close_frame, .payload = close_body(1001)}})),
            std::vector{closed(1001, close_body(1001), "")});
  EXPECT_FALSE(peer.parser().mid_message());
}

TEST(frame_parser, delivers_nothing_after_a_violation) {
  EXPECT_TRUE(violates(bytes_of({{.payload = "a"}, {.opcode = 3}, {.payload = "b"}, {.opcode = close_frame}}),
                       1002, role::server, {text("a")}));
}

TEST(frame_parser, swallows_everything_before_it_was_reset) {
  frame_parser parser;
  std::string stream = bytes_of(frame{.payload = "x"});
  const frame_step step = parser.next({reinterpret_cast<std::byte*>(stream.data()), stream.size()});
  EXPECT_EQ(step.event, frame_event::need_more);
  EXPECT_EQ(step.consumed, stream.size());
}

TEST(frame_parser, is_as_new_after_reset) {
  receiver peer;
  (void)peer.feed(bytes_of({{.payload = "half", .final = false}, {.opcode = 3}}));
  std::vector<std::byte> assembly(8);
  peer.parser().reset(role::client, {.message_bytes_max = 8, .fragments_max = 2}, assembly);
  EXPECT_EQ(peer.feed(bytes_of({{.payload = "a", .final = false, .masked = false},
                                {.opcode = continuation, .payload = "b", .masked = false}})),
            std::vector{text("ab")});
}

// 8.1 UTF-8

TEST(frame_parser, accepts_a_character_that_is_cut_by_fragments_and_control_frames) {
  const std::string stream = bytes_of({{.payload = "\xf0", .final = false},
                                       {.opcode = ping_frame, .payload = "\xff"},
                                       {.opcode = continuation, .payload = "\x9f\x98", .final = false},
                                       {.opcode = continuation, .payload = "\x80"}});
  receiver peer;
  EXPECT_EQ(peer.feed(stream), (std::vector{ping("\xff"), text("\xf0\x9f\x98\x80")}));
}

TEST(frame_parser, refuses_text_that_is_not_utf8) {
  EXPECT_TRUE(violates(bytes_of(frame{.payload = "caf\xe9"}), 1007));
  EXPECT_TRUE(violates(bytes_of(frame{.payload = "\xed\xa0\x80"}), 1007));
  EXPECT_TRUE(violates(bytes_of(frame{.payload = "\xe2\x82"}), 1007)); // ends inside a character
  EXPECT_TRUE(violates(
      bytes_of({{.payload = "\xe2\x82", .final = false}, {.opcode = continuation, .payload = ""}}), 1007));
  EXPECT_TRUE(violates(
      bytes_of({{.payload = "\xe2\x82", .final = false}, {.opcode = continuation, .payload = "("}}), 1007));
}

TEST(frame_parser, refuses_bad_utf8_before_its_fragment_is_complete) {
  const std::string stream = bytes_of(frame{.payload = "\xce\xba\xf4\x90" + std::string(1000, 'x')});
  receiver peer;
  EXPECT_EQ(peer.feed(stream.substr(0, 8 + 3)), std::vector<event>{}); // header, three bytes
  const auto events = peer.feed(stream.substr(8 + 3, 1)); // f4 90: beyond U+10FFFF, whatever follows
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].code, 1007);
}

TEST(frame_parser, begins_utf8_anew_with_each_message) {
  receiver peer;
  EXPECT_EQ(peer.feed(bytes_of({{.opcode = binary_frame, .payload = "\xf0\x9f"}, {.payload = "ok"}})),
            (std::vector{binary("\xf0\x9f"), text("ok")}));
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

TEST(frame_parser, refuses_enormous_lengths_without_waiting_for_them) {
  for (const unsigned shift : {16U, 32U, 61U, 62U}) {
    EXPECT_TRUE(violates(header_of({}, std::uint64_t{1} << shift), 1009)) << shift;
  }
  EXPECT_TRUE(violates(header_of({}, ~std::uint64_t{0} >> 1U), 1009));
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

TEST(frame_parser, counts_neither_control_frames_nor_their_bytes_against_the_limits) {
  receiver peer{role::server, {.message_bytes_max = 2, .fragments_max = 2}};
  std::string stream = bytes_of(frame{.payload = "a", .final = false});
  std::vector<event> expected;
  for (int i = 0; i < 50; ++i) {
    stream += bytes_of(frame{.opcode = ping_frame, .payload = std::string(125, 'p')});
    expected.push_back(ping(std::string(125, 'p')));
  }
  stream += bytes_of(frame{.opcode = continuation, .payload = "b"});
  expected.push_back(text("ab"));
  EXPECT_EQ(peer.feed(stream), expected);
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

} // namespace
} // namespace frame_parser_test
} // namespace rowe::wire::test
