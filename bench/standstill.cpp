// SPDX-License-Identifier: Apache-2.0
// Question: how long after the last command of somebody who is gone does a loop still obey it?
//
// Measured: eight driven topics have a lease of 50 ms. In each round a client sends each of them three
// commands with the newest tick, 10 ms apart, and is gone then, in one of three ways that take turns: it says
// nothing more, and goes on driving later; its connection ends; or it is silent, and its connection ends
// later. A loop of 1 kHz asks latest_within() for each topic in each cycle. Times are from just before the
// last command of a topic is sent to the first cycle that gets nothing for it. A trial is `within` the lease
// and one period if the cycle before that one began within the lease: then the loop stood still as soon as
// this machine let it have its next period. One whose last command was never obeyed is no trial.
//
// Excluded: what the robot does with nothing; networks.
//
// What would make it lie: a client that stamps late. It stamps before it sends, so a time is at least what it
// was.
//
// Run: bench_standstill [--trials=10000]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>
#include <rowe/rt/periodic.hpp>

#include "raw_client.hpp"

namespace {

using namespace std::chrono_literals;
using rowe::bench::raw_client;
using clock_type = rowe::rt::monotonic_clock;

constexpr std::size_t topics = 8;
constexpr int commands = 3;
constexpr auto lease = 50ms;
constexpr auto period = 1ms;

std::int64_t nanoseconds(clock_type::time_point at) { return at.time_since_epoch().count(); }

// What the loop saw of one topic, for the thread that sends.
struct seen {
  std::atomic<int> obeyed{0};                 // the command that is in force, or was last
  std::atomic<std::int64_t> last_ns{0};       // the last cycle that obeyed it
  std::atomic<std::int64_t> standstill_ns{0}; // the first after it that got nothing; 0: none yet
};

void run(std::array<rowe::subscriber<rowe::ros::twist>, topics>& driven, std::array<seen, topics>& all,
         const std::atomic<bool>& ends) {
  rowe::rt::periodic loop{period, {.priority = 80}};
  while (!ends) {
    const auto now = loop.wait();
    if (!now) return;
    for (std::size_t i = 0; i < topics; ++i) {
      if (const auto command = driven[i].latest_within(*now)) {
        all[i].obeyed = static_cast<int>(command->value().linear.x);
        all[i].last_ns = nanoseconds(*now);
        all[i].standstill_ns = 0;
      } else if (all[i].standstill_ns == 0) {
        all[i].standstill_ns = nanoseconds(*now);
      }
    }
  }
}

std::string text_frame(const std::string& text) {
  return raw_client::frame_of(rowe::wire::opcode::text, text);
}

// A client that knows the newest tick.
class driver {
 public:
  explicit driver(std::uint16_t port) : client_{port} {}
  bool ok() const { return client_.ok(); }

  // Asks for the newest tick.
  void refresh() {
    (void)client_.send(
        text_frame(R"({"op":"call_service","service":"/rowe/control","args":{"topic":"/drive_0"}})"));
    while (client_.ok()) {
      const std::span<std::byte> message = client_.take();
      const std::string_view text{reinterpret_cast<const char*>(message.data()), message.size()};
      constexpr std::string_view before = R"("tick":)";
      const std::size_t at = text.find(before);
      if (at == text.npos) continue;
      const std::string_view rest = text.substr(at + before.size());
      tick_ = rest.substr(0, rest.find_first_not_of("0123456789"));
      client_.answer_pings();
      return;
    }
  }

  // When it was sent.
  std::int64_t command(std::size_t topic, int number) {
    const std::string text = R"({"op":"publish","topic":"/drive_)" + std::to_string(topic) + R"(","tick":)" +
                             tick_ + R"(,"msg":{"linear":{"x":)" + std::to_string(number) +
                             R"(,"y":0,"z":0},"angular":{"x":0,"y":0,"z":0}}})";
    const std::int64_t sent = nanoseconds(clock_type::now());
    (void)client_.send(text_frame(text));
    return sent;
  }

 private:
  raw_client client_;
  std::string tick_;
};

} // namespace

int main(int count, char** arguments) {
  int trials = 10000;
  if (count > 1) trials = std::atoi(std::string_view{arguments[1]}.substr(sizeof "--trials").data());
  auto robot = rowe::endpoint::listen(0).value();
  std::array<rowe::subscriber<rowe::ros::twist>, topics> driven;
  for (std::size_t i = 0; i < topics; ++i)
    driven[i] = robot.subscribe<rowe::ros::twist>("/drive_" + std::to_string(i), {.lease = lease}).value();
  std::array<seen, topics> all;
  std::atomic<bool> ends{false};
  std::thread loop{[&] { run(driven, all, ends); }};

  int done = 0;
  int within = 0;
  int never = 0; // obeyed: a trial that says nothing
  int number = 0;
  std::vector<double> took_ms;
  std::optional<driver> person;
  for (int round = 0; done < trials; ++round) {
    if (!person || !person->ok()) person.emplace(robot.port());
    std::array<std::int64_t, topics> sent{};
    for (int i = 0; i < commands; ++i) {
      ++number;
      person->refresh();
      for (std::size_t topic = 0; topic < topics; ++topic) sent[topic] = person->command(topic, number);
      if (i + 1 < commands) std::this_thread::sleep_for(10ms);
    }
    if (round % 3 == 1) { // while the command is in force
      std::this_thread::sleep_for(5ms);
      person.reset();
    }
    std::this_thread::sleep_for(lease + 20ms);
    if (round % 3 == 2) person.reset();
    for (std::size_t topic = 0; topic < topics; ++topic) {
      const seen& saw = all[topic];
      if (saw.obeyed != number) {
        ++never;
        continue;
      }
      ++done;
      within +=
          saw.standstill_ns != 0 && saw.last_ns - sent[topic] <= std::chrono::nanoseconds{lease}.count();
      took_ms.push_back(static_cast<double>(saw.standstill_ns - sent[topic]) / 1e6);
    }
  }
  ends = true;
  loop.join();
  std::sort(took_ms.begin(), took_ms.end());
  const auto at = [&](double share) {
    return took_ms[std::min(took_ms.size() - 1,
                            static_cast<std::size_t>(share * static_cast<double>(took_ms.size())))];
  };
  std::printf("within the lease of 50 ms and one period: %d of %d (and %d never obeyed: no trial)\n"
              "standstill after the last command: p50 %.1f ms, p99 %.1f ms, max %.1f ms\n",
              within, done, never, at(0.5), at(0.99), at(1));
  return within == done ? 0 : 1;
}
