// SPDX-License-Identifier: Apache-2.0
// Trying it here. Priorities and memory are asked for in the very ways that rowe's endpoints and loops ask.
#include <linux/ethtool.h>
#include <linux/if.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <vector>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/rt/thread.hpp>

#include "../rowe/interrupt.hpp"
#include "trials.hpp"

namespace rowe::tools::fitness {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration pace = 500us; // between two wake-ups

rt::duration resolution_of(clockid_t clock) {
  timespec resolution{};
  ::clock_getres(clock, &resolution);
  return std::chrono::seconds{resolution.tv_sec} + std::chrono::nanoseconds{resolution.tv_nsec};
}

// Sleeps and wakes on the thread that calls it, and fills in what came of it.
void measure(wake_ups& result, rt::duration for_so_long, const rt::grants& given) {
  result.fifo = static_cast<bool>(given.fifo);
  result.refused = given.pinned.error;
  if (result.refused != 0) return;
  const auto cycles = static_cast<std::uint64_t>(std::max<std::int64_t>(for_so_long / pace, 1)) + 1;
  rt::periodic loop{pace, {.cycles_max = cycles}};
  while (loop.wait()) {
    if (interrupt::seen()) loop.stop();
  }
  const rt::histogram& late = loop.lateness();
  result.cut_short = loop.stopped();
  result.count = late.count();
  result.min = late.min();
  result.p50 = late.percentile(50);
  result.p99 = late.percentile(99);
  result.max = late.max();
  late.write_bars([&](std::string_view line) { result.bars.append(line); });
}

class here final : public trials {
 public:
  std::optional<rt::grant> fifo() override {
    const rt::thread tried{{.name = "doctor", .priority = priority}, [] {}};
    if (!tried.joinable()) return std::nullopt;
    return tried.grants().fifo;
  }

  std::optional<rt::grant> lock(std::size_t bytes) override {
    const rt::arena tried{bytes, rt::page_lock::attempted};
    return rt::grant{.asked = true, .error = tried ? tried.lock_errno() : tried.map_errno()};
  }

  std::optional<rt::grant> lock_everything() override {
    const rt::grant given = rt::lock_process_memory();
    ::munlockall();
    return given;
  }

  std::optional<rt::clock_cost> clock() override { return rt::clock_is_cheap(); }

  std::optional<timer_grain> timers() override {
    return timer_grain{.resolution = resolution_of(CLOCK_MONOTONIC),
                       .tick = resolution_of(CLOCK_MONOTONIC_COARSE)};
  }

  std::optional<rt::duration> coalescing(const std::string& interface) override {
    ethtool_coalesce gathered{};
    gathered.cmd = ETHTOOL_GCOALESCE;
    ifreq request{};
    interface.copy(request.ifr_name, sizeof request.ifr_name - 1);
    request.ifr_data = &gathered;
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket < 0) return std::nullopt;
    const bool told = ::ioctl(socket, SIOCETHTOOL, &request) == 0;
    ::close(socket);
    if (!told) return std::nullopt;
    return std::chrono::microseconds{gathered.rx_coalesce_usecs};
  }

  std::vector<wake_ups> sleep_and_wake(const cpu_list& cpus, rt::duration for_so_long) override {
    std::vector<wake_ups> results;
    for (const int cpu : cpus) results.push_back({.cpu = cpu, .refused = EAGAIN, .bars = {}});
    std::deque<rt::thread> threads; // each writes to its own result and is joined before they are read
    for (wake_ups& result : results) {
      threads.emplace_back(
          rt::thread_options{.name = "doctor", .cpu = result.cpu, .priority = priority},
          [&result, for_so_long](const rt::grants& given) { measure(result, for_so_long, given); });
    }
    threads.clear();
    return results;
  }
};

} // namespace

std::unique_ptr<trials> machine_trials() { return std::make_unique<here>(); }

} // namespace rowe::tools::fitness
