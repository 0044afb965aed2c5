// SPDX-License-Identifier: Apache-2.0
// Reads messages before they are due, on a thread of its own: the disk, and unpacking a chunk, take longer
// than a message may be late. It keeps as many as 16 MiB hold, but one at least.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <rowe/rt/clock.hpp>

#include "recorded_messages.hpp"

namespace rowe::tools {

// What is next in a recording: a message; a fault, whose sentence is `text`; the end of a lap, after which it
// begins again; or the end.
struct read_item {
  enum class kind : std::uint8_t { message, fault, lap, end };
  kind is = kind::end;
  std::size_t topic = 0;
  std::int64_t time_ns = 0;
  std::string text{};
};

class read_ahead {
 public:
  struct range {
    std::int64_t from_ns = 0;
    std::int64_t until_ns = 0;
    std::vector<std::size_t> topics{};
    bool loop = false;
  };
  // Nobody else uses `from` meanwhile.
  read_ahead(recorded_messages& from, range played);
  read_ahead(const read_ahead&) = delete;
  read_ahead& operator=(const read_ahead&) = delete;
  ~read_ahead();

  // The next item; nothing: it is not there within that time. Behind the end there is nothing.
  std::optional<read_item> take(rt::duration timeout);

  // Goes on from there; what was read and not taken is forgotten. Faults are not.
  void seek(std::int64_t time_ns);

 private:
  void run();
  // Puts it into the queue once there is room. False: there was a seek, or the end, meanwhile.
  bool put(read_item item, std::unique_lock<std::mutex>& held);
  // From the time of a seek, until the end or the next one.
  void read_from(std::int64_t time_ns, std::unique_lock<std::mutex>& held);
  bool put_faults(std::unique_lock<std::mutex>& held);

  recorded_messages& from_;
  const range played_;
  std::mutex mutex_; // guards all below; not held while the file is read
  std::condition_variable changed_;
  std::deque<read_item> items_;
  std::size_t bytes_ = 0; // of items_
  std::optional<std::int64_t> sought_;
  bool over_ = false;
  std::thread thread_; // last: it begins when all the rest is there
};

} // namespace rowe::tools
