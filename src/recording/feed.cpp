// SPDX-License-Identifier: Apache-2.0
#include "recording/feed.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace rowe::recording {

feed::feed(std::size_t bytes, std::size_t topics)
    : lines_{std::bit_floor(bytes / sizeof(record_line))}, lost_of_(topics), named_(topics) {
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
  const bool names = head.kind == record_kind::topic || head.kind == record_kind::typed;
  const bool of_topic = !names && head.kind != record_kind::snapshot;
  const bool says_lost = of_topic && lost_of_[head.topic] != 0;
  if (room() < lines + (says_lost ? 1 : 0)) {
    if (head.kind == record_kind::message) count_lost(head.topic, 1);
    return false;
  }
  if (says_lost) (void)put_lost_of(head.topic, head.logged_ns);
  if (names) named_[head.topic] = true;
  head.bytes = static_cast<std::uint32_t>(bytes);
  push(head, content);
  return true;
}

bool feed::ask_for_snapshot(std::string_view cause, std::int64_t now_ns) noexcept {
  if (snapshots_asked_ != snapshots_taken_.get()) return true;
  if (!put({.kind = record_kind::snapshot, .logged_ns = now_ns}, std::array{cause})) return false;
  ++snapshots_asked_;
  return true;
}

bool feed::begin_long(record_head head, std::uint64_t bytes, std::size_t part_bytes) noexcept {
  // Each part may leave the most of a line unused, and parts may be shorter than they could be: twice as
  // many.
  const std::size_t lines = bytes / sizeof(record_line) + 2 * (2 * (bytes / part_bytes + 1));
  const std::string_view length{reinterpret_cast<const char*>(&bytes), sizeof bytes};
  if (room() < lines + 2) {
    count_lost(head.topic, 1);
    return false;
  }
  head.kind = record_kind::long_begin;
  if (!put(head, std::array{length})) return false; // there is room: see above
  reserved_ += lines;
  reserved_of_[head.place] = lines;
  left_of_[head.place] = bytes;
  return true;
}

void feed::put_part(std::uint16_t place, std::string_view part) noexcept {
  push({.bytes = static_cast<std::uint32_t>(part.size()), .kind = record_kind::long_part, .place = place},
       std::array{part});
  const std::size_t used = std::min(lines_of(part.size()), reserved_of_[place]);
  left_of_[place] -= std::min<std::uint64_t>(part.size(), left_of_[place]);
  const std::size_t given_back = left_of_[place] == 0 ? reserved_of_[place] : used;
  reserved_of_[place] -= given_back;
  reserved_ -= given_back;
}

void feed::count_lost(std::uint32_t topic, std::uint64_t count) noexcept {
  lost_total_.add(count);
  std::uint32_t& of_it = lost_of_[topic];
  if (of_it == 0 && count != 0) ++topics_with_lost_;
  of_it = static_cast<std::uint32_t>(std::min<std::uint64_t>(of_it + count, UINT32_MAX));
}

bool feed::put_lost(std::int64_t logged_ns) noexcept {
  for (std::uint32_t topic = 0; topics_with_lost_ != 0 && topic < lost_of_.size(); ++topic)
    if (!put_lost_of(topic, logged_ns)) return false;
  return true;
}

bool feed::put_lost_of(std::uint32_t topic, std::int64_t logged_ns) noexcept {
  if (lost_of_[topic] == 0 || !named_[topic]) return true; // later, under its name
  if (room() < 1) return false;
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
