// SPDX-License-Identifier: Apache-2.0
// All parts as core_parts puts them together, without the cycle: for tests of the parts that call nearly all
// others. The test does what the core does in a cycle, as far as it matters.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/core/core_parts.hpp"
#include "service/incoming/peer_parts.hpp"
#include "service/state/state_fixture.hpp"

namespace all_parts {

using namespace ::peer_parts;
using rowe::service::pair_index;

// With the parts that tests use.
struct exposed : rowe::service::core_parts {
  using core_parts::core_parts;
  using core_parts::direct_messages_;
  using core_parts::dispatcher_;
  using core_parts::handle_registry_;
  using core_parts::handle_submissions_;
  using core_parts::inconsistency;
  using core_parts::ingress_;
  using core_parts::outbox_;
  using core_parts::receiver_;
  using core_parts::refusals_;
  using core_parts::sender_;
  using core_parts::service_directory_;
  using core_parts::state_;
  using core_parts::stop_service_;
  using core_parts::thread_submissions_;
};

class no_handler final : public rowe::service::frame_handler {
 public:
  void handle(peer_index, const rowe::wire::frame_step&) noexcept override {}
  void handle_again(peer_index, std::span<std::byte>, bool) noexcept override {}
  bool stop_in_use() const noexcept override { return false; }
  bool is_stop(peer_index, std::span<const std::byte>, bool) noexcept override { return false; }
};

struct all_parts : state_fixture::outside_fixture {
  using outside_fixture::outside_fixture;

  no_handler handler;
  exposed parts{memory, chosen_options(), with_threads(), seams(), handler, start_time};
  rowe::service::core_state& state = parts.state_;
  rowe::service::counters& counts = state.counts;
  rowe::service::cycle_state& cycle = state.cycle;

  // A peer that the transport knows, too; it takes plain messages.
  connection& connect() {
    const connection_id id = transport.open(ours);
    no_sink nobody;
    transport.poll(cycle.now, nobody);
    connection& c = state.peers[{id.index}];
    c = {};
    c.id = id;
    c.state = connection::phase::open;
    c.ours = ours;
    c.protocol = &protocols.find({});
    c.spoke_last = c.protocol->topics.id();
    c.opened_at = c.heard_at = cycle.now;
    c.takes_messages = c.local = true;
    parts.ingress_.open({id.index});
    parts.outbox_.open({id.index});
    parts.refusals_.open({id.index});
    parts.sender_.open({id.index});
    parts.stop_service_.open({id.index});
    state.peers.add();
    return c;
  }
  void block(const connection& c) { transport.link_of(c.id).capacity_bytes = 0; }
  void unblock(const connection& c) {
    transport.link_of(c.id).capacity_bytes = 1 << 20;
    parts.sender_.writable({c.id.index});
  }
  // Writes what there is, and returns what has arrived at the peer.
  std::string hear(const connection& by) {
    parts.sender_.flush_all();
    parts.direct_messages_.take_outcomes();
    no_sink nobody;
    transport.poll(cycle.now, nobody);
    const auto sent = transport.sent(by.id);
    std::string bytes{reinterpret_cast<const char*>(sent.data()), sent.size()};
    transport.peer_reads(by.id, sent.size());
    return bytes;
  }
  pair_index offer(const rowe::detail::pair_request& asked) { return outside_fixture::offer(state, asked); }
  // One that sends and receives plain messages, or only sends them.
  pair_index offer_lane(bool receives = true, std::uint32_t depth = 8) {
    return offer({.kind = rowe::detail::pair_kind::talk,
                  .receives = receives,
                  .out_depth = depth,
                  .in_depth = depth,
                  .completions_depth = depth,
                  .out_bytes = 128,
                  .in_bytes = 128,
                  .completions_bytes = 128});
  }
  rowe::detail::queue_pair& pair(pair_index at) { return state.pairs[at]; }
  // A handle's thread submits a plain message, to everyone where there is no peer.
  bool submit(pair_index by, std::string_view text, rowe::detail::peer_ref to = {}, bool only_now = false) {
    const rowe::detail::producer_end& end = pair(by).user.out;
    const auto slot = end.free_ring->try_take();
    if (!slot) return false;
    const std::int64_t stamped = rowe::rt::nanoseconds_of(cycle.now);
    *end.memory.header(*slot) = {.stamped_ns = stamped,
                                 .expires_ns = only_now ? stamped : rowe::rt::nanoseconds_of(rowe::rt::never),
                                 .bytes = static_cast<std::uint32_t>(text.size()),
                                 .peer = to};
    text.copy(reinterpret_cast<char*>(end.memory.value(*slot)), text.size());
    return end.ring->try_push(*slot);
  }
  static rowe::detail::peer_ref ref(const connection& c) { return {c.id.index, c.id.generation}; }
  void TearDown() override { EXPECT_EQ(parts.inconsistency(), ""); }
};

} // namespace all_parts
