// SPDX-License-Identifier: Apache-2.0
#include "event_folder.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace rowe::tools {
namespace {

// What events that are alike have in common. The port of a peer is another for each of its connections.
std::string key_of(const event& happened) {
  const std::string_view peer = happened.peer;
  std::string words{std::string_view{happened.what}};
  if (const auto at = peer.empty() ? words.npos : words.find(peer); at != words.npos)
    words.erase(at, peer.size());
  std::string key{static_cast<char>('a' + static_cast<int>(happened.what_kind))};
  key.append(happened.identity).append(1, ' ');
  return key.append(peer.substr(0, peer.rfind(':'))).append(1, ' ').append(words);
}

} // namespace

void event_folder::take(const event& happened, rt::time_point now) {
  flush(now);
  std::string key = key_of(happened);
  if (const auto like = std::ranges::find(rows_, key, &row::key); like != rows_.end()) {
    ++like->held;
    like->last = happened;
    return;
  }
  if (new_lines_ == new_lines_max) {
    ++left_out_;
    return;
  }
  ++new_lines_;
  line_(happened, 0);
  const auto free = std::ranges::find(rows_, std::string{}, &row::key);
  if (free == rows_.end()) return; // those like it count as new ones
  *free = {.key = std::move(key), .last = happened, .held = 0, .due = now + period};
}

void event_folder::flush(rt::time_point now) {
  for (row& one : rows_) {
    if (one.key.empty() || now < one.due) continue;
    if (one.held == 0) {
      one.key.clear();
      continue;
    }
    write(one);
    one.due = now + period;
  }
  if (now >= period_began_ + period) end_period(now);
}

void event_folder::finish() {
  for (row& one : rows_) {
    if (one.held != 0) write(one);
    one.key.clear();
  }
  end_period(period_began_);
}

void event_folder::write(row& one) { line_(one.last, std::exchange(one.held, 0) - 1); }

void event_folder::end_period(rt::time_point now) {
  if (left_out_ != 0) rest_(std::exchange(left_out_, 0));
  new_lines_ = 0;
  period_began_ = now;
}

} // namespace rowe::tools
