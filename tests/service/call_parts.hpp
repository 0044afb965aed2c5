// SPDX-License-Identifier: Apache-2.0
// The parts that calls stand on, put together as the core does, with peers that are connected and no
// transport: for tests of the parts that begin and end calls.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "service/call_completion.hpp"
#include "service/event_log.hpp"
#include "service/memory_plan.hpp"
#include "service/shared_inbox.hpp"
#include "service/submission_queue.hpp"

namespace call_parts {

using namespace std::chrono_literals;
using rowe::service::call_endpoint;
using rowe::service::connection;
using rowe::service::connection_id;
using rowe::service::counter;
using rowe::service::peer_index;

inline rowe::limits few() {
  rowe::limits bounds;
  bounds.small_slots = 2 * rowe::service::replies_max;
  bounds.small_slot_bytes = 256;
  bounds.large_slots = 1;
  bounds.message_bytes_max = 1024;
  bounds.connections_max = 4;
  bounds.calls_max = 16;
  bounds.calls_per_connection_max = 8;
  bounds.services_max = 8;
  bounds.lanes_max = 2;
  bounds.door_slots = 4;
  return bounds;
}

struct call_parts : testing::Test {
  const rowe::limits bounds = few();
  rowe::rt::arena memory{rowe::service::plan_memory(bounds).arena(), rowe::rt::page_lock::none};
  rowe::json::reader validator = rowe::json::reader::create(bounds.message_bytes_max, 16).value();
  const rowe::wire::protocol_set& protocols = rowe::wire::protocols_of(rowe::peer_profile::standard);
  rowe::service::cycle_state cycle{.now = rowe::rt::time_point{1s}};
  rowe::service::shared_state shown{memory, bounds};
  rowe::service::counters& counts = shown.counts;
  rowe::service::submission_queue submissions{memory, bounds};
  rowe::service::shared_inbox shared{memory, bounds};
  rowe::service::event_log events{cycle, shown};
  rowe::service::timers due{memory, bounds, cycle.now};
  rowe::service::peer_table peers{memory, bounds};
  rowe::service::topic_table topics{memory, bounds, protocols.envelope};
  rowe::service::latch_store latches{memory, bounds};
  rowe::service::message_store store{
      memory, bounds, {.cycle = cycle, .counts = counts, .due = due, .text_bytes_max = SIZE_MAX}};
  rowe::service::outbox out{memory,
                            bounds,
                            {.cycle = cycle,
                             .counts = counts,
                             .due = due,
                             .store = store,
                             .peers = peers,
                             .topics = topics,
                             .latches = latches}};
  rowe::service::refusals refused{memory,
                                  bounds,
                                  {.cycle = cycle,
                                   .counts = counts,
                                   .events = events,
                                   .peers = peers,
                                   .out = out,
                                   .protocols = protocols}};
  rowe::service::rows<rowe::service::pair_index, rowe::detail::lane> lanes =
      memory.carve<rowe::detail::lane>(bounds.lanes_max);
  rowe::service::rows<rowe::service::pair_index, rowe::service::pair_row> views =
      memory.carve<rowe::service::pair_row>(bounds.lanes_max);
  rowe::service::call_table calls{memory, bounds, bounds.connections_max};
  rowe::service::local_delivery delivery{
      {.cycle = cycle, .counts = counts, .lanes = lanes, .views = views, .queue = submissions}};
  rowe::service::receiver inbox{memory,
                                bounds,
                                {.cycle = cycle,
                                 .counts = counts,
                                 .peers = peers,
                                 .calls = calls,
                                 .out = out,
                                 .lanes = lanes,
                                 .views = views,
                                 .queue = submissions,
                                 .shared = shared,
                                 .delivery = delivery,
                                 .claimants = bounds.connections_max,
                                 .answers_any = false}};
  rowe::service::direct_messages messages{memory,
                                          bounds,
                                          {.cycle = cycle,
                                           .shown = shown,
                                           .peers = peers,
                                           .calls = calls,
                                           .store = store,
                                           .out = out,
                                           .delivery = delivery,
                                           .inbox = inbox,
                                           .validator = validator,
                                           .claimants = bounds.connections_max}};
  rowe::service::call_completion completion{memory,
                                            bounds,
                                            {.cycle = cycle,
                                             .counts = counts,
                                             .due = due,
                                             .peers = peers,
                                             .calls = calls,
                                             .store = store,
                                             .out = out,
                                             .refused = refused,
                                             .messages = messages,
                                             .delivery = delivery,
                                             .lanes = lanes,
                                             .views = views,
                                             .validator = validator,
                                             .protocols = protocols}};

  connection& join(std::uint32_t index) {
    connection& c = peers[{index}];
    c = {};
    c.id = {index, 1};
    c.state = connection::phase::open;
    c.protocol = &protocols.find({});
    peers.add();
    out.open({index});
    refused.open({index});
    return c;
  }
  // What is queued for a peer as answers, oldest first.
  std::vector<std::string> replies(const connection& to) {
    std::vector<std::string> all;
    for (auto at = out.of({to.id.index}).replies.entries.head; at; at = out.entries().after(at)) {
      const auto text = store.slots().text(out.entries().at(at).index);
      all.emplace_back(text.begin(), text.end());
    }
    return all;
  }
  // No further answer to it finds room.
  void fill(const connection& to) {
    while (out.has_place_for_reply({to.id.index}))
      ASSERT_TRUE(out.reply({to.id.index}, [](rowe::json::writer& into) { into.append("{}"); }));
  }
  void TearDown() override {
    EXPECT_TRUE(calls.check());
    EXPECT_TRUE(completion.check());
    EXPECT_TRUE(due.check());
    EXPECT_TRUE(store.check());
  }
};

} // namespace call_parts
