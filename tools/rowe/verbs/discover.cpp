// SPDX-License-Identifier: Apache-2.0
// rowe discover: which robots are announced on the network. Avahi finds them; no code of ours speaks
// multicast DNS.
#include <array>
#include <cerrno>
#include <optional>
#include <string>
#include <system_error>

#include "../arguments/command_line.hpp"
#include "../child.hpp"
#include "../console.hpp"
#include "../network/announced.hpp"
#include "../output.hpp"
#include "../text/json_values.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration timeout_default = 5s; // avahi-browse ends by itself after a second or two

struct discover_settings {
  std::optional<rt::duration> timeout;
  bool json = false;
};

command table_of(discover_settings& o) {
  return {.verb = "discover",
          .examples = {{{"rowe discover", "the robots that are announced on the network"},
                        {"rowe discover --json | jq -r .url", "their URLs alone"}}},
          .description =
              "Prints a line for each robot: its name, its URL, its addresses, and what else it\n"
              "announces. Anybody on the network can announce any name: only the certificate proves\n"
              "that it is your robot. Runs avahi-browse (package avahi-utils).\n",
          .operands = {},
          .options = {
              {"--timeout", "", "TIME", "how long to wait for answers (default 5s)", time_span{&o.timeout}},
              {"--json", "", "", "a JSON object for each", &o.json},
          }};
}

std::string json_of(const announced_robot& one) {
  std::string addresses;
  for (const std::string& address : one.addresses)
    addresses.append(addresses.empty() ? "" : ",").append(json_string_of(address));
  std::string texts;
  for (const auto& [key, value] : one.texts)
    texts.append(texts.empty() ? "" : ",")
        .append(json_string_of(key))
        .append(":")
        .append(json_string_of(value));
  return joined(R"({"name":)", json_string_of(one.service), R"(,"url":)", json_string_of(one.url()),
                R"(,"host":)", json_string_of(one.host), R"(,"port":)", one.port, R"(,"addresses":[)",
                addresses, R"(],"txt":{)", texts, "}}\n");
}

std::string line_of(const announced_robot& one) {
  std::string text = joined(printable(one.service), "  ", one.url());
  for (const std::string& address : one.addresses) text.append(" ").append(address);
  for (const auto& [key, value] : one.texts)
    text.append(" ").append(printable(key)).append("=").append(printable(value));
  return text + '\n';
}

exit_code report(const announced_robots& found, bool json, const console& to) {
  std::string text;
  for (const announced_robot& one : found.all()) text += json ? json_of(one) : line_of(one);
  if (found.unreadable() > 0) to.error(counted(found.unreadable(), "answer"), " could not be read");
  if (found.left_out() > 0) to.error(counted(found.left_out(), "answer"), " more left out");
  if (text.empty()) to.note("no robot is announced here");
  emit(text);
  return exit_code::done;
}

exit_code cannot_run(int why, const console& to) {
  if (why == ENOENT) {
    to.error("avahi-browse is not there: install the package avahi-utils");
  } else {
    to.error("avahi-browse cannot be run: ", std::generic_category().message(why));
  }
  return exit_code::failed;
}

} // namespace

exit_code discover(argument_list arguments) {
  discover_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  const console to{"discover"};
  constexpr std::array<const char*, 3> words{"avahi-browse", "-rpt", "_rowe._tcp"};
  child browsing{words};
  if (browsing.error() != 0) return cannot_run(browsing.error(), to);

  const auto deadline = rt::monotonic_clock::now() + chosen.timeout.value_or(timeout_default);
  announced_robots found;
  std::string line;
  auto what = child::outcome::line;
  while ((what = browsing.next(line, deadline)) == child::outcome::line) found.add(line);
  if (what == child::outcome::interrupted && found.all().empty()) return exit_code::interrupted;
  if (what == child::outcome::end) {
    if (const int code = browsing.end(); code != 0) {
      to.error("avahi-browse ended with ", code, ": is avahi-daemon running?");
      return exit_code::failed;
    }
  }
  if (what == child::outcome::too_much) to.error("avahi-browse writes without end; this is the beginning");
  const exit_code reported = report(found, chosen.json, to);
  return what == child::outcome::too_late && found.all().empty() ? exit_code::timed_out : reported;
}

} // namespace rowe::tools
