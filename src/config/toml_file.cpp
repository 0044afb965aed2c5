// SPDX-License-Identifier: Apache-2.0
// toml++ is compiled here alone, without exceptions, and under a name of our own: a program that uses another
// version of it, or other settings, must not get our functions, nor we its.
#include "config/toml_file.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>

#include "access/files.hpp"
#include "config/values.hpp"

// Its assertions would end the program, or, under NDEBUG, be taken for true. What it reads is not trusted.
#undef NDEBUG
#define TOML_ASSERT(claim) static_cast<void>(0)
#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#define TOML_HEADER_ONLY 1
#define TOML_MAX_NESTED_VALUES 8
#define toml rowe_toml
#include <toml++/toml.h>

namespace rowe::config {
namespace {

// Tables nest as deep as a line has dots, and are destroyed recursively: a bound of the line's length is one
// of the stack that this takes.
bool check_lines(std::string_view text, fault& wrong) {
  for (std::int64_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (end > line_bytes_max) {
      wrong = {line, "the line has " + std::to_string(end) + " bytes; it may have " +
                         std::to_string(line_bytes_max)};
      return false;
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return true;
}

// Where a text stands, as far as it is right: up to its first mistake, where the parser stops as well.
class place_in_text {
 public:
  // Reads the sign at the beginning of `rest`; how many bytes that are.
  std::size_t read(std::string_view rest) noexcept {
    if (quote_ != 0) return read_string(rest);
    const bool ends_line = rest[0] == '\n';
    if (comment_ || rest[0] == '#') {
      comment_ = !ends_line;
    } else if (rest[0] == '"' || rest[0] == '\'') {
      quote_ = rest[0];
      multi_line_ = quotes(rest) >= 3;
      return multi_line_ ? 3 : 1;
    }
    return 1;
  }

  // Whether the parser takes any character here as it is.
  bool is_free() const noexcept { return comment_ || (quote_ != 0 && !multi_line_); }

 private:
  static std::size_t quotes(std::string_view rest) noexcept {
    return std::min(rest.find_first_not_of(rest[0]), rest.size());
  }

  std::size_t read_string(std::string_view rest) noexcept {
    if (rest[0] == '\\' && quote_ == '"') return rest.size() > 1 && rest[1] != '\n' ? 2 : 1;
    if (rest[0] == '\n' && !multi_line_) quote_ = 0; // a mistake
    if (rest[0] != quote_) return 1;
    const std::size_t found = quotes(rest);
    if (multi_line_ && found < 3) return found;
    quote_ = 0;
    return multi_line_ ? std::min<std::size_t>(found, 5) : 1; // two of its own may stand before the three
  }

  char quote_ = 0; // that ends the string
  bool multi_line_ = false;
  bool comment_ = false;
};

// toml++ 3.3.0 asks whether a character is white space by a switch that lacks a case for some beyond ASCII,
// and calls that unreachable. So they may stand only where it does not ask.
bool check_characters(std::string_view text, fault& wrong) {
  place_in_text place;
  std::int64_t line = 1;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == '\n') ++line;
    if (static_cast<unsigned char>(text[at]) >= 0x80 && !place.is_free()) {
      wrong = {line, "characters beyond ASCII are allowed in comments, and in strings of one line"};
      return false;
    }
    at += place.read(text.substr(at));
  }
  return true;
}

std::int64_t line_of(const toml::source_region& region) noexcept { return region.begin.line; }

bool convert(const toml::node& from, std::size_t depth, item& into, fault& wrong);

bool convert_array(const toml::array& from, std::size_t depth, item& into, fault& wrong) {
  array list;
  for (const toml::node& one : from) {
    if (!convert(one, depth, list.of.emplace_back(), wrong)) return false;
  }
  into.is = std::move(list);
  return true;
}

bool convert_table(const toml::table& from, std::size_t depth, table& into, fault& wrong) {
  for (const auto& [key, one] : from) {
    item& member = into.of.emplace_back();
    member.name = key.str();
    if (!convert(one, depth, member, wrong)) return false;
    if (const std::int64_t line = line_of(key.source()); line > 0) member.line = line;
  }
  return true;
}

std::string written_real(double number) {
  std::array<char, 32> digits; // the shortest form of a double has 24
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr};
}

bool convert(const toml::node& from, std::size_t depth, item& into, fault& wrong) {
  into.line = line_of(from.source());
  if (depth >= depth_max) {
    wrong = {into.line, "this nests deeper than " + std::to_string(depth_max) + " levels"};
    return false;
  }
  switch (from.type()) {
  case toml::node_type::boolean: into.is = from.as_boolean()->get(); return true;
  case toml::node_type::integer: into.is = std::int64_t{from.as_integer()->get()}; return true;
  case toml::node_type::string: into.is = std::string{from.as_string()->get()}; return true;
  case toml::node_type::array: return convert_array(*from.as_array(), depth + 1, into, wrong);
  case toml::node_type::table: {
    table members;
    if (!convert_table(*from.as_table(), depth + 1, members, wrong)) return false;
    into.is = std::move(members);
    return true;
  }
  case toml::node_type::floating_point:
    into.is = other_value{"the real number " + written_real(from.as_floating_point()->get())};
    return true;
  default: into.is = other_value{"a date or a time of day"}; return true;
  }
}

std::string text_of_errno() { return std::generic_category().message(errno); }

} // namespace

bool read_file(const std::string& path, file_text& into, fault& wrong) {
  const access::open_file file{path};
  if (!file) {
    wrong.text = "the file cannot be read: " + text_of_errno();
    return false;
  }
  const struct stat& about = file.facts();
  if (!S_ISREG(about.st_mode)) {
    wrong.text = "this is no regular file";
    return false;
  }
  const auto bytes = static_cast<std::uint64_t>(about.st_size);
  if (bytes <= file_bytes_max) {
    into.text.resize(static_cast<std::size_t>(bytes) + 1); // one more, to see that it has not grown
    const ssize_t got = file.read(into.text.data(), into.text.size());
    if (got < 0) {
      wrong.text = "the file cannot be read: " + text_of_errno();
      return false;
    }
    into.text.resize(static_cast<std::size_t>(got));
  }
  if (bytes > file_bytes_max || into.text.size() > file_bytes_max) {
    wrong.text = "the file has " + std::to_string(std::max<std::uint64_t>(bytes, into.text.size())) +
                 " bytes; it may have " + std::to_string(file_bytes_max);
    return false;
  }
  into.writable_by_others = (about.st_mode & (S_IWGRP | S_IWOTH)) != 0 && !access::is_credential(path);
  return true;
}

bool parse(std::string_view text, table& into, fault& wrong) {
  if (!check_lines(text, wrong) || !check_characters(text, wrong)) return false;
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) {
    const toml::parse_error& why = parsed.error();
    wrong = {line_of(why.source()), std::string{why.description()}};
    return false;
  }
  return convert_table(parsed.table(), 0, into, wrong);
}

std::string described(const item& one) {
  struct visitor {
    std::string operator()(bool truth) const { return truth ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return std::to_string(number); }
    std::string operator()(const std::string& text) const { return quoted(text.substr(0, 80)); }
    std::string operator()(const other_value& other) const { return other.words; }
    std::string operator()(const array&) const { return "a list"; }
    std::string operator()(const table&) const { return "a table"; }
  };
  return std::visit(visitor{}, one.is);
}

} // namespace rowe::config
