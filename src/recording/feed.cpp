// SPDX-License-Identifier: Apache-2.0
#include "recording/feed.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace rowe::recording {

feed::feed(std::size_t bytes) noexcept : lines_{std::bit_floor(bytes / sizeof(record_line))} {
  memory_ = rt::arena{rt::arena::bytes_for<ring::entry>(lines_) + rt::arena::bytes_for<ring>(),
                      rt::page_lock::attempted};
  if (!memory_) return;
  ring_ = memory_.make<ring>(memory_.carve<ring::entry>(lines_));
  in_ = ring_->take_producer();
  out_ = ring_->take_consumer();
}

bool feed::put(record_head head, std::span<const std::string_view> content) noexcept {
  std::size_t bytes = 0;
  for (const std::string_view one : content) bytes += one.size();
  const std::size_t lines = lines_of(bytes);
  const bool says_lost = lost_of_[head.topic] != 0;
  if (in_->room_at_least() < lines + (says_lost ? 1 : 0)) {
    if (head.kind == record_kind::message) count_lost(head.topic, 1);
    return false;
  }
  if (says_lost) (void)put_lost_of(head.topic, head.logged_ns);
  head.bytes = static_cast<std::uint32_t>(bytes);
  push(head, content);
  return true;
}

void feed::count_lost(std::uint32_t topic, std::uint64_t count) noexcept {
  lost_total_.add(count);
  std::uint32_t& of_it = lost_of_[topic];
  if (of_it == 0 && count != 0) ++topics_with_lost_;
  of_it = static_cast<std::uint32_t>(std::min<std::uint64_t>(of_it + count, UINT32_MAX));
}

bool feed::put_lost(std::int64_t logged_ns) noexcept {
  for (std::uint32_t topic = 0; topics_with_lost_ != 0 && topic < topics_max; ++topic)
    if (lost_of_[topic] != 0 && !put_lost_of(topic, logged_ns)) return false;
  return true;
}

bool feed::put_lost_of(std::uint32_t topic, std::int64_t logged_ns) noexcept {
  if (in_->room_at_least() < 1) return false;
  push({.kind = record_kind::lost, .topic = topic, .count = lost_of_[topic], .logged_ns = logged_ns}, {});
  lost_of_[topic] = 0;
  --topics_with_lost_;
  return true;
}

// There is room.
void feed::push(const record_head& head, std::span<const std::string_view> content) noexcept {
  record_line line;
  std::memcpy(line.bytes.data(), &head, sizeof head);
  std::size_t used = sizeof head;
  for (std::string_view rest : content) {
    while (!rest.empty()) {
      if (used == line.bytes.size()) {
        (void)in_->try_push(line);
        used = 0;
      }
      const std::size_t now = rest.copy(line.bytes.data() + used, line.bytes.size() - used);
      rest.remove_prefix(now);
      used += now;
    }
  }
  std::memset(line.bytes.data() + used, 0, line.bytes.size() - used);
  (void)in_->try_push(line);
}

std::size_t feed::take(std::string& into) {
  constexpr std::size_t at_once = 512;
  const std::size_t before = into.size();
  into.reserve(before + at_once * sizeof(record_line));
  (void)out_->drain([&](const record_line& one) { into.append(one.bytes.data(), one.bytes.size()); },
                    at_once);
  return into.size() - before;
}

bool feed::next(std::string_view& bytes, record_head& head, std::string_view& content) noexcept {
  if (bytes.size() < sizeof head) return false;
  std::memcpy(&head, bytes.data(), sizeof head);
  const std::size_t taken = lines_of(head.bytes) * sizeof(record_line);
  if (bytes.size() < taken) return false;
  content = bytes.substr(sizeof head, head.bytes);
  bytes.remove_prefix(taken);
  return true;
}

} // namespace rowe::recording
