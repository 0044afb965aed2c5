// SPDX-License-Identifier: Apache-2.0
// How many system calls a server of bench/peers makes for what a client asks of it, counted by strace. A
// server that is watched is slow, and a slow one is asked more: where only its sends count, nothing else is
// watched.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include "peer_client.hpp"
#include "peers.hpp"

namespace rowe::bench {

enum class watched { everything, sends };

// Of a server's whole life, in which use(port) was made of it; nothing where strace is missing, may not
// trace, or use() failed.
template <class Use>
std::optional<double> calls_of(const contender& who, std::string_view mode, int cpu, watched what,
                               Use&& use) {
  const std::string file =
      std::filesystem::temp_directory_path() / ("rowe_calls_" + std::to_string(::getpid()));
  // -D: the process that was started is the server, which strace watches from behind.
  std::vector<std::string> command{"strace", "-D", "-f", "-q", "-c", "-U", "calls,name", "-o", file};
  if (what == watched::sends)
    command.insert(command.end(), {"--seccomp-bpf", "-e", "trace=write,writev,sendto,sendmsg,sendmmsg"});
  command.insert(command.end(), who.command.begin(), who.command.end());
  bool good = false;
  {
    const server_process server{command, mode, cpu};
    good = use(server.port());
  }
  std::optional<double> counted;
  for (int i = 0; i < 100 && good && !counted; ++i) {
    std::ifstream table{file};
    for (std::string line; std::getline(table, line);) {
      char name[64] = "";
      double calls = 0;
      if (std::sscanf(line.c_str(), "%lf %63s", &calls, name) == 2 && std::string_view{name} == "total")
        counted = calls;
    }
    if (!counted) ::usleep(20'000); // strace is still writing
  }
  std::filesystem::remove(file);
  return counted;
}

// For each of so many messages: what is left of a long run without a short one.
template <class Use>
std::optional<double> calls_per_message(const contender& who, std::string_view mode, int cpu, watched what,
                                        int messages, Use&& use) {
  const auto run = [&](int count) {
    return calls_of(who, mode, cpu, what, [&](std::uint16_t port) { return use(port, count); });
  };
  const auto few = run(messages), many = run(3 * messages);
  if (!few || !many) return std::nullopt;
  return (*many - *few) / (2 * messages);
}

} // namespace rowe::bench
