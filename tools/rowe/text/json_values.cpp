// SPDX-License-Identifier: Apache-2.0
#include "json_values.hpp"

#include <cstddef>

#include "../console.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t shown_bytes_max = 24; // of what is wrong, so that a person finds the place

void gather(json_value value, const std::string& path, std::vector<json_leaf>& into) {
  const std::size_t before = into.size();
  std::size_t index = 0;
  for (const auto [name, member] : value.members()) {
    gather(member, joined(path, path.empty() ? "" : ".", spelling_of(name)), into);
  }
  for (const json_value element : value.elements()) gather(element, joined(path, "[", index++, "]"), into);
  if (into.size() == before) into.push_back({path, value});
}

} // namespace

json_value read_json(std::string_view text) noexcept {
  constexpr std::size_t depth_max = 1024; // the most that an endpoint may be told to accept
  const auto read = json_value::parse(text, depth_max);
  return read ? *read : json_value{};
}

std::string object_fault(std::string_view text) {
  constexpr std::string_view what = "is no JSON object: ";
  const auto read = json_value::parse(text);
  if (read) return read->kind() == json_kind::object ? "" : joined(what, "it does not begin with {");
  const auto at = static_cast<std::size_t>(read.error().value);
  if (read.code() == errc::too_deep) {
    return joined(what, "it is nested more than ", read.error().limit, " deep (at byte ", at, ")");
  }
  if (at == text.size()) return joined(what, "it ends too early (at byte ", at, ")");
  const bool is_number = text[at] == '-' || (text[at] >= '0' && text[at] <= '9');
  return joined(what, "it is wrong at byte ", at, is_number ? ", or too large for a double" : "", ", from ",
                quoted(text.substr(at, shown_bytes_max)), " on");
}

std::string_view spelling_of(json_value string) noexcept {
  return string.text().substr(1, string.text().size() - 2);
}

std::vector<json_leaf> leaves_of(json_value json) {
  std::vector<json_leaf> leaves;
  gather(json, {}, leaves);
  return leaves;
}

std::string with_member(std::string_view object, std::string_view name, std::string_view value) {
  const std::size_t open = object.find('{') + 1;
  const auto members = read_json(object).members();
  const bool empty = members.begin() == members.end();
  return joined(object.substr(0, open), json_string_of(name), ":", value, empty ? "" : ",",
                object.substr(open));
}

std::string without_member(json_value object, std::string_view name) {
  std::string kept = "{";
  for (const auto [one, value] : object.members()) {
    if (!one.says(name)) kept.append(joined(kept.size() == 1 ? "" : ",", one.text(), ":", value.text()));
  }
  return kept += '}';
}

std::string json_string_of(std::string_view utf8) {
  std::string text = "\"";
  for (const char c : utf8) text.append(c == '"' || c == '\\' ? "\\" : "").push_back(c);
  return printable(text += '"'); // its notation for control characters is that of JSON
}

std::string plain_text_of(json_value value) {
  const auto text = value.get<std::string>();
  return printable(text ? std::string_view{*text} : value.text());
}

} // namespace rowe::tools
