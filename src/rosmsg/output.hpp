// SPDX-License-Identifier: Apache-2.0
// Bytes that are written into a caller's string, which keeps its capacity. It is not emptied before: what it
// had is written over, so that only what is longer than the last message must be filled with zeros first.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace rowe::rosmsg {

class output {
 public:
  static constexpr std::size_t slack_bytes = 64; // may be written beyond the limit, before that is seen

  output(std::string& into, std::size_t bytes_max) noexcept
      : into_{into}, limit_{std::min(bytes_max, into.max_size() / 4)} {
    begin_ = at_ = into.data();
    end_ = begin_ + into.size();
  }

  std::size_t bytes() const noexcept { return static_cast<std::size_t>(at_ - begin_); }
  std::size_t limit() const noexcept { return limit_; }
  std::size_t left() const noexcept { return limit_ - std::min(limit_, bytes()); }

  // Where so many bytes may be written, a few of which may not be used; null: they are beyond the limit.
  char* room(std::size_t count) {
    if (static_cast<std::size_t>(end_ - at_) < count && !grow(count)) return nullptr;
    return at_;
  }
  void advance_to(char* end) noexcept { at_ = end; }

  bool append(std::string_view text) {
    char* const to = room(text.size());
    if (to == nullptr) return false;
    text.copy(to, text.size());
    at_ += text.size();
    return true;
  }
  bool append(char c) {
    char* const to = room(1);
    if (to == nullptr) return false;
    *to = c;
    ++at_;
    return true;
  }
  bool zeros(std::size_t count) {
    char* const to = room(count);
    if (to == nullptr) return false;
    if (count != 0) std::memset(to, 0, count);
    at_ += count;
    return true;
  }
  // What was written before.
  char* written(std::size_t index) noexcept { return begin_ + index; }

  // The string is what was written. False: it is longer than the limit.
  bool finish() {
    const bool fits = bytes() <= limit_;
    into_.resize(fits ? bytes() : 0);
    return fits;
  }

 private:
  bool grow(std::size_t count) {
    const std::size_t used = bytes();
    if (used > limit_ || count > limit_ + slack_bytes - used) return false;
    const std::size_t more = std::max<std::size_t>(4096, used / 2);
    const std::size_t most = used + count <= into_.capacity() ? into_.capacity() : SIZE_MAX;
    into_.resize(std::min({used + count + more, limit_ + slack_bytes, most}));
    begin_ = into_.data();
    at_ = begin_ + used;
    end_ = begin_ + into_.size();
    return true;
  }

  std::string& into_;
  const std::size_t limit_;
  char* begin_;
  char* at_;
  char* end_;
};

} // namespace rowe::rosmsg
