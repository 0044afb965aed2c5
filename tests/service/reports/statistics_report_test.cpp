// SPDX-License-Identifier: Apache-2.0
// What /rowe/stats says of the loops: how regularly each runs.
#include "service/core/core_fixtures.hpp"

#include <rowe/stop_latch.hpp>

namespace statistics_report_test {
namespace {

using namespace harness;

struct loops_reported : core_test {
  rowe::detail::queue_pair& offer_loop(std::string_view name, rowe::duration loop_timeout) {
    return on.offer_now(rowe::detail::latch_request({.name = name, .loop_timeout = loop_timeout}));
  }
  // The loop looks, as often; the service thread comes once.
  void run(rowe::stop_latch& loop, int cycles, rowe::duration each) {
    for (; cycles > 0; --cycles) (void)loop.engaged(at += each);
    on.cycle();
  }
  std::string page() {
    const auto answer = on.net.get({"/api/v1/stats", {}, false}, on.core);
    return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
  }
  std::string reported() { return member(page(), "loops"); }

  rowe::time_point at{2000s};
};

TEST_F(loops_reported, are_none_where_nothing_can_be_stopped) { EXPECT_EQ(reported(), "[]"); }

TEST_F(loops_reported, have_zeros_until_a_cycle_is_done) {
  rowe::stop_latch loop{core_harness::handle_of(offer_loop("base", 100ms))};
  const std::string none = R"([{"name":"base","cycles":0,"p50_us":0,"p99_us":0,"p999_us":0,"max_us":0,)"
                           R"("bound_us":100000}])";
  EXPECT_EQ(reported(), none);
  run(loop, 1, 1ms); // it ends none
  EXPECT_EQ(reported(), none);
}

TEST_F(loops_reported, say_how_long_cycles_took_and_may_take) {
  rowe::stop_latch base{core_harness::handle_of(offer_loop("base", 100ms))};
  rowe::stop_latch arm{core_harness::handle_of(offer_loop("arm.left", 1500us))};
  run(base, 1, 1ms);
  run(base, 9890, 1ms);
  run(base, 95, 2ms);
  run(base, 14, 5ms);
  run(base, 1, 42'123'456ns);
  run(arm, 2, 500us);
  // A percentile is that of its bucket's upper end, so at most 1/128 more than the truth.
  EXPECT_EQ(reported(), R"([{"name":"base","cycles":10000,"p50_us":1003.519,"p99_us":2007.039,)"
                        R"("p999_us":5013.503,"max_us":42123.456,"bound_us":100000},)"
                        R"({"name":"arm.left","cycles":1,"p50_us":500,"p99_us":500,"p999_us":500,)"
                        R"("max_us":500,"bound_us":1500}])");
}

TEST_F(loops_reported, are_the_same_in_the_topic_the_service_and_the_page) {
  rowe::stop_latch loop{core_harness::handle_of(offer_loop("base", 100ms))};
  run(loop, 3, 1ms);
  const std::string wanted = R"("loops":[{"name":"base","cycles":2,"p50_us":1000,"p99_us":1000,)"
                             R"("p999_us":1000,"max_us":1000,"bound_us":100000}])";
  peer by{on};
  by.tell(R"({"op":"call_service","id":"1","service":"/rowe/stats"})");
  EXPECT_TRUE(has(by.hear_as_one(), wanted));
  by.tell(R"({"op":"subscribe","topic":"/rowe/stats"})");
  on.cycles(3, 500ms);
  EXPECT_TRUE(has(by.hear_as_one(), wanted));
  EXPECT_TRUE(has(page(), wanted));
}

TEST_F(loops_reported, take_a_time_that_goes_back_as_none) {
  rowe::stop_latch loop{core_harness::handle_of(offer_loop("base", 100ms))};
  run(loop, 1, 1ms);
  run(loop, 1, 0ms);
  run(loop, 1, -1s);
  EXPECT_TRUE(has(reported(), R"("cycles":2,"p50_us":0,"p99_us":0,"p999_us":0,"max_us":0,)")) << reported();
}

TEST_F(loops_reported, begin_anew_with_a_new_latch) {
  auto& pair = offer_loop("base", 100ms);
  {
    rowe::stop_latch loop{core_harness::handle_of(pair)};
    run(loop, 1000, 1ms);
  }
  EXPECT_TRUE(has(reported(), R"("cycles":999)"));
  pair.lifecycle.close();
  on.cycle();
  EXPECT_EQ(reported(), "[]");
  offer_loop("base", 100ms);
  EXPECT_TRUE(has(reported(), R"("cycles":0,"p50_us":0,"p99_us":0,"p999_us":0,"max_us":0,)")) << reported();
}

TEST_F(loops_reported, have_the_exact_maximum_even_above_a_minute) {
  rowe::stop_latch loop{core_harness::handle_of(offer_loop("base", 10s))};
  run(loop, 1, 1ms);
  run(loop, 1, 2h); // longer than the histogram's minute
  EXPECT_TRUE(has(reported(), R"("max_us":7200000000,)")) << reported();
}

} // namespace
} // namespace statistics_report_test
