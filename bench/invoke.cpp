// SPDX-License-Identifier: Apache-2.0
// Question: how long does a call take from one user thread to another through sockets and service threads,
// and back?
//
// Measured, one call after the other, each timed alone; p50, p99, p99.9 of each round, medians over the
// rounds. Core A is --here, core B --there:
//
// - rowe_spin, rowe_poll, rowe_wake, rowe_phase: an endpoint by each idle policy (phase: awake
// for the answer), its service thread on core B. The request's frame goes into a socket; the service thread
// reads it, validates the JSON, looks up the service and decodes a struct; a user thread on core A takes it
// with try_next() and answers with reply(); the service thread encodes and sends; the same user thread reads
// that from its socket. So who calls and who answers is one thread, since two cores hold two that spin.
//
// - rowe_both_ends_poll, rowe_both_ends_wake: both ends are rowe's, with four threads that wait in the
// kernel: lane::invoke() and its service thread on core A, responder::next() and its service thread on core
// B.
//
// - baseline_v1: likewise, both ends by the paper's design (baseline_v1/endpoint.hpp): four threads that wait
// for condition variables and in libwebsockets' loop, the caller's two on core A.
//
// - baseline_v1_one_core: the same with all four on core A. There nobody is ever woken on a core that sleeps,
// which is no place for a client and a server, but shows what that costs the others.
//
// - baseline_v1_server: its server alone, both threads on core B, called as rowe_spin is.
//
// - raw: the same bytes both ways over a socket of the same kind, and nothing else; both threads spin.
//
// `of_raw` is the ratio to raw inside each round (target for rowe_spin: at most 1.25), `x_baseline_v1` how
// many times faster than baseline_v1 (target for rowe_spin: at least 8).
//
// Excluded: what a raw client does with frames; names, TLS, a network: all is loopback with TCP_NODELAY. The
// two hand-overs more of a client that is rowe's too, with cores for its threads to spin on; bench_hand_over
// says what they cost.
//
// What would make it lie: other load on either core; a machine that halts its cores, where whoever sleeps
// pays ten times what he pays elsewhere (a virtual one above all: it is hard on baseline_v1, and on rowe_poll
// and rowe_wake); to compare rowe_spin with baseline_v1 and forget that it spends a core.
//
// Run: bench_invoke [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>

#include <rowe/rowe.hpp>
#include <rowe/rt/thread.hpp>

#include "baseline_v1/endpoint.hpp"
#include "raw_client.hpp"
#include "stand.hpp"

namespace rowe::bench {
struct numbers {
  std::int32_t a, b;
};
struct sum {
  std::int32_t result;
};
} // namespace rowe::bench
template <>
inline constexpr auto rowe::schema<rowe::bench::numbers> =
    rowe::fields<&rowe::bench::numbers::a, &rowe::bench::numbers::b>{};
template <>
inline constexpr auto rowe::schema<rowe::bench::sum> = rowe::fields<&rowe::bench::sum::result>{};

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr int trips = 3'000;       // in a round, of those who spin
constexpr int trips_asleep = 400;  // of those who sleep, which take ten times as long and more
constexpr int trips_to_warm = 100; // untimed
constexpr std::string_view service = "add-two-numbers";
constexpr std::string_view call_text = R"({"service":"add-two-numbers","a":38,"b":4,"message_id":"100000"})";
constexpr std::string_view reply_text = R"({"result":42,"in_reply_to":"100000"})";

[[noreturn]] void give_up(const char* what) {
  std::fprintf(stderr, "bench_invoke: %s\n", what);
  std::exit(1);
}

// Times `count` trips behind some that do not count; microseconds each. `settle()` looks at what came, and
// prepares the next one.
template <class Trip, class Settle>
std::vector<double> time_trips(int count, Trip&& trip, Settle&& settle) {
  std::vector<double> each;
  each.reserve(static_cast<std::size_t>(count));
  for (int i = -trips_to_warm; i < count; ++i) {
    const auto begin = monotonic_clock::now();
    const bool done = trip();
    const double took = nanoseconds_since(begin) / 1e3;
    if (!done || !settle()) give_up("a call failed");
    if (i >= 0) each.push_back(took);
  }
  return each;
}
template <class Trip>
std::vector<double> time_trips(int count, Trip&& trip) {
  return time_trips(count, trip, [] { return true; });
}

// ---- the contenders; each returns what its trips took

std::vector<double> raw() {
  const socket_pair sockets;
  if (!sockets.ok()) give_up("no sockets");
  const std::string request = raw_client::frame_of(wire::opcode::text, call_text);
  const std::string reply(wire::frame_header_bytes(reply_text.size(), wire::role::server) + reply_text.size(),
                          'r');
  const rt::thread partner = on_the_other_core([&] {
    std::string buffer(request.size(), '\0');
    while (spin_for(sockets.theirs(), buffer) && send_whole(sockets.theirs(), reply)) continue;
  });
  std::string buffer(reply.size(), '\0');
  auto each = time_trips(
      trips, [&] { return send_whole(sockets.ours(), request) && spin_for(sockets.ours(), buffer); });
  (void)::shutdown(sockets.ours(), SHUT_WR); // the partner's sign to end
  return each;
}

// Calls from a socket of this thread's; `answer()` is what this thread does for the reply meanwhile. What the
// client does with a frame is not timed, as it is not in raw.
template <class Answer>
std::vector<double> time_calls(int count, raw_client& client, Answer&& answer) {
  std::string request = raw_client::frame_of(wire::opcode::text, call_text);
  int id = 100'000;
  const auto trip = [&] {
    if (!client.send(request)) return false;
    answer();
    return client.wait();
  };
  const auto settle = [&] {
    if (client.take().empty()) return false;
    client.answer_pings();
    id = id == 999'999 ? 100'000 : id + 1;
    const std::string digits = std::to_string(id);
    std::copy(digits.begin(), digits.end(), request.end() - 8); // the message_id
    return true;
  };
  return time_trips(count, trip, settle);
}

template <idle Policy>
std::vector<double> rowe_server() {
  auto robot = endpoint::listen(
      0, {.idle_policy = Policy, .service_cpu = there, .limits = {.messages_per_second_max = 0}});
  if (!robot) give_up("cannot listen");
  auto adder = robot->serve<numbers, sum>(service);
  raw_client client{robot->port()};
  if (!adder || !client.ok()) give_up("no service, or no connection");
  return time_calls(Policy == idle::spin ? trips : trips_asleep, client, [&] {
    auto asked = adder->try_next();
    while (!asked) asked = adder->try_next();
    (void)adder->reply(*asked, {asked->value().a + asked->value().b}); // else no answer comes
  });
}

template <idle Policy>
std::vector<double> rowe_both_ends() {
  auto robot = endpoint::listen(
      0, {.idle_policy = Policy, .service_cpu = there, .limits = {.messages_per_second_max = 0}});
  if (!robot) give_up("cannot listen");
  auto adder = robot->serve<numbers, sum>(service);
  auto operators =
      endpoint::connect("ws://127.0.0.1:" + std::to_string(robot->port()), {.idle_policy = Policy});
  if (!adder || !operators || !operators->wait_peer(5s)) give_up("no service, or no connection");
  auto lane = operators->open_lane().value();
  std::atomic<bool> done{false};
  const rt::thread handler = on_the_other_core([&] {
    while (!done.load(std::memory_order_relaxed)) { // relaxed: nothing else is read on the strength of it
      if (auto asked = adder->next(10ms)) (void)adder->reply(*asked, {asked->value().a + asked->value().b});
    }
  });
  auto each = time_trips(trips_asleep, [&] {
    return lane.invoke(message{"service", service, "a", 38, "b", 4}, 1s).has_value();
  });
  done.store(true, std::memory_order_relaxed);
  return each;
}

// Without a core it runs where the calling thread does; so does its service thread.
rt::thread baseline_server(std::optional<int> cpu, std::atomic<int>& port, std::atomic<bool>& done) {
  return rt::thread{rt::thread_options{.name = "server", .cpu = cpu}, [&port, &done] {
                      const auto robot = baseline_v1::endpoint::open_local(0);
                      if (!robot) give_up("baseline_v1 cannot listen");
                      port.store(robot->port());
                      while (!done.load()) {
                        const auto asked = robot->receive(10ms);
                        if (!asked) continue;
                        const auto number = [&](const char* name) {
                          return json_object_get_int(json_object_object_get(asked.get(), name));
                        };
                        const baseline_v1::object reply{json_object_new_object()};
                        json_object_object_add(reply.get(), "result",
                                               json_object_new_int(number("a") + number("b")));
                        robot->async_reply(asked, reply, 1s);
                      }
                    }};
}

template <bool OneCore>
std::vector<double> baseline_both_ends() {
  std::atomic<int> port{0};
  std::atomic<bool> done{false};
  const rt::thread server = baseline_server(OneCore ? std::nullopt : std::optional{there}, port, done);
  while (port.load() == 0) continue;
  const auto operators = baseline_v1::endpoint::open_remote("127.0.0.1", port.load());
  if (!operators || !operators->wait_peer(5s)) give_up("baseline_v1 cannot connect");
  auto each = time_trips(trips_asleep, [&] {
    const baseline_v1::object call{json_object_new_object()};
    json_object_object_add(call.get(), "service", json_object_new_string(service.data()));
    json_object_object_add(call.get(), "a", json_object_new_int(38));
    json_object_object_add(call.get(), "b", json_object_new_int(4));
    return operators->invoke(call, 1s) != nullptr;
  });
  done.store(true);
  return each;
}

std::vector<double> baseline_one_end() {
  std::atomic<int> port{0};
  std::atomic<bool> done{false};
  const rt::thread server = baseline_server(there, port, done);
  while (port.load() == 0) continue;
  raw_client client{static_cast<std::uint16_t>(port.load())};
  if (!client.ok()) give_up("baseline_v1 lets nobody in");
  auto each = time_calls(trips_asleep, client, [] {});
  done.store(true);
  return each;
}

struct contender {
  const char* name;
  std::vector<double> (*run)();
};

constexpr contender contenders[] = {
    {"raw", raw},
    {"baseline_v1", baseline_both_ends<false>},
    {"baseline_v1_one_core", baseline_both_ends<true>},
    {"baseline_v1_server", baseline_one_end},
    {"rowe_spin", rowe_server<idle::spin>},
    {"rowe_poll", rowe_server<idle::poll>},
    {"rowe_wake", rowe_server<idle::wake>},
    {"rowe_phase", rowe_server<idle::phase>},
    {"rowe_both_ends_poll", rowe_both_ends<idle::poll>},
    {"rowe_both_ends_phase", rowe_both_ends<idle::phase>},
    {"rowe_both_ends_wake", rowe_both_ends<idle::wake>},
};

struct series {
  std::vector<double> p50, p99, p999, of_raw, x_baseline;
};

void report(const char* name, const series& each) {
  benchmark::RegisterBenchmark((std::string{"invoke/"} + name).c_str(),
                               [&each](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(median(each.p50) * 1e-6);
                                 state.counters["p50_us"] = median(each.p50);
                                 state.counters["p99_us"] = median(each.p99);
                                 state.counters["p999_us"] = median(each.p999);
                                 state.counters["of_raw"] = median(each.of_raw);
                                 state.counters["x_baseline_v1"] = median(each.x_baseline);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::array<series, std::size(contenders)> all;
  return run_on_two_cores("bench_invoke", count, arguments, [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        std::vector<double> each = contenders[i].run();
        all[i].p50.push_back(quantile(each, 0.5));
        all[i].p99.push_back(quantile(each, 0.99));
        all[i].p999.push_back(quantile(each, 0.999));
      }
      for (series& one : all) {
        one.of_raw.push_back(one.p50.back() / all[0].p50.back());
        one.x_baseline.push_back(all[1].p50.back() / one.p50.back());
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) report(contenders[i].name, all[i]);
    return true;
  });
}
