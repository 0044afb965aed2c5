// SPDX-License-Identifier: Apache-2.0
#include <cerrno>

#include "../rowe/arguments/values.hpp"
#include "trials.hpp"

namespace rowe::tools::fitness {
namespace {

std::int64_t number_of(std::string_view word) { return integer_of(word).value_or(0); }
rt::duration nanoseconds_of(std::string_view word) { return rt::duration{number_of(word)}; }

class elsewhere final : public trials {
 public:
  explicit elsewhere(const facts& of) : text_{of.read("/trials").text} {}

  std::optional<rt::grant> fifo() override { return grant_of("fifo"); }

  std::optional<rt::grant> lock(std::size_t bytes) override {
    const auto words = answer("lock_bytes_max", 2);
    if (words.empty()) return std::nullopt;
    const bool fits = static_cast<std::int64_t>(bytes) <= number_of(words[1]);
    return rt::grant{.asked = true, .error = fits ? 0 : ENOMEM};
  }

  std::optional<rt::grant> lock_everything() override { return grant_of("lock_everything"); }

  std::optional<rt::clock_cost> clock() override {
    const auto words = answer("clock", 3);
    if (words.empty()) return std::nullopt;
    rt::clock_cost cost;
    cost.read = nanoseconds_of(words[1]);
    cost.system_call = nanoseconds_of(words[2]);
    return cost;
  }

  std::optional<timer_grain> timers() override {
    const auto words = answer("timers", 3);
    if (words.empty()) return std::nullopt;
    return timer_grain{.resolution = nanoseconds_of(words[1]), .tick = nanoseconds_of(words[2])};
  }

  std::optional<rt::duration> coalescing(const std::string& interface) override {
    const auto words = answer("coalescing", 3, interface);
    if (words.empty()) return std::nullopt;
    return std::chrono::microseconds{number_of(words[2])};
  }

  std::vector<wake_ups> sleep_and_wake(const cpu_list& cpus, rt::duration) override {
    std::vector<wake_ups> results;
    for (const int cpu : cpus) {
      const auto words = answer("wake_ups", 8, std::to_string(cpu));
      if (words.empty()) continue;
      results.push_back({.cpu = cpu,
                         .fifo = number_of(words[2]) != 0,
                         .count = static_cast<std::uint64_t>(number_of(words[3])),
                         .min = nanoseconds_of(words[4]),
                         .p50 = nanoseconds_of(words[5]),
                         .p99 = nanoseconds_of(words[6]),
                         .max = nanoseconds_of(words[7]),
                         .bars = {}});
    }
    return results;
  }

 private:
  // The words of the line that begins with this name, and goes on with `about` where that is given.
  std::vector<std::string_view> answer(std::string_view name, std::size_t count,
                                       std::string_view about = {}) {
    for (const std::string_view line : lines_of(text_)) {
      auto words = words_of(line);
      if (words.size() == count && words[0] == name && (about.empty() || words[1] == about)) return words;
    }
    return {};
  }

  std::optional<rt::grant> grant_of(std::string_view name) {
    const auto words = answer(name, 2);
    if (words.empty()) return std::nullopt;
    return rt::grant{.asked = true, .error = static_cast<int>(number_of(words[1]))};
  }

  std::string text_;
};

} // namespace

std::unique_ptr<trials> recorded_trials(const facts& of) { return std::make_unique<elsewhere>(of); }

} // namespace rowe::tools::fitness
