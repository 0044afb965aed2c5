// SPDX-License-Identifier: Apache-2.0
// Question: how long does an urgent message take to a peer that reads its telemetry too slowly, on the same
// connection and on one of its own?
//
// Measured, in turn in each round of one run, from the moment the message is handed over to the moment the
// reader's parser has it: rowe, and a server of default sockets (urgent_servers.hpp). The reader is ours, on
// loopback: it reads 4 KiB at a time and spends a fixed time on each message, 30 us unless stated; it answers
// pings when it comes to them, as every WebSocket library must. rowe_two_connections: the peer subscribes to
// what is urgent on a second connection, into which it looks after each message; rowe_two_connections_wake:
// and handles wake the service thread (idle::wake), which else looks every 50 us. The figures are the median
// and the maximum over all rounds, and the median over rounds of the ratio of the medians. The targets are
// 1/400 at 30 us, and 1/5000 with the second connection. `in_front` is what the time is made of: how many
// messages the reader handled before it (median); load blurs it less.
//
// Other readers take all that comes at once, behind telemetry that fills every slot: rowe_fast does so for
// ever; rowe_slowing until the middle, and from there on it spends 300 us on each message, which is 1 MB/s.
// `rowe_slowing` has what is handed over in the first half second of that, when what was in flight has to be
// read first; `rowe_slowed` what comes later. `messages_per_s` is how much telemetry a reader handled before.
//
// Excluded: what an application does not read although its WebSocket layer has (bench/urgent_clients/run
// measures that, with readers of other makers); networks.
//
// What would make it lie: other load. A reader that is preempted reads more slowly for both, and a service
// thread that is woken late finds round trips longer than they are.
//
// Run: bench_urgent [--rounds=11] [--microseconds=30]
#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <netinet/in.h>
#include <sys/socket.h>

#include "net/base/descriptor.hpp"
#include "stand.hpp"
#include "urgent_servers.hpp"
#include "wire/websocket/frame_parser.hpp"
#include "wire/websocket/websocket.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

int microseconds_a_message = 30;

constexpr int slowed_microseconds = 300;
constexpr duration slowing_time = 500ms;

// A number for each urgent message.
struct figures {
  std::vector<std::int64_t> handed_over; // when
  std::vector<double> late;              // nanoseconds
  std::vector<double> in_front;          // messages that were handled between its hand-over and itself
  double messages_per_s = 0;

  void add(const figures& more) {
    handed_over.insert(handed_over.end(), more.handed_over.begin(), more.handed_over.end());
    late.insert(late.end(), more.late.begin(), more.late.end());
    in_front.insert(in_front.end(), more.in_front.begin(), more.in_front.end());
  }
  // Those that were handed over in this time.
  figures within(time_point from, time_point until) const {
    figures some;
    for (std::size_t i = 0; i < late.size(); ++i) {
      if (handed_over[i] < rt::nanoseconds_of(from) || handed_over[i] >= rt::nanoseconds_of(until)) continue;
      some.handed_over.push_back(handed_over[i]);
      some.late.push_back(late[i]);
      some.in_front.push_back(in_front[i]);
    }
    return some;
  }
};

// How long a reader spends on a message: nothing until `fast_until`, then so much.
struct reading {
  time_point fast_until{};
  int microseconds = microseconds_a_message;
};

// The slow peer. Runs on a thread of its own until told to stop, or the stream ends.
class reader {
 public:
  // What was handed over before `counts_from` is not measured. With `beside` it looks into that one's
  // connection, too, after each message.
  reader(std::uint16_t port, time_point counts_from, const reading& pace, reader* beside = nullptr)
      : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)},
        counts_from_{rt::nanoseconds_of(counts_from)},
        pace_{pace},
        beside_{beside} {
    if (beside) beside->application_ = this;
    const sockaddr_in to = loopback(port);
    ok = ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    const timeval timeout{.tv_sec = 1, .tv_usec = 0};
    (void)::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout); // else it blocks
    parser_.reset(wire::role::client, {.message_bytes_max = 4096, .fragments_max = 1}, assembly_);
  }

  void upgrade(std::uint16_t port, std::initializer_list<std::string_view> topics) {
    send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    std::string answer;
    char one = 0;
    while (ok && !answer.ends_with("\r\n\r\n")) {
      ok = ::recv(socket_.get(), &one, 1, 0) == 1;
      answer += one;
    }
    for (const std::string_view topic : topics)
      say(wire::opcode::text, R"({"op":"subscribe","topic":")" + std::string{topic} + R"("})");
  }

  void run(const std::atomic<bool>& stop) {
    while (!stop.load(std::memory_order_relaxed) && look(0)) continue; // relaxed: only when, not what
  }

  // How many messages of telemetry it has handled in this time.
  std::size_t handled(time_point from, time_point until) const {
    const auto first = std::lower_bound(handled_.begin(), handled_.end(), rt::nanoseconds_of(from));
    return static_cast<std::size_t>(std::lower_bound(first, handled_.end(), rt::nanoseconds_of(until)) -
                                    first);
  }

  bool ok = false;
  figures said;

 private:
  // Takes what is there; false when the stream has ended.
  bool look(int flags) {
    std::array<std::byte, 4096 + 64> buffer;
    const ssize_t bytes = ::recv(socket_.get(), buffer.data(), 4096, flags);
    std::span<std::byte> rest{buffer.data(), bytes > 0 ? static_cast<std::size_t>(bytes) : 0};
    while (!rest.empty()) {
      const wire::frame_step step = parser_.next(rest);
      rest = rest.subspan(step.consumed);
      take(step);
    }
    return bytes != 0;
  }

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
      if (stamp < counts_from_) return;
      said.handed_over.push_back(stamp);
      said.late.push_back(static_cast<double>(rt::nanoseconds_of(now) - stamp));
      const std::vector<std::int64_t>& handled = application_->handled_;
      const auto first = std::lower_bound(handled.begin(), handled.end(), stamp);
      said.in_front.push_back(static_cast<double>(handled.end() - first));
      return;
    }
    handled_.push_back(rt::nanoseconds_of(now));
    if (now >= pace_.fast_until) {
      while (monotonic_clock::now() - now < std::chrono::microseconds{pace_.microseconds}) continue;
    }
    if (beside_) (void)beside_->look(MSG_DONTWAIT);
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
  std::int64_t counts_from_;
  reading pace_;
  reader* beside_;
  const reader* application_ = this;  // who handles the telemetry
  std::vector<std::int64_t> handled_; // when, each message of telemetry
  wire::frame_parser parser_;
  std::array<std::byte, 4096 + 64> assembly_{};
};

// With `second` what is urgent has a connection of its own.
template <class Server>
bool run(Server& server, duration warm_up, duration time, figures& said, bool second = false) {
  const time_point begin = monotonic_clock::now();
  std::optional<reader> urgent;
  if (second) urgent.emplace(server.port(), begin + warm_up, reading{});
  reader slow{server.port(), begin + warm_up, reading{}, second ? &*urgent : nullptr};
  std::atomic<bool> stop{false};
  {
    const rt::thread reads = on_the_other_core([&] {
      if (second) {
        urgent->upgrade(server.port(), {"/urgent"});
        slow.upgrade(server.port(), {"/telemetry"});
      } else {
        slow.upgrade(server.port(), {"/telemetry", "/urgent"});
      }
      slow.run(stop);
    });
    for (time_point now = begin; now < begin + warm_up + time; now = monotonic_clock::now()) server.turn(now);
    stop.store(true, std::memory_order_relaxed); // see reader::run()
  }
  said = std::move(second ? urgent->said : slow.said);
  return slow.ok && (!second || urgent->ok);
}

bool run_rowe(figures& said) {
  robot server;
  return server.open("http://localhost") && run(server, 2s, 1s, said);
}

template <idle Policy>
bool run_two_connections(figures& said) {
  robot server;
  return server.open("http://localhost", Policy) && run(server, 300ms, 700ms, said, true);
}

// Fast for a second; then for ever, or slow for one.
bool run_fast(robot& server, time_point slow_from, time_point end, figures& said) {
  const time_point begin = monotonic_clock::now();
  reader one{server.port(), begin, {slow_from, slowed_microseconds}};
  std::atomic<bool> stop{false};
  {
    const rt::thread reads = on_the_other_core([&] {
      one.upgrade(server.port(), {"/telemetry", "/urgent"});
      one.run(stop);
    });
    for (time_point now = begin; now < end; now = monotonic_clock::now()) server.full_turn(now);
    stop.store(true, std::memory_order_relaxed); // see reader::run()
  }
  said = std::move(one.said);
  const time_point counted = begin + 200ms; // the credit has learned by then
  said.messages_per_s = static_cast<double>(one.handled(counted, begin + 1s)) / 0.8;
  return one.ok;
}

bool run_rowe_fast(figures& said) {
  robot server;
  const time_point begin = monotonic_clock::now();
  if (!server.open("http://localhost") || !run_fast(server, rt::never, begin + 1s, said)) return false;
  const double rate = said.messages_per_s;
  said = said.within(begin + 200ms, rt::never);
  said.messages_per_s = rate;
  return true;
}

// The latter half is kept for run_rowe_slowed().
figures slowed;
bool run_rowe_slowing(figures& said) {
  robot server;
  const time_point slow_from = monotonic_clock::now() + 1s;
  const time_point end = slow_from + 2 * slowing_time;
  if (!server.open("http://localhost") || !run_fast(server, slow_from, end, said)) return false;
  slowed = said.within(slow_from + slowing_time, rt::never);
  const double rate = said.messages_per_s;
  said = said.within(slow_from, slow_from + slowing_time);
  said.messages_per_s = rate;
  return true;
}
bool run_rowe_slowed(figures& said) {
  said = slowed;
  return true;
}

bool run_default(figures& said) {
  default_sockets server;
  return server.open(false) && run(server, 800ms, 1200ms, said);
}

struct contender {
  const char* name;
  bool (*run)(figures&);
  figures all{};
  std::vector<double> ratios{}; // of each round
  std::vector<double> rates{};
};

void report(const contender& each) {
  benchmark::RegisterBenchmark((std::string{"urgent/"} + each.name).c_str(),
                               [&each](benchmark::State& state) {
                                 std::vector<double> late = each.all.late;
                                 for (auto _ : state) state.SetIterationTime(median(late) * 1e-9);
                                 state.counters["p99_ms"] = quantile(late, 0.99) * 1e-6;
                                 state.counters["max_ms"] = quantile(late, 1) * 1e-6;
                                 state.counters["in_front"] = median(each.all.in_front);
                                 state.counters["messages"] = static_cast<double>(late.size());
                                 state.counters["default_over_this"] = median(each.ratios);
                                 if (median(each.rates) > 0)
                                   state.counters["messages_per_s"] = median(each.rates);
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
  std::array<contender, 7> all{{{"default", run_default},
                                {"rowe", run_rowe},
                                {"rowe_fast", run_rowe_fast},
                                {"rowe_slowing", run_rowe_slowing},
                                {"rowe_slowed", run_rowe_slowed},
                                {"rowe_two_connections", run_two_connections<rowe::idle::poll>},
                                {"rowe_two_connections_wake", run_two_connections<rowe::idle::wake>}}};
  return run_on_two_cores("bench_urgent", count, arguments, [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      double default_median = 0;
      for (contender& each : all) {
        figures said;
        if (!each.run(said) || said.late.empty()) {
          std::fprintf(stderr, "%s: a connection failed, or nothing urgent came in time\n", each.name);
          return false;
        }
        if (&each == &all.front()) default_median = median(said.late);
        each.all.add(said);
        each.ratios.push_back(default_median / median(said.late));
        each.rates.push_back(said.messages_per_s);
      }
    }
    for (const contender& each : all) report(each);
    return true;
  });
}
