// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_gate.hpp"

#include <gtest/gtest.h>

#include <string_view>

namespace stop_gate_test {
namespace {

using rowe::service::stop_gate;
using rowe::service::stop_verb;
using rowe::wire::decoded;
using rowe::wire::verb;

TEST(stop_gate, knows_its_names_in_both_spellings_and_no_others) {
  const struct {
    std::string_view name;
    stop_verb expected;
  } table[] = {
      {"/rowe/stop", stop_verb::stop},
      {"rowe/stop", stop_verb::stop},
      {"/rowe/stop/reset", stop_verb::reset},
      {"rowe/stop/reset", stop_verb::reset},
      {"/rowe/stop/guard", stop_verb::guard},
      {"rowe/stop/guard", stop_verb::guard},
      {"/rowe/stop/state", stop_verb::state},
      {"rowe/stop/state", stop_verb::state},
      {"", stop_verb::none},
      {"/", stop_verb::none},
      {"//rowe/stop", stop_verb::none},
      {"/rowe/stop/", stop_verb::none},
      {"/rowe/stop/lea", stop_verb::none},
      {"/rowe/stats", stop_verb::none},
      {"/Rowe/Stop", stop_verb::none},
      {"/rowe/stop#1", stop_verb::none},
  };
  for (const auto& row : table) EXPECT_EQ(stop_gate::service_named(row.name), row.expected) << row.name;
}

TEST(stop_gate, names_each_verb_with_the_slash) {
  for (const stop_verb which : {stop_verb::stop, stop_verb::reset, stop_verb::guard, stop_verb::state}) {
    const std::string_view name = stop_gate::name_of(which);
    EXPECT_TRUE(name.starts_with("/rowe/stop")) << name;
    EXPECT_EQ(stop_gate::service_named(name), which) << name;
  }
}

TEST(stop_gate, finds_the_stop_in_texts_whatever_else_is_wrong_with_them) {
  const struct {
    std::string_view text;
    bool expected;
  } table[] = {
      {R"({"service":"/rowe/stop"})", true},
      {R"({"service":"rowe/stop"})", true},
      {R"({"topic":"/rowe/stop"})", true},
      {R"({"service":"/rowe/stop#7"})", true},
      {R"({"service":"/rowe/stop#"})", true},
      {R"({"op":42,"id":{},"service":"/rowe/stop"})", true},
      {R"({"service":null,"topic":"rowe/stop"})", true},
      {R"({"service":"/other","topic":"/rowe/stop"})", true},
      {"{\"service\":\"/rowe/st\\u006fp\"}", true}, // an escape
      {R"({"topic":"/rowe/stop#7"})", false},       // only calls have ids
      {R"({"service":"/rowe/stop/reset"})", false},
      {R"({"service":"/rowe/stopped"})", false},
      {R"({"service":["/rowe/stop"]})", false},
      {R"({"args":{"service":"/rowe/stop"}})", false},
      {R"({"id":"/rowe/stop"})", false},
      {R"({})", false},
      {R"(["/rowe/stop"])", false},
      {R"("/rowe/stop")", false},
  };
  for (const auto& row : table) EXPECT_EQ(stop_gate::asks_to_stop(row.text), row.expected) << row.text;
}

TEST(stop_gate, judges_a_request_by_its_verb_and_the_rest_by_its_text) {
  constexpr std::string_view stop = "/rowe/stop";
  constexpr std::string_view names_it = R"({"service":"/rowe/stop"})";
  constexpr std::string_view other = R"({"service":"/other"})";
  const struct {
    decoded read;
    verb what;
    std::string_view topic;
    std::string_view service;
    std::string_view text;
    stop_verb expected;
  } table[] = {
      {decoded::request, verb::call, {}, stop, other, stop_verb::stop},
      {decoded::request, verb::call, {}, "/rowe/stop/reset", names_it, stop_verb::reset},
      {decoded::request, verb::publish, stop, {}, other, stop_verb::stop},
      {decoded::request, verb::publish, "/odom", {}, names_it, stop_verb::none},
      {decoded::request, verb::subscribe, stop, stop, names_it, stop_verb::none},
      {decoded::request, verb::reply, {}, stop, names_it, stop_verb::none},
      {decoded::request, verb::message, {}, {}, names_it, stop_verb::stop},
      {decoded::request, verb::message, {}, stop, other, stop_verb::none},
      {decoded::refused, verb::subscribe, {}, {}, names_it, stop_verb::stop},
      {decoded::refused, verb::call, {}, stop, other, stop_verb::none},
      {decoded::malformed, verb::call, stop, stop, names_it, stop_verb::stop},
      {decoded::malformed, verb::call, stop, stop, other, stop_verb::none},
  };
  for (const auto& row : table) {
    rowe::wire::request asked;
    asked.what = row.what;
    asked.topic = row.topic;
    asked.service = row.service;
    EXPECT_EQ(stop_gate::find(row.read, asked, row.text), row.expected)
        << "row " << &row - table << ": " << row.text;
  }
}

TEST(stop_gate, judges_a_call_of_this_process_by_its_service_and_an_object_by_its_text_too) {
  using form = rowe::wire::call_args::form;
  constexpr std::string_view names_it = R"({"topic":"/rowe/stop"})";
  EXPECT_EQ(stop_gate::find("/rowe/stop/guard", {.is = form::object, .text = names_it}), stop_verb::guard);
  EXPECT_EQ(stop_gate::find("/other", {.is = form::object, .text = names_it}), stop_verb::stop);
  EXPECT_EQ(stop_gate::find("/other", {.is = form::object, .text = "{}"}), stop_verb::none);
  EXPECT_EQ(stop_gate::find("/other", {.is = form::args, .text = names_it}), stop_verb::none);
}

TEST(stop_gate, lets_peers_that_came_for_the_stop_stop_and_see_the_state) {
  const struct {
    verb what;
    std::string_view topic;
    bool expected;
  } table[] = {
      {verb::call, {}, true}, // refused where it is answered
      {verb::publish, "/rowe/stop", true},
      {verb::publish, "/rowe/stop/state", false},
      {verb::publish, "/odom", false},
      {verb::subscribe, "rowe/stop/state", true},
      {verb::subscribe, "/rowe/stop", false},
      {verb::subscribe, "/odom", false},
      {verb::unsubscribe, "/rowe/stop/state", true},
      {verb::unsubscribe, "/odom", false},
      {verb::advertise, "/rowe/stop", false},
      {verb::advertise_service, {}, false},
      {verb::status, {}, false},
      {verb::set_level, {}, false},
      {verb::unknown, {}, false},
  };
  for (const auto& row : table) {
    rowe::wire::request asked;
    asked.what = row.what;
    asked.topic = row.topic;
    EXPECT_EQ(stop_gate::is_for_stop_peers(asked), row.expected)
        << "row " << &row - table << ": " << row.topic;
  }
  EXPECT_TRUE(stop_gate::is_for_stop_peers(stop_verb::stop));
  EXPECT_TRUE(stop_gate::is_for_stop_peers(stop_verb::state));
  EXPECT_FALSE(stop_gate::is_for_stop_peers(stop_verb::none));
  EXPECT_FALSE(stop_gate::is_for_stop_peers(stop_verb::reset));
  EXPECT_FALSE(stop_gate::is_for_stop_peers(stop_verb::guard));
}

} // namespace
} // namespace stop_gate_test
