// SPDX-License-Identifier: Apache-2.0
// usage: bench_urgent_servers ORIGIN
//
// The two servers of bench/urgent_clients/run, for readers of other makers and pages of ORIGIN. Says `rowe
// PORT` and `default PORT`, then `pong T NOW` whenever the ping in front of the default server's urgent
// message T is answered. Ends with its input.
#include <atomic>
#include <cstdio>

#include <unistd.h>

#include <rowe/rt/thread.hpp>

#include "rounds.hpp"
#include "urgent_servers.hpp"

int main(int count, char** arguments) {
  using namespace rowe::bench;
  if (const auto cpus = two_cpus())
    (void)rowe::rt::prepare_this_thread({.name = "bench", .cpu = cpus->first});
  robot bounded;
  default_sockets unbounded;
  if (count != 2 || !bounded.open(arguments[1]) || !unbounded.open(true)) {
    std::fprintf(stderr, "bench_urgent_servers cannot listen\n");
    return 1;
  }
  std::printf("rowe %d\ndefault %d\n", bounded.port(), unbounded.port());
  std::fflush(stdout);
  std::atomic<bool> stop{false};
  const auto serve = [&stop](auto& server) {
    while (!stop.load(std::memory_order_relaxed))
      server.turn(monotonic_clock::now()); // relaxed: when, not what
  };
  const rowe::rt::thread first{rowe::rt::thread_options{.name = "rowe"}, [&] { serve(bounded); }};
  const rowe::rt::thread second{rowe::rt::thread_options{.name = "default"}, [&] { serve(unbounded); }};
  for (char typed = 0; ::read(STDIN_FILENO, &typed, 1) > 0;) continue;
  stop.store(true, std::memory_order_relaxed); // see above
}
