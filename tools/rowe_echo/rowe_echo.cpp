// SPDX-License-Identifier: Apache-2.0
// rowe_echo: a server that sends back what it receives.
#include <cstdint>
#include <string>

#include <rowe/endpoint.hpp>

#include "../rowe/arguments/command_line.hpp"
#include "../rowe/arguments/limit_options.hpp"
#include "../rowe/console.hpp"
#include "../rowe/output.hpp"
#include "send_back.hpp"

namespace rowe::tools {
namespace {

exit_code run(argument_list arguments) {
  std::int64_t port = 0;
  std::string address = "127.0.0.1";
  bool insecure = false;
  bool quiet = false;
  const command table{
      .verb = "rowe_echo",
      .examples = {{{"rowe_echo --port 9001", "on 127.0.0.1"},
                    {"rowe_echo --port 9001 --listen 0.0.0.0 --insecure", "for the whole network"}}},
      .description =
          "A server that sends every plain message back to whom it came from, and answers every call with\n"
          "itself. One line with the URL goes to stdout when it is ready; Ctrl-C ends it.\n",
      .operands = {},
      .options = {
          {"--port", "", "N", "TCP port; 0 (the default) takes any free one", integer{&port, 0, 65535}},
          {"--listen", "", "ADDR", "numeric; beyond loopback only with --insecure", &address},
          {"--insecure", "", "", "whoever reaches the port may connect", &insecure},
          {"--quiet", "-q", "", "print errors only", &quiet}}};
  if (const auto end = read(table, arguments)) return *end;
  console to{table.verb};
  to.be_quiet(quiet);

  const auto bounds = limits_for(table.verb);
  if (!bounds) return exit_code::usage;
  endpoint_options options = echoing_options(*bounds);
  options.address = address;
  options.insecure = insecure;
  auto server = endpoint::listen(static_cast<std::uint16_t>(port), options);
  if (!server) {
    to.error("cannot listen on ", printable(address), ": ", server.error().message());
    return server.code() == errc::not_loopback ? exit_code::usage : exit_code::failed;
  }
  const std::string host = address.find(':') == address.npos ? address : joined("[", address, "]");
  emit(joined("rowe_echo listens on ws://", host, ":", server->port(), "/\n"));
  send_back(*server, false, to);
  return exit_code::done;
}

} // namespace
} // namespace rowe::tools

int main(int count, char** words) { return rowe::tools::run_program(count, words, rowe::tools::run); }
