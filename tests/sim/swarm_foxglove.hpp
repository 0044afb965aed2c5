// SPDX-License-Identifier: Apache-2.0
// Foxglove's protocol in the swarm. What a server says by it is what it says by the tests' codec with numbers
// (swarm_numbers.hpp) in other words: as_numbers() translates, so that both are checked by the same rules.
// What has no such words stays as it is, and is checked here.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "wire/graph_view.hpp"
#include "wire/numbers_codec.hpp"
#include "json/reading/reader.hpp"

namespace swarm {

// In what words a peer with numbers speaks.
enum class tongue : std::uint8_t { numbers, foxglove };

namespace foxglove {

namespace json = rowe::json;

inline constexpr std::string_view subprotocol = "foxglove.sdk.v1";
inline constexpr std::string_view older_subprotocol = "foxglove.websocket.v1";

inline std::string call(std::uint32_t service, std::string_view id, std::string_view args) {
  return "\x02" + numbers::four(service) + std::string{id} + numbers::four(4) + "json" + std::string{args};
}

struct translated {
  std::string text{};     // by the codec with numbers; empty: a list of nothing
  bool of_others = false; // it has no such words: parameters, and the graph
  std::string wrong{};    // why it is not of the protocol
};

inline translated fails(std::string_view why) { return {.wrong = std::string{why}}; }

inline std::optional<std::uint32_t> number_in(const std::optional<json::value>& of) {
  const auto number = of ? json::to_unsigned(*of) : std::nullopt;
  if (!number || *number > UINT32_MAX) return std::nullopt;
  return static_cast<std::uint32_t>(*number);
}
inline std::optional<std::string> text_in(const std::optional<json::value>& of) {
  std::string buffer(of ? of->raw.size() : 0, '\0');
  const auto text = of ? json::to_string(*of, buffer) : std::nullopt;
  return text ? std::optional{std::string{*text}} : std::nullopt;
}

// What a schema is must be text, and JSON; and each of these names must be there.
inline bool has_form(const json::value& side) {
  for (const std::string_view name : {"encoding", "schemaName", "schemaEncoding"}) {
    if (!text_in(json::find(side.raw, name))) return false;
  }
  const auto schema = text_in(json::find(side.raw, "schema"));
  return schema && json::is_object(*schema);
}

inline translated list_as_numbers(const json::value& all, std::string_view list, char kind,
                                  std::string_view name) {
  const auto found = json::find(all.raw, list);
  if (!found || found->type != json::kind::array) return fails("it has no list");
  translated into{.text = std::string{kind}};
  json::array_walk walk{found->raw};
  for (json::value one; walk.next(one);) {
    const auto number = number_in(name.empty() ? std::optional{one} : json::find(one.raw, "id"));
    if (!number) return fails("an element has no number");
    std::string its;
    if (!name.empty()) {
      its = text_in(json::find(one.raw, name)).value_or("");
      const bool is_topic = name == "topic";
      const auto request = json::find(one.raw, "request");
      const auto response = json::find(one.raw, "response");
      if (is_topic ? !has_form(one) : !request || !response || !has_form(*request) || !has_form(*response))
        return fails("an element has no schema");
    }
    into.text += numbers::four(*number) + numbers::four(static_cast<std::uint32_t>(its.size())) + its;
  }
  return into;
}

inline translated text_as_numbers(const std::string& text) {
  const json::value all = json::root(text);
  const auto op = text_in(json::find(all.raw, "op"));
  if (!op) return fails("it has no op");
  if (*op == "serverInfo") {
    const bool has_session = text_in(json::find(all.raw, "sessionId")).has_value();
    return has_session ? translated{.text = "h" + text_in(json::find(all.raw, "name")).value_or("")}
                       : fails("it has no session");
  }
  if (*op == "advertise") return list_as_numbers(all, "channels", 'T', "topic");
  if (*op == "unadvertise") return list_as_numbers(all, "channelIds", 't', {});
  if (*op == "advertiseServices") return list_as_numbers(all, "services", 'S', "name");
  if (*op == "unadvertiseServices") return list_as_numbers(all, "serviceIds", 's', {});
  if (*op == "status") {
    const auto why = text_in(json::find(all.raw, "message"));
    return why ? translated{.text = "e" + *why} : fails("it says nothing");
  }
  if (*op == "serviceCallFailure") {
    const auto id = number_in(json::find(all.raw, "callId"));
    const auto why = text_in(json::find(all.raw, "message"));
    const bool named = number_in(json::find(all.raw, "serviceId")).has_value();
    return id && why && named ? translated{.text = "f" + numbers::four(*id) + *why}
                              : fails("it names no call");
  }
  if (*op == "connectionGraphUpdate") {
    const std::string wrong = graph_view{}.take(text);
    return wrong.empty() ? translated{.text = text, .of_others = true} : fails(wrong);
  }
  if (*op == "parameterValues") {
    const auto list = json::find(all.raw, "parameters");
    if (!list || list->type != json::kind::array) return fails("it has no list");
    json::array_walk walk{list->raw};
    for (json::value one; walk.next(one);) {
      if (!text_in(json::find(one.raw, "name"))) return fails("a parameter has no name");
    }
    return {.text = text, .of_others = true};
  }
  return fails("a server says no such thing");
}

// `is_json`: of a text that it is valid; JSON in binary messages is looked at by who asks.
template <class Is_json>
translated as_numbers(const std::string& message, Is_json&& is_json) {
  if (message.starts_with('{')) return is_json(message) ? text_as_numbers(message) : fails("no valid JSON");
  if (message.starts_with('\x01') && message.size() > 13) return {.text = "m" + message.substr(1)};
  constexpr std::string_view encoding = "json";
  const std::size_t head = 1 + 8 + 4 + encoding.size();
  if (!message.starts_with('\x03') || message.size() < head ||
      message.substr(head - encoding.size(), encoding.size()) != encoding)
    return fails("no such binary message");
  return {.text = "r" + message.substr(5, 4) + message.substr(head)};
}

} // namespace foxglove
} // namespace swarm
