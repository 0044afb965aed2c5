// SPDX-License-Identifier: Apache-2.0
// What libwebsockets allocates, when, and what happens when there is nothing left for it.
#include "memory_hog.hpp"
#include "support.hpp"

#include <libwebsockets.h>

namespace rowe::net {
namespace memory_test {
namespace {

constexpr std::size_t least_bytes = std::size_t{1} << 16;

// The longest request that the filter lets through: a subprotocol list as long as the header may be.
std::string longest_request(std::uint16_t port) {
  const std::string bare = upgrade_request(port, "Sec-WebSocket-Protocol: rowe.v1\r\n");
  std::string names;
  while (bare.size() + names.size() + 10 < 4096) names += ", other.v1";
  return upgrade_request(port, "Sec-WebSocket-Protocol: rowe.v1" + names + "\r\n");
}

std::uint64_t allocations(const socket_transport& transport) { return transport.memory().allocations; }

struct memory : served {};

TEST_F(memory, is_used_for_the_context_and_given_back_after_each_handshake_and_page) {
  const std::uint64_t resting = transport->memory().bytes_used;
  EXPECT_GT(resting, 4096U);
  EXPECT_LT(resting, 16384U);
  for (int i = 0; i < 20; ++i) {
    const raw_socket client = upgraded(drive, *transport);
    EXPECT_EQ(transport->memory().bytes_used, resting);
    raw_socket visitor = answered_whole(drive, *transport, request(transport->port(), "/"));
    EXPECT_EQ(transport->memory().bytes_used, resting);
  }
  EXPECT_EQ(transport->memory().refusals, 0U);
}

// The figure in lws_host.cpp on which the decision rests whether there is room.
TEST_F(memory, needs_at_most_two_thirds_of_what_is_set_aside_for_a_handshake) {
  const std::string_view spoken[] = {"rowe.v1"};
  listen({.subprotocols = spoken});
  const std::uint64_t resting = transport->memory().bytes_used;
  raw_socket client = answered(drive, *transport, longest_request(transport->port()));
  EXPECT_EQ(client.text.substr(0, 12), "HTTP/1.1 101");
  const std::uint64_t taken = transport->memory().bytes_peak - resting;
  RecordProperty("bytes", std::to_string(taken));
  EXPECT_GT(taken, 8192U);
  EXPECT_LE(taken, std::uint64_t{16} << 10);
}

TEST_F(memory, of_the_least_size_serves_the_most_handshakes) {
  listen({.limits = {.handshakes_max = 1024, .handshake_bytes = least_bytes}});
  for (int i = 0; i < 3; ++i) upgraded(drive, *transport);
  EXPECT_EQ(drive.sink().opens.size(), 3U);
  EXPECT_EQ(transport->memory().refusals, 0U);
}

TEST_F(memory, is_not_touched_while_peers_are_connected) {
  auto other = connecting({.host = "127.0.0.1", .port = transport->port()});
  recording_sink& seen = drive.add(*other);
  other->connect();
  raw_socket client = upgraded(drive, *transport);
  ASSERT_TRUE(drive.until([&] { return seen.opens.size() == 1; }));

  const std::uint64_t before = allocations(*transport) + allocations(*other);
  const std::uint64_t turns = transport->counters().lws_turns;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(client.send("to the server"));
    for (const auto& open : drive.sink().opens) write(*transport, open.id, "to the peers");
    write(*other, seen.opens[0].id, "from the client");
    drive.skip(100ms); // libwebsockets' own timers come due again and again
    drive.turn();
    (void)client.read();
  }
  EXPECT_GT(transport->counters().lws_turns, turns + 40);
  EXPECT_EQ(allocations(*transport) + allocations(*other), before);
}

TEST_F(memory, that_a_slow_reader_of_a_page_holds_is_refused_to_others_until_it_reads_on) {
  const std::string body(std::size_t{6} << 20,
                         'x'); // more than the kernel takes for a reader that does not read
  listen({.limits = {.handshake_bytes = std::size_t{8} << 20}});
  drive.sink().answer = [&](const service::http_request& asked) {
    return page_of(asked.path == "/large" ? std::string_view{body} : "small");
  };
  raw_socket peer = upgraded(drive, *transport);
  raw_socket slow = reader_of(drive, *transport, "/large");
  EXPECT_GT(transport->memory().bytes_used, std::uint64_t{1} << 20) << "libwebsockets keeps no copy";

  raw_socket second = answered_whole(drive, *transport, request(transport->port(), "/large"));
  EXPECT_EQ(second.text.substr(0, 12), "HTTP/1.1 503");
  EXPECT_NE(second.text.find("handshake_bytes"), std::string::npos) << second.text;
  ASSERT_EQ(drive.sink().rejections.size(), 1U);
  EXPECT_EQ(drive.sink().rejections[0].status, 503);
  EXPECT_EQ(transport->counters().handshakes_starved, 1U);
  EXPECT_EQ(transport->memory().refusals, 1U);

  // There is room for small things all the while.
  raw_socket third = answered_whole(drive, *transport, request(transport->port(), "/small"));
  EXPECT_EQ(third.text.substr(0, 12), "HTTP/1.1 200");
  write(*transport, drive.sink().opens[0].id, "still here");
  ASSERT_TRUE(drive.until([&] { return peer.has("still here"); }));

  ASSERT_TRUE(drive.until([&] { return slow.ended(); }));
  EXPECT_GE(slow.text.size(), body.size());
  raw_socket again = answered_whole(drive, *transport, request(transport->port(), "/large"));
  EXPECT_EQ(again.text.substr(0, 12), "HTTP/1.1 200");
}

TEST_F(memory, that_is_used_up_refuses_newcomers_and_nobody_else) {
  listen({.limits = {.handshake_bytes = least_bytes}});
  raw_socket peer = upgraded(drive, *transport);
  drive.sink().answer = [](const service::http_request&) { return page_of("whole"); };
  const memory_hog hog{drive, *transport};
  const std::uint64_t starved = transport->counters().handshakes_starved;
  const std::size_t rejected = drive.sink().rejections.size();
  const auto expect_rejection = [&](const std::string& asked) {
    raw_socket newcomer = answered_whole(drive, *transport, asked);
    EXPECT_EQ(newcomer.text.substr(0, 12), "HTTP/1.1 503");
    EXPECT_FALSE(newcomer.failed) << "the answer came with a reset";
  };
  for (int i = 0; i < 5; ++i) {
    expect_rejection(request(transport->port(), "/"));
    expect_rejection(upgrade_request(transport->port()));
    write(*transport, drive.sink().opens[0].id, "still here");
    ASSERT_TRUE(drive.until([&] { return peer.has("still here"); }));
    ASSERT_TRUE(peer.send("so am I"));
    ASSERT_TRUE(drive.until([&] { return drive.sink().received[0].ends_with("so am I"); }));
    peer.text.clear();
    drive.sink().received.clear();
  }
  EXPECT_EQ(transport->counters().handshakes_starved, starved + 10U);
  EXPECT_EQ(drive.sink().rejections.size(), rejected + 10U);
  EXPECT_TRUE(drive.sink().closes.empty());
}

int nothing(lws*, lws_callback_reasons, void*, void*, std::size_t) { return 0; }

struct foreign_context {
  foreign_context() {
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.protocols = protocols;
    made = lws_create_context(&info);
  }
  ~foreign_context() { lws_context_destroy(made); }
  static constexpr lws_protocols protocols[] = {{"any", nothing, 0, 0, 0, nullptr, 0}, {}};
  lws_context* made;
};

// Other parts of the program may use libwebsockets, too: contexts made before ours, during and after.
TEST_F(memory, is_not_given_to_other_users_of_libwebsockets) {
  transport.reset();
  auto before = std::make_unique<foreign_context>();
  listen({});
  const std::uint64_t resting = transport->memory().bytes_used;
  const std::uint64_t counted = allocations(*transport);
  auto during = std::make_unique<foreign_context>();
  ASSERT_TRUE(before->made && during->made);
  before.reset();
  EXPECT_EQ(transport->memory().bytes_used, resting);
  EXPECT_EQ(allocations(*transport), counted);
  upgraded(drive, *transport);
  lws_service(during->made, -1);
  transport.reset();
  const foreign_context after;
  EXPECT_NE(after.made, nullptr);
}

} // namespace
} // namespace memory_test
} // namespace rowe::net
