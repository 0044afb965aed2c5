// SPDX-License-Identifier: Apache-2.0
#include "service/requests/call_router.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/calls/call_parts.hpp"
#include "json/padded.hpp"

namespace call_router_test {
namespace {

using namespace call_parts;
using form = rowe::wire::call_args::form;

struct call_router_test : call_parts::call_parts {
  explicit call_router_test(bool relay = false) : call_parts{::state_fixture::with(few(), relay)} {}

  rowe::service::stop_service stop{memory,
                                   {.state_ = state,
                                    .sender_ = sending,
                                    .access_control_ = access,
                                    .call_completion_ = completion,
                                    .command_gate_ = gate,
                                    .stop_rules_ = rules}};
  rowe::service::service_directory directory{memory, bounds};
  rowe::service::topic_rates rates{{.state_ = state, .statistics_topic_ = {}}};
  rowe::service::advertisement_table advertised{memory, bounds};
  rowe::detail::latch_words<> loop;
  rowe::service::statistics_report report{
      {.state_ = state, .stop_rules_ = rules, .outbox_ = out, .topic_rates_ = rates}};
  rowe::service::parameters values{memory, {.state_ = state}};
  rowe::service::parameter_services of_values{{.state_ = state,
                                               .access_control_ = access,
                                               .outbox_ = out,
                                               .call_completion_ = completion,
                                               .parameters_ = values}};
  rowe::service::graph_services graph{{.state_ = state,
                                       .advertisement_table_ = advertised,
                                       .service_directory_ = directory,
                                       .stop_rules_ = rules,
                                       .statistics_report_ = report}};
  rowe::service::type_services of_types{{.state_ = state,
                                         .stop_rules_ = rules,
                                         .outbox_ = out,
                                         .call_completion_ = completion,
                                         .parameters_ = values}};
  rowe::service::rights_service of_rights{{.state_ = state, .access_control_ = access}};
  rowe::service::endpoint_services own{{.state_ = state,
                                        .outbox_ = out,
                                        .call_completion_ = completion,
                                        .statistics_report_ = report,
                                        .graph_services_ = graph,
                                        .parameter_services_ = of_values,
                                        .type_services_ = of_types,
                                        .control_service_ = control,
                                        .rights_service_ = of_rights}};
  rowe::service::call_requests requests{{.state_ = state,
                                         .message_store_ = store,
                                         .outbox_ = out,
                                         .local_delivery_ = delivery,
                                         .receiver_ = inbox,
                                         .direct_messages_ = messages,
                                         .call_completion_ = completion,
                                         .long_calls_ = of_long,
                                         .stop_service_ = stop}};
  rowe::service::call_router router{{.state_ = state,
                                     .service_directory_ = directory,
                                     .refusals_ = refused,
                                     .receiver_ = inbox,
                                     .local_delivery_ = delivery,
                                     .call_completion_ = completion,
                                     .long_calls_ = of_long,
                                     .call_requests_ = requests,
                                     .endpoint_services_ = own,
                                     .stop_service_ = stop}};

  static rowe::wire::request of(const connection& c, std::string_view service, std::string_view id) {
    rowe::wire::request asked;
    asked.what = rowe::wire::verb::call;
    asked.codec = c.protocol->first.id();
    asked.service = service;
    asked.id_raw = id;
    return asked;
  }
  void provide(std::string_view service, const connection& by) {
    const auto added = directory.add(service, {}, {}, by.id).index;
    directory.at(added).speaks = by.protocol->first.id();
  }
  // There is a loop that can be stopped; it acknowledges nothing.
  void add_loop() { (void)rules.add_loop("loop", 1s, loop, cycle.now); }
  std::uint64_t stops() const { return counts.read(counter::stops); }
  // A call of this process; nobody is told what becomes of it.
  void start(std::string_view service, std::string_view args, rowe::rt::time_point deadline) {
    const rowe::tests::padded text{args};
    router.start(
        {.service = service, .what = {.text = text.text()}, .began = cycle.now, .deadline = deadline});
  }
};

struct hub_test : call_router_test {
  hub_test() : call_router_test{true} {}
};

TEST_F(hub_test, says_busy_and_which_limits_to_a_peer_that_has_its_share) {
  connection& caller = join(0);
  provide("/add", join(1));
  while (calls.admits({0})) ASSERT_TRUE(router.take_call(caller, of(caller, "/add", {})));
  EXPECT_TRUE(told(caller).empty());
  EXPECT_TRUE(router.take_call(caller, of(caller, "/add", {})));
  ASSERT_EQ(told(caller).size(), 1U);
  EXPECT_NE(told(caller)[0].find("calls_per_connection_max"), std::string::npos);
}

TEST_F(call_router_test, stops_although_there_is_no_time_for_the_answer) {
  add_loop();
  start("/rowe/stop", "{}", cycle.now - 1s);
  EXPECT_EQ(stops(), 1U);
  start("/rowe/stop/reset", "{}", cycle.now - 1s); // but nothing else
  EXPECT_EQ(counts.read(counter::stop_refusals), 0U);
  EXPECT_EQ(counts.read(counter::calls_timed_out), 2U);
}

TEST_F(call_router_test, stops_although_there_is_no_place_for_the_answer) {
  add_loop();
  while (completion.open({}, {}, "/add", rowe::rt::never)) {
  }
  const rowe::tests::padded text{R"({"service":"/rowe/stop"})"};
  router.start({.service = {},
                .what = {.is = form::object, .text = text.text()},
                .began = cycle.now,
                .deadline = cycle.now + 1s});
  EXPECT_EQ(stops(), 1U);
}

} // namespace
} // namespace call_router_test
