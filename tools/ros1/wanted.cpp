// SPDX-License-Identifier: Apache-2.0
#include "wanted.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <string>

#include "../rowe/console.hpp"
#include "definition.hpp"

namespace rowe::ros1 {

std::string wanted_names::set(const std::vector<std::string>& patterns) {
  for (const std::string& text : patterns) {
    one next;
    const std::size_t equals = text.find('=');
    next.pattern = text.substr(0, equals);
    if (equals != text.npos) {
      next.type = plain_type_name(std::string_view{text}.substr(equals + 1));
      if (next.type.empty())
        return tools::joined(tools::quoted(text.substr(equals + 1)), " is no type; it reads package/Name");
    }
    next.is_name = next.pattern.find_first_of("*?[") == next.pattern.npos;
    if (next.pattern.empty()) return "a name or pattern is empty";
    if (next.pattern.front() != '/' && next.pattern.front() != '*') next.pattern.insert(0, 1, '/');
    all_.push_back(std::move(next));
  }
  return {};
}

bool wanted_names::names(std::string_view name) const {
  return std::any_of(all_.begin(), all_.end(), [&](const one& o) { return o.is_name && o.pattern == name; });
}

bool wanted_names::match(std::string_view name) const {
  const std::string text{name};
  return std::any_of(all_.begin(), all_.end(),
                     [&](const one& o) { return fnmatch(o.pattern.c_str(), text.c_str(), 0) == 0; });
}

std::string wanted_names::type_of(std::string_view name) const {
  const std::string text{name};
  for (const one& o : all_) {
    if (!o.type.empty() && fnmatch(o.pattern.c_str(), text.c_str(), 0) == 0) return o.type;
  }
  return {};
}

} // namespace rowe::ros1
