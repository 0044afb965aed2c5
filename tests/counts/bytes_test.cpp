// SPDX-License-Identifier: Apache-2.0
// What a message takes on the wire, to the byte: its text, the header of its frame, and the pings beside it.
#include "service/core/core_fixtures.hpp"

#include "service/outgoing/credit.hpp"

namespace harness {
namespace {

using rowe::service::credit;
using rowe::service::side;

constexpr std::string_view envelope = R"({"op":"publish","topic":"/t","msg":})";
constexpr std::size_t ping_frame = 2 + 16; // of a server

// A topic, and a peer that has heard all that was said before.
struct world {
  explicit world(side ours = side::server) : on{small_options(), ours}, one{on, ours} {
    one.say(R"({"op":"subscribe","topic":"/t"})");
    on.cycles(3);
    (void)one.hear();
  }

  core_harness on;
  rowe::detail::queue_pair& pair = on.offer(rowe::detail::pair_kind::publish_text, "/t", 2000, {.depth = 16});
  peer one;

  // Published in one cycle: `count` messages of so many bytes of text.
  std::size_t sent_for(std::size_t message_bytes, int count = 1) {
    const std::string text = R"({"x":")" + std::string(message_bytes - envelope.size() - 8, 'x') + "\"}";
    for (int i = 0; i < count; ++i) EXPECT_TRUE(publish_text(on, pair, text));
    on.cycle();
    return on.net.sent(one.id()).size();
  }
};

TEST(bytes, of_a_message_from_a_server_are_its_text_and_two_or_from_126_on_four) {
  for (const auto& [text, header] : {std::pair{60U, 2U}, {125U, 2U}, {126U, 4U}, {1000U, 4U}}) {
    world w;
    EXPECT_EQ(w.sent_for(text), text + header);
    EXPECT_EQ(w.one.hear().at(0).size(), text);
  }
}

TEST(bytes, of_a_message_from_a_client_are_four_more) {
  for (const auto& [text, header] : {std::pair{60U, 6U}, {125U, 6U}, {126U, 8U}, {1000U, 8U}}) {
    world w{side::client};
    EXPECT_EQ(w.sent_for(text), text + header);
    EXPECT_EQ(w.one.hear().at(0).size(), text);
  }
}

TEST(bytes, of_many_messages_are_those_of_each) {
  world w;
  EXPECT_EQ(w.sent_for(60, 16), 16U * 62U);
}

TEST(bytes, of_the_pings_beside_messages_are_at_most_six_in_a_thousand) {
  world w;
  std::size_t bytes = 0;
  for (int i = 0; i < 1000; ++i) {
    bytes += w.sent_for(300);
    ASSERT_EQ(w.one.hear().size(), 1U);
  }
  const auto pings = static_cast<std::size_t>(w.one.pings);
  EXPECT_EQ(bytes, 1000U * 304U + pings * ping_frame);
  // One goes early, the others where half of what may be in flight has been written since the last one.
  EXPECT_LE(pings, 1 + bytes / (credit::bytes_min_low_rtt / 2));
  EXPECT_GE(pings, 2U);
}

} // namespace
} // namespace harness
