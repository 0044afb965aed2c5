// SPDX-License-Identifier: Apache-2.0
// A loop of 1 kHz that obeys the stop: stop PORT. It stands until somebody guards it at its page and resets
// it there; with a second word, `unguarded`, a reset alone will do: `rowe reset`, or the page.
#include <cstdio>
#include <cstdlib>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

// Yours: here, words for whoever watches.
static void say(const char* words) {
  static const char* said = nullptr;
  if (words == said) return;
  std::puts(said = words);
  (void)std::fflush(stdout);
}
static void brake() { say("braking"); }
static void drive() { say("driving"); }

int main(int count, char** words) {
  if (count != 2 && count != 3) return std::fputs("usage: stop PORT [unguarded]\n", stderr), 2;
  rowe::endpoint_options options;
  options.stop.unguarded = count == 3;
  auto robot = rowe::endpoint::listen(static_cast<std::uint16_t>(std::atoi(words[1])), options).value();
  std::printf("listening on port %d\n", robot.port());

  rowe::rt::periodic loop{1ms};
  auto latch = robot.stop_latch({.name = "base"}).value();
  while (auto now = loop.wait()) {
    if (latch.engaged(*now)) {
      brake();
      latch.acknowledge(*now);
      continue;
    }
    drive();
  }
}
