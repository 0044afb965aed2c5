// SPDX-License-Identifier: Apache-2.0
#include "time_range.hpp"

#include <algorithm>
#include <limits>
#include <string_view>
#include <variant>

#include "../console.hpp"
#include "../text/times.hpp"

namespace rowe::tools {
namespace {

// When a place is, in a file.
std::int64_t time_of_place(const place_in_time& place, const recorded_messages& file) {
  if (const auto* const offset = std::get_if<from_begin>(&place))
    return file.begin_ns() + std::min(offset->offset.count(), INT64_MAX - file.begin_ns());
  if (const auto* const offset = std::get_if<from_end>(&place)) return file.end_ns() - offset->offset.count();
  return std::get<absolute_time>(place).since_1970_ns;
}

// Reads --from or --to. Empty: it is in `time_ns`, which it leaves alone where the option was not given.
std::string read_place(std::string_view option, const std::string& text, const recorded_messages& file,
                       std::int64_t& time_ns) {
  if (text.empty()) return {};
  const auto place = place_in_time_of(text);
  if (!place)
    return joined(option, " needs a time such as 90s, 1:30, -10s or 2026-11-30T04:10:00Z, not ",
                  quoted(text));
  time_ns = time_of_place(*place, file);
  return {};
}

} // namespace

std::optional<time_range> time_range_of(const std::string& from, const std::string& to,
                                        const recorded_messages& file, std::string& wrong) {
  std::int64_t from_ns = file.begin_ns(), to_ns = file.end_ns();
  wrong = read_place("--from", from, file, from_ns);
  if (wrong.empty()) wrong = read_place("--to", to, file, to_ns);
  if (!wrong.empty()) return std::nullopt;
  from_ns = std::max(from_ns, file.begin_ns());
  const std::string spans = joined("the recording is from ", iso_text(file.begin_ns(), time_zone::local),
                                   " to ", iso_text(file.end_ns(), time_zone::local), ", ",
                                   clock_text(rt::duration{file.end_ns() - file.begin_ns()}));
  if (from_ns > file.end_ns()) {
    wrong = joined("--from ", printable(from), " is behind its end: ", spans);
    return std::nullopt;
  }
  const bool to_the_end = to.empty() || to_ns > file.end_ns();
  if (!to_the_end && to_ns <= from_ns) {
    wrong = joined("--to ", printable(to), " is not behind ",
                   from.empty() ? "its begin" : joined("--from ", printable(from)), ": ", spans);
    return std::nullopt;
  }
  return time_range{.from_ns = from_ns,
                    .to_ns = to_the_end ? file.end_ns() : to_ns,
                    .until_ns = to_the_end ? std::numeric_limits<std::int64_t>::max() : to_ns,
                    .to_the_end = to_the_end};
}

} // namespace rowe::tools
