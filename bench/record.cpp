// SPDX-License-Identifier: Apache-2.0
// Question: what does it cost a robot to record itself?
//
// Measured: the processor time of the service thread and of the recorder's thread, as the kernel counts it
// (/proc/self/task/TID/schedstat), in percent of a core; what a publish takes in the loop (median); bytes on
// the disk for each message; what was lost. Rounds with a recording and without one take turns, in one
// process on one endpoint; the medians over the rounds are printed. The messages are nav_msgs/Odometry that
// change.
//   steady    10 topics, each published at 1 kHz
//   flood     one topic, 100 messages in each cycle of 1 kHz
// Without a recording nobody listens: the loop's messages end in its own call.
//
// Excluded: the disk, but for what the kernel takes to copy into its cache.
//
// What would make it lie: a disk so slow that its cache fills, which then shows as `lost`; loops that are
// late, which publish less: `messages_per_second` says how many there were.
//
// Run: bench_record FOLDER [--rounds=5] [--seconds=5]
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>
#include <rowe/ros.hpp>
#include <rowe/rowe.hpp>

namespace {

using rowe::rt::monotonic_clock;
using namespace std::chrono_literals;

// Nanoseconds that this process's threads of a name have run.
double ran_ns(std::string_view wanted) {
  double all = 0;
  for (const auto& task : std::filesystem::directory_iterator{"/proc/self/task"}) {
    std::string name;
    std::getline(std::ifstream{task.path() / "comm"}, name);
    double ran = 0;
    if (name == wanted && std::ifstream{task.path() / "schedstat"} >> ran) all += ran;
  }
  return all;
}

double median(std::vector<double> of) {
  std::ranges::sort(of);
  return of.empty() ? 0 : of[of.size() / 2];
}

struct round_figures {
  double service = 0; // percent of a core
  double recorder = 0;
  double publish_ns = 0;
  double per_second = 0;
  double bytes = 0; // for each message
  double lost = 0;
};

struct workload {
  const char* name;
  int topics;
  int each_cycle; // messages of each topic
};

round_figures run(rowe::endpoint& robot, std::vector<rowe::publisher<rowe::ros::odometry>>& topics,
                  const workload& of, const std::string& folder, bool records, int seconds) {
  rowe::recorder into;
  if (records) {
    std::filesystem::remove_all(folder);
    into = robot.record({.file = {.path = folder + "/"}, .topics = {"/odom/*"}}).value();
  }
  round_figures got;
  std::vector<double> publishes;
  rowe::ros::odometry value;
  rowe::rt::periodic loop{1ms, {.cycles_max = static_cast<std::uint64_t>(seconds) * 1000}};
  const double service_before = ran_ns("rowe");
  const double recorder_before = ran_ns("rowe-record");
  const auto began = monotonic_clock::now();
  std::uint64_t count = 0;
  while (const auto now = loop.wait()) {
    for (int i = 0; i < of.each_cycle; ++i) {
      for (int t = 0; t < of.topics; ++t) {
        value.pose.pose.position.x = static_cast<double>(count) * 1e-3;
        value.pose.pose.position.y = 1.0 / static_cast<double>(count + 3);
        value.twist.twist.linear.x = static_cast<double>(count % 977) * 1e-4;
        const auto before = monotonic_clock::now();
        (void)topics[static_cast<std::size_t>(t)].publish(value, *now);
        if (count++ % 16 == 0)
          publishes.push_back(static_cast<double>((monotonic_clock::now() - before).count()));
      }
    }
  }
  const double all_ns = static_cast<double>((monotonic_clock::now() - began).count());
  if (records) (void)into.flush(10s);
  got.service = 100 * (ran_ns("rowe") - service_before) / all_ns;
  got.recorder = 100 * (ran_ns("rowe-record") - recorder_before) / all_ns;
  got.publish_ns = median(publishes);
  got.per_second = static_cast<double>(count) * 1e9 / all_ns;
  if (!records) return got;
  (void)into.close();
  const auto figures = into.figures();
  got.bytes =
      static_cast<double>(figures.bytes) / static_cast<double>(std::max<std::uint64_t>(figures.messages, 1));
  got.lost =
      static_cast<double>(figures.lost) + static_cast<double>(count) - static_cast<double>(figures.messages);
  return got;
}

int number_of(std::string_view word, std::string_view option, int otherwise) {
  if (!word.starts_with(option)) return otherwise;
  word.remove_prefix(option.size());
  (void)std::from_chars(word.data(), word.data() + word.size(), otherwise);
  return otherwise;
}

} // namespace

int main(int count, char** words) {
  if (count < 2) return std::fputs("usage: bench_record FOLDER [--rounds=N] [--seconds=N]\n", stderr), 2;
  int rounds = 5;
  int seconds = 5;
  for (int i = 2; i < count; ++i) {
    rounds = number_of(words[i], "--rounds=", rounds);
    seconds = number_of(words[i], "--seconds=", seconds);
  }
  const std::string folder = std::string{words[1]} + "/bench_record";
  for (const workload& of : {workload{"steady", 10, 1}, workload{"flood", 1, 100}}) {
    rowe::endpoint_options options;
    options.limits.handle_bytes = 64 * 1024 * 1024;
    auto robot = rowe::endpoint::listen(0, options).value();
    std::vector<rowe::publisher<rowe::ros::odometry>> topics;
    for (int t = 0; t < of.topics; ++t)
      topics.push_back(
          robot
              .advertise<rowe::ros::odometry>("/odom/" + std::to_string(t),
                                              {.depth = 2048U / static_cast<std::uint32_t>(of.topics)})
              .value());
    std::array<std::vector<round_figures>, 2> all;
    for (int i = 0; i < rounds; ++i)
      for (const bool records : {false, true})
        all[records ? 1 : 0].push_back(run(robot, topics, of, folder, records, seconds));
    for (const bool records : {false, true}) {
      const auto of_all = [&](double round_figures::*which) {
        std::vector<double> values;
        for (const round_figures& one : all[records ? 1 : 0]) values.push_back(one.*which);
        return median(values);
      };
      std::printf("%s %s: messages_per_second %.0f, service %.2f %%, recorder %.2f %%, publish %.0f ns",
                  of.name, records ? "recorded" : "alone", of_all(&round_figures::per_second),
                  of_all(&round_figures::service), of_all(&round_figures::recorder),
                  of_all(&round_figures::publish_ns));
      if (records)
        std::printf(", bytes_per_message %.0f, lost %.0f", of_all(&round_figures::bytes),
                    of_all(&round_figures::lost));
      std::printf("\n");
      std::fflush(stdout);
    }
  }
  std::filesystem::remove_all(folder);
}
