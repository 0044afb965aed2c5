// SPDX-License-Identifier: Apache-2.0
// The files of a recording, one behind the other: when one ends and the next begins, which of the old ones
// go, and what happens when the disk takes no more. One ordinary thread; allocates, and waits for the disk.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/recording.hpp>

#include "recording/described_topics.hpp"
#include "recording/file_names.hpp"
#include "recording/messages_target.hpp"
#include "recording/recording_file.hpp"

namespace rowe::recording {

class series final : public messages_target {
 public:
  static constexpr rt::duration chunk_time = std::chrono::milliseconds{150};
  static constexpr std::size_t chunks_max = 131'072; // of a file: their list stands at its end, and in memory
  static constexpr std::uint64_t index_entries_max =
      2'000'000; // likewise: of all chunks, one for each channel
  static constexpr rt::duration retry_time = std::chrono::seconds{1};
  static constexpr std::uint64_t disk_free_min = 4
                                                 << 20; // before another file begins on a disk that was full

  explicit series(recording_options chosen);

  bool begin(rt::time_point now) override;

  void set_topic(std::uint32_t number, std::string name, std::string type, std::string schema) override;
  void add(std::uint32_t number, std::string_view json, std::int64_t logged_ns,
           std::int64_t published_ns) override;
  void note_lost(std::uint32_t number, std::uint64_t count, std::int64_t logged_ns) override;
  void tend(rt::time_point now, bool drained) override;
  bool flush() override;
  bool close() override;

  const std::string& fault() const noexcept override { return fault_; }
  void describe(recording_figures& into) const override;
  const std::vector<std::string>& unended() const noexcept override { return unended_; }

 private:
  // Whether what has failed will be tried again.
  bool waits_for_room() const noexcept { return chosen_.total_bytes != 0; }
  bool open_next(rt::time_point now);
  void end_file();
  void end_chunk();
  void delete_oldest();
  void split_if_due(rt::time_point now);
  bool give_channel(described_topic& to);
  void say_lost();
  void write(described_topic& of, std::string_view json, std::int64_t logged_ns, std::int64_t published_ns);

  const recording_options chosen_;
  file_names names_;
  std::uint32_t attempts_ = 0; // of the names of files
  std::optional<recording_file> file_;
  rt::time_point began_{};           // when it did
  std::uint64_t added_ = 0;          // messages to it
  std::vector<recorded_file> ended_; // of the series, the oldest first
  std::vector<std::string> unended_;
  described_topics topics_;
  described_topic losses_;
  rt::time_point chunk_due_{};
  rt::time_point retry_at_{};
  std::string fault_;
  std::uint64_t files_ = 0;
  std::uint64_t deleted_ = 0;
  std::uint64_t messages_ = 0; // in files that have ended
  std::uint64_t bytes_ = 0;    // likewise
  std::uint64_t lost_ = 0;     // that the disk did not take
  std::string last_path_;
};

} // namespace rowe::recording
