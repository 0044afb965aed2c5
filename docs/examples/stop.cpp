// SPDX-License-Identifier: Apache-2.0
// A loop of 1 kHz that obeys the stop: stop PORT. It stands until somebody guards it at its page and resets
// it there; with a second word, `unguarded`, a reset alone will do: `rowe reset`, or the page.
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <string_view>

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
  const std::string_view said = words[1];
  std::uint16_t port = 0;
  const auto read = std::from_chars(said.data(), said.data() + said.size(), port);
  if (read.ec != std::errc{} || read.ptr != said.data() + said.size())
    return std::fprintf(stderr, "a port is a number from 0 to 65535, not '%s'\n", words[1]), 2;
  rowe::endpoint_options options;
  options.stop.unguarded = count == 3;
  auto robot = rowe::endpoint::listen(port, options).value();
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
