// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "net/base/deadline_list.hpp"
#include "net/base/poll_set.hpp"
#include "support.hpp"

namespace rowe::net {
namespace waiting_test {
namespace {

rt::time_point clock_now() { return rt::monotonic_clock::now(); }

struct waiting : served {};

TEST_F(waiting, lasts_until_its_end_when_nothing_happens) {
  recording_sink sink;
  const auto turn = clock_now();
  transport->poll(turn, sink); // libwebsockets has its first turn
  const auto begin = clock_now();
  transport->wait(turn, turn + 30ms); // so its next one is far off, however late this is
  EXPECT_GE(clock_now() - begin, 30ms);
}

TEST_F(waiting, without_end_still_sleeps_for_long_stretches) {
  recording_sink sink;
  const auto begin = clock_now();
  transport->poll(begin, sink);
  // Each of these returns because of libwebsockets' turn, a quarter of a second after the last one. Were
  // there a wake-up each millisecond, three waits could not last so long.
  for (int i = 0; i < 3; ++i) {
    transport->wait(clock_now(), rt::never);
    transport->poll(clock_now(), sink);
  }
  EXPECT_GE(clock_now() - begin, 600ms);
  EXPECT_LE(transport->counters().lws_turns, 4U);
}

TEST_F(waiting, is_not_shortened_by_a_page_that_its_reader_does_not_read) {
  listen({.limits = {.handshake_bytes = 16 << 20}});
  const std::uint64_t resting = transport->memory().bytes_used;
  static const std::string body(8 << 20, 'x');
  drive.sink().answer = [](const service::http_request&) { return page_of(body); };
  raw_socket client = reader_of(drive, *transport, "/");
  EXPECT_GT(transport->memory().bytes_used, resting);
  // The kernel may move bytes for a while; in the end a wait lasts.
  EXPECT_TRUE(drive.until([&] {
    const auto begin = clock_now();
    transport->wait(drive.now(), drive.now() + 20ms);
    return clock_now() - begin >= 20ms;
  }));
  EXPECT_GT(transport->memory().bytes_used, resting);
}

TEST_F(waiting, ends_when_bytes_arrive_and_the_poll_needs_no_second_look) {
  const raw_socket client = upgraded(drive, *transport);
  ASSERT_TRUE(client.send("x"));
  wait_for_event(*transport, drive.now());
  drive.turn();
  EXPECT_EQ(drive.sink().received.begin()->second, "x");
}

TEST_F(waiting, twice_before_a_poll_loses_nothing) {
  raw_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  ASSERT_TRUE(client.send(upgrade_request(transport->port()))); // reported once only: edge triggered
  wait_for_event(*transport, drive.now());
  wait_for_event(*transport, drive.now());
  drive.turn();
  EXPECT_EQ(drive.sink().opens.size(), 1U);
}

TEST_F(waiting, ends_at_once_while_a_close_is_unreported) {
  const raw_socket client = upgraded(drive, *transport);
  transport->close(drive.sink().opens[0].id, close_how::aborted);
  wait_for_event(*transport, drive.now());
  drive.turn();
  EXPECT_EQ(drive.sink().closes.size(), 1U);
}

TEST_F(waiting, ends_for_a_deadline_of_the_transport_itself) {
  listen({.limits = {.header_timeout = 40ms}});
  raw_socket client{transport->port()};
  ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == 1; }));
  transport->wait(drive.now(), drive.now() + 3600s);
  EXPECT_TRUE(drive.until([&] { return client.ended(); }));
}

TEST_F(waiting, is_ended_by_wake_from_another_thread) {
  recording_sink sink;
  for (int i = 0; i < 100; ++i) {
    const auto now = clock_now();
    transport->poll(now, sink);
    std::thread other{[&] { transport->wake(); }}; // before the wait or during it
    wait_for_event(*transport, now);
    other.join();
  }
}

class poll_set_by : public testing::TestWithParam<sleeping_by> {};

TEST_P(poll_set_by, sleeps_no_shorter_than_asked_and_wakes_for_events) {
  auto polled = poll_set::open(GetParam());
  ASSERT_TRUE(polled);
  for (const rt::duration span : {rt::duration{100us}, rt::duration{5ms}}) {
    const auto begin = clock_now();
    polled->wait(begin, begin + span);
    EXPECT_GE(clock_now() - begin, span);
    for (const socket_event& event : polled->take()) EXPECT_EQ(event.token.from, source::timer);
  }
  const auto [one, other] = local_pair();
  ASSERT_TRUE(polled->add(one.get(), EPOLLIN, {source::connection, 0xabcdef, 0x12345678}));
  ASSERT_EQ(::write(other.get(), "x", 1), 1);
  polled->wait(clock_now(), clock_now() + 1h);
  const auto events = polled->take();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].token.from, source::connection);
  EXPECT_EQ(events[0].token.index, 0xabcdefU);
  EXPECT_EQ(events[0].token.generation, 0x12345678U);
  polled->remove(one.get());
  EXPECT_TRUE(polled->take().empty());
}

// Its timer is left running; were it taken for one of the next sleep after it has gone off, that would not
// end.
TEST_P(poll_set_by, ends_each_short_sleep_after_others_that_events_ended) {
  auto polled = poll_set::open(GetParam());
  ASSERT_TRUE(polled);
  const auto [one, other] = local_pair();
  ASSERT_TRUE(polled->add(one.get(), EPOLLIN | EPOLLET, {source::connection}));
  for (int round = 0; round < 20; ++round) {
    const auto begin = clock_now();
    for (int i = 0; i <= round; ++i) {
      ASSERT_EQ(::write(other.get(), "x", 1), 1);
      polled->wait(clock_now(), clock_now() + 300us);
      (void)polled->take();
    }
    polled->wait(begin, begin + 300us); // the clock may stand, too
    (void)polled->take();
    polled->wait(begin, begin + 300us);
    EXPECT_GE(clock_now() - begin, 300us);
    (void)polled->take();
  }
}

TEST_P(poll_set_by, sleeps_long_after_a_short_sleep) {
  auto polled = poll_set::open(GetParam());
  ASSERT_TRUE(polled);
  const auto begin = clock_now();
  polled->wait(begin, begin + 100us);
  (void)polled->take();
  for (auto now = clock_now(); now - begin < 20ms; now = clock_now()) { // one of them ends early at most
    polled->wait(now, begin + 20ms);
    (void)polled->take();
  }
  polled->wait(clock_now(), clock_now() + 100us);
  EXPECT_GE(clock_now() - begin, 20ms);
}

INSTANTIATE_TEST_SUITE_P(both, poll_set_by, testing::Values(sleeping_by::epoll_pwait2, sleeping_by::timerfd));

constexpr rt::time_point start{1000s};

TEST(deadline_list, gives_nobody_out_who_is_found_long_after_its_time) {
  deadline_list list{5s};
  deadline_node a, b;
  list.arm(a, start);
  list.arm(b, start + 3s);
  EXPECT_EQ(list.take_due(start + 1h), nullptr) << "this process did not run";
  EXPECT_EQ(list.take_due(start + 1h + 900ms), nullptr);
  EXPECT_EQ(list.take_due(start + 1h + 1s), &a);
  EXPECT_EQ(list.take_due(start + 1h + 3900ms), nullptr) << "they keep their distance";
  EXPECT_EQ(list.take_due(start + 1h + 4s), &b);
}

TEST(deadline_list, gives_out_who_is_found_late_once_more_where_the_thread_hardly_runs) {
  deadline_list list{5s};
  deadline_node a, b, c;
  list.arm(a, start);
  list.arm(b, start);
  EXPECT_EQ(list.take_due(start + 10s), nullptr);
  EXPECT_EQ(list.take_due(start + 20s), &a) << "nobody could keep a place for ever";
  EXPECT_EQ(list.take_due(start + 20s), &b);
  list.arm(c, start + 20s);
  EXPECT_EQ(list.take_due(start + 25s), &c) << "in time";
  list.arm(a, start + 25s);
  EXPECT_EQ(list.take_due(start + 40s), nullptr) << "so the next one is late for the first time";
}

TEST(deadline_list, gives_out_in_the_order_of_arming) {
  deadline_list list{5s};
  deadline_node a, b, c;
  EXPECT_EQ(list.next(), rt::never);
  list.arm(a, start);
  list.arm(b, start + 1s);
  list.arm(c, start + 2s);
  list.arm(a, start + 3s); // again: it goes to the end
  EXPECT_EQ(list.next(), start + 6s);
  EXPECT_EQ(list.take_due(start + 5s), nullptr);
  EXPECT_EQ(list.take_due(start + 6s), &b);
  EXPECT_EQ(list.oldest(), &c);
  c.disarm();
  c.disarm();
  EXPECT_EQ(list.take_due(start + 9s), &a);
  EXPECT_EQ(list.take_due(start + 9s), nullptr);
  {
    deadline_node gone;
    list.arm(gone, start);
  }
  EXPECT_EQ(list.oldest(), nullptr);
}

} // namespace
} // namespace waiting_test
} // namespace rowe::net
