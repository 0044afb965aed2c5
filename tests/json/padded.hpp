// SPDX-License-Identifier: Apache-2.0
// A text with the room behind it that a reader needs.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "json/reading/reader.hpp"

namespace rowe::tests {

class padded {
 public:
  // The bytes behind the text are quotes: the least welcome thing for a parser to take for its input.
  explicit padded(std::string_view text) : bytes_{text.size()}, store_{text} {
    store_.append(json::reader::tailroom_bytes, '"');
  }
  std::string_view text() const { return std::string_view{store_}.substr(0, bytes_); }
  std::span<char> bytes() { return std::span{store_}.first(bytes_); }

 private:
  std::size_t bytes_;
  std::string store_;
};

} // namespace rowe::tests
