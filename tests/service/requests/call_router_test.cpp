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

  rowe::service::stop_rules rules{options.stop, cycle.now, 1};
  rowe::service::stop_service stop{memory,
                                   {.state = state,
                                    .sender = sending,
                                    .access_control = access,
                                    .call_completion = completion,
                                    .stop_rules = rules}};
  rowe::service::service_directory directory{memory, bounds};
  rowe::service::topic_rates rates{{.state = state, .statistics_topic = {}}};
  rowe::service::advertisement_table advertised{memory, bounds};
  rowe::detail::latch_words<> loop;
  rowe::service::statistics_report report{
      {.state = state, .stop_rules = rules, .outbox = out, .topic_rates = rates}};
  rowe::service::parameters values{memory, {.state = state}};
  rowe::service::parameter_services of_values{{.state = state,
                                               .access_control = access,
                                               .outbox = out,
                                               .call_completion = completion,
                                               .parameters = values}};
  rowe::service::graph_services graph{{.state = state,
                                       .advertisement_table = advertised,
                                       .service_directory = directory,
                                       .stop_rules = rules,
                                       .statistics_report = report}};
  rowe::service::type_services of_types{
      {.state = state, .stop_rules = rules, .outbox = out, .call_completion = completion}};
  rowe::service::endpoint_services own{{.state = state,
                                        .service_directory = directory,
                                        .stop_rules = rules,
                                        .outbox = out,
                                        .call_completion = completion,
                                        .statistics_report = report,
                                        .graph_services = graph,
                                        .parameter_services = of_values,
                                        .type_services = of_types}};
  rowe::service::call_requests requests{{.state = state,
                                         .message_store = store,
                                         .outbox = out,
                                         .local_delivery = delivery,
                                         .receiver = inbox,
                                         .direct_messages = messages,
                                         .call_completion = completion,
                                         .long_calls = of_long,
                                         .stop_service = stop}};
  rowe::service::call_router router{{.state = state,
                                     .service_directory = directory,
                                     .refusals = refused,
                                     .receiver = inbox,
                                     .local_delivery = delivery,
                                     .call_completion = completion,
                                     .long_calls = of_long,
                                     .call_requests = requests,
                                     .endpoint_services = own,
                                     .stop_service = stop}};

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
  EXPECT_TRUE(replies(caller).empty());
  EXPECT_TRUE(router.take_call(caller, of(caller, "/add", {})));
  ASSERT_EQ(replies(caller).size(), 1U);
  EXPECT_NE(replies(caller)[0].find("calls_per_connection_max"), std::string::npos);
}

TEST_F(call_router_test, hands_a_call_of_this_process_to_the_stop_with_its_arguments) {
  add_loop();
  start("rowe/stop", R"({"source":"test"})", cycle.now + 1s);
  EXPECT_EQ(stops(), 1U);
  EXPECT_EQ(rules.source(), "test");
  EXPECT_EQ(calls.in_flight(), 1U); // answered when the loop has acknowledged, or in vain
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

TEST_F(call_router_test, knows_no_stop_where_there_is_none) {
  start("/rowe/stop", "{}", cycle.now - 1s);
  start("/rowe/stop", "{}", cycle.now + 1s);
  EXPECT_EQ(stops(), 0U);
  EXPECT_EQ(calls.in_flight(), 0U);
}

} // namespace
} // namespace call_router_test
