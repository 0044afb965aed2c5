// SPDX-License-Identifier: Apache-2.0
// Reads records from bytes that anybody may have written: nothing is read beyond their end, and what is too
// short says so. Texts refer to the bytes that are read.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "mcap/format.hpp"

namespace rowe::mcap {

// The fields of one record, one after the other. After the first that is not whole, all are empty.
class field_reader {
 public:
  explicit field_reader(std::string_view record) noexcept : rest_{record} {}

  bool whole() const noexcept { return whole_; }
  std::string_view rest() const noexcept { return rest_; }

  template <std::unsigned_integral T>
  T number() noexcept {
    const std::string_view from = bytes(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < from.size(); ++i)
      value = static_cast<T>(value |
                             static_cast<T>(static_cast<T>(static_cast<unsigned char>(from[i])) << (8 * i)));
    return value;
  }
  std::string_view bytes(std::uint64_t count) noexcept {
    whole_ = whole_ && count <= rest_.size();
    if (!whole_) return rest_ = {};
    const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(count));
    rest_.remove_prefix(taken.size());
    return taken;
  }
  std::string_view text() noexcept { return bytes(number<std::uint32_t>()); }
  // `read_one(entries)` takes one entry of a list or a map.
  template <class Read>
  void list(Read&& read_one) {
    field_reader entries{text()};
    while (entries.whole() && !entries.rest().empty()) read_one(entries);
    whole_ = whole_ && entries.whole();
  }
  time_span times() noexcept {
    time_span read;
    read.earliest_ns = number<std::uint64_t>();
    read.latest_ns = number<std::uint64_t>();
    return read;
  }

 private:
  std::string_view rest_;
  bool whole_ = true;
};

struct record {
  opcode what{};
  std::string_view content;
};
// The record at the begin of `from`, which is cut off there; none: it is not whole.
std::optional<record> next_record(std::string_view& from) noexcept;

struct header {
  std::string profile;
  std::string program;
};
struct footer {
  std::uint64_t summary_at = 0; // 0: there is none
  std::uint64_t offsets_at = 0;
  std::uint32_t check_sum = 0; // 0: none
};
// A chunk, without what is in it.
struct chunk_head {
  time_span times;
  std::uint64_t plain_bytes = 0;
  std::uint32_t plain_check_sum = 0; // 0: none
  std::string_view compression;
  std::uint64_t packed_bytes = 0;
};
inline constexpr std::size_t chunk_head_bytes_min = 8 + 8 + 8 + 4 + 4 + 8;

// Of the content of a record of this kind; none: it is too short, or says what cannot be.
std::optional<header> read_header(std::string_view content);
std::optional<footer> read_footer(std::string_view content) noexcept;
std::optional<schema> read_schema(std::string_view content);
std::optional<channel> read_channel(std::string_view content);
std::optional<message> read_message(std::string_view content) noexcept;
std::optional<chunk_index> read_chunk_index(std::string_view content);
std::optional<attachment_index> read_attachment_index(std::string_view content);
std::optional<metadata_index> read_metadata_index(std::string_view content);
std::optional<statistics> read_statistics(std::string_view content);
std::optional<std::pair<std::string, text_map>> read_metadata(std::string_view content);
// `content` begins with the head, and need not have more. `into.packed_bytes` may be more than there are.
// Also how long the head is.
std::optional<std::pair<chunk_head, std::size_t>> read_chunk_head(std::string_view content) noexcept;

} // namespace rowe::mcap
