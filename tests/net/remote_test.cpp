// SPDX-License-Identifier: Apache-2.0
#include <sys/eventfd.h>

#include "net/client/client_attempt.hpp"
#include "support.hpp"

namespace rowe::net {
namespace remote_test {
namespace {

TEST(client_and_server, of_ours_understand_each_other) {
  const std::string_view spoken[] = {"rowe.v1"};
  auto robot = listening({.subprotocols = spoken});
  auto hop = connecting({.host = "127.0.0.1", .port = robot->port(), .path = "/x", .subprotocols = spoken});
  driver drive{*robot};
  recording_sink& at_hop = drive.add(*hop);
  hop->connect();
  ASSERT_TRUE(drive.until([&] { return at_hop.opens.size() == 1 && drive.sink().opens.size() == 1; }));
  EXPECT_EQ(at_hop.opens[0].subprotocol, "rowe.v1");
  EXPECT_EQ(drive.sink().opens[0].subprotocol, "rowe.v1");
  EXPECT_EQ(drive.sink().opens[0].path, "/x");
  const std::string much(16'000, 'm');
  EXPECT_EQ(write(*hop, at_hop.opens[0].id, "to the robot"), 12U);
  EXPECT_EQ(write(*robot, drive.sink().opens[0].id, much), much.size());
  ASSERT_TRUE(drive.until([&] {
    return drive.sink().received[0] == "to the robot" && at_hop.received[0].size() == much.size();
  }));
  hop->close(at_hop.opens[0].id, close_how::flushed);
  ASSERT_TRUE(drive.until([&] { return at_hop.closes.size() == 1 && drive.sink().closes.size() == 1; }));
  EXPECT_EQ(at_hop.closes[0].cause, close_cause::asked);
  EXPECT_EQ(drive.sink().closes[0].cause, close_cause::peer);
}

TEST(client_by_name, finds_localhost) {
  auto robot = listening();
  auto hop = connecting({.host = "localhost", .port = robot->port()});
  driver drive{*robot};
  recording_sink& at_hop = drive.add(*hop);
  for (std::size_t i = 1; i <= 3; ++i) { // each attempt looks it up anew
    hop->connect();
    ASSERT_TRUE(drive.until([&] { return at_hop.opens.size() == i; }))
        << (at_hop.rejections.empty() ? "" : at_hop.rejections[0].what);
    robot->close(drive.sink().opens[i - 1].id, close_how::aborted);
    ASSERT_TRUE(drive.until([&] { return at_hop.closes.size() == i; }));
  }
  EXPECT_EQ(at_hop.opens[0].address, "127.0.0.1:" + std::to_string(robot->port()));
}

TEST(client_by_name, gives_up_a_name_that_nobody_knows) {
  auto hop = connecting({.host = "no-such-host.invalid", .port = 80});
  driver drive{*hop};
  hop->connect();
  drive.turn();
  EXPECT_TRUE(drive.sink().rejections.empty());
  drive.skip(5100ms); // a name server may take its time; we do not, and the helper is left to finish alone
  ASSERT_TRUE(drive.until([&] { return drive.sink().rejections.size() == 1; }));
  EXPECT_NE(drive.sink().rejections[0].what.find("no-such-host.invalid"), std::string::npos);
}

TEST(client_by_name, tries_each_address_in_turn) {
  const std::string_view name[] = {"robot"};
  auto robot = listening({.allow_hosts = name});
  auto polled = poll_set::open();
  ASSERT_TRUE(polled);
  auto lws = lws_host::open(lws_role::client, {}, 1, handshake_bytes_least);
  ASSERT_TRUE(lws);
  const socket_limits limits;
  socket_counters counters;
  std::vector<std::byte> scratch(65536);
  established connections{limits, *polled};
  const descriptor waker{::eventfd(0, EFD_CLOEXEC)};
  const connect_options options{.host = "robot", .port = robot->port()};
  auto attempt = client_attempt::open(options, *polled, **lws, connections, counters, scratch, waker.get());
  ASSERT_TRUE(attempt);
  resolved_host three; // nobody at the first; the second cannot be routed to; ours
  three.addresses[0] = *numeric_address("127.0.0.3", robot->port());
  three.addresses[1] = *numeric_address("240.0.0.1", robot->port());
  three.addresses[2] = *numeric_address("127.0.0.1", robot->port());
  three.count = 3;
  (*attempt)->use(three);

  driver drive{*robot};
  recording_sink ours;
  (*attempt)->ask();
  ASSERT_TRUE(drive.until([&] {
    for (const socket_event& event : polled->take())
      if (event.token.from == source::attempt) (*attempt)->on_event(event, drive.now(), ours);
    (*attempt)->step(drive.now(), ours);
    drive.skip(100ms); // an address may neither accept nor refuse
    return !ours.opens.empty() || !ours.rejections.empty();
  }));
  ASSERT_EQ(ours.opens.size(), 1U) << ours.rejections.at(0).what;
  EXPECT_EQ(ours.opens[0].address, "127.0.0.1:" + std::to_string(robot->port()));
}

TEST(client_options, are_checked_before_anything_is_tried) {
  const auto refusal_of = [](const connect_options& options) {
    const auto made = socket_transport::connect(options);
    EXPECT_FALSE(made);
    return made ? error{errc::full} : made.error();
  };
  const std::string long_host(101, 'h');
  const std::string long_path = '/' + std::string(1024, 'p');
  EXPECT_EQ(refusal_of({.host = ""}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a b"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "[::1]"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a\r\nEvil: 1"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a", .port = 0}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a", .path = "x"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a", .path = "/x y"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = "a", .path = "/\r\nEvil: 1"}).code, errc::bad_url);
  EXPECT_EQ(refusal_of({.host = long_host}), (error{errc::too_big, 101, 100}));
  EXPECT_EQ(refusal_of({.host = "a", .path = long_path}), (error{errc::too_big, 1025, 1024}));
  EXPECT_EQ(refusal_of({.host = "a", .limits = {.header_bytes_max = 5000}}),
            (error{errc::bad_argument, 5000, 4096}));
}

} // namespace
} // namespace remote_test
} // namespace rowe::net
