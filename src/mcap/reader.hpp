// SPDX-License-Identifier: Apache-2.0
// Reads the messages of a recording in the order of their times, from any time on. A file with a summary is
// not looked through: it is quick to open and to seek, however large it is. One without is, once. One thread
// at a time; allocates, and waits for its source.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <set>
#include <string>
#include <vector>

#include "mcap/compression.hpp"
#include "mcap/format.hpp"
#include "mcap/record_reader.hpp"
#include "mcap/scan.hpp"
#include "mcap/sink.hpp"

namespace rowe::mcap {

class reader {
 public:
  // Of chunks whose messages overlap in time no more bytes are in memory at once than `overlap_bytes_max`,
  // and one chunk. What would be beyond that is damage.
  explicit reader(source& from, std::size_t overlap_bytes_max = std::size_t{512} << 20U)
      : from_{from}, overlap_bytes_max_{overlap_bytes_max} {}

  // False: it is no recording, or cannot be read; wrong() says why. `on_progress` is told how many bytes were
  // read, where the whole file has to be.
  bool open(const std::function<void(std::uint64_t)>& on_progress = {});
  const std::string& wrong() const noexcept { return wrong_; }

  const header& head() const noexcept { return head_; }
  const summary& all() const noexcept { return all_; }
  bool has_summary() const noexcept { return has_summary_; }
  // Reads one of all().metadata. False: it is not there, or damaged.
  bool read_metadata(const metadata_index& at, text_map& into);
  // What could not be read so far.
  const std::vector<damage>& damaged() const noexcept { return damaged_; }

  // Only messages logged from then on, until `end_ns` (itself included), and of these channels (none: all).
  struct selection {
    std::uint64_t begin_ns = 0;
    std::uint64_t end_ns = std::numeric_limits<std::uint64_t>::max();
    std::set<channel_number> channels{};
  };
  void select(selection wanted);
  // The next of them, in order of time; of the same time, in that of the file. Valid until the next call.
  // Null: there are no more.
  const message* next();

 private:
  // A chunk, or messages without one.
  struct piece {
    time_span times;
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
    bool is_chunk = false;
    std::vector<channel_number> channels{}; // that are in it; empty: not known
  };
  struct open_piece {
    std::uint64_t offset = 0;
    std::string records;
    std::vector<placed_message> messages; // the wanted ones, by time
    std::size_t at = 0;
    std::uint64_t next_ns() const noexcept { return messages[at].logged_ns; }
  };

  bool read_summary();
  bool read_summary_records(std::string_view records);
  bool says_all() const;
  bool lists_all_until(std::uint64_t end);
  bool is_sound(const chunk_index& one) const noexcept;
  bool wants(const piece& one) const;
  void open_piece_at(std::size_t number);
  std::string load(const piece& one, std::string& records);

  source& from_;
  const std::size_t overlap_bytes_max_;
  std::string wrong_;
  header head_;
  summary all_;
  bool has_summary_ = false;
  std::vector<damage> damaged_;
  std::vector<piece> pieces_; // by their earliest times
  selection wanted_;
  std::size_t next_piece_ = 0;
  std::list<open_piece> opened_;
  decompressor unpacks_;
  std::string packed_;
  message current_;
};

} // namespace rowe::mcap
