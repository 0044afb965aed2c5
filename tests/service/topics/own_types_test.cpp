// SPDX-License-Identifier: Apache-2.0
// The types of the endpoint's own topics and services agree with what it sends.
#include "service/core/access_fixture.hpp"

#include <set>
#include <string>

#include "service/topics/own_types.hpp"
#include "json/reading/reader.hpp"

namespace own_types_test {
namespace {

using namespace access_fixture;
using rowe::member_description;
using rowe::schema_description;
using rowe::value_description;
using rowe::value_kind;
namespace json = rowe::json;

std::string object_fault(std::string_view text, const schema_description& type, const std::string& at);

// What of a value is not as described; empty: all is.
std::string value_fault(const json::value& v, const value_description& d, const member_description& m,
                        const std::string& at) {
  const std::string wrong = at + " is " + std::string{v.raw.substr(0, 60)};
  switch (d.kind) {
  case value_kind::boolean: return v.type == json::kind::boolean ? "" : wrong;
  case value_kind::float32:
  case value_kind::float64: return v.type == json::kind::number ? "" : wrong;
  case value_kind::text: return v.type == json::kind::string && v.raw.size() - 2 <= d.count_max ? "" : wrong;
  case value_kind::object: return v.type == json::kind::object ? object_fault(v.raw, *d.object, at) : wrong;
  case value_kind::optional:
    if (v.type == json::kind::null) // a member is left out
      return &d == m.type && d.element->kind != value_kind::optional ? wrong : "";
    return value_fault(v, *d.element, m, at);
  case value_kind::array: {
    if (v.type != json::kind::array) return wrong;
    json::array_walk walk{v.raw};
    for (json::value one; walk.next(one);)
      if (std::string fault = value_fault(one, *d.element, m, at + "[]"); !fault.empty()) return fault;
    return {};
  }
  default: break;
  }
  if (m.by_name) {
    for (const auto& e : d.enumerators)
      if (json::text_is(v, e.name)) return {};
    return wrong;
  }
  if (m.as_string) return v.type == json::kind::string ? "" : wrong;
  return json::to_integer(v) || json::to_unsigned(v) ? "" : wrong;
}

std::string object_fault(std::string_view text, const schema_description& type, const std::string& at) {
  if (type.members.empty()) return {}; // of which nothing is described
  std::set<std::string_view> seen;
  json::object_walk walk{json::document{text}};
  for (json::member one; walk.next(one);) {
    const member_description* described = nullptr;
    for (const member_description& m : type.members)
      if (json::name_is(one, m.name)) described = &m;
    const std::string path = at + "." + std::string{one.name_raw};
    if (described == nullptr) return path + " is not described";
    seen.insert(described->name);
    if (std::string fault = value_fault(one.what, *described->type, *described, path); !fault.empty())
      return fault;
  }
  for (const member_description& m : type.members)
    if (m.type->kind != value_kind::optional && !seen.contains(m.name))
      return at + "." + std::string{m.name} + " is missing";
  return {};
}

rowe::endpoint_options with_an_asker() {
  rowe::endpoint_options options = with_roles();
  options.access.roles.push_back({.name = "asker", .call = {"/rosapi/service_type"}});
  options.access.identities.push_back({"asker", "asker", rowe::hash_token(token_of("asker"))});
  return options;
}

struct own_types : access {
  own_types() : access{with_an_asker()} {}

  static std::string values_of(const std::string& answer) {
    const auto found = json::find(json::root(answer).raw, "values");
    return found ? std::string{found->raw} : std::string{};
  }
};

TEST_F(own_types, agree_with_what_services_answer) {
  stoppable_loop loop{on};
  const auto speed = open_parameter<double>(on, "/speed", 0.5, {0.0, 1.0});
  peer& boss = comes("supervisor");
  boss.tell(R"({"op":"subscribe","topic":"/odom"})");
  const auto args_of = [&](std::string_view name) -> std::string {
    if (name == "/rosapi/message_details") return R"({"type":"rowe/Stats"})";
    if (name.ends_with("_details") && name != "/rosapi/node_details") return R"({"type":"rosapi/GetParam"})";
    return R"({"name":"/speed","value":"0.25","topic":"/odom","service":"/rowe/stop","type":"rowe/Stats"})";
  };
  for (const auto& own : rowe::service::own_service_types()) {
    if (own.name.starts_with("/rowe/stop")) continue; // below
    const std::string answer = call(boss, own.name, args_of(own.name));
    const std::string values = values_of(answer);
    if (own.name == "/rosapi/delete_param" || own.name.starts_with("/rosapi/action_")) {
      EXPECT_TRUE(answer.find("\"result\":false") != std::string::npos || values.starts_with("{")) << answer;
      continue; // nobody has types of actions here, and a parameter is never deleted
    }
    ASSERT_TRUE(values.starts_with('{')) << own.name << ": " << answer;
    EXPECT_EQ(object_fault(values, *own.answer, ""), "") << own.name << ": " << values;
  }
  // While nothing is stopped, its cause is null; and a stop whose loop does not look is not observed.
  call_stop(on, boss, "guard", R"("guard":"hand",)");
  (void)loop.moves();
  call_stop(on, boss, "reset", "");
  for (const std::string_view name :
       {"/rowe/stop/state", "/rowe/stop", "/rowe/stop/reset", "/rowe/stop/guard"}) {
    const auto* const own = rowe::service::own_type_of_service(name);
    boss.say(R"({"op":"call_service","service":")" + std::string{name} + R"(","args":{}})");
    std::string values;
    for (int i = 0; i < 200 && values.empty(); ++i) {
      on.cycle(std::chrono::milliseconds{1});
      for (const std::string& one : boss.hear())
        if (one.find("service_response") != std::string::npos) values = values_of(one);
    }
    EXPECT_EQ(object_fault(values, *own->answer, ""), "") << name << ": " << values;
  }
}

TEST_F(own_types, agree_with_what_topics_say) {
  stoppable_loop loop{on};
  const auto speed = open_parameter<double>(on, "/speed", 0.5, {0.0, 1.0});
  (void)on.offer_now(rowe::detail::subscribe_request<pose>("/cmd_vel", {.lease = 300ms}));
  peer& boss = comes("supervisor");
  for (const auto& own : rowe::service::own_topic_types()) {
    boss.say(R"({"op":"subscribe","topic":")" + std::string{own.name} + "\"}");
    std::string message;
    for (int i = 0; i < 400 && message.empty(); ++i) {
      on.cycle(std::chrono::milliseconds{5});
      for (const std::string& one : boss.hear()) {
        const auto topic = json::find(json::root(one).raw, "topic");
        if (topic && json::text_is(*topic, own.name))
          message = std::string{json::find(json::root(one).raw, "msg")->raw};
      }
    }
    ASSERT_FALSE(message.empty()) << own.name;
    EXPECT_EQ(object_fault(message, *own.message, ""), "") << own.name << ": " << message;
  }
}

TEST_F(own_types, are_told_to_ros_clients) {
  peer& boss = comes("supervisor");
  EXPECT_EQ(values_of(call(boss, "/rosapi/topic_type", R"({"topic":"/rowe/stats"})")),
            R"({"type":"rowe/Stats"})");
  EXPECT_EQ(values_of(call(boss, "/rosapi/service_type", R"({"service":"rosapi/topics"})")),
            R"({"type":"rosapi/Topics"})");
  EXPECT_EQ(values_of(call(boss, "/rosapi/service_type", R"({"service":"/rowe/stop"})")), R"({"type":""})")
      << "nothing here can be stopped";
  EXPECT_EQ(values_of(call(boss, "/rosapi/service_response_details", R"({"type":"rosapi/Topics"})")),
            R"({"typedefs":[{"type":"rosapi/Topics","fieldnames":["topics","types","left_out"],)"
            R"("fieldtypes":["string","string","uint32"],"fieldarraylen":[0,0,-1],)"
            R"("examples":["[]","[]","0"],"constnames":[],"constvalues":[]}]})");
  EXPECT_EQ(values_of(call(comes("asker"), "/rosapi/service_type", R"({"service":"/rosapi/set_param"})")),
            R"({"type":""})");
}

} // namespace
} // namespace own_types_test
