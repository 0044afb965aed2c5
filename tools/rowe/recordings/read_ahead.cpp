// SPDX-License-Identifier: Apache-2.0
#include "read_ahead.hpp"

#include <algorithm>
#include <utility>

namespace rowe::tools {
namespace {

constexpr std::size_t ahead_bytes_max = 16U << 20U;

// What could not be read is asked for so often, since that takes as long as a message or more.
constexpr std::uint64_t messages_between_faults = 64;

std::size_t size_of(const read_item& item) { return sizeof item + item.text.size(); }

} // namespace

read_ahead::read_ahead(recorded_messages& from, range played)
    : from_{from}, played_{std::move(played)}, sought_{played_.from_ns}, thread_{[this] { run(); }} {}

read_ahead::~read_ahead() {
  {
    const std::lock_guard hold{mutex_};
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::optional<read_item> read_ahead::take(rt::duration timeout) {
  std::unique_lock held{mutex_};
  if (!changed_.wait_for(held, timeout, [&] { return !items_.empty(); })) return std::nullopt;
  read_item item = std::move(items_.front());
  items_.pop_front();
  bytes_ -= size_of(item);
  held.unlock();
  changed_.notify_all();
  return item;
}

void read_ahead::seek(std::int64_t time_ns) {
  {
    const std::lock_guard hold{mutex_};
    std::erase_if(items_, [](const read_item& one) { return one.is != read_item::kind::fault; });
    bytes_ = 0;
    for (const read_item& one : items_) bytes_ += size_of(one);
    sought_ = time_ns;
  }
  changed_.notify_all();
}

void read_ahead::run() {
  std::unique_lock held{mutex_};
  for (;;) {
    changed_.wait(held, [&] { return over_ || sought_.has_value(); });
    if (over_) return;
    read_from(*std::exchange(sought_, std::nullopt), held);
  }
}

bool read_ahead::put(read_item item, std::unique_lock<std::mutex>& held) {
  const std::size_t size = size_of(item);
  changed_.wait(held, [&] { return over_ || sought_ || items_.empty() || bytes_ + size <= ahead_bytes_max; });
  if (over_ || sought_) return false;
  bytes_ += size;
  items_.push_back(std::move(item));
  changed_.notify_all();
  return true;
}

bool read_ahead::put_faults(std::unique_lock<std::mutex>& held) {
  bool goes_on = true;
  for (std::string& one : from_.faults())
    goes_on = put({.is = read_item::kind::fault, .text = std::move(one)}, held) && goes_on;
  return goes_on;
}

void read_ahead::read_from(std::int64_t time_ns, std::unique_lock<std::mutex>& held) {
  std::uint64_t messages = 0; // of the lap
  for (;;) {
    held.unlock();
    if (messages == 0) from_.select(time_ns, played_.until_ns, played_.topics);
    std::optional<kept_message> next = from_.next();
    read_item item;
    if (next) {
      item = {read_item::kind::message, next->topic, next->time_ns, std::string{next->data}};
      ++messages;
    }
    held.lock();
    const bool asks = !next || messages % messages_between_faults == 0;
    if (asks && !put_faults(held)) return;
    const bool again = !next && played_.loop && (messages != 0 || time_ns != played_.from_ns);
    if (again) {
      item.is = read_item::kind::lap;
      messages = 0;
      time_ns = played_.from_ns;
    }
    if (!put(std::move(item), held) || (!next && !again)) return;
  }
}

} // namespace rowe::tools
