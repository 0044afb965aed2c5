// SPDX-License-Identifier: Apache-2.0
// A recording in memory, and one to try things with.
#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mcap/reader.hpp"
#include "mcap/writer.hpp"

namespace memory_file {

namespace mcap = rowe::mcap;

struct file final : mcap::sink, mcap::source {
  std::string bytes_written;
  std::uint64_t room = UINT64_MAX; // after that nothing is taken
  std::vector<std::uint64_t> ends; // of each write

  bool write(std::string_view bytes) override {
    const std::size_t fits = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), room));
    bytes_written.append(bytes.substr(0, fits));
    room -= fits;
    ends.push_back(bytes_written.size());
    return fits == bytes.size();
  }
  std::uint64_t bytes() const override { return bytes_written.size(); }
  bool read(std::uint64_t at, std::span<char> into) override {
    if (at > bytes_written.size() || into.size() > bytes_written.size() - at) return false;
    std::memcpy(into.data(), bytes_written.data() + at, into.size());
    return true;
  }
};

struct heard {
  std::uint16_t channel;
  std::uint64_t logged_ns;
  std::string data;
  friend bool operator==(const heard&, const heard&) = default;
};

inline std::vector<heard> all_of(mcap::reader& from) {
  std::vector<heard> all;
  while (const mcap::message* one = from.next())
    all.push_back({one->channel, one->logged_ns, std::string{one->data}});
  return all;
}
inline std::vector<heard> all_of(file& from) {
  mcap::reader reads{from};
  return reads.open() ? all_of(reads) : std::vector<heard>{};
}

// Messages 0 to `count`, in turn on two channels, one each millisecond; `chunks` of ten.
inline std::string body(std::uint64_t n) {
  return R"({"n":)" + std::to_string(n) + R"(,"text":"some of this is said again and again"})";
}
inline void fill(mcap::writer& into, std::uint64_t count, std::uint64_t first = 0) {
  const auto schema = into.add_schema("test/Number", "jsonschema", R"({"type":"object"})");
  const auto odd = into.add_channel(*schema, "/odd", "json");
  const auto even = into.add_channel(*schema, "/even", "json", {{"latched", "true"}});
  for (std::uint64_t n = first; n < first + count; ++n) {
    const std::string text = body(n);
    into.add({.channel = n % 2 == 1 ? *odd : *even,
              .sequence = static_cast<std::uint32_t>(n),
              .logged_ns = n * 1'000'000,
              .published_ns = n * 1'000'000,
              .data = text});
    if (n % 10 == 9) into.end_chunk();
  }
}
inline std::vector<heard> expected(std::uint64_t count) {
  std::vector<heard> all;
  for (std::uint64_t n = 0; n < count; ++n)
    all.push_back({static_cast<std::uint16_t>(n % 2 == 1 ? 1 : 2), n * 1'000'000, body(n)});
  return all;
}

inline file recording(std::uint64_t count, mcap::compression how = mcap::compression::zstd,
                      bool ends = true) {
  file made;
  mcap::writer into{made, {.how = how, .program = "rowe"}};
  fill(into, count);
  into.add_metadata("robot", {{"name", "crawler"}});
  if (ends) into.end();
  return made;
}

} // namespace memory_file
