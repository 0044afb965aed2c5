// SPDX-License-Identifier: Apache-2.0
// What an honest peer of Foxglove's protocol must be told of parameters. It asks for some of them and wants
// to be told of their changes. Each request is answered; and what it asked for twice, with the same answer,
// is what it was told.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "swarm_context.hpp"
#include "swarm_parameters.hpp"

namespace swarm {

class honest_parameters {
 public:
  explicit honest_parameters(context& in) : in_{in} {}

  // Before a cycle.
  void act(far_end& link) {
    if (!wanted_) link.say(of_all(R"("op":"subscribeParameterUpdates")"));
    wanted_ = true;
    if (asked_ || in_.on.now < asks_next_) return;
    asks_next_ = in_.on.now + 300ms;
    asked_ = {.id = "h" + std::to_string(++requests_), .cycle = in_.cycles, .worked = in_.worked_until()};
    link.say(of_all(R"("op":"getParameters","id":")" + asked_->id + '"'));
  }

  // Of a text that is valid JSON and has a list of parameters.
  void hear(const std::string& text) {
    namespace json = rowe::json;
    const json::value all = json::root(text);
    std::map<std::string, std::string> values;
    json::array_walk walk{json::find(all.raw, "parameters")->raw};
    for (json::value one; walk.next(one);) {
      const auto value = json::find(one.raw, "value");
      values[foxglove::text_in(json::find(one.raw, "name")).value()] =
          value ? value->raw : std::string_view{};
    }
    const std::string id = foxglove::text_in(json::find(all.raw, "id")).value_or("");
    if (id.empty()) {
      for (const auto& [name, value] : values) {
        told_[name] = value;
        differs_.erase(name);
      }
      return;
    }
    if (!asked_ || id != asked_->id)
      return fail("ids", "is answered what it never asked: " + shortened(text));
    asked_.reset();
    compare(values);
  }

  // After a cycle that was one.
  void look() {
    if (asked_ && in_.cycles > asked_->cycle + cycles_max && in_.worked_until() > asked_->worked + time_max)
      fail("floor_parameters",
           "has no parameters after " + std::to_string(in_.cycles - asked_->cycle) + " cycles");
  }

  void leave() { asked_.reset(); }

 private:
  // Changes are told 50 times a second at most, each to a few peers in a cycle.
  static constexpr std::uint64_t cycles_max = 40;
  static constexpr duration time_max = 200ms;
  struct request {
    std::string id{};
    std::uint64_t cycle = 0;
    time_point worked{};
  };
  struct difference {
    std::string value{};
    std::uint64_t cycle = 0; // since then
    int answers = 0;         // so far
  };

  static std::string of_all(std::string_view begins) {
    std::string text = "{" + std::string{begins} + R"(,"parameterNames":[)";
    for (const std::string_view name : parameter_names) {
      if (text.back() != '[') text += ',';
      text += '"' + std::string{name} + '"';
    }
    return text + "]}";
  }
  void fail(std::string_view invariant, const std::string& what) {
    in_.fail(invariant, "the honest peer of Foxglove's protocol " + what);
  }
  // A value may change and change back between two requests, but not for long without its being told.
  void compare(const std::map<std::string, std::string>& now) {
    for (const auto& [name, value] : now) {
      const auto told = told_.find(name);
      if (told == told_.end() || told->second == value) {
        differs_.erase(name);
        continue;
      }
      difference& d =
          differs_.try_emplace(name, difference{.value = value, .cycle = in_.cycles}).first->second;
      if (d.value != value) d = {.value = value, .cycle = in_.cycles};
      if (++d.answers > 3 && in_.cycles > d.cycle + cycles_max)
        fail("parameters_told",
             "was told that " + name + " is " + told->second + ", and hears " + value + " again and again");
    }
  }

  context& in_;
  bool wanted_ = false;
  std::uint64_t requests_ = 0;
  std::optional<request> asked_{};
  time_point asks_next_{};
  std::map<std::string, std::string> told_{};
  std::map<std::string, difference> differs_{}; // what it hears from what it was told
};

} // namespace swarm
