// SPDX-License-Identifier: Apache-2.0
#include "json_values.hpp"

#include <charconv>
#include <cstddef>
#include <cstdint>

#include "../console.hpp"
#include "json_scanner.hpp"

namespace rowe::tools {
namespace {

std::optional<std::string_view> member_at(std::string_view object, std::string_view wanted) noexcept {
  std::optional<std::string_view> found;
  if (object.front() != '{') return found;
  for_each_member(object, [&](std::string_view name, std::string_view value) {
    if (!found && name == wanted) found = value;
  });
  return found;
}

std::optional<std::string_view> element_at(std::string_view array, std::size_t wanted) noexcept {
  std::optional<std::string_view> found;
  if (array.front() != '[') return found;
  std::size_t index = 0;
  for_each_element(array, [&](std::string_view value) {
    if (index++ == wanted) found = value;
  });
  return found;
}

// Cuts the first step off a path: a name up to the next `.` or `[`, or `[12]`.
std::string_view cut_step(std::string_view& path) noexcept {
  const std::size_t end = path.front() == '[' ? path.find(']') + 1 : path.find_first_of(".[");
  const std::string_view step = path.substr(0, end == 0 ? path.npos : end); // 0: no `]`
  path.remove_prefix(step.size());
  if (path.starts_with('.')) path.remove_prefix(1);
  return step;
}

void gather(std::string_view value, const std::string& path, std::vector<json_leaf>& into) {
  const std::size_t before = into.size();
  if (value.front() == '{') {
    for_each_member(value, [&](std::string_view name, std::string_view member) {
      gather(member, joined(path, path.empty() ? "" : ".", name), into);
    });
  } else if (value.front() == '[') {
    std::size_t index = 0;
    for_each_element(
        value, [&](std::string_view element) { gather(element, joined(path, "[", index++, "]"), into); });
  }
  if (into.size() == before) into.push_back({path, value});
}

void append_utf8(std::string& to, std::uint32_t code) {
  const auto put = [&](std::uint32_t byte) { to += static_cast<char>(static_cast<unsigned char>(byte)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xc0 | code >> 6);
    put(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    put(0xe0 | code >> 12);
    put(0x80 | (code >> 6 & 0x3f));
    put(0x80 | (code & 0x3f));
  } else {
    put(0xf0 | code >> 18);
    put(0x80 | (code >> 12 & 0x3f));
    put(0x80 | (code >> 6 & 0x3f));
    put(0x80 | (code & 0x3f));
  }
}

// The number of the four digits in "\u00e4" at `text`.
std::uint32_t code_unit_of(std::string_view text) noexcept {
  std::uint32_t unit = 0;
  std::from_chars(text.data() + 2, text.data() + 6, unit, 16);
  return unit;
}

// Appends what the escape in front of `text` stands for; returns how many bytes it has.
std::size_t append_escaped(std::string& to, std::string_view text) {
  if (text[1] != 'u') {
    const bool plain = text[1] == '"' || text[1] == '\\' || text[1] == '/';
    to.append(plain ? text.substr(1, 1) : text.substr(0, 2));
    return 2;
  }
  std::uint32_t code = code_unit_of(text);
  std::size_t bytes = 6;
  if (code >= 0xd800 && code < 0xdc00 && text.substr(6).starts_with("\\u")) {
    code = 0x10000 + ((code - 0xd800) << 10) + (code_unit_of(text.substr(6)) - 0xdc00);
    bytes = 12;
  }
  if (code < 0x20) {
    to.append(text.substr(0, bytes));
  } else {
    append_utf8(to, code);
  }
  return bytes;
}

} // namespace

std::optional<std::string_view> value_at(std::string_view json, std::string_view path) noexcept {
  std::optional<std::string_view> at = json_scanner{json}.value();
  while (at && !path.empty()) {
    const std::string_view step = cut_step(path);
    if (!step.starts_with('[')) {
      at = member_at(*at, step);
      continue;
    }
    std::size_t index = 0;
    const char* const last = step.data() + step.size() - 1;
    const auto [end, failure] = std::from_chars(step.data() + 1, last, index);
    at = failure == std::errc{} && end == last ? element_at(*at, index) : std::nullopt;
  }
  return at;
}

std::vector<json_leaf> leaves_of(std::string_view json) {
  std::vector<json_leaf> leaves;
  gather(json_scanner{json}.value(), {}, leaves);
  return leaves;
}

std::string with_member(std::string_view object, std::string_view name, std::string_view value) {
  const std::size_t open = object.find('{') + 1;
  const bool empty = json_scanner{object.substr(open)}.peek() == '}';
  return joined(object.substr(0, open), json_string_of(name), ":", value, empty ? "" : ",",
                object.substr(open));
}

std::string without_member(std::string_view object, std::string_view name) {
  std::string kept = "{";
  for_each_member(object, [&](std::string_view one, std::string_view value) {
    if (one != name) kept.append(joined(kept.size() == 1 ? "\"" : ",\"", one, "\":", value));
  });
  return kept += '}';
}

std::string json_string_of(std::string_view utf8) {
  std::string text = "\"";
  for (const char c : utf8) text.append(c == '"' || c == '\\' ? "\\" : "").push_back(c);
  return printable(text += '"'); // its notation for control characters is that of JSON
}

std::string plain_text_of(std::string_view value) {
  if (!value.starts_with('"')) return std::string{value};
  const std::string_view inner = value.substr(1, value.size() - 2);
  std::string text;
  for (std::size_t at = 0; at < inner.size();) {
    if (inner[at] == '\\') {
      at += append_escaped(text, inner.substr(at));
    } else {
      text += inner[at++];
    }
  }
  return printable(text);
}

} // namespace rowe::tools
