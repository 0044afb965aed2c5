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
#include "../arguments/limit_options.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../output.hpp"
#include "../text/json_values.hpp"
#include "../text/message_format.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view service = "/rowe/stats";
constexpr rt::duration timeout_default = 2s;
constexpr std::uint32_t answer_bytes_max = limits{}.message_bytes_max;

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
  std::string_view heading;
  std::string_view member;
  bool if_any = false; // left out where no peer has it
};
constexpr std::array<column, 9> columns{{{"ADDRESS", "address"},
                                         {"IDENTITY", "identity", true},
                                         {"ROLE", "identity_role", true},
                                         {"DIALECT", "dialect"},
                                         {"SINCE_S", "since_s"},
                                         {"SILENT_S", "silent_s"},
                                         {"QUEUED", "queued"},
                                         {"IN", "messages_in"},
                                         {"OUT", "messages_out"}}};

// A member's value for a table; `-` where there is none.
std::string cell_of(json_value object, std::string_view member) {
  const auto value = object.find(member);
  const std::string text = value ? plain_text_of(*value) : "";
  return text.empty() ? "-" : text;
}

using row = std::array<std::string, columns.size()>;

// The first row has the headings.
std::string table_of_rows(const std::vector<row>& rows) {
  std::array<std::size_t, columns.size()> widths{};
  for (const row& r : rows) {
    for (std::size_t i = 0; i < r.size(); ++i) widths[i] = std::max(widths[i], r[i].size());
  }
  const auto shows = [&](std::size_t i) {
    return !columns[i].if_any ||
           std::any_of(rows.begin() + 1, rows.end(), [i](const row& r) { return r[i] != "-"; });
  };
  std::string text;
  for (const row& r : rows) {
    for (std::size_t i = 0; i + 1 < r.size(); ++i) {
      if (shows(i)) text.append(r[i]).append(widths[i] - r[i].size() + 2, ' ');
    }
    text.append(r.back()).append("\n");
  }
  return text;
}

// "losses: expired 3, full 1".
std::string losses_line(json_value report) {
  std::string line;
  if (const auto losses = report.find("losses"); losses && losses->kind() == json_kind::object) {
    for (const auto [name, value] : losses->members()) {
      if (value.text() == "0") continue;
      line.append(joined(line.empty() ? "losses: " : ", ", plain_text_of(name), " ", value.text()));
    }
    if (line.empty()) line = "losses: none";
  }
  return line.empty() ? line : line + '\n';
}

std::string page_of(json_value report) {
  std::vector<row> rows(1);
  for (std::size_t i = 0; i < columns.size(); ++i) rows[0][i] = columns[i].heading;
  const json_value connections = report.find("connections").value_or(json_value{});
  for (const json_value one : connections.elements()) {
    row& r = rows.emplace_back();
    for (std::size_t i = 0; i < columns.size(); ++i) r[i] = cell_of(one, columns[i].member);
  }
  return joined(cell_of(report, "name"), ", up for ", cell_of(report, "uptime_s"), " s, peers ",
                cell_of(report, "peers"), "\n", table_of_rows(rows), losses_line(report));
}

exit_code ask(endpoint hub, const std::string& url, const peers_options& o, const console& to) {
  auto stats = hub.client<json_text, json_text>(service, {.depth = 1, .text_bytes_max = answer_bytes_max});
  if (!stats) {
    to.error("cannot call ", service, ": ", stats.error().message());
    return exit_code::failed;
  }
  const rt::duration timeout = o.timeout.value_or(timeout_default);
  remote connection{hub, url, to};
  if (const auto end = connection.wait(timeout)) return *end;

  watcher waits{connection};
  const auto answer = waits.during([&] { return stats->call("{}", timeout); });
  if (answer) {
    emit(o.json ? on_one_line(answer->value()) : page_of(answer->json()));
    return exit_code::done;
  }
  if (interrupt::seen()) return exit_code::interrupted;
  if (answer.code() == errc::timed_out) {
    to.error(url, " does not answer within ", seconds_text(timeout));
    return exit_code::timed_out;
  }
  const bool unknown = answer.code() == errc::no_service || answer.code() == errc::refused;
  to.error(url,
           unknown ? " does not let us call /rowe/stats: our role may not, or it is no rowe endpoint" : ": ",
           unknown ? "" : answer.error().message());
  return exit_code::failed;
}

} // namespace

exit_code peers(argument_list arguments) {
  peers_options chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"peers"};
  to.be_quiet(chosen.quiet);
  const spelled_url url = read_url(chosen.at.url);
  if (url.url.empty()) return usage_error("peers", url.wrong);
  const auto bounds = limits_for("peers");
  if (!bounds) return exit_code::usage;
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(chosen.at, options, to)) return *end;
  auto hub = endpoint::connect(url.url, options);
  if (!hub) return cannot_open(url.url, hub.error(), to);
  return ask(std::move(hub).value(), url.url, chosen, to);
}

} // namespace rowe::tools
