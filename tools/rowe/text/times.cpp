// SPDX-License-Identifier: Apache-2.0
#include "times.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <ctime>

#include "../arguments/values.hpp"
#include "../console.hpp"

namespace rowe::tools {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr int digits_of_second = 9;

std::string padded(std::int64_t number, std::size_t width) {
  std::string text = std::to_string(number);
  return text.size() < width ? std::string(width - text.size(), '0') + text : text;
}

// ".123" of 123'456'789 ns.
std::string fraction_text(std::int64_t ns, int decimals) {
  if (decimals == 0) return {};
  return joined(".", padded(ns, digits_of_second).substr(0, static_cast<std::size_t>(decimals)));
}

// Reads from the front of a text, and fails for good once something is not there.
class piecewise {
 public:
  explicit piecewise(std::string_view text) : rest_{text} {}

  std::int64_t digits(std::size_t least, std::size_t most) {
    std::size_t count = 0;
    std::int64_t value = 0;
    for (; count < most && count < rest_.size() && rest_[count] >= '0' && rest_[count] <= '9'; ++count)
      value = value * 10 + (rest_[count] - '0');
    good_ = good_ && count >= least;
    rest_.remove_prefix(count);
    return value;
  }
  bool takes(std::string_view one_of) {
    if (rest_.empty() || one_of.find(rest_.front()) == one_of.npos) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void needs(std::string_view one_of) { good_ = takes(one_of) && good_; }
  // ".123", where there is one, in nanoseconds.
  std::int64_t fraction() {
    if (!takes(".,")) return 0;
    const std::size_t before = rest_.size();
    std::int64_t ns = digits(1, digits_of_second);
    for (std::size_t count = before - rest_.size(); count < digits_of_second; ++count) ns *= 10;
    (void)digits(0, rest_.size());
    return ns;
  }
  bool is_read() const { return good_ && rest_.empty(); }
  bool at_end() const { return rest_.empty(); }
  void fail() { good_ = false; }

 private:
  std::string_view rest_;
  bool good_ = true;
};

// "1:30", "1:02:03.5".
std::optional<rt::duration> clock_time_of(std::string_view text) {
  if (text.find(':') == text.npos) return std::nullopt;
  piecewise from{text};
  std::int64_t seconds = from.digits(1, 6);
  for (int parts = 0; parts < 2 && from.takes(":"); ++parts) {
    const std::int64_t part = from.digits(2, 2);
    if (part >= 60) from.fail();
    seconds = seconds * 60 + part;
  }
  const std::int64_t ns = seconds * second_ns + from.fraction();
  return from.is_read() ? std::optional{rt::duration{ns}} : std::nullopt;
}

// What the zone adds to UTC, in seconds; nothing: it is the local one.
std::optional<std::int64_t> zone_of(piecewise& from) {
  if (from.at_end()) return std::nullopt;
  if (from.takes("Zz")) return 0;
  const bool east = from.takes("+");
  if (!east) from.needs("-");
  const std::int64_t hours = from.digits(2, 2);
  (void)from.takes(":");
  const std::int64_t seconds = hours * 3600 + from.digits(2, 2) * 60;
  return east ? seconds : -seconds;
}

std::optional<std::int64_t> seconds_of(std::tm day, std::optional<std::int64_t> zone) {
  day.tm_isdst = -1;
  const int month = day.tm_mon, date = day.tm_mday;
  const std::time_t seconds = zone ? ::timegm(&day) : ::mktime(&day);
  if (day.tm_mon != month || day.tm_mday != date) return std::nullopt; // 30 February
  return static_cast<std::int64_t>(seconds) - zone.value_or(0);
}

} // namespace

std::string iso_text(std::int64_t since_1970_ns, time_zone zone, int decimals) {
  const auto seconds = static_cast<std::time_t>(since_1970_ns / second_ns);
  std::tm day{};
  if (zone == time_zone::utc) {
    ::gmtime_r(&seconds, &day);
  } else {
    ::localtime_r(&seconds, &day);
  }
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &day);
  std::string iso{text.data(), length};
  iso += fraction_text(since_1970_ns % second_ns, decimals);
  const auto minutes = static_cast<std::int64_t>(zone == time_zone::utc ? 0 : day.tm_gmtoff / 60);
  if (minutes == 0) return iso += 'Z';
  const std::int64_t size = std::abs(minutes);
  return joined(iso, minutes < 0 ? "-" : "+", padded(size / 60, 2), ":", padded(size % 60, 2));
}

std::optional<std::int64_t> iso_time_of(std::string_view text) {
  piecewise from{text};
  std::tm day{};
  day.tm_year = static_cast<int>(from.digits(4, 4)) - 1900;
  from.needs("-");
  day.tm_mon = static_cast<int>(from.digits(2, 2)) - 1;
  from.needs("-");
  day.tm_mday = static_cast<int>(from.digits(2, 2));
  from.needs("Tt ");
  day.tm_hour = static_cast<int>(from.digits(2, 2));
  from.needs(":");
  day.tm_min = static_cast<int>(from.digits(2, 2));
  if (from.takes(":")) day.tm_sec = static_cast<int>(from.digits(2, 2));
  const std::int64_t ns = from.fraction();
  const auto zone = zone_of(from);
  if (!from.is_read() || day.tm_hour > 23 || day.tm_min > 59 || day.tm_sec > 60) return std::nullopt;
  const auto seconds = seconds_of(day, zone);
  if (!seconds || *seconds < 0 || *seconds >= INT64_MAX / second_ns) return std::nullopt;
  return *seconds * second_ns + ns;
}

std::string clock_text(rt::duration time, int decimals) {
  const std::int64_t ns = std::abs(time.count());
  const std::int64_t seconds = ns / second_ns;
  const std::string hours = seconds < 3600 ? "" : joined(seconds / 3600, ":");
  const std::int64_t minutes = seconds / 60 % 60;
  return joined(time.count() < 0 ? "-" : "", hours,
                hours.empty() ? std::to_string(minutes) : padded(minutes, 2), ":", padded(seconds % 60, 2),
                fraction_text(ns % second_ns, decimals));
}

std::optional<place_in_time> place_in_time_of(std::string_view text) {
  if (const auto time = iso_time_of(text)) return absolute_time{*time};
  const bool negative = text.starts_with('-');
  const std::string_view size = text.substr(negative ? 1 : 0);
  const auto clock = clock_time_of(size);
  const auto offset = clock ? clock : duration_of(size);
  if (!offset || *offset == rt::for_ever) return std::nullopt;
  return negative ? place_in_time{from_end{*offset}} : place_in_time{from_begin{*offset}};
}

std::string decimal_text(double number, int decimals) {
  std::array<char, 64> text{};
  const auto written =
      std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed, decimals);
  return written.ec == std::errc{} ? std::string{text.data(), written.ptr} : "-";
}

} // namespace rowe::tools
