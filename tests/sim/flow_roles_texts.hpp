// SPDX-License-Identifier: Apache-2.0
// What peers with roles say (flow_roles.hpp). Each text has a number, by which it is known wherever it
// appears.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "flow_policies.hpp"
#include "swarm_choices.hpp"

namespace flow {

inline std::string subscribe(std::string_view topic) {
  return R"({"op":"subscribe","queue_length":16,"topic":")" + std::string{topic} + "\"}";
}
inline std::string provide(std::string_view service) {
  return R"({"op":"advertise_service","type":"a/B","service":")" + std::string{service} + "\"}";
}

inline std::string text_of(verb what, std::string_view name, std::int64_t number, swarm::choices& random) {
  const std::string n = std::to_string(number);
  switch (what) {
  case verb::subscribe: return subscribe(name);
  case verb::publish:
    return R"({"op":"publish","topic":")" + std::string{name} + R"(","msg":{"n":)" + n + "}}";
  case verb::advertise: return R"({"op":"advertise","type":"a/B","topic":")" + std::string{name} + "\"}";
  case verb::call:
    if (random.one_in(2))
      return R"({"message_id":)" + n + R"(,"service":")" + std::string{name} + R"(","n":)" + n + "}";
    return R"({"op":"call_service","id":")" + n + R"(","service":")" + std::string{name} +
           R"(","args":{"n":)" + n + "}}";
  case verb::provide: return provide("/new" + std::string{name});
  case verb::plain: return R"({"n":)" + n + "}";
  }
  return {};
}

// Whether one of these texts has the number.
inline bool has_number(const std::vector<std::string>& texts, std::int64_t number) {
  const std::string last = "\"n\":" + std::to_string(number) + "}";
  const std::string not_last = "\"n\":" + std::to_string(number) + ",";
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& one) {
    return one.find(last) != std::string::npos || one.find(not_last) != std::string::npos;
  });
}

} // namespace flow
