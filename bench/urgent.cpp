// SPDX-License-Identifier: Apache-2.0
// Question: how long does an urgent message take to a peer that reads its telemetry too slowly, on the same
// connection?
//
// Measured, in turn in each round of one run, from the moment the message is handed over to the moment the
// reader's parser has it:
//   rowe      an endpoint with a topic of 300 B telemetry that is always full and an urgent topic; its
//   service
//             thread under SCHED_FIFO where that is permitted
//   default   a socket with the kernel's own buffers, kept full of the same frames; an urgent frame is always
//             the next one written: what a server does that has priorities and no bound
// The reader is ours, on loopback: it reads 4 KiB at a time and spends a fixed time on each message, 30 us
// unless stated; it answers pings when it comes to them, as every WebSocket library must. The figures are the
// median and the maximum over all rounds, and the median over rounds of the ratio of the two medians. The
// target is 1/400 at 30 us.
//
// Excluded: what an application does not read although its WebSocket layer has; networks.
//
// What would make it lie: other load. A reader that is preempted reads more slowly for both, and a service
// thread that is woken late finds round trips longer than they are.
//
// Run: bench_urgent [--rounds=11] [--microseconds=30]
#include <array>
#include <atomic>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <rowe/rowe.hpp>

#include "net/descriptor.hpp"
#include "stand.hpp"
#include "wire/websocket.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t frame_bytes = 300;
constexpr duration between_urgent = 7ms; // no multiple of anything else here
constexpr std::string_view stamp_mark = R"("t":)";
int microseconds_a_message = 30;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return at;
}

std::string urgent_text(time_point now) {
  return "{" + std::string{stamp_mark} + std::to_string(rt::nanoseconds_of(now)) + "}";
}

// The slow peer. Runs on a thread of its own until told to stop, or the stream ends.
class reader {
 public:
  explicit reader(std::uint16_t port) : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    const sockaddr_in to = loopback(port);
    ok = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    const timeval patience{.tv_sec = 0, .tv_usec = 100'000};
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience); // else it blocks
    parser_.reset(wire::role::client, {.message_bytes_max = 4096, .fragments_max = 1}, assembly_);
  }

  void upgrade(std::uint16_t port) {
    send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    std::string answer;
    char one = 0;
    while (ok && !answer.ends_with("\r\n\r\n")) {
      ok = ::recv(socket_.get(), &one, 1, 0) == 1;
      answer += one;
    }
    say(wire::opcode::text, R"({"op":"subscribe","topic":"/telemetry"})");
    say(wire::opcode::text, R"({"op":"subscribe","topic":"/urgent"})");
  }

  void run(const std::atomic<bool>& stop) {
    std::array<std::byte, 4096 + 64> room;
    while (!stop.load(std::memory_order_relaxed)) { // relaxed: only when, not what
      const ssize_t bytes = ::recv(socket_.get(), room.data(), 4096, 0);
      if (bytes == 0) return;
      std::span<std::byte> rest{room.data(), bytes > 0 ? static_cast<std::size_t>(bytes) : 0};
      while (!rest.empty()) {
        const wire::frame_step step = parser_.next(rest);
        rest = rest.subspan(step.consumed);
        take(step);
      }
    }
  }

  bool ok = false;
  std::vector<double> late; // nanoseconds
  std::uint64_t telemetry = 0;

 private:
  void take(const wire::frame_step& step) {
    const std::string_view text{reinterpret_cast<const char*>(step.payload.data()), step.payload.size()};
    if (step.event == wire::frame_event::ping) say(wire::opcode::pong, text);
    if (step.event == wire::frame_event::violation || step.event == wire::frame_event::close) ok = false;
    if (step.event != wire::frame_event::text) return;
    const time_point now = monotonic_clock::now();
    if (const auto at = text.find(stamp_mark); at != std::string_view::npos) {
      std::int64_t stamp = 0;
      (void)std::from_chars(text.data() + at + stamp_mark.size(), text.data() + text.size(),
                            stamp); // our own
      late.push_back(static_cast<double>(rt::nanoseconds_of(now) - stamp));
      return;
    }
    ++telemetry;
    while (monotonic_clock::now() - now < std::chrono::microseconds{microseconds_a_message}) continue;
  }

  void say(wire::opcode what, std::string_view text) {
    std::array<std::byte, 256> frame;
    const wire::mask_key plain{}; // masks nothing, and is allowed
    const std::size_t header = wire::write_frame_header(frame.data(), what, text.size(), plain);
    std::memcpy(frame.data() + header, text.data(), text.size());
    send({reinterpret_cast<const char*>(frame.data()), header + text.size()});
  }
  void send(std::string_view bytes) {
    ok = ok && ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
                   static_cast<ssize_t>(bytes.size());
  }

  net::descriptor socket_;
  wire::frame_parser parser_;
  std::array<std::byte, 4096 + 64> assembly_{};
};

// Hands over an urgent message now and then.
class metronome {
 public:
  explicit metronome(time_point begins) : next_{begins} {}
  bool due(time_point now) {
    if (now < next_) return false;
    next_ = now + between_urgent;
    return true;
  }

 private:
  time_point next_;
};

bool run_rowe(duration warm_up, duration time, std::vector<double>& late) {
  auto robot = endpoint::listen(0, {.poll_period = 50us, .service_priority = 20});
  if (!robot) return false;
  auto telemetry = robot->advertise<json_text>("/telemetry", {.depth = 256, .text_bytes_max = 400});
  auto urgent = robot->advertise<json_text>("/urgent", {.priority = priority::urgent, .text_bytes_max = 100});
  if (!telemetry || !urgent) return false;
  reader slow{robot->port()};
  slow.upgrade(robot->port());
  std::atomic<bool> stop{false};
  {
    const rt::thread reads = on_the_other_core([&] { slow.run(stop); });
    constexpr std::string_view envelope = R"({"op":"publish","topic":"/telemetry","msg":{"x":""}})";
    const std::string text = R"({"x":")" + std::string(frame_bytes - 4 - envelope.size(), 'x') + R"("})";
    const time_point begin = monotonic_clock::now();
    metronome urgently{begin + warm_up};
    for (time_point now = begin; now < begin + warm_up + time; now = monotonic_clock::now()) {
      for (int i = 0; i < 64 && telemetry->publish(text, now); ++i) continue;
      if (urgently.due(now)) (void)urgent->publish(urgent_text(now), now); // what is refused is not measured
      ::usleep(300);
    }
    stop.store(true, std::memory_order_relaxed); // see run()
  }
  late = std::move(slow.late);
  return slow.ok;
}

// The frames of one connection, the next one chosen when the one before has been taken whole.
bool run_default(duration warm_up, duration time, std::vector<double>& late) {
  const net::descriptor listening{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  sockaddr_in at = loopback(0);
  socklen_t bytes = sizeof at;
  if (::bind(listening.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 ||
      ::listen(listening.get(), 1) != 0 ||
      ::getsockname(listening.get(), reinterpret_cast<sockaddr*>(&at), &bytes) != 0)
    return false;
  reader slow{ntohs(at.sin_port)};
  net::descriptor out{::accept4(listening.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)};
  const int yes = 1;
  (void)::setsockopt(out.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); // as everybody does
  std::atomic<bool> stop{false};
  {
    const rt::thread reads = on_the_other_core([&] { slow.run(stop); });
    const auto frame_of = [](std::string_view text) {
      std::string frame(wire::frame_header_bytes(text.size(), wire::role::server), '\0');
      (void)wire::write_frame_header(reinterpret_cast<std::byte*>(frame.data()), wire::opcode::text,
                                     text.size());
      return frame.append(text);
    };
    const std::string telemetry = frame_of(std::string(frame_bytes - 4, 'x'));
    std::string many;
    for (int i = 0; i < 16; ++i) many += telemetry;
    std::string rest;
    const time_point begin = monotonic_clock::now();
    metronome urgently{begin + warm_up};
    std::string waiting; // urgent ones, next to be written
    for (time_point now = begin; now < begin + warm_up + time; now = monotonic_clock::now()) {
      if (urgently.due(now)) waiting += frame_of(urgent_text(now));
      if (rest.empty()) rest = waiting.empty() ? many : std::exchange(waiting, {});
      const ssize_t sent = ::send(out.get(), rest.data(), rest.size(), MSG_NOSIGNAL);
      if (sent > 0) rest.erase(0, static_cast<std::size_t>(sent));
      pollfd writable{.fd = out.get(), .events = POLLOUT, .revents = 0};
      if (sent < 0) (void)::poll(&writable, 1, 1); // or the next urgent one
    }
    stop.store(true, std::memory_order_relaxed); // see run()
    out.reset();
  }
  late = std::move(slow.late);
  return slow.ok;
}

void report(const char* who, std::vector<double> late, double ratio) {
  benchmark::RegisterBenchmark((std::string{"urgent/"} + who).c_str(),
                               [late, ratio](benchmark::State& state) mutable {
                                 for (auto _ : state) state.SetIterationTime(median(late) * 1e-9);
                                 state.counters["max_ms"] = quantile(late, 1) * 1e-6;
                                 state.counters["messages"] = static_cast<double>(late.size());
                                 state.counters["default_over_this"] = ratio;
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  microseconds_a_message = number_option(count, arguments, "microseconds", 30);
  return run_on_two_cores("bench_urgent", count, arguments, [](int rounds) {
    std::vector<double> ours, theirs, ratios;
    for (int round = 0; round < rounds; ++round) {
      std::vector<double> mine, other;
      if (!run_rowe(2s, 2s, mine) || !run_default(1s, 3s, other) || mine.empty() || other.empty()) {
        std::fprintf(stderr, "a connection failed\n");
        return false;
      }
      ratios.push_back(median(other) / median(mine));
      ours.insert(ours.end(), mine.begin(), mine.end());
      theirs.insert(theirs.end(), other.begin(), other.end());
    }
    report("rowe", ours, median(ratios));
    report("default", theirs, 1);
    return true;
  });
}
