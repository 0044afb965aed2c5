// SPDX-License-Identifier: Apache-2.0
// Question: how many messages of 300 bytes a second does rowe send to one client, and take from one, next to
// other libraries?
//
// Measured, in turns of 60 ms, each server alone on the first core (peers.hpp says which there are, and what
// they do), the one client of all on the other:
//   send      the server sends one message again and again; the client counts what arrives
//   receive   the client sends for the time of a turn; then it asks how many messages the server has taken,
//             and the time is the one at which it has the answer
// Contenders as in bench_round_trip; rowe is its transport and frames. As shipped it bounds what
// is in flight, so that an urgent message is not late (flood.hpp). rowe_unclamped writes as much as the
// kernel takes. Each has one message more than once: what encoding costs is bench_json_write's question.
// messages_per_s is the median of the rounds; ratios are of figures of the same round.
//
// Excluded: what an endpoint does about a message (queue pairs, queues, expiry, JSON); networks, TLS,
// compression.
//
// What would make it lie: other load; a client slower than the server, which looks at the header of every
// message: raw_busy shows what it takes at least.
//
// Run: bench_throughput [--rounds=11] [--peer NAME=COMMAND]... (preset bench; ws: npm ci in bench/peers/ws)
#include <charconv>
#include <cstdio>
#include <string>
#include <vector>

#include "peer_field.hpp"

namespace rowe::bench {
namespace {

using rt::time_point;

constexpr std::size_t bytes = 300;
constexpr rt::duration turn = 60ms;
constexpr rt::duration begin_time = 10ms;  // of a flood, before it is measured
constexpr std::size_t frames_a_call = 200; // of the client's

// Messages a second; 0 when the server fails.
double send_rate(const peer_field::row& of) {
  peer_client client;
  if (!client.open(of.server->port(), false)) return 0;
  client.send(frame_around(text_of(bytes)));
  std::size_t count = 0;
  const auto take_until = [&](time_point end) {
    while (client.ok && monotonic_clock::now() < end)
      client.receive([&](std::string_view text) { count += text.size() == bytes; });
  };
  take_until(monotonic_clock::now() + begin_time);
  count = 0;
  const time_point begin = monotonic_clock::now();
  take_until(begin + turn);
  return client.ok ? static_cast<double>(count) * 1e9 / nanoseconds_since(begin) : 0;
}

double receive_rate(const peer_field::row& of) {
  peer_client client;
  if (!client.open(of.server->port(), false)) return 0;
  const std::string frame = frame_around(text_of(bytes));
  std::string many;
  for (std::size_t i = 0; i < frames_a_call; ++i) many += frame;
  const time_point begin = monotonic_clock::now();
  std::size_t sent = 0;
  while (client.ok && monotonic_clock::now() < begin + turn)
    sent += client.send_some(std::string_view{many}.substr(sent % many.size()));
  client.send(
      std::string_view{many}.substr(sent % many.size())); // the frame that was begun, and those behind
  client.send(frame_around("?"));
  const std::string answer = client.next();
  double count = 0;
  (void)std::from_chars(answer.data(), answer.data() + answer.size(), count); // 0, where it is none
  const std::size_t whole = (sent / many.size() + 1) * frames_a_call + 1;     // all sent, and the question
  return count == static_cast<double>(whole) ? count * 1e9 / nanoseconds_since(begin) : 0;
}

void report(const char* what, const peer_field& field, const peer_field::row& of) {
  const double rate = median(of.figures.at(what));
  const auto ratios = field.ratios(of, what, better::more);
  benchmark::RegisterBenchmark((std::string{what} + "/" + of.who.name).c_str(),
                               [rate, ratios](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(1 / rate);
                                 state.counters["messages_per_s"] = rate;
                                 for (const auto& [name, ratio] : ratios) state.counters[name] = ratio;
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::vector<contender> all = all_contenders(choice::frames);
  for (contender& outside : peer_options(count, arguments)) all.push_back(std::move(outside));
  return run_on_two_cores("bench_throughput", count, arguments, [&](int rounds) {
    (void)rowe::rt::prepare_this_thread({.name = "client", .cpu = there}); // the servers have the other
    peer_field send{all, "flood"}, receive{all, "sink"};
    const auto measure = [](peer_field& field, const char* what, auto rate) {
      return field.round([&](peer_field::row& of) {
        of.figures[what].push_back(rate(of));
        return of.figures[what].back() > 0;
      });
    };
    for (int round = 0; round < rounds; ++round)
      if (!measure(send, "send_300", send_rate) || !measure(receive, "receive_300", receive_rate))
        return false;
    for (const peer_field::row& of : send.rows()) report("send_300", send, of);
    for (const peer_field::row& of : receive.rows()) report("receive_300", receive, of);
    return true;
  });
}
