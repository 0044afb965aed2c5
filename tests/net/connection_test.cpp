// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "support.hpp"

namespace rowe::net {
namespace connection_test {
namespace {

struct connection : served {
  raw_socket client = upgraded(drive, *transport);
  connection_id id = drive.sink().opens.at(0).id;

  // A kernel that is busy may acknowledge nothing for longer than the write deadline.
  connection() { drive.stop_clock(); }

  // Writes until something is refused; returns what was taken.
  std::size_t fill(std::string_view piece) {
    std::size_t taken = 0;
    for (;;) {
      const std::size_t now = write(*transport, id, piece);
      taken += now;
      if (now < piece.size()) return taken;
    }
  }
  bool closed() { return !drive.sink().closes.empty(); }
  bool closes_by(close_cause cause) {
    return drive.until([&] { return closed(); }) && drive.sink().closes[0].cause == cause;
  }
};

TEST_F(connection, refuses_what_has_no_room_and_says_when_there_is_room_again) {
  write_beyond_its_room(drive, *transport, id, client, 100'000, 20'000'000);
}

TEST_F(connection, says_nothing_of_room_when_nothing_was_refused) {
  EXPECT_EQ(write(*transport, id, "a"), 1U);
  ASSERT_TRUE(drive.until([&] { return client.has("a"); }));
  drive.turn();
  EXPECT_EQ(drive.sink().writables, 0);
}

TEST_F(connection, ends_when_the_peer_shuts_its_end) {
  ASSERT_TRUE(client.send("last words"));
  client.shut();
  ASSERT_TRUE(drive.until([&] { return closed(); }));
  EXPECT_EQ(drive.sink().received[id.index], "last words");
  EXPECT_EQ(drive.sink().closes[0].id, id);
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::peer);
  EXPECT_TRUE(drive.sink().gone.empty()) << "it may still read";
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
}

TEST_F(connection, says_that_nobody_is_there_before_it_reads_what_was_left) {
  ASSERT_TRUE(client.send("last words"));
  client.reset();
  ASSERT_TRUE(closes_by(close_cause::reset));
  ASSERT_EQ(drive.sink().gone.size(), 1U);
  EXPECT_EQ(drive.sink().gone[0], id);
  EXPECT_EQ(drive.sink().received_when_gone, "");
  EXPECT_EQ(drive.sink().received[id.index], "last words");
}

TEST_F(connection, ends_by_a_reset_while_reading_is_off) {
  transport->read_enabled(id, false);
  client.reset();
  ASSERT_TRUE(closes_by(close_cause::reset));
}

TEST_F(connection, that_a_write_finds_dead_is_reported_once_by_the_next_poll) {
  client.reset();
  // The first write may still be taken for a living connection; a later one is not.
  for (int i = 0; i < 3; ++i) (void)write(*transport, id, "x");
  EXPECT_TRUE(drive.sink().closes.empty());
  drive.turn();
  drive.turn();
  ASSERT_EQ(drive.sink().closes.size(), 1U);
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::reset);
  EXPECT_EQ(write(*transport, id, "x"), 0U);
}

TEST_F(connection, is_cut_when_the_peer_acknowledges_nothing_for_the_write_deadline) {
  const auto refill = [&](connection_id) { fill(std::string(100'000, 'x')); };
  drive.sink().when_writable = refill; // the kernel moves bytes to the peer's buffer until that is full
  refill(id);
  int seconds = 0;
  while (!closed() && ++seconds < 100) {
    drive.skip(500ms);
    drive.turn();
    if (seconds == 1) {
      EXPECT_FALSE(closed());
    }
    drive.skip(510ms);
    drive.turn();
  }
  ASSERT_TRUE(closed());
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::timed_out);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
}

TEST_F(connection, is_not_cut_long_after_room_was_found_again) {
  fill(std::string(100'000, 'x'));
  ASSERT_TRUE(drive.until([&] { return client.read() && drive.sink().writables == 1; }));
  for (int seconds = 0; seconds < 5; ++seconds) {
    drive.skip(1s);
    drive.turn();
  }
  EXPECT_FALSE(closed());
}

TEST_F(connection, closes_flushed_after_everything_is_read) {
  const std::size_t taken = fill(std::string(50'000, 'x'));
  transport->close(id, close_how::flushed);
  EXPECT_EQ(write(*transport, id, "late"), 0U);
  drive.turn();
  EXPECT_FALSE(closed());
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  EXPECT_EQ(client.text.size(), taken);
  EXPECT_FALSE(closed()) << "the peer's end is still open";
  client.close();
  ASSERT_TRUE(closes_by(close_cause::asked));
}

TEST_F(connection, throws_away_what_arrives_while_it_closes) {
  transport->close(id, close_how::flushed);
  ASSERT_TRUE(client.send(std::string(100'000, 'x')));
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_FALSE(client.failed);
  client.shut();
  ASSERT_TRUE(drive.until([&] { return closed(); }));
  EXPECT_TRUE(drive.sink().received[id.index].empty());
}

TEST_F(connection, cuts_a_peer_that_does_not_end_a_flushed_close) {
  drive.turn(); // the close's time is the last turn's
  transport->close(id, close_how::flushed);
  drive.skip(900ms);
  drive.turn();
  EXPECT_FALSE(closed());
  drive.skip(100ms);
  drive.turn();
  ASSERT_TRUE(closed());
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::asked);
}

TEST_F(connection, closes_aborted_by_a_reset_and_reports_it_in_the_next_poll) {
  transport->close(id, close_how::aborted);
  EXPECT_FALSE(closed());
  drive.turn();
  ASSERT_TRUE(closed());
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::asked);
  ASSERT_TRUE(drive.until([&] { return client.ended(); }));
  EXPECT_TRUE(client.failed);
}

TEST_F(connection, may_be_closed_from_within_every_report) {
  drive.sink().when_bytes = [&](connection_id from, std::span<std::byte>) {
    transport->close(from, close_how::aborted);
  };
  ASSERT_TRUE(client.send("x"));
  ASSERT_TRUE(drive.until([&] { return closed(); }));

  drive.sink().when_open = [&](connection_id opened) { transport->close(opened, close_how::flushed); };
  raw_socket next = answered_whole(drive, *transport, upgrade_request(transport->port()) + "behind");
  EXPECT_EQ(next.text.substr(0, 12), "HTTP/1.1 101");
  next.close();
  ASSERT_TRUE(drive.until([&] { return drive.sink().closes.size() == 2; }));
}

TEST_F(connection, does_nothing_for_an_id_that_is_stale) {
  client.close();
  ASSERT_TRUE(drive.until([&] { return closed(); }));
  raw_socket next = upgraded(drive, *transport);
  const connection_id fresh = drive.sink().opens.at(1).id;
  ASSERT_EQ(fresh.index, id.index);
  EXPECT_NE(fresh.generation, id.generation);
  for (const connection_id stale : {id, connection_id{}, connection_id{1u << 20, 1}}) {
    EXPECT_EQ(write(*transport, stale, "x"), 0U);
    transport->read_enabled(stale, false);
    transport->close(stale, close_how::aborted);
  }
  ASSERT_TRUE(next.send("alive"));
  EXPECT_TRUE(drive.until([&] { return drive.sink().received[fresh.index] == "alive"; }));
  EXPECT_EQ(drive.sink().closes.size(), 1U);
}

TEST_F(connection, is_not_read_while_reading_is_off) {
  transport->read_enabled(id, false);
  ASSERT_TRUE(client.send("held"));
  for (int i = 0; i < 10; ++i) drive.turn();
  EXPECT_TRUE(drive.sink().received[id.index].empty());
  transport->read_enabled(id, true);
  EXPECT_TRUE(drive.until([&] { return drive.sink().received[id.index] == "held"; }));
}

TEST_F(connection, alone_delivers_much_at_once) {
  ASSERT_TRUE(client.send(std::string(60'000, 'x')));
  ASSERT_TRUE(drive.until([&] { return drive.sink().received[id.index].size() == 60'000; }));
  EXPECT_GT(*std::max_element(drive.sink().reads.begin(), drive.sink().reads.end()), 4096U);
}

TEST_F(connection, delivers_one_quantum_a_turn_while_others_are_readable_too) {
  raw_socket other = upgraded(drive, *transport);
  const connection_id other_id = drive.sink().opens.at(1).id;
  ASSERT_TRUE(client.send(std::string(40'000, 'x')));
  ASSERT_TRUE(other.send(std::string(40'000, 'y')));
  while (!client.all_arrived() || !other.all_arrived()) std::this_thread::yield();
  auto& received = drive.sink().received;
  drive.sink().reads.clear();
  for (int turns = 1; turns <= 5; ++turns) {
    drive.turn();
    EXPECT_EQ(received[id.index].size(), 4096U * static_cast<unsigned>(turns));
    EXPECT_EQ(received[other_id.index].size(), 4096U * static_cast<unsigned>(turns));
  }
  EXPECT_EQ(*std::max_element(drive.sink().reads.begin(), drive.sink().reads.end()), 4096U);
}

struct connections : served {};

TEST_F(connections, are_not_cut_while_a_slow_peer_still_acknowledges) {
  // Without the kernel's own limit on unsent bytes there are megabytes under way, and room again only when a
  // third of them is gone; or when the kernel makes the buffer longer, which it does a few times at most, and
  // which is filled then.
  listen({.limits = {.unsent_bytes_max = 1U << 30}});
  raw_socket client = upgraded(drive, *transport);
  drive.stop_clock();
  const connection_id id = drive.sink().opens.at(0).id;
  const std::string piece(100'000, 'x');
  std::size_t sent = 0, seen = 0;
  const auto fill = [&] {
    while (const std::size_t taken = write(*transport, id, piece)) sent += taken;
  };
  const auto arrived = [&] {
    int waiting = 0;
    EXPECT_EQ(::ioctl(client.fd(), FIONREAD, &waiting), 0);
    return seen + static_cast<std::size_t>(waiting);
  };
  fill();
  int rounds = 0;
  for (int without_room = 0; without_room < 6; ++without_room) { // 3.6 s: each second brings something
    if (++rounds == 100) GTEST_SKIP() << "a busy kernel finds room again and again, so nothing is to be seen";
    char some[65536];
    const auto enough = seen + (sent - seen) / 40;
    const std::size_t before = arrived();
    ASSERT_TRUE(drive.until([&] {
      const ssize_t bytes = ::recv(client.fd(), some, sizeof some, 0);
      if (bytes > 0) seen += static_cast<std::size_t>(bytes);
      return seen > enough && arrived() > before; // so there was something to acknowledge
    }));
    drive.skip(600ms);
    drive.turn();
    ASSERT_TRUE(drive.sink().closes.empty());
    if (std::exchange(drive.sink().writables, 0) > 0) {
      fill();
      without_room = -1;
    }
  }
}

TEST_F(connections, clamp_the_send_buffer_when_asked_and_of_a_low_rtt_peer) {
  for (const bool when_asked : {true, false}) {
    listen({.limits = when_asked ? socket_limits{.send_buffer_bytes = 16384}
                                 : socket_limits{.unsent_bytes_max = 1U << 30}});
    raw_socket client = upgraded(drive, *transport, 4096);
    const connection_id id = drive.sink().opens.at(0).id;
    if (!when_asked) transport->limit_send_buffer(id, 16384);
    std::size_t taken = 0;
    const std::string piece(1000, 'x');
    while (const std::size_t now = write(*transport, id, piece)) taken += now;
    EXPECT_LT(taken, 100'000U) << when_asked;                           // unclamped: megabytes on loopback
    transport->limit_send_buffer({id.index, id.generation + 1}, 16384); // of nobody
  }
}

} // namespace
} // namespace connection_test
} // namespace rowe::net
