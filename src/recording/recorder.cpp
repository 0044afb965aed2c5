// SPDX-License-Identifier: Apache-2.0
#include "recording/recorder.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include <unistd.h>

#include <rowe/types.hpp>

#include "recording/black_box.hpp"
#include "recording/series.hpp"

namespace rowe::recording {
namespace {

constexpr std::int64_t buffer_bytes_min = 1 << 20;
constexpr std::int64_t buffer_bytes_max = 1 << 30;
constexpr std::size_t snapshots_max = 8; // that wait for the thread
constexpr std::size_t cause_bytes_max = 4096;

std::unique_ptr<messages_target> target_for(recording_options options) {
  if (options.black_box.before > rt::duration{0}) return std::make_unique<black_box>(std::move(options));
  // Files that are not split would be one, which cannot be deleted while it is written.
  if (options.total_bytes != 0)
    options.split_bytes =
        std::min(options.split_bytes != 0 ? options.split_bytes : options.total_bytes / 8 + 1,
                 options.total_bytes / 2 + 1);
  return std::make_unique<series>(std::move(options));
}

} // namespace

recorder::recorder(const recording_options& options, std::size_t topics)
    : feed_{options.buffer_bytes, topics}, target_{target_for(options)} {}

result<std::unique_ptr<recorder>> recorder::start(const recording_options& options, std::size_t topics,
                                                  std::string* why) {
  const auto bytes = static_cast<std::int64_t>(std::min<std::size_t>(options.buffer_bytes, INT64_MAX));
  if (bytes < buffer_bytes_min || bytes > buffer_bytes_max)
    return error{errc::bad_argument, bytes, bytes < buffer_bytes_min ? buffer_bytes_min : buffer_bytes_max,
                 argument::buffer_bytes};
  if (options.path.empty()) {
    if (why != nullptr) *why = "the option path is empty";
    return errc::bad_recording;
  }
  std::unique_ptr<recorder> made{new recorder{options, topics}};
  if (!made->feed_)
    return error{errc::no_memory, static_cast<std::int64_t>(options.buffer_bytes), made->feed_.map_errno()};
  if (!made->target_->begin(rt::monotonic_clock::now())) {
    if (why != nullptr) *why = made->target_->fault();
    return errc::bad_recording;
  }
  made->target_->describe(made->figures_);
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
    without_failing([&] { work(); });
  }
  without_failing([&] {
    while (take_all(rt::monotonic_clock::now())) continue;
    for (const long_message& one : long_messages_) not_taken_ += one.bytes > one.text.size() ? 1U : 0U;
    (void)target_->close(); // the fault says it
    show();
  });
}

// A robot goes on without its recording when there is no memory for that.
template <class Does>
void recorder::without_failing(Does&& does) noexcept {
  try {
    does();
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock{mutex_};
    figures_.fault = "out of memory"; // so short that it needs none
    all_written_ = false;
    flushes_done_ = flushes_wanted_;
    changed_.notify_all();
  }
}

void recorder::work() {
  std::uint64_t wanted = 0;
  std::vector<std::string> snapshots;
  {
    const std::lock_guard lock{mutex_};
    wanted = flushes_wanted_;
    snapshots.swap(snapshots_);
  }
  const rt::time_point now = rt::monotonic_clock::now();
  (void)take_all(now); // what comes meanwhile is for the next time
  for (const std::string& cause : snapshots) target_->snapshot(cause);
  target_->tend(now, true);
  if (wanted == flushes_done_) return show(); // this thread alone changes it
  const bool all_written = target_->flush();
  show();
  const std::lock_guard lock{mutex_};
  all_written_ = all_written;
  flushes_done_ = wanted;
  changed_.notify_all();
}

void recorder::show() {
  recording_figures now;
  now.lost = not_taken_;
  target_->describe(now);
  const std::lock_guard lock{mutex_};
  figures_ = std::move(now);
}

// What is in the feed now. False: that was nothing.
bool recorder::take_all(rt::time_point now) {
  const std::size_t there = feed_.pending_bytes();
  target_->tend(now, false); // what happens from here on happens now, or somewhat before
  for (std::size_t taken = 0; taken < there;) {
    taken += feed_.take(taken_);
    std::string_view rest = taken_;
    record_head head;
    std::string_view content;
    while (feed::next(rest, head, content)) {
      try {
        take(head, content);
      } catch (const std::bad_alloc&) {
        not_taken_ += head.kind == record_kind::message || head.kind == record_kind::long_part ? 1U : 0U;
      }
    }
    taken_.erase(0, taken_.size() - rest.size());
    target_->tend(now, false);
  }
  return there != 0;
}

void recorder::take(const record_head& head, std::string_view content) {
  switch (head.kind) {
  case record_kind::topic:
  case record_kind::typed: return take_topic(head, content);
  case record_kind::message: return target_->add(head.topic, content, head.logged_ns, head.published_ns);
  case record_kind::lost: return target_->note_lost(head.topic, head.count, head.logged_ns);
  case record_kind::snapshot: feed_.note_snapshot(); return target_->snapshot(content);
  case record_kind::long_begin: {
    long_message& begun = long_messages_[head.place];
    not_taken_ += begun.bytes > begun.text.size() ? 1U : 0U; // nobody ended it
    begun = {.head = head};
    std::memcpy(&begun.bytes, content.data(), sizeof begun.bytes);
    return;
  }
  case record_kind::long_part: {
    long_message& one = long_messages_[head.place];
    if (one.text.size() >= one.bytes) return; // its topic has gone
    one.text += content;
    if (one.text.size() < one.bytes) return;
    target_->add(one.head.topic, one.text, one.head.logged_ns, one.head.published_ns);
    one = {};
  }
  }
}

void recorder::take_topic(const record_head& head, std::string_view content) {
  const auto text = [&] { // behind its length
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, content.data(), sizeof bytes);
    std::string one{content.substr(sizeof bytes, bytes)};
    content.remove_prefix(sizeof bytes + bytes);
    return one;
  };
  // A long message that is under way was of the topic that had this number before.
  for (long_message& one : long_messages_) {
    if (one.bytes <= one.text.size() || one.head.topic != head.topic) continue;
    ++not_taken_;
    one = {};
  }
  std::string name = text();
  std::string type = text();
  std::string schema = text();
  if (head.kind == record_kind::typed) {
    const schema_description* its = nullptr;
    std::memcpy(&its, schema.data(), sizeof its);
    schema = json_schema(*its);
  }
  target_->set_topic(head.topic, std::move(name), std::move(type), std::move(schema));
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
  if (closed_) return figures_.fault.empty();
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

void recorder::snapshot(std::string_view cause) {
  const std::lock_guard lock{mutex_};
  if (snapshots_.size() < snapshots_max) snapshots_.emplace_back(cause.substr(0, cause_bytes_max));
}

void recorder::discard() {
  (void)close();
  if (figures_.files != 0) ::unlink(figures_.path.c_str());
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
