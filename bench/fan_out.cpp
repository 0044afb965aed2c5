// SPDX-License-Identifier: Apache-2.0
// Question: how long does one message of 300 bytes take to reach 1, 10, 100 and 1000 clients, and what does a
// client more cost?
//
// Measured: one client sends the message, and it goes to all, the sender included; the time ends when the
// last one has it. Servers run alone on the first core (peers.hpp says which there are), all clients on the
// other, in one thread that never sleeps. Contenders as in bench_round_trip, asleep as there; rowe_json is a
// hub, which parses and checks the message, a publication of rosbridge's, and gives it to its topic's
// subscribers. p50 and p99 are of all rounds; the ratios are of medians of the same round. `sends`, of those
// that wait, is how many calls of send() and its relatives the server makes for a client and message (strace,
// in a run of its own): 1 is the least there can be.
//
// Excluded: networks, TLS, compression; clients that are slow (bench_urgent's question).
//
// What would make it lie: other load; a limit of open files below 1100 (`ulimit -n`). On loopback the
// receiver's half of TCP runs inside the sender's call: with networks a client costs less.
//
// Run: bench_fan_out [--rounds=11] [--peer NAME=COMMAND]... (preset bench; ws: npm ci in bench/peers/ws)
#include <array>
#include <cstdio>
#include <deque>
#include <string>
#include <vector>

#include <sys/epoll.h>

#include "peer_field.hpp"
#include "system_calls.hpp"

namespace rowe::bench {
namespace {

using rt::time_point;

constexpr std::size_t bytes = 300;
constexpr std::size_t sizes[] = {1, 10, 100, 1000};
constexpr int warm_up = 5;          // an endpoint's first ping to each client is among these
constexpr rt::duration turn = 15ms; // of one contender with so many clients in one round
constexpr int trips_least = 5;
constexpr int counted = 5; // messages

// So many clients of one server.
class audience {
 public:
  bool grow(std::uint16_t port, bool rosbridge, std::size_t size) {
    while (clients_.size() < size) {
      peer_client& one = clients_.emplace_back();
      if (!one.open(port, rosbridge)) return false;
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.u64 = clients_.size() - 1;
      if (::epoll_ctl(polled_.get(), EPOLL_CTL_ADD, one.socket(), &event) != 0) return false;
    }
    return true;
  }

  // One message to all, by way of the server, in whatever order it has; that is remembered. A hub has read
  // what it was asked for before this comes, since it reads in turn and each client asked before.
  bool first_trip() {
    order_.clear();
    clients_.front().send(frame_);
    const time_point until = monotonic_clock::now() + timeout;
    while (order_.size() != clients_.size() && monotonic_clock::now() < until) {
      std::array<epoll_event, 64> ready;
      const int count = ::epoll_wait(polled_.get(), ready.data(), static_cast<int>(ready.size()), 0);
      for (int i = 0; i < count; ++i) {
        const std::size_t which = ready[static_cast<std::size_t>(i)].data.u64;
        if (take(clients_[which])) order_.push_back(which);
        if (!clients_[which].ok) return false;
      }
    }
    return order_.size() == clients_.size();
  }
  // And the same again. Only the one that is next is asked: to look at all would hinder the server.
  bool trip() {
    clients_.front().send(frame_);
    for (const std::size_t which : order_) {
      peer_client& one = clients_[which];
      const time_point until = monotonic_clock::now() + timeout;
      for (int i = 1; !take(one); ++i)
        if (!one.ok || (i % 1024 == 0 && monotonic_clock::now() > until)) return false;
    }
    return true;
  }

 private:
  static bool take(peer_client& one) {
    bool whole = false;
    one.receive([&](std::string_view text) { whole = text.size() == bytes; });
    return whole;
  }

  const std::string frame_ = frame_around(text_of(bytes));
  net::descriptor polled_{::epoll_create1(EPOLL_CLOEXEC)};
  std::deque<peer_client> clients_;
  std::vector<std::size_t> order_; // of the server
};

std::string name_of(std::size_t size) { return "fan_out_" + std::to_string(size); }

bool measure(peer_field::row& of) {
  audience all;
  for (const std::size_t size : sizes) {
    if (!all.grow(of.server->port(), of.who.rosbridge, size)) return false;
    for (int i = 0; i < warm_up; ++i)
      if (!all.first_trip()) return false;
    std::vector<double> trips;
    const time_point end = monotonic_clock::now() + turn;
    while (monotonic_clock::now() < end || trips.size() < trips_least) {
      const time_point begin = when_asleep(of.who);
      if (!all.trip()) return false;
      trips.push_back(nanoseconds_since(begin));
    }
    std::vector<double>& samples = of.samples[name_of(size)];
    samples.insert(samples.end(), trips.begin(), trips.end());
    of.figures[name_of(size)].push_back(median(std::move(trips)));
  }
  return true;
}

// Of send() and its relatives, for a client and message.
std::optional<double> count_sends(const contender& who) {
  constexpr std::size_t size = 200;
  const auto use = [&](std::uint16_t port, int messages) {
    audience all;
    if (!all.grow(port, who.rosbridge, size)) return false;
    for (int i = 0; i < messages; ++i)
      if (!all.first_trip()) return false;
    return true;
  };
  const auto calls = calls_per_message(who, "fan_out", here, watched::sends, counted, use);
  return calls ? std::optional{*calls / size} : std::nullopt;
}

void report(peer_field& field, peer_field::row& of, std::size_t size, const std::optional<double>& sends) {
  const std::string what = name_of(size);
  const auto ratios = field.ratios(of, what, better::less);
  benchmark::RegisterBenchmark((what + "/" + of.who.name).c_str(),
                               [&of, what, ratios, sends](benchmark::State& state) {
                                 std::vector<double>& trips = of.samples[what];
                                 for (auto _ : state) state.SetIterationTime(median(trips) * 1e-9);
                                 state.counters["p50_us"] = quantile(trips, 0.5) * 1e-3;
                                 state.counters["p99_us"] = quantile(trips, 0.99) * 1e-3;
                                 for (const auto& [name, ratio] : ratios) state.counters[name] = ratio;
                                 if (sends) state.counters["sends"] = *sends;
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::vector<contender> all = all_contenders(choice::usual);
  for (contender& outside : peer_options(count, arguments)) all.push_back(std::move(outside));
  std::optional<peer_field> field;
  return run_on_two_cores("bench_fan_out", count, arguments, [&](int rounds) {
    (void)rowe::rt::prepare_this_thread({.name = "client", .cpu = there}); // the servers have the other
    field.emplace(all, "fan_out");
    for (int round = 0; round < rounds; ++round)
      if (!field->round(measure)) return false;
    for (peer_field::row& of : field->rows()) {
      const auto sends = of.who.busy() ? std::nullopt : count_sends(of.who);
      for (const std::size_t size : sizes) report(*field, of, size, sends);
    }
    return true;
  });
}
