// SPDX-License-Identifier: Apache-2.0
// How often the service thread enters the kernel: its turns, on this thread, over sockets, under traps that
// see every system call whoever makes it. The clock stands while it is counted, so that nothing is due but
// what the peers say. A thread that is watched can start no others: what waits here for ever is ended by
// ctest.
#include <rowe/responder.hpp>
#include <rowe/rt/tripwire.hpp>
#include <rowe/subscriber.hpp>

#include <gtest/gtest.h>

#include <deque>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "net/support.hpp"
#include "net/transport/socket_transport.hpp"
#include "service/core/core_harness.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace {

using namespace std::chrono_literals;
using rowe::detail::pair_kind;
using rowe::service::counter;

// What a core_harness plays over.
struct sockets {
  explicit sockets(std::uint32_t connections_max) {
    rowe::net::listen_options how;
    how.limits.connections_max = connections_max;
    listening = rowe::net::listening(how);
  }
  operator rowe::service::transport&() { return *listening; } // NOLINT(google-explicit-constructor)
  std::unique_ptr<rowe::net::socket_transport> listening;
};

rowe::endpoint_options options() {
  auto chosen = harness::small_options();
  chosen.relay = true;
  chosen.limits.connections_max = 16;
  chosen.limits.subscriptions_max = 128;
  chosen.limits.small_slots = 128;
  chosen.limits.queue_depth_max = 64;
  chosen.limits.queued_max = 1024;
  return chosen;
}

// A peer, by a socket of its own. It answers pings together with what it says next.
class peer {
 public:
  explicit peer(std::uint16_t port) : socket_{port} {
    assembly_.resize(64 * 1024);
    parser_.reset(rowe::wire::role::client, {.message_bytes_max = 60 * 1024, .fragments_max = 1}, assembly_);
    if (!socket_.send(rowe::net::upgrade_request(port))) throw std::runtime_error{"no connection"};
  }
  bool upgraded() {
    if (!socket_.has("\r\n\r\n")) return false;
    socket_.text.clear();
    return true;
  }

  void put(rowe::wire::opcode what, std::string_view text) {
    const rowe::wire::mask_key key{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
    std::vector<std::byte> frame(rowe::wire::frame_header_bytes_max + text.size());
    const std::size_t header = rowe::wire::write_frame_header(frame.data(), what, text.size(), key);
    text.copy(reinterpret_cast<char*>(frame.data() + header), text.size());
    rowe::wire::mask(std::span{frame}.subspan(header, text.size()), key);
    said_.append(reinterpret_cast<const char*>(frame.data()), header + text.size());
  }
  void put(std::string_view text) { put(rowe::wire::opcode::text, text); }
  // All that was put, in one segment.
  void send() {
    if (!socket_.send(said_)) throw std::runtime_error{"the connection is lost"};
    said_.clear();
  }
  void say(std::string_view text) {
    put(text);
    send();
  }

  // The texts that have come.
  std::vector<std::string> hear() {
    socket_.read();
    std::vector<std::string> texts;
    std::span<std::byte> rest{reinterpret_cast<std::byte*>(socket_.text.data()), socket_.text.size()};
    while (!rest.empty()) {
      const auto step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      const std::string_view text{reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
      if (step.event == rowe::wire::frame_event::text) texts.emplace_back(text);
      if (step.event == rowe::wire::frame_event::ping) put(rowe::wire::opcode::pong, text);
    }
    socket_.text.clear();
    return texts;
  }

 private:
  rowe::net::raw_socket socket_;
  std::vector<std::byte> assembly_;
  rowe::wire::frame_parser parser_;
  std::string said_;
};

struct system_calls : testing::Test {
  harness::core_harness_over<sockets> on{options()};
  std::deque<peer> peers;

  static void SetUpTestSuite() { ASSERT_TRUE(rowe::rt::tripwire::watch_system_calls()); }

  template <class Turn>
  static std::uint64_t counted(Turn turn) {
    auto wire = rowe::rt::tripwire::arm();
    turn();
    return wire.disarm().system_calls;
  }
  std::uint64_t counted_cycle() {
    return counted([&] { on.cycle(0ns); });
  }
  // Of the turn that finds what was said. The kernel may take its time to bring it; turns before find
  // nothing.
  template <class Turn>
  std::uint64_t counted_arrival(Turn turn) {
    const std::uint64_t before = on.count(counter::bytes_in);
    for (;;) {
      const std::uint64_t calls = counted(turn);
      if (on.count(counter::bytes_in) != before) return calls;
      EXPECT_EQ(calls, 1U);
    }
  }
  std::uint64_t counted_arrival() {
    return counted_arrival([&] { on.cycle(0ns); });
  }

  // One that has subscribed, and has been sent so much that its first ping is answered: then its socket's
  // buffer is as it stays.
  peer& listening_to(std::string_view topic) {
    peer& made = peers.emplace_back(on.net.listening->port());
    while (!made.upgraded()) on.cycle(1ms);
    made.say(R"({"op":"subscribe","topic":")" + std::string{topic} + "\"}");
    for (int i = 0; i < 50; ++i) {
      made.say(R"({"op":"publish","topic":")" + std::string{topic} + R"(","msg":{"hello":"to myself"}})");
      while (made.hear().empty()) on.cycle(100us);
    }
    return made;
  }
  rowe::detail::queue_pair& publishing(std::string_view topic) {
    auto& pair = on.offer(pair_kind::publish_text, topic, 300, {.depth = 64});
    on.cycle(1ms);
    return pair;
  }
  void publish(rowe::detail::queue_pair& by, std::string_view text) {
    ASSERT_TRUE(rowe::detail::publish_into(by, text.size(), on.now, [&](std::byte* slot) {
      text.copy(reinterpret_cast<char*>(slot), text.size());
    }));
  }
  // Peers have heard everything and answered every ping, and the answers have been read.
  void settle() {
    for (int quiet = 0; quiet < 3;) {
      for (peer& one : peers) {
        (void)one.hear();
        one.send();
      }
      quiet = counted([&] { on.cycle(1ms); }) == 1 ? quiet + 1 : 0;
    }
  }
};

TEST_F(system_calls, are_one_in_a_turn_without_anything_to_do) {
  for (int i = 0; i < 5; ++i) listening_to("/a");
  settle();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(counted_cycle(), 1U) << i; // epoll_wait
}

TEST_F(system_calls, are_three_for_a_message_that_comes_and_goes_back) {
  peer& one = listening_to("/echo");
  settle();
  for (int i = 0; i < 1000; ++i) {
    one.say(R"({"op":"publish","topic":"/echo","msg":{"n":1}})");
    ASSERT_EQ(counted_arrival(), 3U) << i; // epoll_wait, recv, send
    ASSERT_EQ(one.hear().size(), 1U) << i;
  }
}

// Under idle::poll and wake: what was waited for is not looked for again.
TEST_F(system_calls, are_three_for_it_as_well_when_it_was_waited_for) {
  peer& one = listening_to("/echo");
  settle();
  for (int i = 0; i < 1000; ++i) {
    one.say(R"({"op":"publish","topic":"/echo","msg":{"n":1}})");
    const auto calls = counted_arrival([&] {
      on.net.listening->wait(on.now, on.now + 1s);
      on.cycle(0ns);
    });
    ASSERT_EQ(calls, 3U) << i; // epoll_pwait2, recv, send
    ASSERT_EQ(one.hear().size(), 1U) << i;
  }
}

// Under idle::spin: no events are asked for between a call and its answer.
TEST_F(system_calls, are_three_for_a_call_that_a_handle_answers) {
  peer& one = listening_to("/a");
  rowe::responder<rowe::json_text, rowe::json_text> service{
      on.handle_of(on.offer({.kind = pair_kind::respond_text,
                             .name = "/add",
                             .out_depth = 8,
                             .in_depth = 4,
                             .out_bytes = 300,
                             .in_bytes = 300}))};
  settle();
  for (int i = 0; i < 1000; ++i) {
    one.say(R"({"service":"/add","a":38,"b":4,"message_id":"1"})");
    ASSERT_EQ(counted_arrival(), 2U) << i; // epoll_wait, recv
    ASSERT_TRUE(on.core.awaits_answer());
    auto asked = service.try_next(on.now);
    ASSERT_TRUE(asked && service.reply(*asked, R"({"sum":42})", on.now));
    ASSERT_TRUE(on.core.has_answer());
    ASSERT_EQ(counted([&] { on.core.write_answer(on.now); }), 1U) << i; // send
    ASSERT_EQ(one.hear().size(), 1U) << i;
    if (i % 50 == 0) settle();
  }
}

TEST_F(system_calls, are_two_for_the_forty_messages_that_one_peer_is_sent_in_a_turn) {
  peer& one = listening_to("/telemetry");
  auto& pair = publishing("/telemetry");
  for (int round = 0; round < 50; ++round) {
    settle();
    for (int i = 0; i < 40; ++i) publish(pair, R"({"n":1})");
    ASSERT_EQ(counted_cycle(), 2U) << round; // epoll_wait, one send of all
    ASSERT_EQ(one.hear().size(), 40U) << round;
  }
}

TEST_F(system_calls, are_two_for_the_forty_messages_that_one_peer_has_sent) {
  peer& one = listening_to("/command");
  auto& pair = on.offer(pair_kind::subscribe_text, "/heard", 300, {.depth = 64});
  settle();
  for (int i = 0; i < 40; ++i) one.put(R"({"op":"publish","topic":"/heard","msg":{"n":1}})");
  one.send();
  ASSERT_EQ(counted_arrival(), 2U); // epoll_wait, recv
  std::size_t taken = 0;
  for (rowe::subscriber<rowe::json_text> heard{on.handle_of(pair)}; heard.try_take();) ++taken;
  EXPECT_EQ(taken, 40U);
}

TEST_F(system_calls, are_one_for_each_peer_that_hears_a_message_and_one_more) {
  for (int i = 0; i < 8; ++i) listening_to("/all");
  auto& pair = publishing("/all");
  for (int i = 0; i < 50; ++i) {
    settle();
    publish(pair, R"({"n":1})");
    ASSERT_EQ(counted_cycle(), 9U) << i; // epoll_wait, eight sends
    for (peer& each : peers) ASSERT_EQ(each.hear().size(), 1U) << i;
  }
}

} // namespace
