// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/sender.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/incoming/peer_parts.hpp"

namespace sender_test {
namespace {

using namespace peer_parts;
using rowe::service::write_work_per_cycle;
using rowe::wire::opcode;

struct sender_test : peer_parts::peer_parts {
  sender_test()
      : peer_parts{::state_fixture::with({.connections_max = 2 * write_work_per_cycle,
                                          .message_bytes_max = 1024,
                                          .small_slots = 512,
                                          .small_slot_bytes = 256,
                                          .large_slots = 4,
                                          .handles_max = 1})} {}

  void say(const connection& to, std::string_view text) {
    ASSERT_TRUE(out.reply({to.id.index}, [&](rowe::json::writer& into) { into.append(text); }));
  }
  static std::span<const std::byte> bytes(std::string_view text) {
    return std::as_bytes(std::span{text.data(), text.size()});
  }
  std::size_t& capacity(const connection& c) { return transport.link_of(c.id).capacity_bytes; }
  void TearDown() override {
    EXPECT_TRUE(sending.check());
    peer_parts::TearDown();
  }
};

TEST_F(sender_test, begins_anew_with_the_next_peer_at_the_same_place) {
  connection& peer = connect();
  capacity(peer) = 0;
  sending.add_stop_reply({peer.id.index}, std::string{"{\"old\":1}"});
  sending.send_control({peer.id.index}, opcode::pong, bytes("old"));
  const connection_id was = peer.id;
  sending.forget({was.index});
  out.forget({was.index});
  transport.peer_closes(was);
  (void)arrived(peer);
  peer.state = connection::phase::free;
  peers.remove();
  connection& next = connect();
  ASSERT_EQ(next.id.index, was.index);
  say(next, "{\"new\":1}");
  sending.flush_all();
  const std::string all = arrived(next);
  EXPECT_EQ(all.find("old"), all.npos);
  EXPECT_NE(all.find("new"), all.npos);
}

} // namespace
} // namespace sender_test
