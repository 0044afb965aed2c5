// SPDX-License-Identifier: Apache-2.0
// Files of TOML: read, within bounds, and taken apart into items that know their lines. The only file that
// sees toml++ is toml_file.cpp.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace rowe::config {

struct item;
using items = std::vector<item>;

// What is neither of the others: a date, or a real number, in words.
struct other_value {
  std::string words;
};
struct array {
  items of;
};
struct table {
  items of; // in the order of their names
};

struct item {
  std::string name; // of a member of a table
  std::int64_t line = 0;
  std::variant<bool, std::int64_t, std::string, other_value, array, table> is;
};

struct fault {
  std::int64_t line = 0; // 0: of the file as a whole
  std::string text;
};

inline constexpr std::size_t file_bytes_max = 1U << 20;
inline constexpr std::size_t line_bytes_max = 2048;
inline constexpr std::size_t depth_max = 4; // [[role]], its list, a member of that

struct file_text {
  std::string text;
  bool writable_by_others = false;
};

// Reads a regular file of file_bytes_max at most; false: `wrong` says why not.
bool read_file(const std::string& path, file_text& into, fault& wrong);

// Takes a text apart; false: `wrong` says where it is no TOML, or exceeds a bound.
bool parse(std::string_view text, table& into, fault& wrong);

// What a value is, for a diagnostic: `"a text"`, `5`, `a list`.
std::string described(const item& one);

} // namespace rowe::config
