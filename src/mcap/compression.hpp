// SPDX-License-Identifier: Apache-2.0
// The compressions that chunks may have, by Debian's liblz4 (its frame format) and libzstd. Allocates; never
// waits.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <rowe/recording.hpp>

namespace rowe::mcap {

using rowe::compression;

// As files name it: "", "lz4", "zstd".
std::string_view name_of(compression which) noexcept;
std::optional<compression> compression_named(std::string_view name) noexcept;

// Keeps its working memory from chunk to chunk.
class compressor {
 public:
  explicit compressor(compression how);
  ~compressor();
  compressor(const compressor&) = delete;
  compressor& operator=(const compressor&) = delete;

  compression how() const noexcept { return how_; }
  // Appends `plain`, compressed.
  void append(std::string& into, std::string_view plain);

 private:
  struct state;
  compression how_;
  std::unique_ptr<state> state_;
};

class decompressor {
 public:
  decompressor();
  ~decompressor();
  decompressor(const decompressor&) = delete;
  decompressor& operator=(const decompressor&) = delete;

  // Puts what `packed` holds into `into`. False: it is damaged, or does not hold `plain_bytes` bytes. Takes
  // memory as data comes, and no more than that.
  bool unpack(compression how, std::string_view packed, std::uint64_t plain_bytes, std::string& into);

 private:
  struct state;
  std::unique_ptr<state> state_;
};

} // namespace rowe::mcap
