// SPDX-License-Identifier: Apache-2.0
// What becomes of messages that come out of a feed: files (series.hpp), or memory until something happens
// (black_box.hpp). One ordinary thread; allocates, and waits for the disk.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>

namespace rowe::recording {

class messages_target {
 public:
  virtual ~messages_target() = default;

  // False: fault() says why.
  virtual bool begin(rt::time_point now) = 0;
  virtual void set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) = 0;
  // `number` was set.
  virtual void add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
                   std::int64_t published_ns) = 0;
  // Messages of it never came here.
  virtual void note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) = 0;
  // Ends what is due: a chunk, a file. To be called every 10 ms or so. `drained`: nothing waits that came
  // before `now`. Else a file that has a time to end goes on.
  virtual void tend(rt::time_point now, bool drained) = 0;
  // All that was added lies where it is to lie. False: not all of it; fault() says why.
  virtual bool flush() = 0;
  // Likewise, and the file is ended.
  virtual bool close() = 0;
  // Somebody asks for what is in memory.
  virtual void snapshot(std::string_view cause) { (void)cause; }

  // Why nothing is written now; empty: all is well.
  virtual const std::string& fault() const noexcept = 0;
  // Adds what is known here.
  virtual void describe(recording_figures& into) const = 0;
  // Files of the same name that an earlier program did not end.
  virtual const std::vector<std::string>& unended() const noexcept = 0;
};

} // namespace rowe::recording
