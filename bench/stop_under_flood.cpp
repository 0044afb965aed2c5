// SPDX-License-Identifier: Apache-2.0
// Question: how long does a stop take while other peers flood the robot?
//
// Measured, for eight peers that send as fast as the robot takes: messages of 2 bytes, 200 bytes, 60 KiB,
// the deepest ones, 60 KiB of tokens, and 60 KiB that are refused at their end; and without a flood. The
// first ones again while the robot records all of it (`..._recorded`: into the folder for temporary files). A
// probe calls /rowe/stop every 2 ms, open-loop (from the time it was to be sent), and takes the time to the
// answer. The robot stands already and its loop has acknowledged, so the answer is the service thread's
// alone; what a loop adds is one period of its own. p50, p99, p99.9, the largest, and how many of the calls
// were answered.
//
// Robot: a whole endpoint; its service thread is pinned to core --here, idle policy spin, SCHED_FIFO --prio
// where that is granted (then it yields: the kernel would take it off its core otherwise). Flooders and probe
// share core
// --there; the probe is SCHED_FIFO 10 there.
//
// The witness: the largest gaps that a thread sees that does nothing but read the clock, on core --here with
// the same priority and the same yields, before each flood. What the machine does to such a thread it does to
// the robot's, and no program can be better. On core --there the probe is its own witness: `woke_late` is by
// how much it woke after its time, and `robot` counts from its waking where the robot had answered what came
// before in time, so that what the machine does to the probe is not the robot's; all other figures count from
// the time it was to be sent. `cycle_max` is the robot's own longest cycle, whatever held it up.
//
// Excluded: what a loop adds to the answer; networks.
//
// What would make it lie: other load; a host that takes cores away (see the witness).
//
// Run: bench_stop_under_flood [--rounds=5] [--seconds=2] [--prio=80]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <benchmark/benchmark.h>

#include <rowe/recording.hpp>
#include <rowe/rowe.hpp>
#include <rowe/rt/periodic.hpp>

#include "stop_counters.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr int flooders = 8;

int priority = 80;
int seconds = 2;

std::string deepest() {
  std::string text = R"({"a":)";
  const int levels = 62;
  return text + std::string(levels, '[') + std::string(levels, ']') + "}";
}

// As many tokens as 60 KiB have, between a start and an end. What is refused at its end is scanned whole.
std::string filled(const char* start, const char* with, const char* end) {
  std::string text = start;
  while (text.size() < 60 * 1024 - 16) text += with;
  return text + end;
}

struct flood {
  const char* name;
  std::string message; // empty: none
  bool recorded = false;
};

std::vector<flood> floods() {
  const std::string head = R"({"op":"publish","topic":"/flood","msg":{"data":")";
  const std::string small = head + std::string(200 - head.size() - 3, 'x') + "\"}}";
  const std::string large = head + std::string(60 * 1024 - head.size() - 3, 'x') + "\"}}";
  return {{"none", {}},
          {"none_recorded", {}, true},
          {"2B", "{}"},
          {"200B", small},
          {"200B_recorded", small, true},
          {"60KiB", large},
          {"60KiB_recorded", large, true},
          {"deepest", deepest()},
          {"tokens", filled(R"({"a":[1)", ",1", "]}")},
          {"refused", filled(R"({"a":[1)", R"(,"")", ",\"\n\"]}")}};
}

class client {
 public:
  explicit client(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    (void)::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // a hint
    ok_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    std::string head;
    char c = 0;
    while (ok_ && head.find("\r\n\r\n") == std::string::npos) {
      ok_ = ::recv(socket_, &c, 1, 0) == 1;
      head += c;
    }
  }
  client(const client&) = delete;
  client& operator=(const client&) = delete;
  ~client() { ::close(socket_); }

  bool ok() const { return ok_; }
  void send(const std::string& bytes) {
    for (std::size_t at = 0; ok_ && at < bytes.size();) {
      const ssize_t n = ::send(socket_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
      ok_ = n > 0;
      if (n > 0) at += static_cast<std::size_t>(n);
    }
  }
  // One frame of a server, at most; false when none comes within a second.
  bool hear() {
    std::array<unsigned char, 65536> buffer;
    if (!take(buffer.data(), 2)) return false;
    std::size_t length = buffer[1] & 0x7f;
    if (length == 126) {
      if (!take(buffer.data(), 2)) return false;
      length = static_cast<std::size_t>(buffer[0]) << 8 | buffer[1];
    }
    return take(buffer.data(), length);
  }
  // Discards what the robot said, so that it goes on answering.
  void discard() {
    std::array<char, 65536> buffer;
    while (::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT) > 0) {
    }
  }
  void give_up_after_a_second() {
    const timeval second{1, 0};
    (void)::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second); // else it waits longer
  }
  void shut() { (void)::shutdown(socket_, SHUT_RDWR); } // whoever sends is told

 private:
  bool take(unsigned char* into, std::size_t bytes) {
    for (std::size_t at = 0; at < bytes;) {
      const ssize_t n = ::recv(socket_, into + at, bytes - at, 0);
      if (n <= 0) return false;
      at += static_cast<std::size_t>(n);
    }
    return true;
  }

  int socket_;
  bool ok_ = false;
};

struct figures : stop_figures {
  std::vector<double> taken_per_second; // messages, in each round
};

bool measure(const flood& with, int cpu, figures& into) {
  into.gaps.push_back(witness(cpu, priority));
  endpoint_options options;
  options.idle_policy = idle::spin;
  options.service_cpu = cpu;
  options.service_priority = priority;
  options.page = false;
  options.limits.messages_per_second_max = 0; // the flood is not cut,
  options.limits.refusals_per_second_max = 0; // and each refusal is answered
  options.stop.unguarded = true;
  auto opened = open_robot(options);
  if (!opened) return false;
  endpoint robot = std::move(*opened);

  recorder records;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "bench_stop_under_flood";
  if (with.recorded) {
    auto made = robot.record({.file = {.path = folder.string() + "/", .total_bytes = 256 << 20}});
    if (!made) return false;
    records = std::move(*made);
  }

  std::vector<std::unique_ptr<client>> peers;
  for (int i = 0; i < flooders && !with.message.empty(); ++i)
    peers.push_back(std::make_unique<client>(robot.port()));
  client probe{robot.port()};
  if (!probe.ok()) return false;
  probe.give_up_after_a_second();
  const auto latch = make_stand(robot, probe);

  std::vector<rt::thread> senders;
  const std::string frame = frame_of(with.message);
  std::string batch;
  while (batch.size() < 16384) batch += frame;
  for (auto& peer : peers) {
    senders.push_back(on_the_other_core([&peer, &batch] {
      for (; peer->ok(); peer->discard()) peer->send(batch);
    }));
  }
  call_stops(probe, std::chrono::seconds{seconds}, into);
  into.cycles.push_back(count_of(robot, "cycle_ns_max"));
  into.taken_per_second.push_back(count_of(robot, "messages_in") / seconds);
  for (auto& peer : peers) peer->shut();
  for (auto& sender : senders) sender.join();
  if (!with.recorded) return true;
  const bool whole = records.close() || records.figures().messages != 0; // the disk may have been too slow
  std::filesystem::remove_all(folder);
  return whole;
}

void report(const flood& with, figures& seen) {
  benchmark::RegisterBenchmark((std::string{"stop_under_flood/"} + with.name).c_str(),
                               [&seen](benchmark::State& state) {
                                 add_stop_counters(seen, state);
                                 state.counters["taken_per_s"] = median(seen.taken_per_second);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  seconds = number_option(count, arguments, "seconds", seconds);
  priority = number_option(count, arguments, "prio", priority);
  const auto cpus = two_cpus();
  const int here = cpus ? cpus->first : 0;
  const std::vector<flood> all = floods();
  std::vector<figures> seen(all.size());
  return run_on_two_cores("bench_stop_under_flood", count, arguments, [&](int rounds) {
    (void)rowe::rt::prepare_this_thread({.name = "bench", .cpu = there}); // refused: the bench still runs
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (!measure(all[i], here, seen[i])) return false;
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) report(all[i], seen[i]);
    return true;
  });
}
