// SPDX-License-Identifier: Apache-2.0
// The connection graph as a client of Foxglove's protocol sees it, by the updates that it was sent. Each is
// checked against those before it.
#pragma once
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "json/reading/reader.hpp"

class graph_view {
 public:
  using holders = std::map<std::string, std::vector<std::string>>; // by name, in the order in which they came

  holders publishers;
  holders subscribers;
  holders providers;
  std::size_t updates = 0;

  static bool is_update(std::string_view text) {
    return text.starts_with(R"({"op":"connectionGraphUpdate",)");
  }
  // What is wrong with the update; empty: nothing.
  std::string take(std::string_view text) {
    namespace json = rowe::json;
    ++updates;
    const json::value all = json::root(text);
    std::set<std::string> there;
    struct list {
      std::string_view name;
      std::string_view who;
      holders* into;
    };
    for (const list& one : {list{"publishedTopics", "publisherIds", &publishers},
                            list{"subscribedTopics", "subscriberIds", &subscribers},
                            list{"advertisedServices", "providerIds", &providers}}) {
      const auto found = json::find(all.raw, one.name);
      if (!found || found->type != json::kind::array) return "it has no " + std::string{one.name};
      json::array_walk walk{found->raw};
      for (json::value each; walk.next(each);) {
        const auto name = text_in(json::find(each.raw, "name"));
        const auto who = json::find(each.raw, one.who);
        if (!name || !who || who->type != json::kind::array) return "an element has no name, or nobody's";
        if (!there.insert(std::string{one.name} + *name).second) return *name + " is told twice";
        std::vector<std::string>& its = (*one.into)[*name];
        its.clear();
        json::array_walk ids{who->raw};
        for (json::value id; ids.next(id);) its.push_back(text_in(id).value_or(""));
        there.insert((one.into == &providers ? "s" : "t") + *name);
      }
    }
    for (const auto& [list_name, kind] : {std::pair{"removedTopics", "t"}, {"removedServices", "s"}}) {
      const auto found = json::find(all.raw, list_name);
      if (!found || found->type != json::kind::array) return std::string{"it has no "} + list_name;
      json::array_walk walk{found->raw};
      for (json::value each; walk.next(each);) {
        const auto name = text_in(each);
        if (!name) return "what is removed has no name";
        if (!there.insert(kind + *name).second) return *name + " is told, and removed";
        if (*kind == 's') {
          providers.erase(*name);
        } else {
          publishers.erase(*name);
          subscribers.erase(*name);
        }
      }
    }
    return {};
  }
  // Without those whom nobody holds.
  static holders held(const holders& of) {
    holders some;
    for (const auto& [name, who] : of) {
      if (!who.empty()) some[name] = who;
    }
    return some;
  }

 private:
  static std::optional<std::string> text_in(const std::optional<rowe::json::value>& of) {
    std::string buffer(of ? of->raw.size() : 0, '\0');
    const auto text = of ? rowe::json::to_string(*of, buffer) : std::nullopt;
    return text ? std::optional{std::string{*text}} : std::nullopt;
  }
};
