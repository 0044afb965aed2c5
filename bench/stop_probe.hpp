// SPDX-License-Identifier: Apache-2.0
// What benches of the stop share: a robot that stands already, a probe that calls /rowe/stop every 2 ms,
// open-loop, and a witness of what the machine does to a thread meanwhile. The files that use it say what the
// figures mean.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <rowe/rowe.hpp>

#include "two_cores.hpp"

namespace rowe::bench {

inline constexpr rt::duration probe_period = std::chrono::milliseconds{2};
inline constexpr int probe_priority = 10;

// A client's text frame, masked with zeros.
inline std::string frame_of(const std::string& text) {
  std::string frame{'\x81'};
  if (text.size() < 126) {
    frame += static_cast<char>(0x80 | text.size());
  } else if (text.size() < 65536) {
    frame += static_cast<char>(0x80 | 126);
    frame += static_cast<char>(text.size() >> 8);
    frame += static_cast<char>(text.size() & 0xff);
  }
  frame.append(4, '\0');
  return frame + text;
}

inline std::string stop_call() {
  return frame_of(R"({"op":"call_service","id":"1","service":"/rowe/stop"})");
}

struct stop_figures {
  std::vector<double> trips;     // of all rounds
  std::vector<double> woke_late; // the probe, by its own core
  std::vector<double> robot;     // the trips without that
  std::vector<double> served;    // and without the probe's waking when it is answered, by those that know it
  std::vector<double> gaps;      // the witness's largest of each round
  std::vector<double> cycles;    // the longest of the robot's service thread in each round
  std::vector<double> p99s;      // of the trips of each round
  std::uint64_t asked = 0, answered = 0;
};

// What a thread sees of this core that only reads the clock, for half a second.
inline double witness(int cpu, int priority) {
  using namespace std::chrono_literals;
  double largest = 0;
  rt::thread{rt::thread_options{.name = "witness", .cpu = cpu, .priority = priority},
             [&](const rt::grants&) {
               const auto end = monotonic_clock::now() + 500ms;
               auto last = monotonic_clock::now();
               auto next_yield = last + 1150us;
               while (last < end) {
                 if (last >= next_yield) { // as the robot's thread does
                   std::this_thread::sleep_for(100us);
                   last = monotonic_clock::now();
                   next_yield = last + 1150us;
                 }
                 const auto now = monotonic_clock::now();
                 largest = std::max(largest, static_cast<double>((now - last).count()));
                 last = now;
               }
             }}
      .join();
  return largest;
}

// Its service thread has the priority of the options only where that is granted.
inline std::optional<endpoint> open_robot(endpoint_options options) {
  auto opened = endpoint::listen(0, options);
  if (!opened) {
    options.service_priority = 0;
    opened = endpoint::listen(0, options);
  }
  if (!opened) return std::nullopt;
  return std::move(*opened);
}

// Calls the stop once, and lets the loop acknowledge. The latch must outlive the probe's calls.
template <class Client>
auto make_stand(endpoint& robot, Client& probe) {
  using namespace std::chrono_literals;
  auto latch = robot.stop_latch({.loop_timeout = 10s}).value();
  std::thread first{[&] {
    probe.send(stop_call());
    (void)probe.hear(); // whether observed or not: from here on it stands
  }};
  for (int i = 0; i < 100; ++i) {
    if (latch.engaged()) latch.acknowledge();
    std::this_thread::sleep_for(1ms);
  }
  first.join();
  return latch;
}

// For so long, on core --there.
template <class Client>
void call_stops(Client& probe, rt::duration time, stop_figures& into) {
  const std::string stop = stop_call();
  std::vector<double> trips;
  rt::thread{rt::thread_options{.name = "probe", .cpu = there, .priority = probe_priority},
             [&](const rt::grants&) {
               rt::time_point due = monotonic_clock::now() + std::chrono::milliseconds{50};
               const rt::time_point end = due + time;
               rt::time_point heard = due;
               for (; due < end; due += probe_period) {
                 std::this_thread::sleep_until(std::chrono::steady_clock::time_point{due.time_since_epoch()});
                 const auto woke = monotonic_clock::now();
                 const bool behind = heard > due; // the robot's answer before this one was late: charged
                 ++into.asked;
                 probe.send(stop);
                 const bool answered = probe.hear();
                 heard = monotonic_clock::now();
                 if (!answered) continue;
                 ++into.answered;
                 trips.push_back(nanoseconds(heard - due));
                 into.robot.push_back(nanoseconds(heard - (behind ? due : woke)));
                 if (!behind) into.woke_late.push_back(nanoseconds(woke - due));
                 if constexpr (requires { probe.came_at(); }) {
                   into.served.push_back(nanoseconds(probe.came_at() - (behind ? due : woke)));
                 }
               }
             }}
      .join();
  into.p99s.push_back(quantile(trips, 0.99));
  into.trips.insert(into.trips.end(), trips.begin(), trips.end());
}

// The largest value that the endpoint has for this count since it was opened; 0 without such a count.
inline double count_of(const endpoint& robot, std::string_view name) {
  for (const rowe::count& one : robot.counts())
    if (one.name == name) return static_cast<double>(one.value);
  return 0;
}

} // namespace rowe::bench
