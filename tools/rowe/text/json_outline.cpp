// SPDX-License-Identifier: Apache-2.0
#include "json_outline.hpp"

#include <algorithm>
#include <cstddef>

#include "../console.hpp"
#include "json_values.hpp"

namespace rowe::tools {
namespace {

bool is_plain_key(std::string_view key) noexcept {
  return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '/' || c == '.';
  });
}

class outline {
 public:
  std::string write(json_value json) {
    value(json, 0);
    return finished();
  }
  std::string write(std::string_view name, json_value json) {
    key(name, json, 0);
    return finished();
  }

 private:
  std::string finished() const {
    const bool begins_below = text_.starts_with('\n');
    return (begins_below ? text_.substr(1) : text_) + '\n';
  }

  // Writes a value behind its key: scalars on the same line, what has members on lines of their own.
  void value(json_value json, std::size_t depth) {
    switch (json.kind()) {
    case json_kind::object: object(json, depth); break;
    case json_kind::array: array(json, depth); break;
    default: behind_key(printable(json.text()));
    }
  }

  void object(json_value json, std::size_t depth) {
    const auto members = json.members();
    if (members.begin() == members.end()) behind_key("{}");
    for (const auto [name, member] : members) key(spelling_of(name), member, depth);
  }

  void key(std::string_view spelt, json_value json, std::size_t depth) {
    const std::string name = printable(spelt);
    begin_line(depth);
    text_.append(is_plain_key(name) ? name : joined("\"", name, "\"")).append(":");
    value(json, depth + 1);
  }

  void array(json_value json, std::size_t depth) {
    if (holds_scalars_only(json)) return scalars(json);
    for (const json_value element : json.elements()) {
      begin_line(depth);
      text_ += '-';
      value(element, depth + 1);
    }
  }

  void scalars(json_value json) {
    std::string list = "[";
    for (const json_value element : json.elements()) {
      list.append(list.size() == 1 ? "" : ", ").append(printable(element.text()));
    }
    behind_key(list += ']');
  }

  static bool holds_scalars_only(json_value json) noexcept {
    for (const json_value element : json.elements()) {
      if (element.kind() == json_kind::object || element.kind() == json_kind::array) return false;
    }
    return true;
  }

  void begin_line(std::size_t depth) { text_.append("\n").append(2 * depth, ' '); }
  void behind_key(std::string_view scalar) { text_.append(text_.empty() ? "" : " ").append(scalar); }

  std::string text_;
};

} // namespace

std::string outline_of(json_value json) { return outline{}.write(json); }
std::string outline_of(std::string_view key, json_value json) { return outline{}.write(key, json); }

} // namespace rowe::tools
