// SPDX-License-Identifier: Apache-2.0
// Parameters as clients of Foxglove's protocol get and set them, and are told of their changes.
#include "access_fixture.hpp"

#include <string>

#include <rowe/parameter.hpp>

namespace core_foxglove_parameters_test {
namespace {

using namespace access_fixture;
using rowe::service::side;

struct foxglove_parameters : access {
  explicit foxglove_parameters(const rowe::endpoint_options& options = with_roles()) : access{options} {}

  template <class T>
  rowe::parameter<T> open(std::string_view name, const T& first, const rowe::range<T>& allowed = {}) {
    return open_parameter(on, name, first, allowed);
  }
  void close(std::string_view name) { on.shared.parameters.close(*on.shared.parameters.find(name)); }
  std::string heard(peer& by) { return by.hear_as_one(); }
  std::string say(peer& by, std::string_view text) { return answer_to(by, text); }
  void pause() {
    on.now += 20ms;
    on.cycles(2);
  }
};

std::string values(std::string_view list, std::string_view id = {}) {
  return R"({"op":"parameterValues",)" +
         (id.empty() ? std::string{} : R"("id":")" + std::string{id} + "\",") + R"("parameters":[)" +
         std::string{list} + "]}";
}

constexpr std::string_view subscribe_all = R"({"op":"subscribeParameterUpdates","parameterNames":[]})";

TEST_F(foxglove_parameters, are_got_by_their_names) {
  auto gain = open<double>("/gain", 2);
  auto count = open<std::uint8_t>("/count", 3);
  peer& one = viewer("observer");
  EXPECT_EQ(
      say(one, R"({"op":"getParameters","parameterNames":["gain","/no","/count"],"id":"x"})"),
      values(R"({"name":"/gain","value":2,"type":"float64"},{"name":"/no"},{"name":"/count","value":3})",
             "x"));
  EXPECT_EQ(say(one, R"({"op":"getParameters","parameterNames":["/rowe/limits/parameters_max"]})"),
            values(R"({"name":"/rowe/limits/parameters_max","value":)" +
                   std::to_string(on.options.limits.parameters_max) + "}"));
}

TEST_F(foxglove_parameters, are_got_all_with_those_of_the_endpoint) {
  auto gain = open<double>("/gain", 0.5);
  peer& one = viewer("observer");
  const std::string all = say(one, R"({"op":"getParameters","parameterNames":[],"id":"all"})");
  EXPECT_TRUE(all.starts_with(R"({"op":"parameterValues","id":"all","parameters":[{"name":"/gain",)")) << all;
  EXPECT_TRUE(has(all, R"({"name":"/rowe/limits/topics_max","value":)"));
  EXPECT_TRUE(has(all, R"({"name":"/rowe/counters/messages_in","value":)"));
}

TEST_F(foxglove_parameters, that_are_set_reach_the_loop_and_all_who_subscribed) {
  auto gain = open<double>("/gain", 0.5, {0, 2});
  auto mode = open<rowe::fixed_string<8>>("/mode", "map");
  peer& boss = viewer("supervisor");
  peer& sees = viewer("observer");
  peer& sees_one = viewer("observer");
  EXPECT_TRUE(has(say(sees, subscribe_all), R"({"name":"/gain","value":0.5,"type":"float64"})"));
  EXPECT_EQ(say(sees_one, R"({"op":"subscribeParameterUpdates","parameterNames":["mode"]})"),
            values(R"({"name":"/mode","value":"map"})"));
  pause();
  EXPECT_EQ(say(boss, R"({"op":"setParameters","id":"s","parameters":[{"name":"/gain","value":1.25},)"
                      R"({"name":"/mode","value":"park"}]})"),
            values(R"({"name":"/gain","value":1.25,"type":"float64"},{"name":"/mode","value":"park"})", "s"));
  EXPECT_TRUE(gain.refresh());
  EXPECT_EQ(gain.get(), 1.25);
  EXPECT_TRUE(mode.refresh());
  EXPECT_EQ(heard(sees),
            values(R"({"name":"/gain","value":1.25,"type":"float64"},{"name":"/mode","value":"park"})"));
  EXPECT_EQ(heard(sees_one), values(R"({"name":"/mode","value":"park"})"));
  EXPECT_EQ(heard(boss), "") << "it did not subscribe";
}

TEST_F(foxglove_parameters, that_the_program_sets_are_told_fifty_times_a_second_at_most) {
  auto gain = open<std::int64_t>("/gain", 0);
  peer& sees = viewer("observer");
  (void)say(sees, subscribe_all);
  pause();
  for (int i = 1; i <= 10; ++i) {
    EXPECT_TRUE(gain.set(i));
    on.cycle();
  }
  EXPECT_EQ(heard(sees), values(R"({"name":"/gain","value":1})"));
  pause();
  EXPECT_EQ(heard(sees), values(R"({"name":"/gain","value":10})"));
  pause();
  EXPECT_EQ(heard(sees), "");
}

TEST_F(foxglove_parameters, are_told_when_they_come_and_go) {
  peer& sees = viewer("observer");
  EXPECT_EQ(say(sees, R"({"op":"subscribeParameterUpdates","parameterNames":["/gain"]})"),
            values(R"({"name":"/gain"})"));
  auto gain = open<std::int64_t>("/gain", 4);
  auto other = open<std::int64_t>("/other", 4);
  pause();
  EXPECT_TRUE(has(heard(sees), values(R"({"name":"/gain","value":4})")));
  close("/gain");
  pause();
  EXPECT_EQ(heard(sees), values(R"({"name":"/gain"})")) << "it is gone";
  auto again = open<bool>("/gain", true);
  pause();
  EXPECT_EQ(heard(sees), values(R"({"name":"/gain","value":true})"));
}

TEST_F(foxglove_parameters, that_come_again_in_another_place_are_not_told_to_be_gone) {
  auto first = open<bool>("/first", true);
  auto gain = open<std::int64_t>("/gain", 1);
  peer& sees = viewer("observer");
  (void)say(sees, subscribe_all);
  close("/first");
  pause();
  EXPECT_EQ(heard(sees), values(R"({"name":"/first"})"));
  close("/gain");
  auto again = open<std::int64_t>("/gain", 2);
  pause();
  EXPECT_EQ(heard(sees), values(R"({"name":"/gain","value":2})"));
}

TEST_F(foxglove_parameters, are_told_no_more_to_who_has_ended_it) {
  auto gain = open<std::int64_t>("/gain", 0);
  auto size = open<std::int64_t>("/size", 0);
  peer& one = viewer("observer");
  (void)say(one, R"({"op":"subscribeParameterUpdates","parameterNames":["/gain","/size"]})");
  EXPECT_EQ(say(one, R"({"op":"unsubscribeParameterUpdates","parameterNames":["gain","/none"]})"), "");
  EXPECT_TRUE(gain.set(1) && size.set(1));
  pause();
  EXPECT_EQ(heard(one), values(R"({"name":"/size","value":1})"));
  (void)say(one, subscribe_all);
  EXPECT_TRUE(has(say(one, R"({"op":"unsubscribeParameterUpdates","parameterNames":["/gain"]})"),
                  "subscribed to all"));
  EXPECT_EQ(say(one, R"({"op":"unsubscribeParameterUpdates","parameterNames":[]})"), "");
  EXPECT_TRUE(gain.set(2) && size.set(2));
  pause();
  EXPECT_EQ(heard(one), "");
}

TEST_F(foxglove_parameters, are_not_told_to_the_next_peer_in_the_same_place) {
  auto gain = open<std::int64_t>("/gain", 0);
  {
    peer& one = viewer("observer");
    (void)say(one, subscribe_all);
    one.leave();
    on.cycle();
  }
  peer& next = viewer("observer");
  EXPECT_TRUE(gain.set(1));
  pause();
  EXPECT_EQ(heard(next), "");
}

TEST_F(foxglove_parameters, out_of_range_are_refused_with_the_value_and_the_limits_and_the_others_set) {
  auto gain = open<double>("/gain", 0.5, {0, 2});
  auto size = open<std::int64_t>("/size", 0);
  peer& boss = viewer("supervisor");
  const std::string answer =
      say(boss, R"({"op":"setParameters","id":"s","parameters":[{"name":"/gain","value":2.5},)"
                R"({"name":"/size","value":7},{"name":"/no","value":1},{"name":"/size"},)"
                R"({"name":"/rowe/limits/topics_max","value":1}]})");
  EXPECT_TRUE(has(answer, "parameter /gain: it is 2.5; a number from 0 to 2 is wanted"));
  EXPECT_TRUE(has(answer, "parameter /no: there is no such parameter"));
  EXPECT_TRUE(has(answer, "parameter /size: the value is missing; nobody can delete it"));
  EXPECT_TRUE(has(answer, "parameter /rowe/limits/topics_max: it is one of the endpoint's own"));
  EXPECT_TRUE(has(answer, R"({"name":"/gain","value":0.5,"type":"float64"},{"name":"/size","value":7})"));
  EXPECT_EQ(size.refresh() ? size.get() : 0, 7);
  EXPECT_FALSE(gain.refresh() && gain.get() != 0.5);
}

TEST_F(foxglove_parameters, that_are_asked_for_wrongly_are_refused_under_the_id) {
  peer& boss = viewer("supervisor");
  for (const char* const text :
       {R"({"op":"getParameters","id":"q7","parameterNames":7})", R"({"op":"getParameters","id":"q7"})",
        R"({"op":"getParameters","id":"q7","parameterNames":[7]})",
        R"({"op":"setParameters","id":"q7","parameters":[{"name":"/no","value":1}]})",
        R"({"op":"setParameters","id":"q7","parameters":[{"name":"/no","value":NaN}]})"}) {
    const std::string answer = say(boss, text);
    EXPECT_TRUE(has(answer, R"({"op":"status","level":2,"message":")"));
    EXPECT_TRUE(has(answer, R"(,"id":"q7"})"));
  }
  EXPECT_FALSE(has(say(boss, R"({"op":"getParameters","id":7,"parameterNames":7})"), R"("id":)"));
}

TEST_F(foxglove_parameters, that_a_message_names_are_limited) {
  auto gain = open<double>("/gain", 0.5);
  peer& one = viewer("supervisor");
  const auto list = [](std::string_view element, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += (i == 0 ? "" : ",") + std::string{element};
    return all;
  };
  const auto most = static_cast<int>(on.options.limits.parameters_max);
  EXPECT_TRUE(
      has(say(one, R"({"op":"setParameters","parameters":[)" + list(R"({"name":"/g"})", most + 1) + "]}"),
          std::to_string(most + 1) + " parameters in one message are too many; it takes " +
              std::to_string(most)));
  EXPECT_EQ(on.count(counter::refused_requests), 1U);
  std::string names;
  for (int i = 0; i <= most; ++i) names += (i == 0 ? "" : ",") + ("\"/p" + std::to_string(i) + "\"");
  const std::string answer =
      say(one, R"({"op":"subscribeParameterUpdates","parameterNames":[)" + names + "]}");
  EXPECT_TRUE(has(answer, "/p" + std::to_string(most) + " is one too many"));
}

TEST_F(foxglove_parameters, are_told_later_to_who_does_not_read_each_once_and_as_they_are_then) {
  auto gain = open<std::int64_t>("/gain", 0);
  auto size = open<std::int64_t>("/size", 0);
  peer& one = viewer("observer");
  (void)say(one, subscribe_all);
  on.net.link_of(one.id()).capacity_bytes = 0;
  for (int i = 1; i <= 50; ++i) {
    EXPECT_TRUE(gain.set(i));
    if (i == 1) {
      EXPECT_TRUE(size.set(1));
    }
    pause();
  }
  EXPECT_FALSE(one.cut());
  on.net.link_of(one.id()).capacity_bytes = 1U << 20U;
  pause();
  pause();
  const std::string all = heard(one);
  EXPECT_TRUE(all.ends_with(values(R"({"name":"/gain","value":50})"))) << all;
  EXPECT_TRUE(has(all, R"({"name":"/size","value":1})"));
}

TEST_F(foxglove_parameters, are_told_to_some_peers_in_a_cycle_and_to_the_others_in_the_next) {
  auto gain = open<std::int64_t>("/gain", 0);
  for (int i = 0; i < 6; ++i) (void)say(viewer("observer"), subscribe_all);
  pause();
  for (peer& one : peers) (void)one.hear();
  EXPECT_TRUE(gain.set(1));
  const auto told = [&] {
    on.cycle();
    std::size_t count = 0;
    for (peer& one : peers) count += one.hear().size();
    return count;
  };
  EXPECT_EQ(told(), rowe::service::parameter_announcements_per_cycle);
  EXPECT_LE(on.next_wake, on.now);
  EXPECT_EQ(told(), 6 - rowe::service::parameter_announcements_per_cycle);
  EXPECT_EQ(told(), 0U);
}

// Few messages so long find a place. The oldest of who has most makes way: that is what it is told of
// changes.
TEST_F(foxglove_parameters, are_told_again_to_who_lost_what_it_was_told) {
  std::deque<rowe::parameter<rowe::fixed_string<64>>> changed, others;
  std::string names;
  for (int i = 0; i < 15; ++i) {
    changed.push_back(open<rowe::fixed_string<64>>("/p" + std::to_string(i), ""));
    others.push_back(open<rowe::fixed_string<64>>("/q" + std::to_string(i), ""));
    names += (i == 0 ? "\"/q" : ",\"/q") + std::to_string(i) + "\"";
  }
  rowe::fixed_string<64> text;
  ASSERT_TRUE(text.assign(std::string(60, 'o')));
  for (auto& each : others) EXPECT_TRUE(each.set(text));
  peer& one = viewer("observer");
  (void)say(one, subscribe_all);
  pause();
  (void)heard(one);
  std::deque<peer*> more; // who have had what all are told first
  for (int i = 0; i < 3; ++i) more.push_back(&viewer("observer"));
  on.net.link_of(one.id()).capacity_bytes = 0;
  ASSERT_TRUE(text.assign(std::string(60, 'c')));
  for (auto& each : changed) EXPECT_TRUE(each.set(text));
  pause();
  const auto lost = [&] { return on.count(counter::evicted) + on.count(counter::outbox_full); };
  ASSERT_EQ(lost(), 0U);
  const std::string get_others = R"({"op":"getParameters","parameterNames":[)" + names + "]}";
  one.tell(get_others, 2);
  for (peer* const other : more) {
    if (lost() != 0) break;
    on.net.link_of(other->id()).capacity_bytes = 0;
    other->tell(get_others, 2);
  }
  ASSERT_EQ(lost(), 1U);
  on.net.link_of(one.id()).capacity_bytes = 1U << 20U;
  std::string told;
  for (int i = 0; i < 4; ++i) {
    pause();
    told += heard(one);
  }
  EXPECT_TRUE(has(told, std::string(60, 'o')));
  for (int i = 0; i < 15; ++i)
    EXPECT_TRUE(has(told, "\"/p" + std::to_string(i) + "\",\"value\":\"" + std::string(60, 'c'))) << i;
}

struct foxglove_parameters_in_small_messages : foxglove_parameters {
  foxglove_parameters_in_small_messages()
      : foxglove_parameters{with_limits(with_roles(), &limits::message_bytes_max, 512,
                                        &limits::small_slot_bytes, 512, &limits::parameters_max, 16)} {}
};

TEST_F(foxglove_parameters_in_small_messages, are_told_in_several) {
  std::deque<rowe::parameter<rowe::fixed_string<64>>> all;
  constexpr std::string_view text = "a text that has almost as many bytes as such a parameter may";
  for (int i = 0; i < 12; ++i) all.push_back(open<rowe::fixed_string<64>>("/p" + std::to_string(i), ""));
  peer& one = viewer("observer");
  const std::string answer = say(one, R"({"op":"getParameters","parameterNames":[]})");
  EXPECT_TRUE(has(answer, "do not fit into a message of 512 bytes"));
  (void)say(one, subscribe_all); // its answer does not fit, but it is told of changes
  pause();
  (void)heard(one);
  rowe::fixed_string<64> long_text;
  ASSERT_TRUE(long_text.assign(text));
  for (auto& each : all) EXPECT_TRUE(each.set(long_text));
  std::string told;
  for (int i = 0; i < 12; ++i) {
    pause();
    told += heard(one);
  }
  for (int i = 0; i < 12; ++i) {
    const std::string its =
        R"({"name":"/p)" + std::to_string(i) + R"(","value":")" + std::string{text} + "\"}";
    const std::size_t at = told.find(its);
    EXPECT_NE(at, std::string::npos) << i;
    EXPECT_EQ(told.find(its, at + 1), std::string::npos) << i << " twice";
  }
  EXPECT_FALSE(one.cut());
}

} // namespace
} // namespace core_foxglove_parameters_test
