// SPDX-License-Identifier: Apache-2.0
#include "subscriptions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../interrupt.hpp"
#include "remote.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration look_period = 1ms; // how often several topics are looked at; nothing tells of all
constexpr std::size_t long_queue_bytes = 64 * 1024 * 1024; // where messages may be long
constexpr std::uint32_t short_bytes_max = limits{}.message_bytes_max;

} // namespace

rt::duration throttle_of(double hertz) noexcept {
  const double ms = std::ceil(std::clamp(1000 / hertz, 1.0, 3'600'000.0)); // at most as many
  return std::chrono::milliseconds{static_cast<std::int64_t>(ms)};
}

// Two for each topic at least.
std::uint32_t subscriptions::depth_of_each(const subscriptions_wanted& what) noexcept {
  const bool is_short = what.text_bytes_max <= short_bytes_max;
  const std::size_t all =
      is_short ? what.depth : std::min<std::size_t>(long_queue_bytes / what.text_bytes_max, what.depth);
  return static_cast<std::uint32_t>(
      std::max<std::size_t>(all / std::max<std::size_t>(what.topics.size(), 1), 2));
}

std::size_t subscriptions::bytes_for(const subscriptions_wanted& what) noexcept {
  const std::size_t places = depth_of_each(what) * std::max<std::size_t>(what.topics.size(), 1);
  return places * (what.text_bytes_max + std::size_t{1024}) + std::size_t{64} * (short_bytes_max + 1024);
}

std::optional<subscriptions> subscriptions::open(endpoint& hub, const subscriptions_wanted& what,
                                                 const console& to, exit_code& otherwise) {
  subscriptions all;
  for (const std::string& topic : what.topics) {
    auto one = hub.subscribe<json_text>(
        topic,
        {.depth = depth_of_each(what), .text_bytes_max = what.text_bytes_max, .throttle = what.throttle});
    if (!one) {
      to.error("cannot subscribe to ", quoted(topic), ": ", one.error().message());
      otherwise = exit_code_of(one.error());
      return std::nullopt;
    }
    all.all_.push_back({topic, std::move(one).value()});
  }
  return all;
}

result<incoming> subscriptions::take(rt::duration timeout) {
  if (all_.size() == 1) {
    auto taken = all_.front().from.take(timeout);
    if (!taken) return taken.error();
    return incoming{all_.front().topic, std::move(*taken)};
  }
  const auto end = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  for (;;) {
    if (auto taken = try_take(); taken || taken.code() != errc::empty) return taken;
    const auto now = rt::monotonic_clock::now();
    if (now >= end || interrupt::seen()) return errc::timed_out;
    interrupt::sleep_until(std::min(end, now + look_period));
  }
}

result<incoming> subscriptions::try_take() {
  one* earliest = nullptr;
  for (one& o : all_) {
    if (!o.next) {
      auto taken = o.from.try_take();
      if (!taken && taken.code() != errc::empty) return taken.error();
      if (!taken) continue;
      o.next.emplace(std::move(*taken));
    }
    if (earliest == nullptr || o.next->arrived() < earliest->next->arrived()) earliest = &o;
  }
  if (earliest == nullptr) return errc::empty;
  incoming taken{earliest->topic, std::move(*earliest->next)};
  earliest->next.reset();
  return taken;
}

} // namespace rowe::tools
