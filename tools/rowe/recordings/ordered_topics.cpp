// SPDX-License-Identifier: Apache-2.0
#include "ordered_topics.hpp"

#include <algorithm>
#include <bit>
#include <thread>
#include <utility>

#include <rowe/rt/periodic.hpp>

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

// What a topic's queue has room for at first: most messages are short.
constexpr std::uint32_t first_bytes_max = 8 * 1024;
constexpr std::size_t topic_queue_bytes = 64 * 1024;
constexpr std::size_t slot_bytes_more = 1024;
// Of one topic, on the way at once: less than any endpoint's queues hold.
constexpr std::uint64_t under_way_max = 64;
constexpr std::size_t under_way_bytes_max = 256 * 1024;
// How long publish() waits for earlier messages, and how it looks for them.
constexpr rt::duration leaving_time = 20ms;
constexpr rt::duration look_time = 30us;
constexpr int looks_at_once = 4;
// After so long without anything leaving, order is not waited for any more.
constexpr rt::duration standstill_max = 10s;

std::uint32_t depth_of(std::uint32_t bytes_max) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(topic_queue_bytes / bytes_max, 2, 16));
}
std::size_t queue_bytes_of(std::uint32_t bytes_max) noexcept {
  return depth_of(bytes_max) * (bytes_max + slot_bytes_more);
}

} // namespace

std::size_t ordered_topics::handle_bytes_for(std::size_t topics, std::size_t longest) noexcept {
  constexpr std::size_t topics_with_long_ones = 32; // at once; these queues are address space until used
  const auto most = static_cast<std::uint32_t>(std::max<std::size_t>(longest, first_bytes_max));
  return topics * queue_bytes_of(first_bytes_max) * 2 +
         std::min(topics + 1, topics_with_long_ones) * queue_bytes_of(most);
}

result<publisher<json_text>> ordered_topics::advertise(const played_topic& what, std::uint32_t bytes_max) {
  return via_.advertise<json_text>(what.name, {.ttl = how_.ttl,
                                               .keep = keep::all,
                                               .depth = depth_of(bytes_max),
                                               .latched = what.latched,
                                               .type = what.type,
                                               .text_bytes_max = bytes_max});
}

result<ordered_topics> ordered_topics::open(endpoint& via, const std::vector<played_topic>& topics,
                                            const topics_options& how, std::string& wrong) {
  ordered_topics all{via, how};
  const std::uint32_t bytes_max = std::min(first_bytes_max, how.longest);
  for (const played_topic& what : topics) {
    auto to = all.advertise(what, bytes_max);
    if (!to) {
      wrong = what.name;
      return to.error();
    }
    all.topics_.push_back({what, std::move(*to), bytes_max});
  }
  return all;
}

status ordered_topics::grow(opened& topic, std::size_t bytes) {
  const auto wanted = std::bit_ceil(static_cast<std::uint32_t>(bytes));
  const std::uint32_t bytes_max = std::min(std::max(wanted, first_bytes_max), how_.longest);
  auto to = advertise(topic.what, bytes_max); // before the old one goes: the topic stays advertised
  if (!to) return to.code() == errc::handle_memory ? error{errc::too_big} : to.error();
  topic.to = std::move(*to);
  topic.bytes_max = bytes_max;
  return {};
}

std::uint64_t ordered_topics::left() const {
  std::uint64_t sum = 0;
  for (const count& one : via_.counts()) {
    const bool of_calls = one.name.starts_with("calls_") || one.name.starts_with("replies_");
    const bool is_lost = one.group == "loss" && one.name != "full" && !of_calls;
    if (is_lost || one.name == "messages_out") sum += one.value;
  }
  return sum;
}

bool ordered_topics::all_left() {
  const rt::time_point end = rt::monotonic_clock::now() + leaving_time;
  for (int looks = 0; under_way_ != 0; ++looks) {
    const rt::time_point now = rt::monotonic_clock::now();
    const std::uint64_t gone = left();
    if (gone != left_last_) moved_at_ = now;
    left_last_ = gone;
    if (gone >= left_before_ + under_way_ || via_.peers() == 0 || now - moved_at_ >= standstill_max) {
      under_way_ = 0;
      under_way_bytes_ = 0;
      break;
    }
    if (now >= end) return false;
    if (looks < looks_at_once) {
      std::this_thread::yield();
    } else {
      rt::kernel_clock::sleep_until(now + look_time);
    }
  }
  return true;
}

status ordered_topics::publish(std::size_t topic, std::string_view json) {
  opened& on = topics_[topic];
  if (json.size() > how_.longest) return errc::too_big;
  const bool another = topic != last_ || json.size() > on.bytes_max;
  const bool much = under_way_ >= under_way_max || under_way_bytes_ + json.size() > under_way_bytes_max;
  if ((another || much) && !all_left()) return errc::full;
  if (json.size() > on.bytes_max) {
    if (const status grown = grow(on, json.size()); !grown) return grown;
  }
  if (under_way_ == 0) {
    left_before_ = left_last_ = left();
    moved_at_ = rt::monotonic_clock::now();
  }
  const status done = on.to.publish(json);
  if (!done) return done;
  last_ = topic;
  ++under_way_;
  under_way_bytes_ += json.size();
  return {};
}

} // namespace rowe::tools
