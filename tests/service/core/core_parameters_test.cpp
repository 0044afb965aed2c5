// SPDX-License-Identifier: Apache-2.0
// Parameters as peers read and write them: by the services of ROS, by role, and on their topic.
#include "access_fixture.hpp"

#include <optional>
#include <string>
#include <utility>

#include <rowe/parameter.hpp>

enum class core_parameters_mode : std::int8_t { off = -3, mapping, locating = 7 };
template <>
inline constexpr auto rowe::names<core_parameters_mode> =
    rowe::enumerators<core_parameters_mode::off, core_parameters_mode::mapping,
                      rowe::enumerator<core_parameters_mode::locating, "localizing">>{};

namespace core_parameters_test {
namespace {

using namespace access_fixture;

struct parameters : access {
  explicit parameters(const rowe::endpoint_options& options = with_roles()) : access{options} {}

  template <class T>
  rowe::parameter<T> open(std::string_view name, const T& first, const rowe::range<T>& allowed = {}) {
    return open_parameter(on, name, first, allowed);
  }
  std::string call(peer& by, std::string_view service, std::string_view args) {
    return access::call(by, "/rosapi/" + std::string{service}, args);
  }
  std::string get(peer& by, std::string_view name) {
    return call(by, "get_param", R"({"name":")" + std::string{name} + "\"}");
  }
  // `json` is what roslib puts in quotes.
  std::string set(peer& by, std::string_view name, std::string_view json) {
    std::string escaped;
    for (const char c : json) escaped += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
    return call(by, "set_param", R"({"name":")" + std::string{name} + R"(","value":")" + escaped + "\"}");
  }
};

TEST_F(parameters, that_a_peer_sets_reach_the_loop) {
  auto gain = open<double>("/gain", 0.5, {0, 2});
  EXPECT_EQ(gain.get(), 0.5);
  EXPECT_FALSE(gain.refresh());
  peer& boss = comes("supervisor");
  EXPECT_TRUE(has(set(boss, "gain", "1.25"), R"("result":true)"));
  EXPECT_TRUE(gain.refresh());
  EXPECT_FALSE(gain.refresh());
  EXPECT_EQ(gain.get(), 1.25);
  EXPECT_TRUE(has(get(boss, "/gain"), R"("value":"1.25","successful":true)"));
}

TEST_F(parameters, that_the_program_sets_are_seen_by_peers) {
  auto count = open<std::uint8_t>("count", 3);
  peer& anyone = comes("observer");
  EXPECT_TRUE(count.set(200));
  EXPECT_EQ(count.get(), 200);
  on.cycle();
  EXPECT_TRUE(has(get(anyone, "count"), R"("value":"200")"));
  EXPECT_EQ(count.get(), 200);
}

// Before it sets what a peer says, the service thread takes what the program has set.
TEST_F(parameters, end_as_the_service_thread_ordered_the_writes) {
  auto gain = open<std::int64_t>("/gain", 1);
  peer& boss = comes("supervisor");
  constexpr std::string_view nine =
      R"({"op":"call_service","service":"/rosapi/set_param","args":{"name":"/gain","value":"9"}})";
  EXPECT_TRUE(gain.set(5));
  boss.tell(nine);
  EXPECT_TRUE(has(get(boss, "/gain"), R"("value":"9")"));
  EXPECT_EQ(gain.get(), 9);
  boss.tell(nine);
  EXPECT_TRUE(gain.set(5));
  on.cycle();
  EXPECT_TRUE(has(get(boss, "/gain"), R"("value":"5")"));
  EXPECT_EQ(gain.get(), 5);
}

TEST_F(parameters, out_of_range_are_refused_with_the_value_and_the_limits) {
  auto gain = open<double>("/gain", 0.5, {0, 2});
  auto count = open<std::int8_t>("/count", 0);
  auto size = open<std::uint64_t>("/size", 0, {0, UINT64_MAX});
  auto on_off = open<bool>("/on", false);
  auto frame = open<rowe::fixed_string<3>>("/frame", "map");
  auto mode = open<core_parameters_mode>("/mode", core_parameters_mode::off);
  peer& boss = comes("supervisor");
  const auto refused = [&](std::string_view name, std::string_view json, std::string_view why) {
    const std::string answer = set(boss, name, json);
    EXPECT_TRUE(has(answer, R"("result":false)"));
    EXPECT_TRUE(has(answer, why));
  };
  refused("/gain", "2.5", "it is 2.5; a number from 0 to 2 is wanted");
  refused("/gain", "\"fast\"", "a number from 0 to 2 is wanted");
  refused("/gain", "fast", "a number from 0 to 2 is wanted");
  refused("/gain", "null", "it is null; a number");
  refused("/count", "128", "it is 128; a whole number from -128 to 127 is wanted");
  refused("/count", "1.5", "it is 1.5; a whole number");
  refused("/count", "-9223372036854775809", "a whole number from -128 to 127");
  refused("/size", "-1", "it is -1; a whole number from 0 to 18446744073709551615 is wanted");
  refused("/size", "18446744073709551616", "a whole number");
  refused("/on", "1", "it is 1; true or false is wanted");
  refused("/frame", "\"base\"", "a text of at most 3 bytes is wanted");
  refused("/mode", "\"flying\"", "one of off, mapping, localizing is wanted");
  refused("/mode", "3", "one of off, mapping, localizing is wanted");
  refused("/nothing", "3", "there is no such parameter");
  refused("/rowe/limits/topics_max", "3", "read-only");
  EXPECT_FALSE(gain.refresh() && gain.get() != 0.5);
  EXPECT_EQ(gain.get(), 0.5);
  EXPECT_EQ(count.get(), 0);
  EXPECT_EQ(size.get(), 0U);
  EXPECT_FALSE(on_off.get());
  EXPECT_EQ(frame.get().view(), "map");
  EXPECT_EQ(mode.get(), core_parameters_mode::off);
  EXPECT_EQ(gain.set(2.5).code(), rowe::errc::out_of_range);
  EXPECT_EQ(gain.set(std::numeric_limits<double>::quiet_NaN()).code(), rowe::errc::out_of_range);
  EXPECT_EQ(mode.set(static_cast<core_parameters_mode>(3)).code(), rowe::errc::out_of_range);
  EXPECT_EQ(rowe::parameter<bool>{}.set(true).code(), rowe::errc::misuse);
}

TEST_F(parameters, of_each_type_keep_every_bit) {
  auto low = open<std::int64_t>("/low", 0);
  auto high = open<std::uint64_t>("/high", 0);
  auto real = open<double>("/real", 0);
  auto single = open<float>("/single", 0);
  auto flag = open<bool>("/flag", false);
  auto text = open<rowe::fixed_string<124>>("/text", "");
  auto mode = open<core_parameters_mode>("/mode", core_parameters_mode::off);
  peer& boss = comes("supervisor");
  const auto taken = [&](std::string_view name, std::string_view json) {
    const std::string answer = set(boss, name, json);
    EXPECT_TRUE(has(answer, R"("result":true)"));
  };
  taken("/low", "-9223372036854775808");
  taken("/high", "18446744073709551615");
  taken("/real", "0.1");
  taken("/single", "0.1");
  taken("/flag", "true");
  taken("/text", R"("a \"b\" \u00e9")");
  taken("/mode", R"("localizing")");
  EXPECT_EQ(low.get(), INT64_MIN);
  EXPECT_EQ(high.get(), UINT64_MAX);
  EXPECT_EQ(real.get(), 0.1);
  EXPECT_EQ(single.get(), 0.1F);
  EXPECT_TRUE(flag.get());
  EXPECT_EQ(text.get().view(), "a \"b\" \u00e9");
  EXPECT_EQ(mode.get(), core_parameters_mode::locating);
  EXPECT_TRUE(has(get(boss, "/low"), R"("value":"-9223372036854775808")"));
  EXPECT_TRUE(has(get(boss, "/high"), R"("value":"18446744073709551615")"));
  EXPECT_TRUE(has(get(boss, "/single"), R"("value":"0.1")"));
  EXPECT_TRUE(has(get(boss, "/text"), R"("value":"\"a \\\"b\\\" )")) << get(boss, "/text");
  EXPECT_TRUE(has(get(boss, "/mode"), R"("value":"\"localizing\"")"));
  taken("/text", "map"); // no JSON: the text itself, as in ROS
  EXPECT_EQ(text.get().view(), "map");
  EXPECT_TRUE(has(call(boss, "set_param", R"({"name":"/real","value":7})"), R"("result":true)"));
  EXPECT_EQ(real.get(), 7);
}

TEST_F(parameters, are_set_only_by_roles_that_may) {
  auto gain = open<double>("/arm/gain", 0.5);
  for (const char* const role : {"observer", "driver", "peer", "guard"}) {
    peer& one = comes(role);
    const std::string answer = set(one, "/arm/gain", "1");
    EXPECT_TRUE(has(answer, "false"));
    if (std::string_view{role} != "guard") {
      EXPECT_TRUE(has(answer, std::string{"role "} + role + ", has no right to set /arm/gain"));
    }
  }
  EXPECT_EQ(gain.get(), 0.5);
  EXPECT_EQ(on.count(counter::denied), 4U);
  EXPECT_TRUE(has(get(comes("observer"), "/arm/gain"), R"("value":"0.5")"));
  EXPECT_TRUE(has(set(comes("supervisor"), "/arm/gain", "1"), R"("result":true)"));
  EXPECT_EQ(gain.get(), 1);
}

TEST_F(parameters, list_those_of_the_endpoint_too) {
  auto gain = open<double>("/gain", 0.5);
  peer& anyone = comes("observer");
  const std::string names = call(anyone, "get_param_names", "{}");
  EXPECT_TRUE(has(names, R"(["/gain","/rowe/limits/connections_max")"));
  EXPECT_TRUE(has(names, R"("/rowe/counters/messages_in")"));
  EXPECT_TRUE(has(get(anyone, "/rowe/limits/topics_max"),
                  "\"" + std::to_string(on.options.limits.topics_max) + "\""));
  EXPECT_TRUE(has(get(anyone, "rowe/counters/messages_in"), R"("value":"3")"));
  EXPECT_TRUE(has(call(anyone, "has_param", R"({"name":"gain"})"), R"("exists":true)"));
  EXPECT_TRUE(has(call(anyone, "has_param", R"({"name":"/no"})"), R"("exists":false)"));
  EXPECT_TRUE(has(get(anyone, "/no"), R"("value":"null","successful":false)"));
  EXPECT_TRUE(has(call(anyone, "get_param", R"({"name":"/no","default":"4"})"), R"("value":"4")"));
  EXPECT_TRUE(has(call(anyone, "search_param", R"({"name":"gain"})"), R"("global_name":"/gain")"));
  EXPECT_TRUE(has(call(anyone, "search_param", R"({"name":"/no"})"), R"("global_name":"")"));
  EXPECT_TRUE(has(call(anyone, "delete_param", R"({"name":"/gain"})"), "nobody can delete it"));
  EXPECT_TRUE(has(call(anyone, "get_param", "{}"), "need a member `name`"));
}

TEST_F(parameters, are_gone_with_their_handle_and_their_name_is_free_again) {
  peer& boss = comes("supervisor");
  {
    auto gain = open<double>("/gain", 0.5);
    EXPECT_TRUE(has(call(boss, "has_param", R"({"name":"/gain"})"), "true"));
    on.shared.parameters.close(*on.shared.parameters.find("gain"));
  }
  on.cycle();
  EXPECT_TRUE(has(call(boss, "has_param", R"({"name":"/gain"})"), R"("exists":false)"));
  auto again = open<bool>("/gain", true);
  EXPECT_TRUE(has(get(boss, "/gain"), R"("value":"true")"));
  EXPECT_TRUE(has(set(boss, "/gain", "false"), R"("result":true)"));
  EXPECT_FALSE(again.get());
}

TEST_F(parameters, are_told_on_a_latched_topic_fifty_times_a_second_at_most) {
  peer& early = comes("observer");
  early.tell(R"({"op":"subscribe","topic":"/rowe/parameters"})");
  auto gain = open<double>("/gain", 0.5);
  on.cycles(2);
  EXPECT_EQ(early.hear_as_one(),
            R"({"op":"publish","topic":"/rowe/parameters","msg":{"values":{"/gain":0.5}}})");
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(gain.set(i));
    on.cycle();
  }
  EXPECT_TRUE(early.hear().empty());
  on.now += 20ms;
  on.cycles(2);
  EXPECT_TRUE(has(early.hear_as_one(), R"("/gain":9)"));
  peer& late = comes("observer");
  late.tell(R"({"op":"subscribe","topic":"/rowe/parameters"})", 2);
  EXPECT_TRUE(has(late.hear_as_one(), R"("/gain":9)"));
}

TEST_F(parameters, none_leaves_no_topic) {
  on.cycles(3);
  EXPECT_FALSE(has(call(comes("observer"), "topics", "{}"), "parameters"));
}

} // namespace
} // namespace core_parameters_test
