// SPDX-License-Identifier: Apache-2.0
// A loop that answers calls: its speed is set by whoever asks, by any codec, while the loop never waits.
#include <cstdio>
#include <optional>

#include <rowe/rowe.hpp>

using namespace std::chrono_literals;

struct speed { double metres_per_second; };
template <> inline constexpr auto rowe::schema<speed> =
    rowe::fields<rowe::field<&speed::metres_per_second, "speed">>{};

int main() {
  auto robot = rowe::endpoint::listen(8080).value();
  auto set_speed = robot.serve<speed, speed>("/set_speed").value();
  speed now_driving{};
  rowe::rt::periodic loop{1ms};
  while (const auto now = loop.wait()) {
    auto request = set_speed.try_next(*now);                        // its answer's place is reserved already
    if (!request) continue;                                         // none has come; the usual case
    if (request->value().metres_per_second > 1.0) {
      (void)set_speed.refuse(*request, "at most 1 m/s", *now);      // who asked may be gone by now: no matter
      continue;
    }
    now_driving = request->value();
    (void)set_speed.reply(*request, now_driving, *now);
  }
}
