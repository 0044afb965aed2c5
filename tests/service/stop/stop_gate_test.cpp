// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_gate.hpp"

#include <gtest/gtest.h>

#include <string_view>

namespace stop_gate_test {
namespace {

using rowe::service::stop_gate;
using rowe::service::stop_verb;

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

} // namespace
} // namespace stop_gate_test
