// SPDX-License-Identifier: Apache-2.0
#include "recording/recorder.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

namespace rowe::recording {
namespace {

constexpr std::int64_t buffer_bytes_min = 1 << 20;
constexpr std::int64_t buffer_bytes_max = 1 << 30;

// Files that are not split would be one, which cannot be deleted while it is written.
recording_options settled(recording_options options) {
  if (options.total_bytes != 0 && options.split_bytes == 0) options.split_bytes = options.total_bytes / 8 + 1;
  return options;
}

} // namespace

recorder::recorder(const recording_options& options, std::size_t buffer_bytes)
    : feed_{buffer_bytes}, series_{settled(options)} {}

result<std::unique_ptr<recorder>> recorder::start(const recording_options& options, std::string* why) {
  const auto bytes = static_cast<std::int64_t>(std::min<std::size_t>(options.buffer_bytes, INT64_MAX));
  if (bytes < buffer_bytes_min || bytes > buffer_bytes_max)
    return error{errc::bad_argument, bytes, bytes < buffer_bytes_min ? buffer_bytes_min : buffer_bytes_max,
                 argument::buffer_bytes};
  std::unique_ptr<recorder> made{new recorder{options, options.buffer_bytes}};
  if (!made->feed_)
    return error{errc::no_memory, static_cast<std::int64_t>(options.buffer_bytes), made->feed_.map_errno()};
  if (!made->series_.begin(rt::monotonic_clock::now())) {
    if (why != nullptr) *why = made->series_.fault();
    return errc::bad_recording;
  }
  made->series_.describe(made->figures_);
  made->thread_ = rt::thread{{.name = "rowe-record"}, [of = made.get()] { of->run(); }};
  if (!made->thread_.joinable()) return error{errc::no_thread, made->thread_.error()};
  return made;
}

recorder::~recorder() { (void)close(); } // who wants to know why not all was written closes it first

// ---- the thread

void recorder::run() noexcept {
  for (bool ends = false; !ends;) {
    {
      std::unique_lock lock{mutex_};
      changed_.wait_for(lock, look_period, [&] { return ends_ || flushes_wanted_ != flushes_done_; });
      ends = ends_;
    }
    work();
  }
}

void recorder::work() {
  std::uint64_t wanted = 0;
  bool ends = false;
  {
    const std::lock_guard lock{mutex_};
    wanted = flushes_wanted_;
    ends = ends_;
  }
  take_all();
  series_.tend(rt::monotonic_clock::now());
  bool all_written = true;
  if (wanted != flushes_done_) all_written = series_.flush(); // this thread alone changes flushes_done_
  if (ends) all_written = series_.close();
  recording_figures now;
  series_.describe(now);
  const std::lock_guard lock{mutex_};
  figures_ = std::move(now);
  all_written_ = all_written;
  if (flushes_done_ == wanted) return;
  flushes_done_ = wanted;
  changed_.notify_all();
}

void recorder::take_all() {
  while (feed_.take(taken_) != 0) {
    std::string_view rest = taken_;
    record_head head;
    std::string_view content;
    while (feed::next(rest, head, content)) take(head, content);
    taken_.erase(0, taken_.size() - rest.size());
    series_.tend(rt::monotonic_clock::now());
  }
}

void recorder::take(const record_head& head, std::string_view content) {
  if (head.kind == record_kind::message)
    return series_.add(head.topic, content, head.logged_ns, head.published_ns);
  if (head.kind == record_kind::lost) return series_.note_lost(head.topic, head.count, head.logged_ns);
  const auto text = [&] { // behind its length
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, content.data(), sizeof bytes);
    std::string one{content.substr(sizeof bytes, bytes)};
    content.remove_prefix(sizeof bytes + bytes);
    return one;
  };
  std::string name = text();
  std::string type = text();
  series_.set_topic(head.topic, std::move(name), std::move(type), text());
}

// ---- others

recording_figures recorder::figures() const {
  const std::lock_guard lock{mutex_};
  recording_figures now = figures_;
  now.lost += feed_.lost();
  now.waiting = feed_.waiting_bytes();
  return now;
}

bool recorder::faulty() const {
  const std::lock_guard lock{mutex_};
  return !figures_.fault.empty();
}

bool recorder::flush(rt::duration timeout) {
  std::unique_lock lock{mutex_};
  const std::uint64_t mine = ++flushes_wanted_;
  changed_.notify_all();
  const auto until = rt::deadline_after(rt::monotonic_clock::now(), timeout);
  const auto done = [&] { return flushes_done_ >= mine; };
  if (until == rt::never) {
    changed_.wait(lock, done);
  } else if (!changed_.wait_for(lock, until - rt::monotonic_clock::now(), done)) {
    return false;
  }
  return all_written_;
}

std::string recorder::close() {
  if (!std::exchange(closed_, true)) {
    {
      const std::lock_guard lock{mutex_};
      ends_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }
  const std::lock_guard lock{mutex_};
  return figures_.fault;
}

} // namespace rowe::recording
