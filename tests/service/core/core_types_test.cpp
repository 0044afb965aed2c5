// SPDX-License-Identifier: Apache-2.0
// What the endpoint says of the types of its handles: to programs by /rowe/types, to ROS's clients by rosapi.
#include "access_fixture.hpp"

#include <array>
#include <string>

enum class core_types_mode : std::int8_t { off = -1, on = 2 };
template <>
inline constexpr auto rowe::names<core_types_mode> =
    rowe::enumerators<core_types_mode::off, core_types_mode::on>{};
struct core_types_point {
  double x = 0;
  float y = 0;
};
template <>
inline constexpr auto rowe::schema<core_types_point> =
    rowe::fields<&core_types_point::x, &core_types_point::y>{};
struct core_types_path {
  core_types_mode mode{};
  std::array<core_types_point, 3> points{};
  std::int64_t number = 0;
};
template <>
inline constexpr auto
    rowe::schema<core_types_path> = rowe::fields<&core_types_path::mode, &core_types_path::points,
                                                 rowe::field<&core_types_path::number>.as_string()>{}
                                        .type("test/Path");

namespace core_types_test {
namespace {

using namespace access_fixture;

rowe::endpoint_options with_a_part() {
  rowe::endpoint_options options = with_roles();
  options.access.roles.push_back(
      {.name = "part", .subscribe = {"/arm/**"}, .call = {"/arm/*", "/rowe/types", "/rosapi/**"}});
  options.access.roles.push_back({.name = "lister", .call = {"/rowe/types"}});
  options.access.identities.push_back({"lister", "lister", rowe::hash_token(token_of("lister"))});
  options.access.identities.push_back({"part", "part", rowe::hash_token(token_of("part"))});
  return options;
}

struct types : access {
  types() : access{with_a_part()} {}

  rowe::detail::queue_pair& publish_paths(std::string_view name) {
    return on.offer_now(rowe::detail::pair_kind::publish_value, name, sizeof(core_types_path), {},
                        &rowe::describe<core_types_path>(), "test/Path");
  }
  void serve(std::string_view name) {
    on.offer_now({.kind = rowe::detail::pair_kind::respond_value,
                  .name = name,
                  .type = "test/Plan",
                  .out_depth = 4,
                  .in_depth = 4,
                  .out_bytes = sizeof(core_types_path),
                  .in_bytes = sizeof(core_types_point),
                  .encoded = &rowe::describe<core_types_path>(),
                  .decoded = &rowe::describe<core_types_point>()});
  }
  // All pages of /rowe/types.
  std::string all_types(peer& by) {
    std::string all;
    for (std::string from = "0"; from != "null";) {
      const std::string answer = call(by, "/rowe/types", R"({"from":)" + from + "}");
      all += answer;
      const std::size_t at = answer.find(R"("next":)");
      if (at == std::string::npos) break;
      from = answer.substr(at + 7, answer.find('}', at) - at - 7);
    }
    return all;
  }
};

constexpr std::string_view path_json =
    R"({"type":"test/Path","members":[{"name":"mode","is":"int8","names":[["off",-1],["on",2]]},)"
    R"({"name":"points","is":"array","most":3,"fixed":true,"of":{"is":"object","object":)"
    R"({"type":"","members":[{"name":"x","is":"float64"},{"name":"y","is":"float32"}]}}},)"
    R"({"name":"number","is":"int64","as_string":true}]})";

TEST_F(types, of_topics_and_services_are_described) {
  publish_paths("/path");
  serve("/plan");
  peer& boss = comes("supervisor");
  const std::string answer = all_types(boss);
  const std::string of_topic = R"({"topic":"/path","type":"test/Path","message":)";
  EXPECT_TRUE(has(answer, of_topic + std::string{path_json} + "}"));
  EXPECT_TRUE(has(answer, R"({"service":"/plan","type":"test/Plan","request":{"type":"","members":[)"
                          R"({"name":"x","is":"float64"},{"name":"y","is":"float32"}]},"answer":)" +
                              std::string{path_json} + "}"))
      << answer;
  EXPECT_TRUE(has(answer, R"("next":null)"));
}

TEST_F(types, of_parameters_say_what_they_may_be) {
  const auto gain = open_parameter<double>(on, "/gain", 0.5, {0, 2});
  const auto any = open_parameter<double>(on, "/any", 0.5);
  const auto single = open_parameter<float>(on, "/single", 0.5F, {.least = 0.1F});
  const auto count = open_parameter<std::int8_t>(on, "/count", 3);
  const auto size = open_parameter<std::uint64_t>(on, "/size", 3);
  const auto flag = open_parameter<bool>(on, "/flag", true);
  const auto frame = open_parameter<rowe::fixed_string<8>>(on, "/frame", "map");
  const auto mode = open_parameter<core_types_mode>(on, "/mode", core_types_mode::on);
  peer& boss = comes("supervisor");
  const std::string all = all_types(boss);
  const auto told = [&all](std::string_view name, std::string_view value) {
    return has(all, R"({"parameter":")" + std::string{name} + R"(","type":"","value":)" + std::string{value} +
                        "}");
  };
  EXPECT_TRUE(told("/gain", R"({"is":"float64","least":0,"most":2})")) << all;
  EXPECT_TRUE(told("/any", R"({"is":"float64"})"));
  EXPECT_TRUE(told("/single", R"({"is":"float32","least":0.1})"));
  EXPECT_TRUE(told("/count", R"({"is":"int64","least":-128,"most":127})"));
  EXPECT_TRUE(told("/size", R"({"is":"uint64","least":0,"most":18446744073709551615})"));
  EXPECT_TRUE(told("/flag", R"({"is":"boolean"})"));
  EXPECT_TRUE(told("/frame", R"({"is":"text","most":8})"));
  EXPECT_TRUE(told("/mode", R"({"is":"int64","names":[["off",-1],["on",2]],"by_name":true})"));
  EXPECT_FALSE(has(all, R"("parameter":"/rowe/)")) << "those are read only";
  on.shared.parameters.close(*on.shared.parameters.find("/mode"));
  EXPECT_FALSE(has(all_types(boss), R"("parameter":"/mode")")) << "it went with its handle";
  EXPECT_FALSE(has(all_types(comes("lister")), R"("parameter":)")) << "it may not read them";
}

TEST_F(types, come_page_after_page_each_once) {
  for (int i = 0; i < 6; ++i) publish_paths("/path" + std::to_string(i));
  peer& boss = comes("supervisor");
  std::string from = "0";
  int pages = 0;
  std::array<int, 6> seen{};
  while (from != "null" && pages < 100) {
    ++pages;
    const std::string answer = call(boss, "/rowe/types", R"({"from":)" + from + "}");
    for (std::size_t i = 0; i < seen.size(); ++i)
      seen[i] += has(answer, R"("topic":"/path)" + std::to_string(i) + "\"") ? 1 : 0;
    const std::size_t at = answer.find(R"("next":)");
    ASSERT_NE(at, std::string::npos) << answer;
    from = answer.substr(at + 7, answer.find('}', at) - at - 7);
  }
  EXPECT_EQ(from, "null");
  EXPECT_GT(pages, 1) << "small slots have 512 bytes here";
  EXPECT_EQ(seen, (std::array{1, 1, 1, 1, 1, 1}));
  EXPECT_TRUE(has(call(boss, "/rowe/types", R"({"from":-1})"), "must be a number, 0 or more"));
}

TEST_F(types, go_with_their_handles) {
  auto& pair = publish_paths("/path");
  peer& boss = comes("supervisor");
  boss.tell(R"({"op":"subscribe","topic":"/path"})", 2);
  EXPECT_TRUE(has(all_types(boss), "/path"));
  pair.lifecycle.close();
  on.cycles(3);
  EXPECT_FALSE(has(all_types(boss), "/path")) << "the peer still subscribes";
}

TEST_F(types, of_what_a_role_may_not_see_are_not_told) {
  publish_paths("/path");
  serve("/plan");
  peer& part = comes("part");
  constexpr std::string_view of_path = R"({"type":"test/Path"})";
  constexpr std::string_view of_plan = R"({"type":"test/Plan"})";
  const std::string none = all_types(part);
  EXPECT_FALSE(has(none, R"("topic":"/path")")) << none;
  EXPECT_FALSE(has(none, "/plan")) << none;
  EXPECT_TRUE(has(call(part, "/rosapi/message_details", of_path), "no handle of this endpoint"));
  EXPECT_TRUE(has(call(part, "/rosapi/service_request_details", of_plan), "no handle of this endpoint"));
  publish_paths("/arm/path");
  serve("/arm/plan");
  const std::string all = all_types(part);
  EXPECT_TRUE(has(all, R"("topic":"/arm/path")"));
  EXPECT_FALSE(has(all, R"("topic":"/path")")) << all;
  EXPECT_FALSE(has(all, R"("service":"/plan")")) << all;
  EXPECT_TRUE(has(call(part, "/rosapi/message_details", of_path), "typedefs"));
  EXPECT_TRUE(has(call(part, "/rosapi/service_request_details", of_plan), "typedefs"));
  EXPECT_TRUE(has(all_types(comes("observer")), R"("topic":"/path")"));
}

TEST_F(types, are_told_to_ros_clients) {
  publish_paths("/path");
  serve("/plan");
  peer& boss = comes("supervisor");
  constexpr std::string_view path =
      R"({"typedefs":[{"type":"test/Path","fieldnames":["mode","points","number"],)"
      R"("fieldtypes":["int8","test/Path_points","string"],"fieldarraylen":[-1,3,-1],)"
      R"("examples":["0","[]",""],"constnames":["off","on"],"constvalues":["-1","2"]},)"
      R"({"type":"test/Path_points","fieldnames":["x","y"],"fieldtypes":["float64","float32"],)"
      R"("fieldarraylen":[-1,-1],"examples":["0.0","0.0"],"constnames":[],"constvalues":[]}]})";
  EXPECT_TRUE(has(call(boss, "/rosapi/message_details", R"({"type":"test/Path"})"), path))
      << call(boss, "/rosapi/message_details", R"({"type":"test/Path"})");
  EXPECT_TRUE(has(call(boss, "/rosapi/service_response_details", R"({"type":"test/Plan"})"),
                  R"({"typedefs":[{"type":"test/Plan","fieldnames":["mode","points","number"])"));
  EXPECT_TRUE(has(call(boss, "/rosapi/service_request_details", R"({"type":"test/Plan"})"),
                  R"({"typedefs":[{"type":"test/Plan","fieldnames":["x","y"])"));
}

TEST_F(types, that_nobody_has_are_refused_by_name) {
  publish_paths("/path");
  peer& boss = comes("supervisor");
  for (const char* service :
       {"/rosapi/message_details", "/rosapi/service_request_details", "/rosapi/service_response_details"}) {
    const std::string answer = call(boss, service, R"({"type":"no/Such"})");
    EXPECT_TRUE(has(answer, "no/Such: no handle of this endpoint has a schema for it"));
    EXPECT_TRUE(has(answer, R"("result":false)"));
    EXPECT_TRUE(has(call(boss, service, "{}"), "the arguments need a member `type`"));
    EXPECT_TRUE(has(call(boss, service, R"({"type":7})"), "the arguments need a member `type`"));
  }
}

} // namespace
} // namespace core_types_test
