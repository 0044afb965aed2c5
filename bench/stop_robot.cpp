// SPDX-License-Identifier: Apache-2.0
// The robot of bench/stop_on_silence: a loop of 1 kHz that obeys its latch. Says `port N` first, then `moves`
// and `stopped NS` (CLOCK_MONOTONIC, when the loop saw it) whenever that changes. Ends with its input.
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include <rowe/rowe.hpp>

int main(int count, char** arguments) {
  using namespace std::chrono_literals;
  const auto timeout = std::chrono::milliseconds{count > 1 ? std::atoi(arguments[1]) : 500};
  auto robot = rowe::endpoint::listen(0, {.stop = {.guard_timeout = timeout}});
  if (!robot) return 1;
  auto latch = robot->stop_latch({.loop_timeout = 1s});
  if (!latch) return 1;
  std::printf("port %d\n", robot->port());
  std::fflush(stdout);
  bool moving = false;
  rowe::rt::periodic loop{1ms, {.priority = 80}};
  for (pollfd typed{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
       ::poll(&typed, 1, 0) == 0 && loop.wait();) {
    const auto now = rowe::rt::monotonic_clock::now();
    const bool engaged = latch->engaged(now);
    if (engaged) latch->acknowledge(now);
    if (moving == !engaged) continue;
    moving = !engaged;
    if (moving) {
      std::printf("moves\n");
    } else {
      std::printf("stopped %lld\n", static_cast<long long>(rowe::rt::nanoseconds_of(now)));
    }
    std::fflush(stdout);
  }
}
