// SPDX-License-Identifier: Apache-2.0
// A feed, the files behind it, and the thread between them. The thread looks at the feed each 10 ms, so that
// who puts messages in never has to wake it.
#pragma once
#include <array>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>
#include <rowe/rt/thread.hpp>

#include "recording/feed.hpp"
#include "recording/messages_target.hpp"

namespace rowe::recording {

class recorder {
 public:
  static constexpr rt::duration look_period = std::chrono::milliseconds{10};

  // Makes the first file and starts the thread. Errors: as recording_writer::create().
  static result<std::unique_ptr<recorder>> start(const recording_options& options, std::size_t topics,
                                                 std::string* why);
  ~recorder();
  recorder(const recorder&) = delete;
  recorder& operator=(const recorder&) = delete;

  // For one thread, which must not wait.
  feed& messages() noexcept { return feed_; }

  // ---- any thread; may wait

  recording_figures figures() const;
  // What was put in before is written. False: not within the time, or not at all; then there is a fault.
  bool flush(rt::duration timeout);
  // Of a black box: writes what it retains. Returns at once.
  void snapshot(std::string_view cause);
  // Ends the thread, and deletes the file, to which nothing was added.
  void discard();
  // Ends the thread and the file. Empty: all was written; else why not.
  std::string close();
  bool closed() const noexcept { return closed_; }
  bool faulty() const;
  const std::vector<std::string>& unended() const noexcept { return target_->unended(); }

 private:
  recorder(const recording_options& options, std::size_t topics);
  void run() noexcept;
  template <class Does>
  void without_failing(Does&& does) noexcept;
  void work();
  bool take_all(rt::time_point now);
  void show();
  void take(const record_head& head, std::string_view content);
  void take_topic(const record_head& head, std::string_view content);

  feed feed_;
  const std::unique_ptr<messages_target> target_;
  std::string taken_;           // from the feed, and not looked at yet
  std::uint64_t not_taken_ = 0; // messages: no memory was left for them, or they came in part only
  struct long_message {
    record_head head{};
    std::uint64_t bytes = 0;
    std::string text{};
  };
  std::array<long_message, long_places> long_messages_; // that come in parts
  rt::thread thread_;
  bool closed_ = false;

  mutable std::mutex mutex_; // what follows
  std::condition_variable changed_;
  bool ends_ = false;
  std::uint64_t flushes_wanted_ = 0;
  std::uint64_t flushes_done_ = 0;
  bool all_written_ = true;            // by the last flush
  std::vector<std::string> snapshots_; // their causes, if some are asked for
  recording_figures figures_;
};

} // namespace rowe::recording
