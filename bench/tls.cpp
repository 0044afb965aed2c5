// SPDX-License-Identifier: Apache-2.0
// Question: what does TLS cost a message of the service thread, next to OpenSSL by itself and next to no TLS?
//
// Measured, over loopback in one process: the server on core --here, which asks for events without waiting,
// and the one client of all (tls_client.hpp) on core --there, which spins. TLS 1.3 and 1.2, both with
// AES-128-GCM.
//   echo_64, echo_512   from the client's write to the last byte of the echo, one message after the other
//   send_300            messages of 300 bytes a second, in a stream of ready frames. The client throws away
//                       what comes without opening it: it would else be the slower end
//   memory              what the process has taken from its heap for each of 50 open connections, with
//                       OpenSSL's part. Clients are another process
//
//   openssl        SSL_read and SSL_write on OpenSSL's own socket BIO, behind an epoll: the limit. It sends
//                  full records, of 16 KiB
//   openssl_ahead  the same, told to read ahead: one recv for a record, where there are else two
//   rowe           the transport and a sink that writes back what it gets, or writes batches of 60 KiB
//   plain          the same without TLS
// In `rowe` the kernel may hold what it likes, as in `openssl`; rowe_shipped bounds what is not sent yet.
//
// p50, p99 and p99.9 are of all rounds; ratios are of medians of the same round, in which the contenders run
// in alternating order.
//
// Excluded: handshakes (bench_stop_under_handshakes), frames, networks.
//
// What would make it lie: other load on either core; SCHED_FIFO, under which threads that spin keep the
// kernel's own, which carry loopback, from their cores; other ciphers: with ChaCha20 OpenSSL itself takes
// twice as long.
//
// Run: bench_tls [--rounds=11] [--here=CPU] [--there=CPU] [Google Benchmark's options]
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <malloc.h>

#include <benchmark/benchmark.h>

#include "distant_clients.hpp"
#include "stand.hpp"
#include "tls_client.hpp"
#include "tls_servers.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::array<std::size_t, 2> sizes{64, 512};
constexpr int warm_up = 30;
constexpr rt::duration echo_stretch = 25ms;
constexpr rt::duration send_stretch = 60ms;
constexpr int stretches_max = 20;      // a busy machine may give the server no time in one of them
constexpr int connections_before = 10; // what is taken once is taken by them
constexpr int connections = 50;

std::string echo_name(std::size_t bytes) { return "echo_" + std::to_string(bytes); }

struct contender {
  std::string name;
  int version; // 0: no TLS
  std::function<std::unique_ptr<tls_server>(serving_bytes)> open;
  bool echoes = true;
  std::map<std::string, std::vector<double>> samples{}; // of all rounds
  std::map<std::string, std::vector<double>> figures{}; // one a round
};

std::vector<contender> contenders(const server_files& files) {
  std::vector<contender> all;
  const auto rowe = [&](std::string name, int version, rowe_server::in_kernel bound, bool echoes = true) {
    const tls_options with = version != 0 ? files.options() : tls_options{};
    all.push_back({std::move(name), version,
                   [=](serving_bytes what) { return std::make_unique<rowe_server>(what, with, bound); },
                   echoes});
  };
  for (const int version : {TLS1_3_VERSION, TLS1_2_VERSION}) {
    const std::string of = version == TLS1_3_VERSION ? "_1_3" : "_1_2";
    for (const bool ahead : {false, true})
      all.push_back({(ahead ? "openssl_ahead" : "openssl") + of, version,
                     [=, &files](serving_bytes what) {
                       return std::make_unique<openssl_server>(what, files, version, ahead);
                     },
                     true});
    rowe("rowe" + of, version, rowe_server::in_kernel::any);
    rowe("rowe_shipped" + of, version, rowe_server::in_kernel::as_shipped, false);
  }
  rowe("plain", 0, rowe_server::in_kernel::any);
  rowe("plain_shipped", 0, rowe_server::in_kernel::as_shipped, false);
  return all;
}

enum class phase { connecting, measuring, done };

// Serves on this thread while the client does `what` on the other core; false when either failed. Neither
// spins before the connection is there: the terminator has to have a core.
template <class What>
bool serve(tls_server& server, int version, What what) {
  if (!server.ok()) return false;
  std::atomic<phase> now{phase::connecting};
  bool good = false;
  const rt::thread client = on_the_other_core([&] {
    const ssl_context with = version != 0 ? client_context(version) : nullptr;
    tls_client one{server.port(), with.get()};
    good = one.ok() && one.shake() &&
           (!server.wants_request() || (one.ask_for_upgrade(server.port()) && one.take_answer()));
    if (good) {
      now.store(phase::measuring, std::memory_order_release); // pairs with the acquires below
      one.spin();
      good = what(one);
    }
    now.store(phase::done, std::memory_order_release); // pairs with the acquires below
  });
  for (; now.load(std::memory_order_acquire) == phase::connecting; std::this_thread::sleep_for(50us))
    server.turn(); // the acquire pairs with the releases above
  while (now.load(std::memory_order_acquire) == phase::measuring) server.turn(); // as above
  return good;
}

bool measure_echo(contender& of) {
  const auto server = of.open(serving_bytes::echo);
  return serve(*server, of.version, [&](tls_client& client) {
    for (const std::size_t bytes : sizes) {
      const std::string text(bytes, 'x');
      std::string echo(bytes, '\0');
      std::vector<double> trips;
      const auto trip = [&] { return client.send(text) && client.take(echo); };
      for (int i = 0; i < warm_up; ++i)
        if (!trip()) return false;
      for (const auto end = monotonic_clock::now() + echo_stretch; monotonic_clock::now() < end;) {
        const auto begin = monotonic_clock::now();
        if (!trip()) return false;
        trips.push_back(nanoseconds_since(begin));
      }
      auto& all = of.samples[echo_name(bytes)];
      all.insert(all.end(), trips.begin(), trips.end());
      of.figures[echo_name(bytes)].push_back(median(std::move(trips)));
    }
    return true;
  });
}

bool measure_send(contender& of) {
  const auto server = of.open(serving_bytes::stream);
  return serve(*server, of.version, [&](tls_client& client) {
    const auto taken_in = [&](rt::duration stretch) {
      const std::uint64_t before = server->bytes_taken();
      const auto begin = monotonic_clock::now();
      while (monotonic_clock::now() < begin + stretch) client.throw_away();
      return static_cast<double>(server->bytes_taken() - before) / nanoseconds_since(begin) * 1e9;
    };
    (void)taken_in(send_stretch / 3); // the kernel's buffers grow meanwhile
    double per_second = 0;
    for (int i = 0; per_second == 0 && i < stretches_max; ++i)
      per_second = taken_in(send_stretch) / static_cast<double>(message_bytes);
    of.samples["send_300"].push_back(per_second);
    of.figures["send_300"].push_back(per_second);
    return per_second > 0;
  });
}

// What a server with so many connections more has taken from the heap, for each of them.
struct memory_of {
  std::string name;
  double bytes = 0;
};

bool measure_memory(const server_files& files, int version, memory_of& into) {
  distant_clients clients{version}; // before there is a thread
  rowe_server server{serving_bytes::echo, version != 0 ? files.options() : tls_options{},
                     rowe_server::in_kernel::as_shipped};
  if (!server.ok()) return false;
  const auto taken_with = [&](int count) {
    clients.open(server.port(), count);
    for (; !clients.are_open(); std::this_thread::sleep_for(50us)) server.turn();
    const struct mallinfo2 heap = ::mallinfo2();
    return static_cast<double>(heap.uordblks + heap.hblkhd);
  };
  const double before = taken_with(connections_before);
  into.bytes = (taken_with(connections) - before) / connections;
  return clients.good();
}

const contender& named(const std::vector<contender>& all, const std::string& name) {
  return *std::find_if(all.begin(), all.end(), [&](const contender& one) { return one.name == name; });
}

// The median over the rounds of the ratio to another's figure.
double ratio(const contender& of, const contender& to, const std::string& what) {
  std::vector<double> each;
  const std::vector<double>& ours = of.figures.at(what);
  const std::vector<double>& theirs = to.figures.at(what);
  for (std::size_t i = 0; i < ours.size(); ++i) each.push_back(ours[i] / theirs[i]);
  return median(std::move(each));
}

void add_ratios(const std::vector<contender>& all, const contender& of, const std::string& what,
                benchmark::State& state) {
  if (of.version != 0) {
    const std::string version = of.name.substr(of.name.size() - 4);
    state.counters["of_openssl"] = ratio(of, named(all, "openssl" + version), what);
    state.counters["of_openssl_ahead"] = ratio(of, named(all, "openssl_ahead" + version), what);
  }
  const bool shipped = of.name.find("shipped") != std::string::npos;
  state.counters["of_plain"] = ratio(of, named(all, shipped ? "plain_shipped" : "plain"), what);
}

void report(const std::vector<contender>& all, contender& of) {
  for (const std::size_t bytes : sizes) {
    if (!of.echoes) break;
    benchmark::RegisterBenchmark((echo_name(bytes) + "/" + of.name).c_str(),
                                 [&all, &of, bytes](benchmark::State& state) {
                                   std::vector<double>& trips = of.samples[echo_name(bytes)];
                                   for (auto _ : state) state.SetIterationTime(median(trips) * 1e-9);
                                   state.counters["p50_us"] = quantile(trips, 0.5) * 1e-3;
                                   state.counters["p99_us"] = quantile(trips, 0.99) * 1e-3;
                                   state.counters["p999_us"] = quantile(trips, 0.999) * 1e-3;
                                   add_ratios(all, of, echo_name(bytes), state);
                                 })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  }
  benchmark::RegisterBenchmark(("send_300/" + of.name).c_str(),
                               [&all, &of](benchmark::State& state) {
                                 const double per_second = median(of.samples["send_300"]);
                                 for (auto _ : state) state.SetIterationTime(1 / per_second);
                                 state.counters["messages_per_s"] = per_second;
                                 add_ratios(all, of, "send_300", state);
                               })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kNanosecond);
}

void report(const memory_of& of) {
  benchmark::RegisterBenchmark(("memory/" + of.name).c_str(),
                               [&of](benchmark::State& state) {
                                 for (auto _ : state) state.SetIterationTime(1e-9); // there is none
                                 state.counters["bytes"] = of.bytes;
                               })
      ->Iterations(1)
      ->UseManualTime();
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  std::signal(SIGPIPE, SIG_IGN); // of OpenSSL's own socket BIO
  const server_files files;
  std::array<memory_of, 3> memories{{{"rowe_1_3"}, {"rowe_1_2"}, {"plain"}}};
  const int versions[] = {TLS1_3_VERSION, TLS1_2_VERSION, 0};
  for (std::size_t i = 0; i < memories.size(); ++i) {
    if (measure_memory(files, versions[i], memories[i])) continue;
    std::fprintf(stderr, "memory/%s: a connection failed\n", memories[i].name.c_str());
    return 1;
  }
  std::vector<contender> all = contenders(files);
  return run_on_two_cores("bench_tls", count, arguments, [&](int rounds) {
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        contender& one = all[round % 2 == 0 ? i : all.size() - 1 - i];
        if ((!one.echoes || measure_echo(one)) && measure_send(one)) continue;
        std::fprintf(stderr, "%s: its connection failed, or stood still\n", one.name.c_str());
        return false;
      }
    }
    for (contender& one : all) report(all, one);
    for (const memory_of& one : memories) report(one);
    return true;
  });
}
