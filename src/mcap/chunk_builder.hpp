// SPDX-License-Identifier: Apache-2.0
// Gathers messages, and makes a chunk of them: the record of the chunk, then those of its message index, as
// they stand in a file. Allocates; never waits.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mcap/compression.hpp"
#include "mcap/format.hpp"

namespace rowe::mcap {

// Where a message is in the plain records of its chunk.
struct placed_message {
  channel_number channel;
  std::uint64_t logged_ns;
  std::uint64_t offset;
};

class chunk_builder {
 public:
  explicit chunk_builder(compression how) : packs_{how} {}

  void add(const message& one);
  bool empty() const noexcept { return gathered_.empty(); }
  std::size_t bytes() const noexcept { return gathered_.size(); } // of the plain records
  const std::vector<placed_message>& messages() const noexcept { return placed_; }

  // Forgets what is gathered.
  void drop() noexcept;
  // Appends the records, which will begin at `offset` of the file, and begins anew. `messages` are those that
  // were in it, by channel and time.
  chunk_index finish(std::string& into, std::uint64_t offset, std::vector<placed_message>& messages);

  // Appends a message index for each channel, which will begin at `offset`. `messages` are put in order.
  static void append_indexes(std::string& into, chunk_index& of, std::vector<placed_message>& messages,
                             std::uint64_t offset);

 private:
  compressor packs_;
  std::string gathered_;
  std::vector<placed_message> placed_;
  time_span times_; // of these
};

} // namespace rowe::mcap
