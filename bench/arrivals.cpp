// SPDX-License-Identifier: Apache-2.0
// Question: how long after publish() has a peer the message, next to what a socket and a hand-over take at
// least?
//
// Measured, from the beginning of publish() until the peer has read the whole frame, one message after the
// other; p50, p99, p99.9 of each round, medians over the rounds. The loop on core A (--here) publishes, and
// is the peer as well: it spins on its socket. The service thread is alone on core B (--there), by each idle
// policy. Each for two messages: `small`, one double, and `odometry`, 13 doubles. With a message every 50 us,
// and for rowe_poll, rowe_wake and rowe_spin_1khz one every millisecond, when the caches have had time to
// forget.
//
// The limits: a thread that spins on core B for a word, which core A stores, and sends the same bytes, ready
// made, over a socket of the same kind: one hand-over and one send. `raw` looks at nothing but the word;
// `raw_warm` asks the kernel for events between two looks, as whoever has sockets must, which costs some time
// and keeps the kernel's code and data in the caches, so that it may be the faster one. raw_1khz and
// raw_warm_1khz are these every millisecond. `of_raw` is the ratio to the faster one of the same pace inside
// each round (target for rowe_spin: at most 1.1). What it is made of is known besides: `send`, how long that
// thread's send() took, and `hand_over`, half of a word's way to the other core and back; the rest is the
// peer's receiving, while its own spinning locks the socket.
//
// Excluded: whatever becomes of the message in the peer: its frame is not looked into; a network.
//
// What would make it lie: other load on either core; two hyperthreads of one core; a peer that spins on the
// core where the sender's kernel works, which it does not here.
//
// Run: bench_arrivals [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/epoll.h>

#include <benchmark/benchmark.h>

#include <rowe/rowe.hpp>
#include <rowe/rt/thread.hpp>

#include "raw_client.hpp"
#include "stand.hpp"

namespace rowe::bench {
struct small {
  double x;
};
struct odometry {
  double stamp;
  std::array<double, 3> position;
  std::array<double, 4> orientation;
  std::array<double, 2> velocity;
  std::array<double, 3> spread;
};
} // namespace rowe::bench
template <>
inline constexpr auto rowe::schema<rowe::bench::small> = rowe::fields<&rowe::bench::small::x>{};
template <>
inline constexpr auto rowe::schema<rowe::bench::odometry> =
    rowe::fields<&rowe::bench::odometry::stamp, &rowe::bench::odometry::position,
                 &rowe::bench::odometry::orientation, &rowe::bench::odometry::velocity,
                 &rowe::bench::odometry::spread>{};

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr int messages = 1'000; // in a round
constexpr int messages_to_warm = 50;
constexpr int messages_at_1khz = 200;
constexpr rt::duration period = 50us;

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "bench_arrivals: %s\n", what);
  std::exit(1);
}

void wait_until(time_point then) {
  while (monotonic_clock::now() < then) continue;
}

// `publish(n, now)`, then `arrive()`, every `pause`; microseconds from the one to the end of the other.
// `settle()` is what is to be done afterwards.
template <class Publish, class Arrive, class Settle>
std::vector<double> time_messages(int count, rt::duration pause, Publish&& publish, Arrive&& arrive,
                                  Settle&& settle) {
  std::vector<double> each;
  each.reserve(static_cast<std::size_t>(count));
  auto next = monotonic_clock::now();
  for (int i = -messages_to_warm; i < count; ++i) {
    wait_until(next += pause);
    const auto begin = monotonic_clock::now();
    if (!publish(i, begin) || !arrive()) give_up("a message was lost");
    const double took = nanoseconds_since(begin) / 1e3;
    if (i >= 0) each.push_back(took);
    if (!settle()) give_up("what arrived is no message");
  }
  return each;
}

small message_of(small*, int n) { return {0.1 * n}; }
odometry message_of(odometry*, int n) {
  const double at = 0.001 * n;
  return {1.7e9 + at,
          {at / 3, at / 7, 0.1},
          {0.0, 0.0, at / 11, 0.7},
          {0.5 + at / 13, at / 17},
          {0.01, 0.02, 0.03}};
}

// ---- the limit

struct limit {
  std::vector<double> arrived; // microseconds each
  double send = 0;             // median, likewise
};

// Between two looks at the word the sender asks the kernel for events where that is to be kept `warm`.
limit raw(std::size_t frame_bytes, int count, rt::duration pause, bool warm) {
  const socket_pair sockets;
  if (!sockets.ok()) give_up("no sockets");
  const net::descriptor events{::epoll_create1(EPOLL_CLOEXEC)};
  epoll_event readable{.events = EPOLLIN, .data = {}};
  if (::epoll_ctl(events.get(), EPOLL_CTL_ADD, sockets.theirs(), &readable) != 0) give_up("no epoll");
  const std::string frame(frame_bytes, 'r');
  alignas(rt::line_bytes) std::atomic<int> word{-messages_to_warm - 1};
  std::vector<double> sends;
  limit found;
  {
    const rt::thread partner = on_the_other_core([&] {
      for (int i = -messages_to_warm; i < count; ++i) {
        while (word.load(std::memory_order_acquire) != i) { // pairs with the release below
          epoll_event event;
          if (warm) (void)::epoll_wait(events.get(), &event, 1, 0); // there are none
        }
        const auto begin = monotonic_clock::now();
        (void)send_whole(sockets.theirs(), frame); // what does not arrive is noticed there
        sends.push_back(nanoseconds_since(begin) / 1e3);
      }
    });
    std::string buffer(frame_bytes, '\0');
    found.arrived = time_messages(
        count, pause,
        [&](int n, time_point) {
          word.store(n, std::memory_order_release); // pairs with the acquire above
          return true;
        },
        [&] { return spin_for(sockets.ours(), buffer); }, [] { return true; });
  }
  found.send = median(sends) - clock_cost() / 1e3;
  return found;
}

// ---- rowe

struct arrivals {
  std::vector<double> took;
  std::size_t frame_bytes = 0; // of the last one
};

template <class Value>
arrivals rowe(idle policy, int count, rt::duration pause) {
  auto robot = endpoint::listen(0, {.idle_policy = policy, .service_cpu = there});
  if (!robot) give_up("cannot listen");
  auto odom = robot->advertise<Value>("/odom");
  raw_client client{robot->port()};
  if (!odom || !client.ok()) give_up("no topic, or no connection");
  (void)client.send(raw_client::frame_of(wire::opcode::text, R"({"op":"subscribe","topic":"/odom"})"));
  while (!odom->wanted()) continue;
  arrivals seen;
  seen.took = time_messages(
      count, pause,
      [&](int n, time_point now) {
        return odom->publish(message_of(static_cast<Value*>(nullptr), n), now).has_value();
      },
      [&] { return client.wait(); },
      [&] {
        const auto text = client.take();
        client.answer_pings();
        seen.frame_bytes = text.size() + wire::frame_header_bytes(text.size(), wire::role::server);
        return !text.empty();
      });
  return seen;
}

// ---- rounds

struct contender {
  const char* name;
  idle policy;
  int count;
  rt::duration pause;
};

constexpr contender contenders[] = {
    {"rowe_spin", idle::spin, messages, period},
    {"rowe_spin_1khz", idle::spin, messages_at_1khz, 1ms},
    {"rowe_poll", idle::poll, messages_at_1khz, 1ms},
    {"rowe_wake", idle::wake, messages_at_1khz, 1ms},
};

struct series {
  std::string name;
  std::vector<double> p50, p99, p999, of_raw, send, hand_over;
};

// Both limits of one pace, in one round.
struct limits {
  limits(std::size_t bytes, int count, rt::duration pause)
      : cold{raw(bytes, count, pause, false)}, warm{raw(bytes, count, pause, true)} {}
  double least() const { return std::min(median(cold.arrived), median(warm.arrived)); }

  limit cold, warm;
};

void enter(series& into, std::string name, std::vector<double> took, double least, double send, double over) {
  into.name = std::move(name);
  into.p50.push_back(quantile(took, 0.5));
  into.p99.push_back(quantile(took, 0.99));
  into.p999.push_back(quantile(took, 0.999));
  into.of_raw.push_back(into.p50.back() / least);
  into.send.push_back(send);
  into.hand_over.push_back(over);
}

template <class Value>
void run_round(const std::string& message, std::span<series> into) {
  std::vector<arrivals> seen;
  for (const contender& one : contenders) seen.push_back(rowe<Value>(one.policy, one.count, one.pause));
  const std::size_t bytes = seen[0].frame_bytes;
  const limits often{bytes, messages, period};
  const limits at_1khz{bytes, messages_at_1khz, 1ms};
  const double over = line_cost() * 1e-3;
  const auto enter_limit = [&](series& of, const char* name, const limit& one, const limits& all) {
    enter(of, name + message, one.arrived, all.least(), one.send, over);
  };
  enter_limit(into[0], "raw/", often.cold, often);
  enter_limit(into[1], "raw_warm/", often.warm, often);
  enter_limit(into[2], "raw_1khz/", at_1khz.cold, at_1khz);
  enter_limit(into[3], "raw_warm_1khz/", at_1khz.warm, at_1khz);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const limits& least = contenders[i].count == messages ? often : at_1khz;
    enter(into[i + 4], std::string{contenders[i].name} + "/" + message, seen[i].took, least.least(),
          least.cold.send, over);
  }
}

void report(const series& each) {
  benchmark::RegisterBenchmark(("arrivals/" + each.name).c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.p50) * 1e-6);
                                 state.counters["p50_us"] = median(each.p50);
                                 state.counters["p99_us"] = median(each.p99);
                                 state.counters["p999_us"] = median(each.p999);
                                 state.counters["of_raw"] = median(each.of_raw);
                                 state.counters["send_us"] = median(each.send);
                                 state.counters["hand_over_us"] = median(each.hand_over);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  constexpr std::size_t each = 4 + std::size(contenders);
  std::vector<series> all(2 * each);
  return run_on_two_cores("bench_arrivals", count, arguments, [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      run_round<small>("small", std::span{all}.first(each));
      run_round<odometry>("odometry", std::span{all}.last(each));
    }
    for (const series& one : all) report(one);
    return true;
  });
}
