// SPDX-License-Identifier: Apache-2.0
// cycle_steps tls|plain, for cycles.py, which counts the instructions of each cycle of the service thread
// under callgrind. An endpoint, and clients that come in groups of eight, so that a cycle finds several of
// them. Prints the names of the phases, in the order in which phase_ends() is called.
//
// The thread for handshakes lowers its own priority, and under valgrind only one thread runs at a time. So on
// a busy machine all of them would wait for the one that hardly runs. Here it keeps its priority.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <rowe/rowe.hpp>

#include "tls_client.hpp"

extern "C" int setpriority(__priority_which_t, id_t, int) noexcept {
  return 0;
} // in place of the C library's
extern "C" [[gnu::noinline]] void phase_ends() { asm volatile(""); }

namespace {

using rowe::bench::tls_client;
constexpr int groups = 4;
constexpr int in_group = 8;

void need(bool fine, const char* what) {
  if (fine) return;
  std::fprintf(stderr, "%s failed\n", what);
  std::_Exit(1); // the endpoint's threads still run
}

// A client's text frame, masked with zeros.
std::string frame_of(std::string_view text) {
  std::string frame{'\x81', static_cast<char>(0x80 | text.size())};
  frame.append(4, '\0');
  return frame.append(text);
}

struct world {
  rowe::endpoint robot;
  SSL_CTX* with; // null: no TLS

  std::vector<std::unique_ptr<tls_client>> connect(int count) {
    std::vector<std::unique_ptr<tls_client>> all;
    for (int i = 0; i < count; ++i) all.push_back(std::make_unique<tls_client>(robot.port(), with));
    return all;
  }
  void reset(std::vector<std::unique_ptr<tls_client>>& all) {
    const linger at_once{1, 0};
    for (auto& one : all)
      (void)::setsockopt(one->fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once); // else in good order
    all.clear();
  }
  // The cycles of a phase have ended when nobody is there any more, and a while later.
  void end(const char* name, std::uint32_t peers) {
    for (int i = 0; i < 3000 && robot.peers() != peers; ++i) ::poll(nullptr, 0, 10);
    need(robot.peers() == peers, "the end of a phase");
    ::poll(nullptr, 0, 300);
    phase_ends();
    std::puts(name);
  }
  void shake(std::vector<std::unique_ptr<tls_client>>& all) {
    for (auto& one : all) need(one->ok() && one->shake(), "a handshake");
  }
  void upgrade(std::vector<std::unique_ptr<tls_client>>& all) {
    for (auto& one : all) need(one->ask_for_upgrade(robot.port()), "a request");
    for (auto& one : all) need(one->take_answer(), "an upgrade");
  }
};

} // namespace

int main(int count, char** words) {
  need(count == 2, "it is tls or plain: this");
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own socket BIO
  const bool secure = std::string_view{words[1]} == "tls";
  const rowe::bench::server_files files;
  rowe::endpoint_options options;
  if (secure) options.tls = files.options();
  options.page = false;
  options.ping_period = options.silence_max = std::chrono::hours{1}; // nobody answers pings
  auto opened = rowe::endpoint::listen(0, options);
  need(static_cast<bool>(opened), "to listen");
  const auto context = rowe::bench::client_context(TLS1_3_VERSION);
  world in{std::move(*opened), secure ? context.get() : nullptr};

  auto peer = in.connect(1);
  in.shake(peer);
  in.upgrade(peer);
  for (int i = 0; i < 3; ++i) { // as the largest of what peers ask for every day
    need(peer[0]->send(frame_of(R"({"op":"call_service","id":"1","service":"/rowe/stats"})")), "a call");
    std::array<char, 2000> some;
    need(peer[0]->take(some), "its answer");
  }
  in.end("statistics", 1);
  for (int i = 0; i < groups; ++i) {
    auto all = in.connect(in_group);
    in.shake(all);
    in.reset(all);
  }
  in.end("handshakes", 1);
  for (int i = 0; i < groups; ++i) {
    auto all = in.connect(in_group);
    in.shake(all);
    in.upgrade(all);
    in.reset(all);
  }
  in.end("upgrades", 1);
  for (int i = 0; i < groups; ++i) {
    std::vector<std::unique_ptr<tls_client>> all;
    for (int j = 0; j < in_group; ++j) all.push_back(std::make_unique<tls_client>(in.robot.port(), nullptr));
    for (int j = 0; j < in_group; ++j) // no TLS, TLS that makes no sense, and the beginning of it
      need(all[static_cast<std::size_t>(j)]->send(
               j % 3 == 0   ? std::string_view{"no handshake\r\n\r\n"}
               : j % 3 == 1 ? std::string_view{"\x16\x03\x01\x00\x04\xff\x00\x00\x00", 9}
                            : std::string_view{"\x16\x03\x01", 3}),
           "bytes");
    for (int j = 0; j < in_group; ++j) { // of what is wrong the server says so: its failure is known then
      std::array<char, 1> some;
      if (j % 3 != 2) need(all[static_cast<std::size_t>(j)]->take(some), "an answer to what is wrong");
    }
    in.reset(all);
  }
  in.end("failures", 1);
}
