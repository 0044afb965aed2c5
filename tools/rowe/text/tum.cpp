// SPDX-License-Identifier: Apache-2.0
#include "tum.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "../console.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t fields_in_a_line = 8;
constexpr std::array<std::string_view, fields_in_a_line> field_names{"time", "tx", "ty", "tz",
                                                                     "qx",   "qy", "qz", "qw"};
constexpr int nanosecond_digits = 9;
constexpr std::int64_t ns_per_second = 1'000'000'000;
constexpr std::int64_t seconds_end = std::int64_t{1} << 32;

using fields = std::array<std::string_view, fields_in_a_line>;

std::string_view without_carriage_return(std::string_view line) noexcept {
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

// Splits a line at blanks and tabs; returns how many fields it has, of which the first eight are in `into`.
std::size_t split(std::string_view line, fields& into) noexcept {
  constexpr std::string_view gaps = " \t";
  std::size_t count = 0;
  for (std::size_t at = line.find_first_not_of(gaps); at != line.npos;
       at = line.find_first_not_of(gaps, at)) {
    const std::size_t end = std::min(line.find_first_of(gaps, at), line.size());
    if (count < into.size()) into[count] = line.substr(at, end - at);
    ++count;
    at = end;
  }
  return count;
}

std::optional<double> number_of(std::string_view text) noexcept {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, failure] = std::from_chars(text.data(), end, value);
  if (failure != std::errc{} || rest != end || !std::isfinite(value))
    return std::nullopt; // "inf" and "nan" parse
  return value;
}

// The digits of a decimal number, and how many of them stand before the point.
struct decimal {
  std::string digits;
  std::int64_t before_point = 0;
};

// Of "1305031098.6659" and of "1.3050310986659e+09"; nothing when it is negative. `text` is a number already.
std::optional<decimal> decimal_of(std::string_view text) {
  if (text.starts_with('-')) return std::nullopt;
  decimal read;
  const std::size_t exponent_at = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, exponent_at);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  for (const char c : mantissa) {
    if (c != '.') read.digits += c;
  }
  int exponent = 0;
  if (exponent_at != text.npos) {
    std::string_view written = text.substr(exponent_at + 1);
    if (written.starts_with('+')) written.remove_prefix(1);
    (void)std::from_chars(written.data(), written.data() + written.size(),
                          exponent); // a number already: it fits
  }
  read.before_point = static_cast<std::int64_t>(point) + exponent;
  return read;
}

// Nanoseconds of a time in seconds, from its decimal digits; the digit behind the ninth rounds. Nothing when
// it is negative or too large.
std::optional<std::int64_t> nanoseconds_of(std::string_view text) {
  constexpr std::int64_t end = seconds_end * ns_per_second;
  const auto read = decimal_of(text);
  if (!read) return std::nullopt;
  const auto digit_at = [&](std::int64_t i) {
    const bool given = i >= 0 && i < static_cast<std::int64_t>(read->digits.size());
    return given ? read->digits[static_cast<std::size_t>(i)] - '0' : 0;
  };
  const std::int64_t wanted = read->before_point + nanosecond_digits; // digits down to the nanosecond
  std::int64_t ns = 0;
  for (std::int64_t i = 0; i < wanted; ++i) {
    if (ns == 0 && i >= static_cast<std::int64_t>(read->digits.size())) break; // zeros, however many
    if (ns > end / 10) return std::nullopt;
    ns = ns * 10 + digit_at(i);
  }
  if (digit_at(wanted) >= 5) ++ns;
  if (ns >= end) return std::nullopt;
  return ns;
}

// Reads one line's fields; returns what is wrong with them, or an empty text.
std::string read_pose(const fields& from, tum_pose& pose) {
  std::array<double, fields_in_a_line> numbers{};
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto number = number_of(from[i]);
    if (!number) {
      return joined("field ", i + 1, " (", field_names[i], ") is ", quoted(from[i]), ", not a finite number");
    }
    numbers[i] = *number;
  }
  const auto time_ns = nanoseconds_of(from[0]);
  if (!time_ns)
    return joined("the time ", printable(from[0]), " is out of range: 0 to 4294967295.999999999 s");
  pose.time_ns = *time_ns;
  std::copy_n(numbers.begin() + 1, pose.position.size(), pose.position.begin());
  std::copy_n(numbers.begin() + 4, pose.orientation.size(), pose.orientation.begin());
  return {};
}

std::string read_line(std::string_view line, std::vector<tum_pose>& poses) {
  fields found{};
  const std::size_t count = split(line, found);
  if (count == 0 || found[0].starts_with('#')) return {};
  if (count != fields_in_a_line) {
    return joined(count, " fields where a pose has 8: time tx ty tz qx qy qz qw");
  }
  tum_pose pose;
  if (std::string wrong = read_pose(found, pose); !wrong.empty()) return wrong;
  if (!poses.empty() && pose.time_ns < poses.back().time_ns) {
    return joined("the time ", found[0], " lies before the pose above");
  }
  poses.push_back(pose);
  return {};
}

} // namespace

tum_file read_tum(std::string_view text) {
  tum_file file;
  std::size_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    const std::string_view line = without_carriage_return(text.substr(0, end));
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
    if (std::string wrong = read_line(line, file.poses); !wrong.empty()) {
      file.fault = {number, std::move(wrong)};
      return file;
    }
  }
  if (file.poses.empty()) file.fault.what = "there is no pose in it";
  return file;
}

tum_file read_tum_file(const std::string& path) {
  std::ifstream file{path, std::ios::binary};
  if (!file.is_open()) return {{}, {0, std::strerror(errno)}};
  std::ostringstream text;
  errno = 0;
  text << file.rdbuf(); // fails for an empty file too, so errno tells: a folder can be opened and not read
  if (errno != 0) return {{}, {0, std::strerror(errno)}};
  return read_tum(text.view());
}

} // namespace rowe::tools
