// SPDX-License-Identifier: Apache-2.0
// What the stress tests of whole endpoints share: the requests, the right replies, and an account of every
// call, so that a call that ends twice, never, or with another's reply shows.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include <rowe/rowe.hpp>

#include "api/seen.hpp"

namespace traffic {

using namespace std::chrono_literals;
using rowe::tests::count_of;
using rowe::tests::url_of;

struct addends {
  std::int64_t a, b;
};
struct total {
  std::int64_t sum;
};
struct reading {
  std::int64_t n, twice;
};

} // namespace traffic

template <>
inline constexpr auto rowe::schema<traffic::addends> =
    rowe::fields<&traffic::addends::a, &traffic::addends::b>{};
template <>
inline constexpr auto rowe::schema<traffic::total> = rowe::fields<&traffic::total::sum>{};
template <>
inline constexpr auto rowe::schema<traffic::reading> =
    rowe::fields<&traffic::reading::n, &traffic::reading::twice>{};

namespace traffic {

inline rowe::endpoint_options options() {
  rowe::endpoint_options made;
  made.poll_period = 100us;
  made.retry_min = 1ms;
  made.retry_max = 5ms;
  made.page = false;
  made.limits.connections_max = 8;
  made.limits.handle_bytes = 1024 * 1024;
  made.limits.door_slots = 8;
  return made;
}

// Small, so that several fit, and what is full is met.
inline rowe::lane_options small_lane(bool receive) {
  return {.depth = 8, .inbox_depth = 8, .calls = 4, .text_bytes_max = 256, .receive = receive};
}
constexpr rowe::service_options small_service{.depth = 4, .text_bytes_max = 256};

// The number behind `name` in an object that was written here; -1 without one.
inline std::int64_t number_in(std::string_view text, std::string_view name) {
  const std::string key = '"' + std::string{name} + "\":";
  const std::size_t at = text.find(key);
  return at == std::string_view::npos ? -1 : std::stoll(std::string{text.substr(at + key.size(), 20)});
}

// Failures by name, from any thread. The first of each name is enough.
class failures {
 public:
  void add(std::string_view what, std::string_view detail = {}) {
    const std::lock_guard lock{mutex_};
    all_[std::string{what} + ' ' + std::string{detail}] += 1;
  }
  // Unless a code is one of those that may happen there.
  void expect(const char* where, rowe::errc code, std::initializer_list<rowe::errc> possible) {
    if (std::find(possible.begin(), possible.end(), code) != possible.end()) return;
    add(where, rowe::error{code}.name());
  }
  std::string text() {
    const std::lock_guard lock{mutex_};
    std::string all;
    for (const auto& [what, times] : all_) all += what + ", " + std::to_string(times) + " times\n";
    return all;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::uint64_t> all_;
};

// The calls that one handle has started and that are pending, each with the number that its reply must have.
// A call that was cancelled is removed, and must not complete any more.
class account {
 public:
  explicit account(failures& to) : to_{to} {}

  void begin(rowe::call_id call, std::int64_t number) {
    if (!open_.emplace(key(call), number).second) to_.add("a call has the id of another one");
  }
  void cancel(rowe::call_id call) {
    if (open_.erase(key(call)) == 0) to_.add("a call ended unnoticed");
  }
  // `number`: the reply's, nothing where there is none.
  void end(rowe::call_id call, std::optional<std::int64_t> number) {
    const auto found = open_.find(key(call));
    if (found == open_.end()) return to_.add("a call ended twice, or after it was cancelled");
    if (number && *number != found->second) to_.add("a call got the reply of another one");
    open_.erase(found);
    answered_ += number.has_value();
  }
  bool settled() const { return open_.empty(); }
  std::uint64_t answered() const { return answered_; }

 private:
  static std::pair<std::uint32_t, std::uint32_t> key(rowe::call_id call) {
    return {call.index, call.generation};
  }
  failures& to_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::int64_t> open_;
  std::uint64_t answered_ = 0;
};

// Random numbers and times of one thread.
class random_source {
 public:
  explicit random_source(std::uint64_t seed) : random_{seed} {}
  std::uint64_t below(std::uint64_t bound) { return random_() % bound; }
  // Some that are over at once, some that are over on the way, some that suffice as a rule.
  rowe::duration time() {
    constexpr std::array<rowe::duration, 5> times{0ns, 1us, 100us, 2ms, 50ms};
    return times[below(times.size())];
  }

 private:
  std::mt19937_64 random_;
};

} // namespace traffic
