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
using rowe::service::transport_sink;
using texts = std::vector<std::string>;

constexpr std::string_view stop = R"({"op":"call_service","service":"/rowe/stop"})";

rowe::endpoint_options few() {
  rowe::endpoint_options options;
  options.limits.connections_max = 3;
  options.limits.lanes_max = 1;
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

TEST_F(ingress_test, carries_out_one_message_of_each_peer_in_turn) {
  connection& third = arrive();
  read(first, frame("a") + frame("b") + frame("c"));
  read(second, frame("x"));
  read(third, frame("k") + frame("l"));
  EXPECT_TRUE(handler.heard.empty()) << "reading only stages it";
  EXPECT_TRUE(in.waits());
  in.read_in_turn();
  EXPECT_EQ(handler.heard, (texts{"0:a", "1:x", "2:k", "0:b", "2:l", "0:c"}));
  EXPECT_FALSE(in.waits());
  EXPECT_TRUE(in.check());
}

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

TEST_F(working, who_has_said_nothing_comes_first) {
  connection& third = arrive();
  std::string heavy;
  for (int i = 0; i < 40; ++i) heavy += frame("w");
  read(first, heavy);
  read(second, heavy);
  turns(1);
  const std::size_t before = handler.heard.size();
  read(third, frame("now"));
  turns(1);
  ASSERT_GT(handler.heard.size(), before);
  EXPECT_EQ(handler.heard[before], "2:now");
  // One that has ordered as much as the others waits with them.
  read(third, frame("w") + frame("again"));
  turns(5);
  const auto place = [&](std::string_view what) {
    return std::find(handler.heard.begin(), handler.heard.end(), what) - handler.heard.begin();
  };
  EXPECT_GE(place("2:again"), place("2:w") + 3) << "behind a turn of each";
}

TEST_F(working, nobody_owes_anything_when_nobody_waits) {
  read(first, frame("w") + frame("w"));
  turns(10);
  EXPECT_FALSE(in.waits());
  read(second, frame("a") + frame("b"));
  read(first, frame("c"));
  turns(1);
  EXPECT_EQ(handler.heard, (texts{"0:w", "0:w", "1:a", "0:c", "1:b"}));
}

TEST_F(ingress_test, counts_the_work_that_a_message_makes_elsewhere) {
  handler.takes = [&](peer_index, std::string_view) {
    state.cycle.work_bytes += 50 * rowe::service::read_work_bytes;
    return true;
  };
  read(first, frame("a") + frame("b") + frame("c") + frame("d"));
  in.read_in_turn();
  EXPECT_EQ(handler.heard.size(), 2U);
  EXPECT_TRUE(in.waits());
  in.read_in_turn();
  EXPECT_EQ(handler.heard.size(), 4U);
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

// What is kept of a long read lies behind the fragments, in the same buffer.
TEST_F(ingress_test, wants_less_at_a_time_where_a_message_in_pieces_is_long) {
  const std::size_t most = state.bounds().message_bytes_max;
  const std::string piece(4000, 'x');
  read(first, frame(piece, opcode::text, false));
  in.read_in_turn();
  EXPECT_EQ(in.wanted_bytes(index(first)), (most - 4000) / 2);
  std::size_t bytes = 4000;
  for (; bytes + 2 * transport_sink::read_bytes_in_turn < most; bytes += 4000) {
    read(first, frame(piece, opcode::continuation, false));
    in.read_in_turn();
  }
  EXPECT_EQ(in.wanted_bytes(index(first)), transport_sink::read_bytes_in_turn);
  read(first, frame("end", opcode::continuation));
  in.read_in_turn();
  EXPECT_EQ(in.wanted_bytes(index(first)), most / 2);
  ASSERT_EQ(handler.heard.size(), 1U);
  EXPECT_EQ(handler.heard[0].size(), 2 + bytes + 3);
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

TEST_F(ingress_test, wants_little_after_a_read_that_was_too_much_for_one_turn) {
  std::string all;
  while (all.size() < 10'000) all += frame("a");
  read(first, all);
  while (in.waits()) in.read_in_turn();
  EXPECT_EQ(in.wanted_bytes(index(first)), transport_sink::read_bytes_alone_min);
  read(first, std::string(all, 0, 10 * frame("a").size()));
  while (in.waits()) in.read_in_turn();
  EXPECT_EQ(in.wanted_bytes(index(first)), transport_sink::read_bytes_alone_min) << "it was not large";
  read(first, frame(std::string(10'000, 'x')));
  EXPECT_EQ(in.wanted_bytes(index(first)), state.bounds().message_bytes_max / 2);
}

TEST_F(ingress_test, carries_out_at_once_what_a_lone_peer_said_and_keeps_the_rest_whole) {
  std::string all;
  texts said;
  for (int i = 0; all.size() < 16'000; ++i) {
    said.push_back("message " + std::to_string(i) + std::string(static_cast<std::size_t>(i % 50), '.'));
    all += frame(said.back());
  }
  read(first, all);
  EXPECT_GE(handler.heard.size(), 90U);
  EXPECT_LT(handler.heard.size(), said.size()) << "there is more than one cycle's work";
  EXPECT_TRUE(in.check());
  while (in.waits()) in.read_in_turn();
  ASSERT_EQ(handler.heard.size(), said.size());
  for (std::size_t i = 0; i < said.size(); ++i) EXPECT_EQ(handler.heard[i], "0:" + said[i]);
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

TEST_F(ingress_test, parks_one_peer_and_reads_the_others) {
  refuse_all();
  handler.takes = [](peer_index from, std::string_view) { return from.value != 0; };
  read(first, frame("a"));
  read(second, frame("x") + frame("y"));
  in.read_in_turn();
  EXPECT_EQ(handler.heard, (texts{"1:x", "1:y"}));
  EXPECT_FALSE(second.unheard);
  admit_all();
  unpark();
  EXPECT_EQ(handler.heard_again, texts{"0:a"});
}

TEST_F(ingress_test, parks_once_more_what_still_finds_no_room_in_its_turn) {
  refuse_all();
  read(first, frame("a"));
  in.read_in_turn();
  admit_all();
  handler.takes = [](peer_index, std::string_view) { return false; };
  for (int i = 0; i < 3; ++i) {
    ++cycle.places_freed;
    unpark();
    EXPECT_TRUE(in.any_parked());
    EXPECT_TRUE(in.check());
  }
  admit_all();
  unpark();
  EXPECT_EQ(handler.heard_again, texts{"0:a"});
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

TEST_F(ingress_test, keeps_whole_what_is_parked_of_a_long_read) {
  const std::string large(9000, 'l'), later(6000, 'm');
  refuse_all();
  read(first, frame("a" + large) + frame(later));
  EXPECT_TRUE(in.any_parked());
  EXPECT_TRUE(in.check());
  admit_all();
  unpark();
  EXPECT_EQ(handler.heard_again, texts{"0:a" + large});
  EXPECT_EQ(handler.heard, texts{"0:" + later});
}

TEST_F(ingress_test, keeps_whole_what_was_in_pieces_and_is_parked) {
  refuse_all();
  const std::string begins(5000, 'a'), ends(5000, 'b');
  read(first, frame(begins, opcode::text, false) + frame(ends, opcode::continuation) + frame("more"));
  EXPECT_TRUE(in.any_parked());
  admit_all();
  unpark();
  EXPECT_EQ(handler.heard_again, texts{"0:" + begins + ends});
  EXPECT_EQ(handler.heard, texts{"0:more"});
}

TEST_F(ingress_test, counts_what_was_parked_of_a_peer_that_leaves) {
  refuse_all();
  read(first, frame("a") + frame("b"));
  in.read_in_turn();
  ASSERT_TRUE(in.any_parked());
  leave(first);
  EXPECT_EQ(counts.read(counter::inbox_full), 2U) << "one, and that with which the inbox was filled";
  EXPECT_TRUE(in.check());
  unpark();
  EXPECT_FALSE(in.waits());
  EXPECT_TRUE(handler.heard.empty());
  EXPECT_TRUE(handler.heard_again.empty());
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

TEST_F(ingress_test, carries_out_nothing_more_of_a_peer_that_is_to_be_closed) {
  handler.takes = [&](peer_index, std::string_view text) {
    if (text == "bad") peers.close_later(first, "bad");
    return true;
  };
  read(first, frame("good") + frame("bad") + frame("lost"));
  in.read_in_turn();
  EXPECT_EQ(handler.heard, (texts{"0:good", "0:bad"}));
  EXPECT_FALSE(in.waits());
  EXPECT_TRUE(in.check());
}

TEST_F(ingress_test, knows_since_when_a_message_is_unfinished) {
  EXPECT_EQ(in.unfinished_since(index(first)), rowe::rt::never);
  const auto began = cycle.now;
  read(first, frame("a", opcode::text, false));
  in.read_in_turn();
  cycle.now += 1s;
  read(first, frame("b", opcode::continuation, false) + frame("", opcode::ping));
  in.read_in_turn();
  EXPECT_EQ(in.unfinished_since(index(first)), began) << "whatever came since";
  const std::string next = frame("next");
  read(first, frame("c", opcode::continuation) + next.substr(0, 3));
  in.read_in_turn();
  EXPECT_EQ(in.unfinished_since(index(first)), cycle.now) << "of the next one, which has begun";
  read(first, next.substr(3));
  in.read_in_turn();
  EXPECT_EQ(in.unfinished_since(index(first)), rowe::rt::never);
  EXPECT_EQ(in.unfinished_since(index(second)), rowe::rt::never);
}

TEST_F(ingress_test, carries_out_a_stop_as_it_is_read_and_leaves_the_rest_as_it_was) {
  handler.has_stop = true;
  read(first, frame("a") + frame(stop) + frame("b"));
  EXPECT_EQ(handler.heard, texts{"0:" + std::string{stop}});
  in.read_in_turn();
  EXPECT_EQ(handler.heard, (texts{"0:" + std::string{stop}, "0:a", "0:b"}));
}

TEST_F(ingress_test, carries_out_a_stop_of_a_peer_whose_message_is_parked) {
  handler.has_stop = true;
  refuse_all();
  handler.takes = [](peer_index, std::string_view text) { return text == stop; };
  std::string all = frame("a" + std::string(6000, 'x'));
  all += frame("b") + frame(stop) + frame("c");
  read(first, all);
  EXPECT_EQ(handler.heard, texts{"0:" + std::string{stop}});
  EXPECT_TRUE(in.any_parked());
  admit_all();
  unpark();
  EXPECT_EQ(handler.heard_again.size(), 1U);
  EXPECT_EQ(handler.heard, (texts{"0:" + std::string{stop}, "0:b", "0:c"}));
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

TEST_F(ingress_test, looks_for_no_stop_where_nothing_can_be_stopped) {
  read(first, frame("a") + frame(stop));
  EXPECT_TRUE(handler.heard.empty());
  in.read_in_turn();
  EXPECT_EQ(handler.heard.front(), "0:a");
}

} // namespace
} // namespace ingress_test
