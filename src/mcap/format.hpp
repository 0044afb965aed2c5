// SPDX-License-Identifier: Apache-2.0
// Room mcap: recordings in the format MCAP, version 0 (https://mcap.dev/spec): writer, reader, repair. Knows
// no endpoint. For ordinary threads: everything here may allocate, and what touches files may wait.
// What its records say. Times are nanoseconds, by the clock of who records: here since 1970.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rowe::mcap {

inline constexpr std::string_view magic{"\x89MCAP0\r\n", 8};

enum class opcode : std::uint8_t {
  header = 1,
  footer,
  schema,
  channel,
  message,
  chunk,
  message_index,
  chunk_index,
  attachment,
  attachment_index,
  statistics,
  metadata,
  metadata_index,
  summary_offset,
  data_end,
};
// In front of what each record says: its opcode, and how many bytes follow.
inline constexpr std::size_t record_head_bytes = 1 + 8;
inline constexpr std::size_t footer_bytes = 8 + 8 + 4;
inline constexpr std::size_t data_end_bytes = 4;
inline constexpr std::size_t summary_offset_bytes = 1 + 8 + 8;

using channel_number = std::uint16_t;
using schema_number = std::uint16_t; // 0: none
using text_map = std::map<std::string, std::string, std::less<>>;

struct schema {
  schema_number id = 0;
  std::string name{};     // "nav_msgs/Odometry"
  std::string encoding{}; // "jsonschema"
  std::string data{};
  friend bool operator==(const schema&, const schema&) = default;
};

struct channel {
  channel_number id = 0;
  schema_number schema = 0;
  std::string topic{};
  std::string encoding{}; // "json"
  text_map metadata{};
  friend bool operator==(const channel&, const channel&) = default;
};

struct message {
  channel_number channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t logged_ns = 0;    // when it was recorded
  std::uint64_t published_ns = 0; // as `logged_ns` if that is not known
  std::string_view data{};
};

// The times of what is in a chunk, or in a file; none: `latest` is less than `earliest`.
struct time_span {
  std::uint64_t earliest_ns = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t latest_ns = 0;
  bool empty() const noexcept { return latest_ns < earliest_ns; }
  void add(std::uint64_t ns) noexcept {
    earliest_ns = ns < earliest_ns ? ns : earliest_ns;
    latest_ns = ns > latest_ns ? ns : latest_ns;
  }
  void add(const time_span& other) noexcept {
    if (other.empty()) return;
    add(other.earliest_ns);
    add(other.latest_ns);
  }
};

// Where a chunk lies, and what is in it. Offsets count from the begin of the file.
struct chunk_index {
  time_span times{};
  std::uint64_t offset = 0; // of the record
  std::uint64_t bytes = 0;  // of the record, with its head
  std::vector<std::pair<channel_number, std::uint64_t>>
      indexes{}; // the offset of each channel's message index
  std::uint64_t indexes_bytes = 0;
  std::string compression{};
  std::uint64_t compressed_bytes = 0;
  std::uint64_t plain_bytes = 0;
};

struct attachment_index {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t logged_ns = 0;
  std::uint64_t created_ns = 0;
  std::uint64_t data_bytes = 0;
  std::string name{};
  std::string media_type{};
};

struct metadata_index {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string name{};
};

struct statistics {
  std::uint64_t messages = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  time_span times{};
  std::map<channel_number, std::uint64_t> messages_of{};
};

// What a file has at its end, for quick access; also what a writer collects for it.
struct summary {
  std::map<schema_number, schema> schemas;
  std::map<channel_number, channel> channels;
  std::vector<chunk_index> chunks; // in the order of the file
  std::vector<attachment_index> attachments;
  std::vector<metadata_index> metadata;
  statistics counts;
};

// ---- limits of what is read

// A chunk whose records are larger is refused: it could take all memory.
inline constexpr std::uint64_t chunk_bytes_max = std::uint64_t{1} << 30;

} // namespace rowe::mcap
