// SPDX-License-Identifier: Apache-2.0
#include "config/values.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

namespace rowe::config {
namespace {

struct unit {
  std::string_view name;
  std::int64_t of; // nanoseconds, or bytes
};
constexpr std::array<unit, 7> time_units{{{"h", 3'600'000'000'000},
                                          {"m", 60'000'000'000},
                                          {"s", 1'000'000'000},
                                          {"ms", 1'000'000},
                                          {"us", 1'000},
                                          {"µs", 1'000},
                                          {"ns", 1}}};
// Those that are a power of two are written; the others are read, too.
constexpr std::array<unit, 9> size_units{{{"TiB", std::int64_t{1} << 40},
                                          {"GiB", 1 << 30},
                                          {"MiB", 1 << 20},
                                          {"KiB", 1 << 10},
                                          {"B", 1},
                                          {"TB", 1'000'000'000'000},
                                          {"GB", 1'000'000'000},
                                          {"MB", 1'000'000},
                                          {"kB", 1'000}}};
constexpr std::string_view forever = "forever";

std::string written_number(const form& what, std::int64_t number) {
  return what.is == kind::time   ? written_time(number)
         : what.is == kind::size ? written_size(number)
                                 : std::to_string(number);
}

// The largest unit that leaves a whole number.
std::string written_in(std::span<const unit> units, std::int64_t number) {
  for (const unit& one : units) {
    if (number % one.of == 0) return std::to_string(number / one.of) + " " + std::string{one.name};
  }
  return {}; // not reached: one unit divides all
}

// A number and its unit; 0 needs none. Below `end`.
std::optional<std::int64_t> quantity_in(std::span<const unit> units, std::string_view text,
                                        std::int64_t limit) noexcept {
  if (text.empty() || text.front() < '0' || text.front() > '9') return std::nullopt;
  double number = 0;
  std::int64_t whole = 0; // exact where the number has no fraction: a double is not, beyond 104 days
  const char* const end = text.data() + text.size();
  const auto [rest, failure] = std::from_chars(text.data(), end, number, std::chars_format::fixed);
  if (failure != std::errc{} || rest[-1] == '.') return std::nullopt;
  const bool exact = std::from_chars(text.data(), rest, whole).ptr == rest;
  std::string_view name{rest, static_cast<std::size_t>(end - rest)};
  if (name.starts_with(' ')) name.remove_prefix(1);
  const auto found = std::ranges::find(units, name, &unit::name);
  if (found == units.end()) return number == 0 && rest == end ? std::optional<std::int64_t>{0} : std::nullopt;
  const double all = number * static_cast<double>(found->of);
  if (!(all < static_cast<double>(limit)) || (number > 0 && all < 0.5)) return std::nullopt;
  return exact ? whole * found->of : std::llround(all);
}

std::string listed(std::span<const std::string_view> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text.append(i == 0 ? "" : i + 1 == words.size() ? " or " : ", ").append(words[i]);
  }
  return text;
}

std::string read_integer(const form& what, std::string_view text, value& into) {
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [read_to, failure] = std::from_chars(text.data(), end, number);
  if (failure == std::errc::invalid_argument || read_to != end) return needs(what, quoted(text));
  into = text.front() == '-' ? std::numeric_limits<std::int64_t>::min()
                             : std::numeric_limits<std::int64_t>::max();
  if (failure == std::errc::result_out_of_range)
    return "is out of range: " + std::string{text.substr(0, 40)} + " (" + allowed(what) + ")";
  into = number;
  return check_range(what, number);
}

std::string read_time(const form& what, std::string_view text, value& into) {
  const auto ns = time_of(text);
  if (!ns) return needs(what, quoted(text));
  into = *ns;
  return check_range(what, *ns);
}

std::string read_size(const form& what, std::string_view text, value& into) {
  const auto bytes = size_of(text);
  if (!bytes) return needs(what, quoted(text));
  into = *bytes;
  return check_range(what, *bytes);
}

std::string read_word(const form& what, std::string_view text, value& into) {
  const auto found = std::find(what.words.begin(), what.words.end(), text);
  if (found == what.words.end()) return needs(what, quoted(text));
  into = std::int64_t{found - what.words.begin()};
  return {};
}

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const auto comma = std::min(text.find(','), text.size());
    parts.emplace_back(text.substr(0, comma));
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return parts;
}

} // namespace

std::string allowed(const form& what) {
  switch (what.is) {
  case kind::boolean: return "true or false";
  case kind::integer:
  case kind::size:
  case kind::time: return written_number(what, what.least) + " to " + written_number(what, what.most);
  case kind::word: return listed(what.words);
  case kind::text: return "a text";
  case kind::path: return "a path";
  case kind::texts: return "a list of texts";
  }
  return {};
}

std::string placeholder(const form& what) {
  switch (what.is) {
  case kind::boolean: return "";
  case kind::integer: return "N";
  case kind::size: return "SIZE";
  case kind::time: return "TIME";
  case kind::word: break;
  case kind::path: return "PATH";
  case kind::text:
  case kind::texts: return "TEXT";
  }
  std::string text;
  for (const std::string_view one : what.words) text.append(text.empty() ? "" : "|").append(one);
  return text;
}

std::string check_text(std::string_view text) {
  if (text.size() > text_bytes_max) {
    return "has a text of " + std::to_string(text.size()) + " bytes; it may have " +
           std::to_string(text_bytes_max);
  }
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 0x7f; };
  const auto* const found = std::ranges::find_if(text, is_control);
  if (found == text.end()) return {};
  return "has a control character, at byte " + std::to_string(found - text.begin());
}

std::string check_range(const form& what, std::int64_t number) {
  if (number >= what.least && number <= what.most) return {};
  return "is out of range: " + written_number(what, number) + " (" + allowed(what) + ")";
}

std::string needs(const form& what, std::string_view found) {
  const std::string other = std::string{", not "}.append(found);
  switch (what.is) {
  case kind::integer: return "needs a whole number" + other + " (" + allowed(what) + ")";
  case kind::size: return "needs a size such as \"64 MiB\" or \"10 GB\"" + other + " (" + allowed(what) + ")";
  case kind::time:
    return "needs a time such as \"250 us\", \"20 ms\" or \"5 s\"" + other + " (" + allowed(what) + ")";
  default: return "needs " + allowed(what) + other;
  }
}

std::string read(const form& what, std::string_view text, value& into) {
  switch (what.is) {
  case kind::boolean:
    if (text != "true" && text != "false") return needs(what, quoted(text));
    into = text == "true";
    return {};
  case kind::integer: return read_integer(what, text, into);
  case kind::size: return read_size(what, text, into);
  case kind::time: return read_time(what, text, into);
  case kind::word: return read_word(what, text, into);
  case kind::text:
  case kind::path: into = std::string{text}; return check_text(text);
  case kind::texts: into = split(text); return {};
  }
  return {};
}

std::string read(const form& what, std::span<const std::string> texts, value& into) {
  if (what.is == kind::texts) {
    into = std::vector<std::string>(texts.begin(), texts.end());
    return {};
  }
  if (texts.empty()) return needs(what, "nothing");
  return read(what, texts.back(), into); // of an option that is given twice, the last counts
}

std::string written(const form& what, const value& of) {
  switch (what.is) {
  case kind::boolean: return std::get<bool>(of) ? "true" : "false";
  case kind::integer: return std::to_string(std::get<std::int64_t>(of));
  case kind::size: return quoted(written_size(std::get<std::int64_t>(of)));
  case kind::time: return quoted(written_time(std::get<std::int64_t>(of)));
  case kind::word: return quoted(what.words[static_cast<std::size_t>(std::get<std::int64_t>(of))]);
  case kind::text:
  case kind::path: return quoted(std::get<std::string>(of));
  case kind::texts: break;
  }
  std::string text = "[";
  for (const std::string& one : std::get<std::vector<std::string>>(of))
    text.append(text.size() == 1 ? "" : ", ").append(quoted(one));
  return text + "]";
}

std::string written_time(std::int64_t ns) {
  if (ns == for_ever_ns) return std::string{forever};
  return ns == 0 ? "0 s" : written_in(time_units, ns);
}

std::string written_size(std::int64_t bytes) { return bytes == 0 ? "0" : written_in(size_units, bytes); }

std::string quoted(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out.append(1, '\\').append(1, c);
    } else if (byte < 0x20 || byte == 0x7f) {
      out.append("\\u00").append(1, digits[byte >> 4U]).append(1, digits[byte & 15U]);
    } else {
      out.append(1, c);
    }
  }
  return out + "\"";
}

std::optional<std::int64_t> time_of(std::string_view text) noexcept {
  return text == forever ? for_ever_ns : quantity_in(time_units, text, for_ever_ns);
}

std::optional<std::int64_t> size_of(std::string_view text) noexcept {
  return quantity_in(size_units, text, std::numeric_limits<std::int64_t>::max());
}

} // namespace rowe::config
