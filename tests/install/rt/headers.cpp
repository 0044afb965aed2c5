// SPDX-License-Identifier: Apache-2.0
// A ring, a free ring, a window and a wheel: the headers are all of them, nothing is linked.
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <numeric>

#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/timer_wheel.hpp>
#include <rowe/rt/window.hpp>

using namespace std::chrono_literals;

int main() {
  std::array<rowe::rt::spsc_ring<int>::entry, 4> places;
  rowe::rt::spsc_ring<int> ring{places};
  auto& out = *ring.take_producer();
  for (const int each : {1, 2, 3, 4}) (void)out.try_push(each);
  const bool full = !out.try_push(5);
  int sum = 0;
  ring.take_consumer()->drain([&](int each) { sum += each; }, places.size());

  std::array<rowe::rt::free_ring<>::entry, 4> numbers;
  rowe::rt::free_ring<> unused{numbers, 3};
  const auto slot = unused.take_consumer()->try_take();

  rowe::rt::window<double> window;
  auto& newest = *window.take_writer();
  newest.write(0.5);
  newest.write(2.5);
  double value = 0;
  const bool fresh = window.take_reader()->read(value) == rowe::rt::freshness::fresh;

  const auto now = rowe::rt::monotonic_clock::now();
  std::array<rowe::rt::timer_node, 2> nodes;
  rowe::rt::timer_wheel wheel{nodes, now};
  wheel.insert(0, now + 2s);
  wheel.insert(1, now + 1s);
  const auto early = wheel.expire(now), first = wheel.expire(now + 3s), second = wheel.expire(now + 3s);

  const bool right =
      full && sum == 10 && slot && fresh && value == 2.5 && early == wheel.none && first == 1 && second == 0;
  std::puts(right ? "ring, free ring, window, wheel" : "wrong");
  return right ? 0 : 1;
}
