// SPDX-License-Identifier: Apache-2.0
// The parts between peers and all others, put together as the core does: what peers are told, what is written
// to them, and who receives. For tests of parts by themselves.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/control/control_service.hpp"
#include "service/incoming/access_control.hpp"
#include "service/incoming/receiver.hpp"
#include "service/incoming/refusals.hpp"
#include "service/outgoing/sender.hpp"
#include "service/state/state_fixture.hpp"

namespace peer_parts {

using namespace std::chrono_literals;
using rowe::service::connection;
using rowe::service::connection_id;
using rowe::service::counter;
using rowe::service::peer_index;

// A transport reports to it that nobody has to know of.
class no_sink final : public rowe::service::transport_sink {
 public:
  rowe::service::admit_answer admit(const rowe::service::credentials&) const noexcept override { return {}; }
  void on_open(connection_id, const rowe::service::peer_info&) noexcept override {}
  void on_bytes(connection_id, std::span<std::byte>) noexcept override {}
  void on_writable(connection_id) noexcept override {}
  void on_close(connection_id, rowe::service::close_cause) noexcept override {}
  void on_rejected(const rowe::service::rejection&) noexcept override {}
  rowe::service::http_answer on_http(const rowe::service::http_request&) noexcept override { return {}; }
};

struct peer_parts : state_fixture::state_fixture {
  using state_fixture::state_fixture;

  rowe::service::message_store store{memory, state};
  rowe::service::outbox out{memory, state, store};
  rowe::service::long_outbox long_out{{.state_ = state, .message_store_ = store, .outbox_ = out}};
  rowe::service::subscription_queues queues{
      {.state_ = state, .message_store_ = store, .outbox_ = out, .long_outbox_ = long_out}};
  rowe::service::sender sending{
      memory, {.state_ = state, .message_store_ = store, .outbox_ = out, .subscription_queues_ = queues}};
  rowe::service::refusals refused{memory, {.state_ = state, .outbox_ = out}};
  rowe::service::access_control access{{.state_ = state, .refusals_ = refused}};
  rowe::service::stop_rules rules{options.stop, cycle.now, 1};
  rowe::service::command_gate gate{memory,
                                   {.state_ = state,
                                    .stop_rules_ = rules,
                                    .sender_ = sending,
                                    .refusals_ = refused}};
  rowe::service::control_service control{{.state_ = state,
                                          .stop_rules_ = rules,
                                          .access_control_ = access,
                                          .command_gate_ = gate}};
  rowe::service::local_delivery delivery{state};
  rowe::service::receiver inbox{memory, {.state_ = state, .outbox_ = out, .local_delivery_ = delivery}};

  // A peer that is connected as far as the parts can tell; the transport knows nothing of it.
  connection& join(std::uint32_t index, std::uint32_t generation = 1) { return join({index, generation}); }
  connection& join(connection_id id, std::string_view subprotocol = {}) {
    connection& c = peers[{id.index}];
    c = {};
    c.id = id;
    c.state = connection::phase::open;
    c.ours = ours;
    c.protocol = &protocols.find(subprotocol);
    c.opened_at = c.heard_at = cycle.now;
    peers.add();
    const peer_index peer{id.index};
    out.open(peer);
    sending.open(peer);
    refused.open(peer);
    return c;
  }
  // One that the transport knows, too.
  connection& connect() {
    const connection_id id = transport.open(rowe::service::side::server);
    no_sink nobody;
    transport.poll(cycle.now, nobody);
    return join(id);
  }
  // What has arrived at such a peer, which reads it now.
  std::string arrived(const connection& at) {
    no_sink nobody;
    transport.poll(cycle.now, nobody);
    const auto sent = transport.sent(at.id);
    std::string bytes{reinterpret_cast<const char*>(sent.data()), sent.size()};
    transport.peer_reads(at.id, sent.size());
    return bytes;
  }

  // What a peer was told and was not written yet, oldest first.
  std::vector<std::string> told(const connection& to) {
    std::vector<std::string> all;
    for (auto at = out.of({to.id.index}).replies.entries.head; at; at = out.entries().after(at)) {
      const auto text = store.slots().text(out.entries().at(at).index);
      all.emplace_back(text.begin(), text.end());
    }
    return all;
  }
  bool was_told(const connection& to, std::string_view part) {
    for (const std::string& text : told(to)) {
      if (text.find(part) != std::string::npos) return true;
    }
    return false;
  }
  void TearDown() override {
    EXPECT_TRUE(peers.check());
    EXPECT_TRUE(store.check());
    EXPECT_TRUE(out.check());
    EXPECT_TRUE(due.check());
    EXPECT_TRUE(inbox.check());
  }
};

} // namespace peer_parts
