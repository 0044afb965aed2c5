// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/ingress.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "service/incoming/reading_parts.hpp"

namespace ingress_test {
namespace {

using namespace reading_parts;
using texts = std::vector<std::string>;

constexpr std::string_view stop = R"({"op":"call_service","service":"/rowe/stop"})";

rowe::endpoint_options few() {
  rowe::endpoint_options options;
  options.limits.connections_max = 3;
  options.limits.handles_max = 1;
  options.limits.message_bytes_max = 60 * 1024;
  options.limits.door_slots = 4;
  return options;
}

struct ingress_test : reading_parts::reading_parts {
  ingress_test() : reading_parts{few()} {}

  connection& first = arrive();
  connection& second = arrive();

  static peer_index index(const connection& c) { return {c.id.index}; }
  // From now on the receiver has no room, or has it again.
  void refuse_all() {
    (void)threads_inbox.try_receive(cycle.now); // there is a receiver, which takes nothing
    rowe::detail::value_header header;
    header.expires_ns = rowe::rt::nanoseconds_of(rowe::rt::never);
    while (inbox.deliver(header, "{}")) {
    }
    handler.takes = [](peer_index, std::string_view) { return false; };
  }
  void admit_all() {
    while (const auto slot = threads_inbox.try_receive(cycle.now))
      (void)threads_inbox.release(*slot); // nobody waits
    ++cycle.places_freed;
    handler.takes = {};
  }
  void unpark() {
    in.unpark();
    in.read_in_turn();
  }
};

// Each message that begins with "w" is work of forty units.
struct working : ingress_test {
  working() {
    handler.takes = [this](peer_index, std::string_view text) {
      if (text.starts_with('w')) cycle.work_bytes += 39 * rowe::service::read_work_bytes;
      return true;
    };
  }
  std::size_t count(std::string_view what) const {
    return static_cast<std::size_t>(std::count(handler.heard.begin(), handler.heard.end(), what));
  }
  void turns(int count) {
    for (int i = 0; i < count; ++i) in.read_in_turn();
    EXPECT_TRUE(in.check());
  }
};

TEST_F(working, who_orders_much_work_has_fewer_turns) {
  std::string light, heavy;
  for (int i = 0; i < 200; ++i) light += frame("l");
  for (int i = 0; i < 40; ++i) heavy += frame("w");
  read(first, heavy);
  read(second, light);
  turns(2); // some 200 units
  EXPECT_GE(count("0:w"), 2U);
  EXPECT_LE(count("0:w"), 5U);
  EXPECT_GE(count("1:l"), count("0:w") * 8) << "ten for each, but for the first ones";
  turns(20);
  EXPECT_EQ(count("1:l"), 200U);
  EXPECT_EQ(count("0:w"), 40U) << "the other one waits for nothing now";
}

TEST_F(ingress_test, wants_nothing_of_a_peer_before_what_it_said_is_carried_out) {
  const std::size_t alone = state.bounds().message_bytes_max / 2;
  EXPECT_EQ(in.wanted_bytes(index(first)), alone);
  read(first, frame("a"));
  EXPECT_EQ(in.wanted_bytes(index(first)), 0U);
  EXPECT_NE(in.wanted_bytes(index(second)), 0U);
  in.read_in_turn();
  EXPECT_EQ(in.wanted_bytes(index(first)), alone);
}

// Each fragment counts, and so does each control frame between them.
TEST_F(ingress_test, ends_a_turn_within_a_message_in_pieces) {
  for (const std::string& between : {frame("", opcode::pong), std::string{}}) {
    std::string all = frame("a", opcode::text, false);
    while (all.size() < 10'000) all += frame("b", opcode::continuation, false) + between;
    read(first, all + frame("c", opcode::continuation));
    EXPECT_TRUE(in.waits());
    int cycles = 0;
    for (; in.waits(); ++cycles) in.read_in_turn();
    EXPECT_GE(cycles, 8); // 1024 pieces at most
  }
}

TEST_F(ingress_test, parks_what_finds_no_room_and_reads_its_peer_no_further) {
  refuse_all();
  read(first, frame("a") + frame("b"));
  in.read_in_turn();
  EXPECT_TRUE(in.any_parked());
  EXPECT_TRUE(first.unheard);
  EXPECT_EQ(in.wanted_bytes(index(first)), 0U);
  EXPECT_TRUE(in.check());
  EXPECT_TRUE(in.waits()) << "a slot may have been released meanwhile";
  in.unpark();
  EXPECT_FALSE(in.waits()) << "no room came";
  in.read_in_turn();
  EXPECT_TRUE(handler.heard.empty());

  admit_all();
  EXPECT_TRUE(in.waits());
  unpark();
  EXPECT_EQ(handler.heard_again, texts{"0:a"});
  EXPECT_EQ(handler.heard, texts{"0:b"});
  EXPECT_FALSE(in.any_parked());
  EXPECT_FALSE(first.unheard);
  EXPECT_EQ(first.unheard_until, cycle.now);
  EXPECT_NE(in.wanted_bytes(index(first)), 0U);
}

TEST_F(ingress_test, knows_of_what_is_parked_whether_it_is_binary) {
  refuse_all();
  read(first, frame("a", opcode::binary));
  read(second, frame("x"));
  in.read_in_turn();
  admit_all();
  handler.takes = [&](peer_index from, std::string_view) {
    EXPECT_EQ(handler.binary_again, from.value == 0);
    return true;
  };
  unpark();
  EXPECT_EQ(handler.heard_again, (texts{"0:a", "1:x"}));
}

// The place in a ring is still there then.
TEST_F(ingress_test, carries_out_nothing_of_the_peer_that_was_there_before) {
  read(first, frame("old") + frame("older"));
  const auto at = first.id;
  leave(first);
  join({at.index, at.generation + 1});
  in.open({at.index});
  EXPECT_TRUE(in.check());
  read(first, frame("new"));
  EXPECT_TRUE(in.check());
  in.read_in_turn();
  EXPECT_EQ(handler.heard, texts{"0:new"});
  read(first, frame("newer"));
  in.read_in_turn();
  EXPECT_EQ(handler.heard, (texts{"0:new", "0:newer"}));
}

TEST_F(ingress_test, carries_out_so_many_stops_ahead_in_a_cycle_and_the_first_of_each_peer) {
  handler.has_stop = true;
  std::string many;
  for (std::uint32_t i = 0; i < rowe::service::stops_ahead_max / 2 + 2; ++i) many += frame(stop);
  in.begin_cycle();
  read(first, many);
  read(second, many);
  const std::size_t ahead = handler.heard.size();
  EXPECT_GE(ahead, rowe::service::stops_ahead_max);
  EXPECT_LT(ahead, rowe::service::stops_ahead_max + 4U);
  connection& third = arrive();
  read(third, frame(stop) + frame(stop));
  EXPECT_EQ(handler.heard.size(), ahead + 1) << "that of a peer that has not stopped in this cycle";
  in.begin_cycle();
  while (in.waits()) in.read_in_turn();
  EXPECT_EQ(handler.heard.size(), 2 * (rowe::service::stops_ahead_max / 2 + 2) + 2U);
  handler.heard.clear();
  read(first, frame(stop) + frame(stop) + frame(stop));
  EXPECT_EQ(handler.heard.size(), 3U) << "a new cycle";
}

} // namespace
} // namespace ingress_test
