// SPDX-License-Identifier: Apache-2.0
// Question: how long is one message under way, there and back, through rowe, through other libraries and
// through a bare socket?
//
// Measured, for texts of 64 and of 512 bytes: from the client's send to the last byte of the echo, one
// message after the other. Every server runs alone on the first core (peers.hpp says which there are), the
// one client of all (peer_client.hpp) on the other, where it never sleeps.
//   raw        nothing but sockets, an epoll and frames: the limit
//   rowe       the transport and the frames; rowe_json is an endpoint that parses and checks the message, a
//              publication of rosbridge's, and gives it to its topic's subscriber
//   ..._busy   asks for events without waiting for them (idle::spin); what has no such name waits in the
//              kernel, as it ships (rowe: idle::poll; rowe_wake: idle::wake)
// Before each message the client lets those that wait fall asleep (40 us): a slow one would else be awake
// still when the next message comes, and look fast. All echo the same bytes. p50, p99 and p99.9 are of all
// rounds; the ratios are of medians of the same round, busy to busy and waiting to waiting. `calls` are the
// system calls a server makes for one message (strace, in a run of its own), of those that wait.
//
// Excluded: networks, TLS, compression; clients that sleep; user threads (a message that a program handles on
// a thread of its own passes two more rings).
//
// What would make it lie: other load; cores that share one; a client that is slower than the kernel, which
// would hide differences (it adds the same to all). The cost of waking a halted core is in every figure of
// those that wait, and is most of it.
//
// Run: bench_round_trip [--rounds=11] [--peer NAME=COMMAND]... (preset bench; ws: npm ci in bench/peers/ws)
#include <cstdio>
#include <string>
#include <vector>

#include "peer_field.hpp"
#include "system_calls.hpp"

namespace rowe::bench {
namespace {

constexpr std::size_t sizes[] = {64, 512};
constexpr int warm_up = 30;
constexpr rt::duration turn = 25ms; // of one contender with one size in one round
constexpr int counted = 500;

std::string name_of(std::size_t bytes) { return "echo_" + std::to_string(bytes); }

// One round trip; false when the echo is none.
bool trip(peer_client& client, const std::string& frame, std::size_t bytes) {
  client.send(frame);
  return client.next().size() == bytes;
}

bool measure(peer_field::row& of, std::size_t bytes) {
  peer_client client;
  if (!client.open(of.server->port(), of.who.rosbridge)) return false;
  const std::string frame = frame_around(text_of(bytes));
  for (int i = 0; i < warm_up; ++i)
    if (!trip(client, frame, bytes)) return false;
  std::vector<double> trips;
  const rt::time_point end = monotonic_clock::now() + turn;
  while (monotonic_clock::now() < end) {
    const rt::time_point begin = when_asleep(of.who);
    if (!trip(client, frame, bytes)) return false;
    trips.push_back(nanoseconds_since(begin));
  }
  std::vector<double>& all = of.samples[name_of(bytes)];
  all.insert(all.end(), trips.begin(), trips.end());
  of.figures[name_of(bytes)].push_back(median(std::move(trips)));
  return true;
}

std::optional<double> count_calls(const contender& who) {
  return calls_per_message(who, "echo", here, watched::everything, counted,
                           [&](std::uint16_t port, int messages) {
                             peer_client client;
                             const std::string frame = frame_around(text_of(64));
                             if (!client.open(port, who.rosbridge)) return false;
                             for (int i = 0; i < messages; ++i)
                               if (!trip(client, frame, 64)) return false;
                             return true;
                           });
}

void report(peer_field& field, peer_field::row& of, std::size_t bytes, const std::optional<double>& calls) {
  const std::string what = name_of(bytes);
  const auto ratios = field.ratios(of, what, better::less);
  benchmark::RegisterBenchmark((what + "/" + of.who.name).c_str(),
                               [&of, what, ratios, calls](benchmark::State& state) {
                                 std::vector<double>& trips = of.samples[what];
                                 for (auto _ : state) state.SetIterationTime(median(trips) * 1e-9);
                                 state.counters["p50_us"] = quantile(trips, 0.5) * 1e-3;
                                 state.counters["p99_us"] = quantile(trips, 0.99) * 1e-3;
                                 state.counters["p999_us"] = quantile(trips, 0.999) * 1e-3;
                                 for (const auto& [name, ratio] : ratios) state.counters[name] = ratio;
                                 if (calls) state.counters["calls"] = *calls;
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::vector<contender> all = all_contenders(choice::all);
  for (contender& outside : peer_options(count, arguments)) all.push_back(std::move(outside));
  std::optional<peer_field> field;
  return run_on_two_cores("bench_round_trip", count, arguments, [&](int rounds) {
    (void)rowe::rt::prepare_this_thread({.name = "client", .cpu = there}); // the servers have the other
    field.emplace(all, "echo");
    for (int round = 0; round < rounds; ++round)
      for (const std::size_t bytes : sizes)
        if (!field->round([&](peer_field::row& of) { return measure(of, bytes); })) return false;
    for (peer_field::row& of : field->rows()) {
      const auto calls = of.who.busy() ? std::nullopt : count_calls(of.who);
      for (const std::size_t bytes : sizes) report(*field, of, bytes, calls);
    }
    return true;
  });
}
