// SPDX-License-Identifier: Apache-2.0
#include "rosmsg/declaration.hpp"

#include <algorithm>
#include <charconv>

#include "json/text/characters.hpp"
#include "json/text/utf8.hpp"

namespace rowe::rosmsg {
namespace {

struct built_in_type {
  std::string_view name;
  kind what;
};
constexpr std::array built_in_types{
    built_in_type{"bool", kind::boolean},      built_in_type{"int8", kind::int8},
    built_in_type{"uint8", kind::uint8},       built_in_type{"char", kind::uint8},
    built_in_type{"int16", kind::int16},       built_in_type{"uint16", kind::uint16},
    built_in_type{"int32", kind::int32},       built_in_type{"uint32", kind::uint32},
    built_in_type{"int64", kind::int64},       built_in_type{"uint64", kind::uint64},
    built_in_type{"float32", kind::float32},   built_in_type{"float64", kind::float64},
    built_in_type{"string", kind::text},       built_in_type{"time", kind::time},
    built_in_type{"duration", kind::duration},
};

std::optional<kind> built_in(std::string_view name, ros_version version) noexcept {
  const auto* const found = std::find_if(built_in_types.begin(), built_in_types.end(),
                                         [&](const built_in_type& one) { return one.name == name; });
  if (found != built_in_types.end()) return found->what;
  const bool is_ros1 = version == ros_version::ros1;
  if (name == "byte") return is_ros1 ? kind::int8 : kind::uint8;
  if (name == "wstring" && !is_ros1) return kind::wide_text;
  return std::nullopt;
}

bool is_type_name(std::string_view name) noexcept {
  for (std::size_t parts = 1;; ++parts) {
    const std::size_t slash = name.find('/');
    if (parts > 3 || !is_identifier(name.substr(0, slash))) return false;
    if (slash == name.npos) return true;
    name.remove_prefix(slash + 1);
  }
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t bytes_max = 60;
  const std::string_view part = json::utf8_prefix(text, bytes_max);
  std::string quoted = '"' + std::string{part} + (part.size() < text.size() ? "...\"" : "\"");
  std::replace_if(
      quoted.begin(), quoted.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return quoted;
}

bool read_count(std::string_view digits, std::uint32_t& into) noexcept {
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), into);
  return end.ec == std::errc{} && end.ptr == digits.data() + digits.size();
}

// Takes "[]", "[3]" or "[<=3]" off the end of `type`.
std::optional<std::string> take_array(std::string_view& type, ros_version version, member& into) {
  if (!type.ends_with(']')) return std::nullopt;
  const std::size_t bracket = type.find('[');
  if (bracket == type.npos) return "the type has a ] without a [";
  const std::string_view count = type.substr(bracket + 1, type.size() - bracket - 2);
  type = type.substr(0, bracket);
  into.many = form::sequence;
  if (count.empty()) return std::nullopt;
  const bool is_bound = version == ros_version::ros2 && count.starts_with("<=");
  if (!read_count(count.substr(is_bound ? 2 : 0), into.count))
    return in_quotes(count) + " is no length of an array";
  if (into.count == 0) return "the array has no elements";
  if (!is_bound) into.many = form::fixed;
  return std::nullopt;
}

std::optional<std::string> read_type(std::string_view type, ros_version version, member& into) {
  const std::string_view whole = type;
  if (auto wrong = take_array(type, version, into)) return wrong;
  const std::size_t bound = version == ros_version::ros2 ? type.find("<=") : type.npos;
  const std::string_view name = type.substr(0, bound);
  const auto what = built_in(name, version);
  if (bound != type.npos) {
    if (!what || (*what != kind::text && *what != kind::wide_text))
      return "only strings have a longest length: " + in_quotes(whole);
    if (!read_count(type.substr(bound + 2), into.text_max))
      return in_quotes(type.substr(bound + 2)) + " is no length of a string";
  }
  if (what) {
    into.what = *what;
    return std::nullopt;
  }
  if (!is_type_name(name)) return in_quotes(whole) + " is no type";
  into.what = kind::object;
  into.type_name = name;
  return std::nullopt;
}

} // namespace

std::string_view stripped(std::string_view text) noexcept {
  constexpr std::string_view white = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(white);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(white) + 1 - first);
}

bool is_identifier(std::string_view word) noexcept {
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || json::is_digit(c);
  };
  return !word.empty() && word.size() <= name_bytes_max && !json::is_digit(word.front()) &&
         std::all_of(word.begin(), word.end(), is_word);
}

std::string plain_name(std::string_view written) {
  constexpr std::string_view folder = "/msg/";
  std::string plain{written};
  if (const std::size_t at = plain.find(folder); at != plain.npos) plain.replace(at, folder.size(), "/");
  return plain;
}

std::optional<std::string> read_line(std::string_view line, ros_version version, declaration& into) {
  into = {};
  line = stripped(line);
  if (line.empty() || line.front() == '#') return std::nullopt;
  member& read = into.read;
  const std::size_t type_end = line.find_first_of(" \t#");
  if (auto wrong = read_type(line.substr(0, type_end), version, read)) return wrong;
  std::string_view rest = type_end == line.npos ? std::string_view{} : stripped(line.substr(type_end));
  const std::size_t name_end = std::min(rest.find_first_of(" \t#=[\"'"), rest.size());
  const std::string_view name = rest.substr(0, name_end);
  if (name.empty()) return "a type without a name behind it";
  if (!is_identifier(name)) return in_quotes(name) + " is no name of a member";
  read.name = name;
  const std::string_view value = stripped(rest.substr(name_end));
  if (value.starts_with('=')) {
    if (read.what == kind::object || read.what == kind::time || read.what == kind::duration)
      return "a constant must be a number, a bool or a string";
    if (read.many != form::one) return "a constant cannot be an array";
    if (read.what != kind::text && stripped(value.substr(1)).empty()) return "a constant without a value";
    into.is = declaration::sort::constant;
    return std::nullopt;
  }
  into.is = declaration::sort::member;
  if (value.empty() || value.front() == '#') return std::nullopt;
  if (version == ros_version::ros1) return in_quotes(value) + " stands behind the name";
  if (read.what == kind::object) return "only numbers, bools and strings have a default: " + in_quotes(value);
  auto json = json_of_default(value, read);
  if (!json) return in_quotes(value) + " is no default of this type";
  read.default_json = std::move(*json);
  return std::nullopt;
}

} // namespace rowe::rosmsg
