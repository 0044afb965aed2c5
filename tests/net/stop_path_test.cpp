// SPDX-License-Identifier: Apache-2.0
// Places kept for peers on the stop's path, and that nobody is kept out by handshakes that do not end.
#include "memory_hog.hpp"
#include "net/base/address.hpp"
#include "net/connections/established.hpp"
#include "support.hpp"

namespace rowe::net {
namespace stop_path_test {
namespace {

// ---- over sockets

// A client behind its upgrade on the path of the stop, or what it was answered instead.
raw_socket on_stop_path(driver& drive, socket_transport& transport) {
  return net::answered(drive, transport, upgrade_request(transport.port(), {}, service::stop_path));
}
std::size_t answered(driver& drive) { return drive.sink().pages.size() + drive.sink().rejections.size(); }
bool is_in(const raw_socket& client) { return client.text.starts_with("HTTP/1.1 101"); }

// As the core does: a displaced peer is sent a last message.
struct displacing {
  explicit displacing(driver& drive, socket_transport& transport) {
    drive.sink().may_displace_which = [this](connection_id id) { return id.index != kept; };
    drive.sink().when_displaced = [this, &transport](connection_id id) {
      displaced.push_back(id.index);
      (void)write(transport, id, "displaced"); // not taken where it was closed before
      transport.close(id, close_how::flushed);
    };
  }
  std::uint32_t kept = UINT32_MAX; // by who just stopped the robot
  std::vector<std::uint32_t> displaced;
};

struct stop_path : served {};
struct silent_handshakes : served {};

TEST_F(stop_path, has_two_places_that_others_do_not_get) {
  listen({.limits = {.connections_max = 5}});
  std::vector<raw_socket> others;
  for (int i = 0; i < 3; ++i) others.push_back(upgraded(drive, *transport));
  raw_socket fourth = answered_whole(drive, *transport, upgrade_request(transport->port()));
  EXPECT_EQ(fourth.text.substr(0, 12), "HTTP/1.1 503");
  const raw_socket first = on_stop_path(drive, *transport);
  const raw_socket second = on_stop_path(drive, *transport);
  EXPECT_TRUE(is_in(first) && is_in(second));
  EXPECT_EQ(drive.sink().opens.back().path, service::stop_path);
}

TEST_F(stop_path, takes_other_places_and_leaves_its_own_to_nobody_else) {
  listen({.limits = {.connections_max = 4}});
  std::vector<raw_socket> stopping;
  for (int i = 0; i < 2; ++i) stopping.push_back(on_stop_path(drive, *transport));
  std::vector<raw_socket> others;
  for (int i = 0; i < 2; ++i) others.push_back(upgraded(drive, *transport)); // these two places are left
  EXPECT_EQ(drive.sink().opens.size(), 4U);
  others.clear();
  ASSERT_TRUE(drive.until([&] { return drive.sink().closes.size() == 2; }));
  for (int i = 0; i < 2; ++i) stopping.push_back(on_stop_path(drive, *transport));
  for (const raw_socket& one : stopping) EXPECT_TRUE(is_in(one));
}

TEST_F(stop_path, needs_a_place_among_few) {
  listen({.limits = {.connections_max = 1}});
  const raw_socket only = upgraded(drive, *transport); // of one place none is kept
  listen({.limits = {.connections_max = 2}});
  const raw_socket first = upgraded(drive, *transport);
  EXPECT_TRUE(is_in(on_stop_path(drive, *transport)));
}

TEST_F(stop_path, gives_the_oldest_place_on_it_to_the_next_one_with_words) {
  listen({.limits = {.connections_max = 4}});
  displacing rule{drive, *transport};
  const raw_socket ordinary[] = {upgraded(drive, *transport), upgraded(drive, *transport)};
  raw_socket first = on_stop_path(drive, *transport);
  const raw_socket second = on_stop_path(drive, *transport);
  ASSERT_TRUE(first.send("unread")); // which must not turn the end into a reset
  ASSERT_TRUE(drive.until([&] { return first.all_arrived(); }));
  const raw_socket third = on_stop_path(drive, *transport);
  EXPECT_TRUE(is_in(third));
  EXPECT_EQ(rule.displaced, (std::vector<std::uint32_t>{2}));
  ASSERT_TRUE(drive.until([&] { return first.ended(); }));
  EXPECT_FALSE(first.failed);
  EXPECT_NE(first.text.find("displaced"), std::string::npos);
  ASSERT_EQ(drive.sink().closes.size(), 1U);
  EXPECT_EQ(drive.sink().closes[0].id.index, 2U);
}

TEST_F(stop_path, is_refused_where_both_have_just_stopped_the_robot) {
  listen({.limits = {.connections_max = 2}});
  displacing rule{drive, *transport};
  const raw_socket ordinary = upgraded(drive, *transport);
  const raw_socket first = on_stop_path(drive, *transport);
  rule.kept = 1;
  raw_socket next = on_stop_path(drive, *transport);
  EXPECT_EQ(next.text.substr(0, 12), "HTTP/1.1 503");
  EXPECT_TRUE(next.has("try again within a second"));
  EXPECT_TRUE(rule.displaced.empty());
  rule.kept = UINT32_MAX;
  EXPECT_TRUE(is_in(on_stop_path(drive, *transport)));
}

TEST_F(stop_path, does_not_wait_for_one_that_was_closed_and_does_not_end) {
  listen({.limits = {.connections_max = 2}});
  displacing rule{drive, *transport};
  const raw_socket ordinary = upgraded(drive, *transport);
  const raw_socket first = on_stop_path(drive, *transport);
  transport->close(drive.sink().opens.back().id, close_how::flushed); // it never shuts its end
  EXPECT_TRUE(is_in(on_stop_path(drive, *transport)));
  EXPECT_EQ(drive.sink().closes.size(), 1U);
}

TEST_F(stop_path, is_checked_for_origin_and_host_as_others_are) {
  raw_socket client = answered_whole(
      drive, *transport,
      upgrade_request(transport->port(), "Origin: http://evil.example\r\n", service::stop_path));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 403");
}

TEST_F(stop_path, is_no_page) {
  listen({.limits = {.connections_max = 2}});
  raw_socket client = answered_whole(drive, *transport, request(transport->port(), service::stop_path));
  EXPECT_EQ(drive.sink().opens.size(), 0U);
  EXPECT_EQ(drive.sink().pages.size(), 1U);
}

TEST_F(stop_path, gets_the_memory_of_pages_that_nobody_reads) {
  listen({.limits = {.handshake_bytes = 8 << 20}});
  const std::string large(6 << 20, 'p'); // more than the kernel takes: libwebsockets keeps the rest
  drive.sink().answer = [&](const service::http_request& asked) {
    return page_of(asked.path == "/large" ? std::string_view{large} : std::string_view{});
  };
  raw_socket reader = reader_of(drive, *transport, "/large"); // of nothing
  const memory_hog hog{drive, *transport};                    // all that is left
  for (const std::string& text : {request(transport->port(), "/rest"), upgrade_request(transport->port())}) {
    raw_socket other = answered_whole(drive, *transport, text);
    EXPECT_EQ(other.text.substr(0, 12), "HTTP/1.1 503");
  }
  EXPECT_TRUE(is_in(on_stop_path(drive, *transport)));
  EXPECT_EQ(transport->counters().handshakes_evicted, 1U);
}

// ---- handshakes that do not end

TEST_F(silent_handshakes, give_their_place_to_newcomers_oldest_first) {
  listen({.limits = {.handshakes_max = 4}});
  std::vector<raw_socket> silent;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    silent.emplace_back(transport->port());
    ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == i; }));
  }
  const raw_socket in = upgraded(drive, *transport);
  EXPECT_EQ(transport->counters().handshakes_evicted, 1U);
  EXPECT_EQ(transport->memory().evictions, 1U);
  ASSERT_TRUE(drive.until([&] { return silent[0].ended(); }));
  EXPECT_EQ(silent[0].text, ""); // it has asked for nothing
  for (std::size_t i = 1; i < 4; ++i) EXPECT_FALSE(silent[i].ended()) << i;
  ASSERT_TRUE(silent[3].send(upgrade_request(transport->port())));
  ASSERT_TRUE(drive.until([&] { return silent[3].has("101"); }));
  EXPECT_EQ(drive.sink().opens.size(), 2U);
}

TEST_F(silent_handshakes, of_many_sources_keep_no_place_from_who_comes_for_the_first_time) {
  listen({.limits = {.handshakes_max = 4}});
  std::vector<raw_socket> flood;
  const auto goes_on = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const std::string from = "127.0.9." + std::to_string(1 + flood.size() % 40);
      const std::uint64_t before = transport->counters().accepted;
      ASSERT_TRUE(
          flood.emplace_back(transport->port(), "127.0.0.1", 0, from.c_str()).send("GET / HTTP/1.1\r\n"));
      ASSERT_TRUE(drive.until([&] { return transport->counters().accepted > before; }));
    }
  };
  goes_on(80);
  raw_socket slow{transport->port()};
  const std::string asked = upgrade_request(transport->port());
  ASSERT_TRUE(slow.send(asked.substr(0, 10)));
  goes_on(80);
  ASSERT_TRUE(slow.send(asked.substr(10)));
  ASSERT_TRUE(drive.until([&] { return slow.has("\r\n\r\n"); }));
  EXPECT_TRUE(is_in(slow));
}

TEST_F(silent_handshakes, that_go_on_with_their_request_byte_by_byte_keep_nobody_out) {
  listen({.limits = {.handshakes_max = 4}});
  std::vector<raw_socket> dripping;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(dripping.emplace_back(transport->port()).send("GET / HTTP/1.1\r\nX: "));
    ASSERT_TRUE(drive.until([&] { return transport->counters().accepted == i; }));
  }
  drive.sink().rejections.clear();
  raw_socket client{transport->port()};
  ASSERT_TRUE(client.send(upgrade_request(transport->port())));
  ASSERT_TRUE(drive.until([&] {
    for (const raw_socket& one : dripping) (void)one.send("x"); // the other end may be gone
    return client.has("\r\n\r\n");
  }));
  EXPECT_TRUE(is_in(client));
  EXPECT_EQ(transport->counters().handshakes_evicted, 1U);
  EXPECT_TRUE(dripping[0].has("HTTP/1.1 503"));
  EXPECT_TRUE(drive.sink().rejections.empty()); // counted, not told one by one
}

TEST_F(silent_handshakes, do_not_push_out_whose_request_has_come) {
  listen({.limits = {.handshakes_max = 4}});
  std::vector<raw_socket> whole; // more of them than places, before the transport looks
  for (int i = 0; i < 12; ++i)
    ASSERT_TRUE(whole.emplace_back(transport->port()).send(upgrade_request(transport->port())));
  ASSERT_TRUE(drive.until([&] { return drive.sink().opens.size() == whole.size(); }));
  EXPECT_EQ(transport->counters().handshakes_evicted, 0U);
  EXPECT_EQ(transport->counters().handshakes_cut, 0U);
}

TEST_F(silent_handshakes, leave_two_places_that_pages_do_not_get) {
  listen({.limits = {.handshakes_max = 4, .handshake_bytes = 16 << 20}});
  const std::string large(4 << 20, 'p');
  drive.sink().answer = [&](const service::http_request&) { return page_of(large); };
  std::vector<raw_socket> readers;
  for (std::size_t i = 0; i < 3; ++i) {
    readers.emplace_back(transport->port(), "127.0.0.1", 2048);
    ASSERT_TRUE(readers.back().send(request(transport->port(), "/large")));
    ASSERT_TRUE(drive.until([&] { return answered(drive) == i + 1; }));
  }
  EXPECT_EQ(drive.sink().pages.size(), 2U);
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
  EXPECT_EQ(drive.sink().rejections[0].what, "2 pages are under way, which is the limit");
  EXPECT_TRUE(is_in(on_stop_path(drive, *transport)));
}

// ---- whose place it is, by addresses that no test has

struct places : testing::Test {
  recording_sink sink;
  std::vector<std::uint32_t> displaced;
  socket_limits limits{.connections_max = 6, .connections_per_address_max = 3};
  poll_set polled = std::move(poll_set::open()).value();
  established connections{limits, polled};
  std::vector<descriptor> others; // the other ends
  rt::time_point now = rt::monotonic_clock::now();

  places() {
    sink.may_displace_which = [](connection_id) { return true; };
    sink.when_displaced = [this](connection_id id) { displaced.push_back(id.index); };
  }
  void pass(rt::duration time) {
    now += time;
    connections.begin_turn(now);
  }
  // The place it got.
  std::optional<std::uint32_t> come(const char* address) {
    const socket_address peer = numeric_address(address, 1234).value();
    connections.begin_turn(now);
    if (!connections.make_room_for_stop(peer, false, sink)) return std::nullopt;
    return take(peer, established::purpose::stop);
  }
  std::uint32_t take(const socket_address& peer, established::purpose why) {
    auto [ours, theirs] = local_pair();
    others.push_back(std::move(theirs));
    EXPECT_TRUE(polled.add(ours.get(), EPOLLIN, {}));
    const connection_id id = connections.open(std::move(ours), peer, why);
    generations[id.index] = id.generation;
    return id.index;
  }
  void leave(std::uint32_t index) {
    connections.close({index, generations[index]}, close_how::aborted);
    connections.report_ended(sink);
  }
  void fill() {
    for (std::uint32_t i = 0; !connections.full(); ++i)
      take(numeric_address("127.0.0.1", 1).value(), established::purpose::any);
  }
  std::map<std::uint32_t, std::uint32_t> generations;
};

TEST_F(places, are_one_for_each_source_beyond_loopback) {
  fill();
  const auto first = come("10.0.0.7");
  ASSERT_TRUE(first);
  EXPECT_EQ(come("10.0.0.7"), first); // its own place again
  EXPECT_EQ(displaced, (std::vector<std::uint32_t>{*first}));
  const auto other = come("10.0.0.8");
  ASSERT_TRUE(other);
  EXPECT_NE(other, first);
  for (int i = 0; i < 1000; ++i) { // however often it comes, at whatever pace
    pass(std::chrono::milliseconds{i % 7});
    EXPECT_EQ(come("10.0.0.7"), first);
  }
  EXPECT_EQ(connections.count_from(numeric_address("10.0.0.8", 1).value()), 1U);
}

TEST_F(places, are_kept_for_a_second_against_other_sources) {
  fill();
  const auto first = come("10.0.0.7");
  pass(300ms);
  const auto second = come("10.0.0.8");
  EXPECT_FALSE(come("10.0.0.9"));
  pass(700ms);
  EXPECT_EQ(come("10.0.0.9"), first);
  EXPECT_FALSE(come("10.0.0.7"));
  pass(300ms);
  EXPECT_EQ(come("10.0.0.7"), second);
}

TEST_F(places, are_not_kept_longer_by_closing_and_coming_back) {
  fill();
  for (const char* address : {"10.0.0.7", "10.0.0.8"}) ASSERT_TRUE(come(address));
  for (int i = 0; i < 4; ++i) { // each is always less than a second old
    pass(300ms);
    leave(4);
    ASSERT_EQ(come("10.0.0.7"), 4U);
    leave(5);
    ASSERT_EQ(come("10.0.0.8"), 5U);
  }
  EXPECT_TRUE(come("10.0.0.9"));
}

TEST_F(places, are_not_kept_longer_by_two_that_change_places) {
  fill();
  for (const char* address : {"10.0.0.7", "10.0.0.8"}) ASSERT_TRUE(come(address));
  for (int i = 0; i < 4; ++i) {
    pass(300ms);
    leave(4);
    leave(5);
    ASSERT_EQ(come(i % 2 == 0 ? "10.0.0.8" : "10.0.0.7"), 5U); // who left last
    ASSERT_EQ(come(i % 2 == 0 ? "10.0.0.7" : "10.0.0.8"), 4U);
  }
  EXPECT_TRUE(come("10.0.0.9"));
}

TEST_F(places, of_a_stranger_who_has_all_that_one_address_may_have_are_one_more) {
  for (int i = 0; i < 3; ++i) take(numeric_address("10.0.0.7", 1).value(), established::purpose::any);
  const auto first = come("10.0.0.7");
  ASSERT_TRUE(first);
  EXPECT_EQ(come("10.0.0.7"), first);
  EXPECT_EQ(connections.count_from(numeric_address("10.0.0.7", 1).value()), 4U);
}

TEST_F(places, of_this_machine_go_to_the_newest) {
  fill();
  const auto first = come("127.0.0.1");
  pass(1ms);
  const auto second = come("127.0.0.1");
  pass(1ms);
  EXPECT_NE(first, second);
  EXPECT_EQ(come("127.0.0.1"), first);
  pass(1ms);
  EXPECT_EQ(come("127.0.0.1"), second);
}

// ---- sources

struct pair_of_addresses {
  const char* one;
  const char* other;
  bool same;
};

TEST(source, is_a_64_of_ipv6_and_an_address_of_ipv4_in_either_spelling) {
  for (const auto& [one, other, same] : {
           pair_of_addresses{"192.0.2.1", "192.0.2.1", true},
           {"192.0.2.1", "192.0.2.2", false},
           {"::ffff:192.0.2.1", "192.0.2.1", true},
           {"::ffff:192.0.2.1", "::ffff:192.0.2.2", false},
           {"::ffff:192.0.2.1", "::1", false}, // the same /64, taken literally
           {"2001:db8:0:1::1", "2001:db8:0:1:ffff:ffff:ffff:ffff", true},
           {"2001:db8:0:1::1", "2001:db8:0:2::1", false},
           {"192.0.2.1", "2001:db8::1", false},
           {"fe80::1%lo", "fe80::2%lo", true},
           {"fe80::1%lo", "fe80::1", false},
       }) {
    const auto a = numeric_address(one, 1);
    const auto b = numeric_address(other, 2);
    ASSERT_TRUE(a && b) << one << " " << other;
    EXPECT_EQ(same_source(*a, *b), same) << one << " " << other;
    EXPECT_EQ(same_source(*b, *a), same) << one << " " << other;
  }
  EXPECT_TRUE(is_loopback(numeric_address("::ffff:127.0.0.1", 1).value()));
  EXPECT_FALSE(is_loopback(numeric_address("::ffff:10.0.0.1", 1).value()));
}

} // namespace
} // namespace stop_path_test
} // namespace rowe::net
