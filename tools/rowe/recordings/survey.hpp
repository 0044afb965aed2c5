// SPDX-License-Identifier: Apache-2.0
// What is in a recording, as far as `rowe info` says it. The summary of a file says how many messages it has;
// what is said of their times and lengths takes a look at each of them.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <rowe/recording.hpp>

#include "stops.hpp"

namespace rowe::tools {

// A topic with one type and encoding, however many publishers it had.
struct surveyed_topic {
  std::string name;
  std::string type;
  std::string encoding;
  std::uint64_t messages = 0;
  // Of the rest nothing is known where the messages were not looked at.
  std::uint64_t bytes = 0; // of all messages
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
  std::int64_t longest_gap_ns = 0;
  // Messages with a lower number than the one before them, or published before it, by the same publisher.
  std::uint64_t out_of_order = 0;

  // Messages a second from the first to the last: (messages - 1) / (last - first). A pause lowers it, and is
  // the longest gap. Nothing: there is no such span.
  std::optional<double> rate_hz() const;
};

struct survey {
  std::string path;
  std::uint64_t file_bytes = 0;
  std::string written_by;
  std::string profile;
  bool is_ended = false;
  bool looked_at_messages = false;
  std::uint64_t messages = 0;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::vector<surveyed_topic> topics; // by name
  std::map<std::string, std::uint64_t> lost;
  std::vector<recorded_stop> stops;
  std::vector<recording_damage> damaged;
  std::vector<recording_notes> metadata;
  std::vector<recording_attachment> attachments;
  std::string packed;             // "lz4", "lz4 and zstd", "nothing"
  std::uint64_t packed_bytes = 0; // of all chunks
  std::uint64_t plain_bytes = 0;  // and once unpacked
  std::uint64_t lost_messages() const;
  // Of what lies in chunks: how many times smaller it is in the file. Nothing: there are none.
  std::optional<double> compression_ratio() const;
};

// What reads tell of the part that is done, from 0 to 1. False: no more is wanted.
using survey_progress = std::function<bool(double)>;

// Looks through a recording; `quick`: at its summary only. Nothing: `why` says why it cannot be read, or is
// empty because `on_progress` has ended it.
std::optional<survey> survey_of(const std::string& path, bool quick, std::string& why,
                                const survey_progress& on_progress);

} // namespace rowe::tools
