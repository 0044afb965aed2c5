// SPDX-License-Identifier: Apache-2.0
#include "stop_words.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>

#include "../arguments/values.hpp"
#include "../console.hpp"
#include "../text/json_values.hpp"

namespace rowe::tools {
namespace {

std::string text_member(json_value answer, std::string_view name) {
  const auto value = answer.find(name);
  return value && value->kind() != json_kind::null ? plain_text_of(*value) : std::string{};
}

// The names of the entries of `list` for which `wanted` holds.
template <class Wanted>
std::string names_in(std::string_view state, std::string_view list, Wanted&& wanted) {
  std::string names;
  for (const json_value one : read_json(state).find(list).value_or(json_value{}).elements()) {
    if (wanted(one)) names.append(names.empty() ? "" : ", ").append(printable(text_member(one, "name")));
  }
  return names;
}

// Who or what stopped it, to be read after "stopped".
std::string cause_words(std::string_view cause, const std::string& source) {
  if (cause == "start") return " since it started";
  if (cause == "guard") return joined(": the guard ", source, " fell silent or went away");
  if (cause == "loop") return joined(": the loop ", source, " was late or ended");
  if (cause == "service") return joined(": the loop ", source, " found the service thread silent");
  return joined(" by ", source);
}

} // namespace

std::string time_words(rt::duration time) {
  const double us = std::chrono::duration<double, std::micro>(time).count();
  std::array<char, 40> buffer;
  int length = 0;
  if (us < 0.9995) {
    length = std::snprintf(buffer.data(), buffer.size(), "%.0f ns", us * 1e3);
  } else if (us < 999.5) {
    length = std::snprintf(buffer.data(), buffer.size(), "%.0f µs", us);
  } else if (us < 999.5e3) {
    length = std::snprintf(buffer.data(), buffer.size(), us < 9950 ? "%.1f ms" : "%.0f ms", us / 1e3);
  } else {
    length = std::snprintf(buffer.data(), buffer.size(), "%.1f s", us / 1e6);
  }
  return {buffer.data(), static_cast<std::size_t>(length)};
}

std::string text_member(std::string_view answer, std::string_view name) {
  return text_member(read_json(answer), name);
}

std::optional<std::int64_t> integer_member(std::string_view answer, std::string_view name) {
  return integer_of(text_member(answer, name));
}

std::string state_words(std::string_view state) {
  const std::string number = joined(", number ", printable(text_member(state, "number")));
  if (text_member(state, "state") == "running") return joined("running", number);
  const std::string cause = text_member(state, "cause");
  const auto since =
      std::chrono::duration<double, std::milli>(std::strtod(text_member(state, "since_ms").c_str(), nullptr));
  return joined("stopped", cause_words(cause, printable(text_member(state, "source"))),
                cause == "start" ? ", " : " ", time_words(std::chrono::duration_cast<rt::duration>(since)),
                " ago", number);
}

std::string late_loops(std::string_view state) {
  const std::string number = text_member(state, "number");
  return names_in(state, "loops",
                  [&](json_value loop) { return text_member(loop, "acknowledged") != number; });
}

std::string silent_guards(std::string_view state) {
  return names_in(state, "guards", [](json_value guard) { return text_member(guard, "fresh") != "true"; });
}

} // namespace rowe::tools
