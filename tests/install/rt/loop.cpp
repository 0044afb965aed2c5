// SPDX-License-Identifier: Apache-2.0
// A loop that hands values through a ring and a window to a thread, gives up by a wheel, and calls no heap.
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/thread.hpp>
#include <rowe/rt/timer_wheel.hpp>
#include <rowe/rt/tripwire.hpp>
#include <rowe/rt/window.hpp>

using namespace std::chrono_literals;
namespace rt = rowe::rt;

int main() {
  rt::arena memory{std::size_t{1} << 16, rt::page_lock::none};
  auto& ring = *memory.make<rt::spsc_ring<int>>(memory.carve<rt::spsc_ring<int>::entry>(16));
  auto& newest = *memory.make<rt::window<int>>();
  rt::timer_wheel wheel{memory.carve<rt::timer_node>(1), rt::monotonic_clock::now()};

  auto& out = *ring.take_producer();
  auto& writer = *newest.take_writer();
  rt::periodic loop{1ms, {.cycles_max = 10}};
  std::uint64_t allocations = 0;
  bool expired = false;
  for (int cycle = 0; const auto now = loop.wait(); ++cycle) {
    auto wire = rt::tripwire::arm();
    if (cycle == 0) wheel.insert(0, *now);
    (void)out.try_push(cycle);
    writer.write(cycle);
    expired = wheel.expire(*now) == 0 || expired;
    allocations += wire.disarm().allocations;
  }

  int last = -1, sum = 0;
  rt::thread reader{{.name = "reader"}, [&] {
                      (void)newest.take_reader()->read(last);
                      ring.take_consumer()->drain([&](int each) { sum += each; }, 16);
                    }};
  reader.join();

  auto wire = rt::tripwire::arm();
  const std::vector<int> on_the_heap(100, last);
  const bool noticed = wire.disarm().allocations > 0 && on_the_heap.size() == 100;

  std::printf("sum %d, newest %d, expired %d, allocations %d, noticed %d\n", sum, last, expired,
              static_cast<int>(allocations), noticed);
  return 0;
}
