// SPDX-License-Identifier: Apache-2.0
#include "message_format.hpp"

#include <algorithm>

#include "../console.hpp"
#include "json_outline.hpp"
#include "json_values.hpp"

namespace rowe::tools {
namespace {

// A cell of a table, in quotes where it would be read as several otherwise.
std::string cell_of(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return std::string{text};
  std::string cell = "\"";
  for (const char c : text) cell.append(c == '"' ? 2 : 1, c);
  return cell += '"';
}

// The path of a part of what stands at `from`.
std::string path_below(std::string_view from, std::string_view path) {
  const bool dot = !from.empty() && !path.empty() && !path.starts_with('[');
  return joined(from, dot ? "." : "", path);
}

} // namespace

std::string on_one_line(std::string_view json) {
  std::string line{json};
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line += '\n';
}

std::optional<std::string> message_format::text_of(std::string_view topic, json_value body) {
  const auto value = body.find(field_);
  if (!value) return std::nullopt;
  switch (how_) {
  case kind::json:
    if (!named_) return on_one_line(value->text());
    return on_one_line(joined(R"({"topic":)", json_string_of(topic), R"(,"msg":)", value->text(), "}"));
  case kind::csv: return rows_of(*value);
  case kind::pretty: break;
  }
  if (!named_) return joined(outline_of(*value), "---\n");
  return joined(outline_of(topic, *value), "---\n");
}

std::string message_format::rows_of(json_value value) {
  const std::vector<json_leaf> leaves = leaves_of(value);
  std::string text;
  if (header_.empty()) {
    for (const json_leaf& leaf : leaves) {
      header_.push_back(leaf.path);
      const std::string name = printable(path_below(field_, leaf.path));
      text.append(header_.size() == 1 ? "" : ",").append(cell_of(name));
    }
    text += '\n';
  }
  std::size_t met = 0;
  for (std::size_t i = 0; i < header_.size(); ++i) {
    // In almost all messages the same path stands in the same place.
    const auto same = [&](const json_leaf& leaf) { return leaf.path == header_[i]; };
    const auto found = i < leaves.size() && same(leaves[i])
                           ? leaves.begin() + static_cast<std::ptrdiff_t>(i)
                           : std::find_if(leaves.begin(), leaves.end(), same);
    if (i > 0) text += ',';
    if (found == leaves.end()) continue;
    text.append(cell_of(plain_text_of(found->value)));
    ++met;
  }
  if (met != header_.size() || met != leaves.size()) ++odd_rows_;
  return text += '\n';
}

} // namespace rowe::tools
