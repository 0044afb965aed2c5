// SPDX-License-Identifier: Apache-2.0
// rowe peers: who is connected to an endpoint, what waits for them and what was lost; from its service
// /rowe/stats.
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../network/asked_robot.hpp"
#include "../network/statistics.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/json_values.hpp"
#include "../text/message_format.hpp"
#include "../text/page.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view service = "/rowe/stats";
constexpr rt::duration timeout_default = 2s;

struct peers_options {
  remote_place at;
  std::optional<rt::duration> timeout;
  bool json = false;
  bool quiet = false;
};

command table_of(peers_options& o) {
  return {
      .verb = "peers",
      .examples = {{{"rowe peers ws://127.0.0.1:8080", "a table"},
                    {"rowe peers 127.0.0.1:8080 --json | jq .counters", "everything"}}},
      .description =
          "Prints who is connected to an endpoint (we are among them), what waits for each, and what was\n"
          "lost since it was opened.\n",
      .operands = {url_operand(o.at.url)},
      .options = with_remote(
          o.at,
          {
              {"--json", "", "", "all that the endpoint reports about itself, as one JSON object", &o.json},
              {"--timeout", "", "TIME", "for the connection and for the answer (default 2s)",
               time_span{&o.timeout}},
              {"--quiet", "-q", "", "print errors only on stderr", &o.quiet},
          })};
}

struct column {
  table_column as;
  std::string_view member;
};
const std::array<column, 9> columns{{{{"ADDRESS"}, "address"},
                                     {{.heading = "IDENTITY", .if_any = true}, "identity"},
                                     {{.heading = "ROLE", .if_any = true}, "identity_role"},
                                     {{"DIALECT"}, "dialect"},
                                     {{"SINCE_S", cell_side::right}, "since_s"},
                                     {{"SILENT_S", cell_side::right}, "silent_s"},
                                     {{"QUEUED", cell_side::right}, "queued"},
                                     {{"IN", cell_side::right}, "messages_in"},
                                     {{"OUT", cell_side::right}, "messages_out"}}};

// A member's value for a table; `-` where there is none.
std::string cell_of(json_value object, std::string_view member) {
  const auto value = object.find(member);
  const std::string text = value ? plain_text_of(*value) : "";
  return text.empty() ? "-" : text;
}

// "losses: expired 3, full 1"; and what somebody did not want, on a line of its own.
std::string losses_lines(json_value report) {
  std::string lost;
  std::string thinned;
  const std::vector<counted_loss> all = losses_in(report);
  for (const counted_loss& one : all) {
    std::string& text = one.is_chosen ? thinned : lost;
    if (one.count != 0) text += joined(text.empty() ? "" : ", ", one.name, " ", one.count);
  }
  if (all.empty()) return {};
  return joined("losses: ", lost.empty() ? "none" : lost, "\n",
                thinned.empty() ? "" : joined("thinned on purpose: ", thinned, "\n"));
}

std::string page_of(json_value report) {
  std::vector<table_column> shown;
  for (const column& one : columns) shown.push_back(one.as);
  text_table table{std::move(shown)};
  const json_value connections = report.find("connections").value_or(json_value{});
  for (const json_value one : connections.elements()) {
    std::vector<std::string> cells;
    for (const column& each : columns) cells.push_back(cell_of(one, each.member));
    table.add(std::move(cells));
  }
  return joined(cell_of(report, "name"), ", up for ", cell_of(report, "uptime_s"), " s, peers ",
                cell_of(report, "peers"), "\n", table.text(columns_of_stdout()), losses_lines(report));
}

} // namespace

exit_code peers(argument_list arguments) {
  peers_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"peers"};
  to.be_quiet(chosen.quiet);
  asked_robot robot{"peers", chosen.timeout.value_or(timeout_default), to};
  if (const auto end = robot.connect(chosen.at)) return *end;
  const auto answer = robot.ask(service);
  if (!answer) return robot.give_up_statistics();
  emit(chosen.json ? on_one_line(*answer) : page_of(read_json(*answer)));
  return exit_code::done;
}

} // namespace rowe::tools
