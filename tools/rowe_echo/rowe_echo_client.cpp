// SPDX-License-Identifier: Apache-2.0
// rowe_echo_client: a client that sends back what it receives.
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>

#include "../rowe/arguments/command_line.hpp"
#include "../rowe/arguments/limit_options.hpp"
#include "../rowe/console.hpp"
#include "../rowe/network/remote.hpp"
#include "../rowe/output.hpp"
#include "send_back.hpp"

namespace rowe::tools {
namespace {

exit_code run(argument_list arguments) {
  std::string where;
  std::optional<rt::duration> timeout;
  bool once = false;
  bool quiet = false;
  const command table{
      .verb = "rowe_echo_client",
      .examples = {{{"rowe_echo_client ws://127.0.0.1:9001", "until Ctrl-C; connects again when cut off"},
                    {"rowe_echo_client 127.0.0.1:9001/runCase?case=1 --once", "one connection"}}},
      .description =
          "A client that sends every plain message of its server back to it, and answers every call with\n"
          "itself.\n",
      .operands = {url_operand(where)},
      .options = {{"--once", "", "", "end when the connection does", &once},
                  {"--timeout", "", "TIME", "how long to wait for the connection (default: until Ctrl-C)",
                   time_span{&timeout}},
                  {"--quiet", "-q", "", "print errors only", &quiet}}};
  if (const auto end = read(table, arguments)) return *end;
  console to{table.verb};
  to.be_quiet(quiet);
  const spelled_url url = read_url(where);
  if (url.url.empty()) return usage_error(table.verb, url.wrong);

  const auto bounds = limits_for(table.verb);
  if (!bounds) return exit_code::usage;
  auto client = endpoint::connect(url.url, echoing_options(*bounds));
  if (!client) return cannot_open(url.url, client.error(), to);
  remote connection{*client, url.url, to};
  if (const auto end = connection.wait(timeout)) return *end;
  send_back(*client, once, to);
  return exit_code::done;
}

} // namespace
} // namespace rowe::tools

int main(int count, char** words) { return rowe::tools::run_program(count, words, rowe::tools::run); }
