// SPDX-License-Identifier: Apache-2.0
// The servers that benches of the whole transport compare: programs of bench/peers, each a process of its
// own on the first core, and stopped (SIGSTOP) but for its turn. Such a program is started as
//
//   COMMAND --port N --mode MODE
//
// and is a WebSocket server on 127.0.0.1:N until it is killed, with TCP_NODELAY and without compression. What
// it does with messages (texts), by MODE:
//
//   echo     each goes back as it came
//   flood    the first one of a connection goes back to it again and again, as fast as it takes it
//   sink     each is taken and counted in silence; one of a single byte is answered by the count since the
//            connection began, itself included, as decimal text. One connection at a time
//   fan_out  each goes to all connections, the sender's included
//
// `--peer NAME=COMMAND`, as often as one likes, adds a server of somebody else to a bench: COMMAND is split
// at blanks. A name that ends in "_busy" says that it asks for events without waiting.
#pragma once
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "net/base/descriptor.hpp"

namespace rowe::bench {

struct contender {
  std::string name;
  std::vector<std::string> command;
  enum { ours, limit, peer } what = peer;
  bool rosbridge = false; // messages must be rosbridge's
  bool outside = false;   // by --peer
  bool busy() const { return name.ends_with("_busy"); }
};

// What a bench compares: everything there is; everybody once, and busy who can be by an option of its own
// (the others' loops are polled by their programs); or of rowe only its transport and frames, which have all
// modes, with and without the bound on what kernels hold.
enum class choice { all, usual, frames };

// What is there, in the order of the tables.
inline std::vector<contender> all_contenders(choice of) {
  std::error_code unknown;
  const std::filesystem::path programs =
      std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
  const std::filesystem::path sources = ROWE_BENCH_SOURCES;
  const std::string rowe = programs / "bench_peer_rowe";
  std::vector<contender> all{
      {"raw_busy", {programs / "bench_peer_raw", "--busy"}, contender::limit},
      {"raw", {programs / "bench_peer_raw"}, contender::limit},
      {"rowe_busy", {rowe, "--idle", "spin"}, contender::ours},
      {"rowe", {rowe, "--idle", "poll"}, contender::ours},
  };
  const auto ours = [&](const char* name, std::vector<std::string> options, bool rosbridge) {
    options.insert(options.begin(), rowe);
    all.push_back({name, std::move(options), contender::ours, rosbridge});
  };
  if (of == choice::all) ours("rowe_wake", {"--idle", "wake"}, false);
  if (of != choice::frames) {
    ours("rowe_json_busy", {"--idle", "spin", "--layer", "endpoint"}, true);
    ours("rowe_json", {"--idle", "poll", "--layer", "endpoint"}, true);
  } else {
    ours("rowe_unclamped_busy", {"--idle", "spin", "--unclamped"}, false);
    ours("rowe_unclamped", {"--idle", "poll", "--unclamped"}, false);
  }
  const auto add = [&](std::string name, std::vector<std::string> command,
                       const std::filesystem::path& needs) {
    if (std::filesystem::exists(needs)) return all.push_back({std::move(name), std::move(command)});
    std::fprintf(stderr, "%s is left out: there is no %s\n", name.c_str(), needs.c_str());
  };
  for (const std::string name : {"lws", "beast", "websocketpp"}) {
    const std::string program = programs / ("bench_peer_" + name);
    const bool busy = name == "lws" ? of != choice::frames : of == choice::all;
    if (busy) add(name + "_busy", {program, "--busy"}, program);
    add(name, {program}, program);
  }
  add("ws", {"node", sources / "peers/ws/server.js"}, sources / "peers/ws/node_modules/ws");
  add("websockets", {"/usr/bin/python3", sources / "peers/websockets_server.py"},
      "/usr/lib/python3/dist-packages/websockets");
  return all;
}

// Takes each `--peer NAME=COMMAND` out of the arguments.
inline std::vector<contender> peer_options(int& count, char** arguments) {
  std::vector<contender> all;
  for (int i = 1; i < count;) {
    if (std::string_view{arguments[i]} != "--peer" || i + 1 == count) {
      ++i;
      continue;
    }
    const std::string given = arguments[i + 1];
    const std::size_t end = given.find('=');
    std::istringstream words{given.substr(end == std::string::npos ? given.size() : end + 1)};
    contender one{given.substr(0, end), {}, contender::peer, false, true};
    for (std::string word; words >> word;) one.command.push_back(word);
    if (!one.command.empty()) all.push_back(std::move(one));
    std::move(arguments + i + 2, arguments + count, arguments + i);
    count -= 2;
  }
  return all;
}

// A port nobody listens on.
inline std::uint16_t free_port() {
  const net::descriptor socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t bytes = sizeof at;
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
      ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&at), &bytes) != 0)
    return 0;
  return ntohs(at.sin_port);
}

// A process that runs from the beginning to the end of this object. It dies with this one.
class server_process {
 public:
  server_process(std::vector<std::string> command, std::string_view mode, int cpu) : port_{free_port()} {
    command.insert(command.end(), {"--port", std::to_string(port_), "--mode", std::string{mode}});
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(static_cast<unsigned>(cpu), &cpus);
    (void)::sched_setaffinity(0, sizeof cpus, &cpus); // refused: it still serves
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    std::vector<char*> words;
    for (std::string& word : command) words.push_back(word.data());
    words.push_back(nullptr);
    ::execvp(words[0], words.data());
    std::perror(words[0]);
    ::_exit(127);
  }
  server_process(const server_process&) = delete;
  server_process& operator=(const server_process&) = delete;
  ~server_process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGTERM);
    ::kill(pid_, SIGCONT);
    ::waitpid(pid_, nullptr, 0);
  }

  std::uint16_t port() const { return port_; }
  bool runs() const { return pid_ > 0 && ::waitpid(pid_, nullptr, WNOHANG) == 0; }
  void pause() const { ::kill(pid_, SIGSTOP); }
  void resume() const { ::kill(pid_, SIGCONT); }

 private:
  std::uint16_t port_;
  pid_t pid_ = -1;
};

} // namespace rowe::bench
