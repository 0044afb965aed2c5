// SPDX-License-Identifier: Apache-2.0
// Question: does a turn of the transport cost more when many peers are connected and silent?
//
// Measured, with 0, 100 and 1000 connections that were upgraded and then say nothing, all in one run and in
// turn:
//   turn   poll() when nothing has happened: the cost that a spinning service thread pays each turn
//   echo   64 bytes from a raw client on the other core to the transport's sink and back: the round trip of
//          one message; the transport polls without pause
// medians over the rounds, and each as a ratio to the same without idle connections, taken inside a round.
// The target is at most 1.1 for the echo.
//
// Excluded: frames, JSON, the core: they do not know how many connections are idle.
//
// What would make it lie: other load on either core; a limit of open files below 2100 (`ulimit -n`), which is
// refused with words.
//
// Run: bench_idle_connections [--rounds=11]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <benchmark/benchmark.h>

#include <rowe/rt/clock.hpp>
#include <rowe/rt/thread.hpp>

#include "net/transport/socket_transport.hpp"
#include "stand.hpp"

namespace rowe::bench {
namespace {

constexpr int echoes = 1'000;
constexpr int turns = 2'000;
constexpr std::array idle_counts{0, 100, 1000};

// Sends back what comes.
class echo_sink final : public service::transport_sink {
 public:
  explicit echo_sink(service::transport& sockets) : transport_{sockets} {}
  service::admit_answer admit(const service::credentials&) const noexcept override { return {}; }
  void on_open(service::connection_id, const service::peer_info&) noexcept override { ++open; }
  void on_bytes(service::connection_id id, std::span<std::byte> bytes) noexcept override {
    (void)transport_.write(id, bytes); // 64 bytes to a reader that waits for them always fit
  }
  void on_writable(service::connection_id) noexcept override {}
  void on_close(service::connection_id, service::close_cause) noexcept override { --open; }
  void on_rejected(const service::rejection& why) noexcept override {
    std::fprintf(stderr, "refused: %.*s\n", static_cast<int>(why.what.size()), why.what.data());
  }
  service::http_answer on_http(const service::http_request&) noexcept override { return {}; }

  int open = 0;

 private:
  service::transport& transport_;
};

// A connection that was upgraded, on the client's side. Blocking.
class raw_client {
 public:
  explicit raw_client(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    (void)::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    ok_ = socket_ >= 0 && ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  raw_client(raw_client&& from) noexcept : socket_{std::exchange(from.socket_, -1)}, ok_{from.ok_} {}
  ~raw_client() {
    if (socket_ >= 0) ::close(socket_);
  }

  bool ok() const { return ok_; }
  void ask(std::uint16_t port) {
    const std::string request =
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
        "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    ok_ = ok_ && ::send(socket_, request.data(), request.size(), MSG_NOSIGNAL) ==
                     static_cast<ssize_t>(request.size());
  }
  void take_answer() {
    std::array<char, 1024> answer;
    ok_ = ok_ && ::recv(socket_, answer.data(), answer.size(), 0) > 0;
  }
  // One message there and back, spinning.
  void echo() {
    std::array<char, 64> message{};
    (void)::send(socket_, message.data(), message.size(), MSG_NOSIGNAL); // its echo is what counts
    for (std::size_t got = 0; got < message.size();) {
      const ssize_t n = ::recv(socket_, message.data(), message.size() - got, MSG_DONTWAIT);
      if (n > 0) got += static_cast<std::size_t>(n);
    }
  }

 private:
  int socket_;
  bool ok_ = false;
};

struct stand {
  std::unique_ptr<net::socket_transport> sockets;
  std::unique_ptr<echo_sink> sink;
  std::vector<raw_client> idle;
  std::vector<double> turn, echo, turn_ratio, echo_ratio;
};

bool connect_one(stand& at) {
  raw_client client{at.sockets->port()};
  client.ask(at.sockets->port());
  const int before = at.sink->open;
  const auto until = monotonic_clock::now() + std::chrono::seconds{5};
  while (at.sink->open == before && monotonic_clock::now() < until)
    at.sockets->poll(monotonic_clock::now(), *at.sink);
  client.take_answer();
  at.idle.push_back(std::move(client));
  return at.sink->open == before + 1 && at.idle.back().ok();
}

bool set_up(stand& at, int idle) {
  net::listen_options options;
  options.limits.connections_max = 1100;
  auto sockets = net::socket_transport::listen(options);
  if (!sockets) {
    std::fprintf(stderr, "cannot listen: %s\n", std::string{sockets.error().name()}.c_str());
    return false;
  }
  at.sockets = std::move(sockets).value();
  at.sink = std::make_unique<echo_sink>(*at.sockets);
  for (int n = 0; n <= idle; ++n) {
    if (connect_one(at)) continue;
    std::fprintf(stderr, "connection %d of %d failed; is `ulimit -n` at least 4000?\n", n, idle);
    return false;
  }
  return true;
}

void measure(stand& at) {
  std::vector<double> each;
  for (int i = 0; i < turns; ++i) {
    const auto begin = monotonic_clock::now();
    at.sockets->poll(begin, *at.sink);
    each.push_back(nanoseconds_since(begin));
  }
  at.turn.push_back(median(each));

  std::atomic<bool> done{false};
  std::vector<double> trips;
  {
    const rt::thread client = on_the_other_core([&] {
      for (int i = 0; i < echoes; ++i) {
        const auto begin = monotonic_clock::now();
        at.idle.front().echo();
        trips.push_back(nanoseconds_since(begin));
      }
      done.store(true, std::memory_order_release); // pairs with the acquire below
    });
    while (!done.load(std::memory_order_acquire))
      at.sockets->poll(monotonic_clock::now(), *at.sink); // pairs above
  }
  at.echo.push_back(median(trips));
}

void report(int idle, const stand& at) {
  benchmark::RegisterBenchmark(("idle_connections/" + std::to_string(idle)).c_str(),
                               [&at](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(at.echo) * 1e-9);
                                 state.counters["echo_ratio"] = median(at.echo_ratio);
                                 state.counters["turn_ns"] = median(at.turn);
                                 state.counters["turn_ratio"] = median(at.turn_ratio);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::array<stand, idle_counts.size()> stands;
  return run_on_two_cores("bench_idle_connections", count, arguments, [&](int rounds) {
    for (std::size_t i = 0; i < stands.size(); ++i) {
      if (!set_up(stands[i], idle_counts[i])) return false;
    }
    for (int round = 0; round < rounds; ++round) {
      for (stand& at : stands) {
        measure(at);
        at.turn_ratio.push_back(at.turn.back() / stands[0].turn.back());
        at.echo_ratio.push_back(at.echo.back() / stands[0].echo.back());
      }
    }
    for (std::size_t i = 0; i < stands.size(); ++i) report(idle_counts[i], stands[i]);
    return true;
  });
}
