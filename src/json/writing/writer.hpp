// SPDX-License-Identifier: Apache-2.0
// Writes JSON text into the caller's span. The writer never allocates and never writes outside the span: if a
// piece does not fit, nothing more is written, and overflowed() says so. It places commas and escapes
// strings, so callers give only keys and values. They must nest them correctly, because the writer's only
// state is one bit (is a comma due?). The codecs and the core use it on the service thread, and users'
// threads use it to write in place; one writer belongs to one thread at a time.
//
// Every number is exact: doubles and floats are written with the fewest digits that read back to the same
// value (digits.hpp).
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include <rowe/rt/attributes.hpp>

#include "json/text/bytes.hpp"

namespace rowe::json {

// What number() takes as an integer: every integer type but bool and the character types, which are not
// numbers.
template <class T>
concept integer =
    std::integral<T> && !std::same_as<T, bool> && !std::same_as<T, char> && !std::same_as<T, wchar_t> &&
    !std::same_as<T, char8_t> && !std::same_as<T, char16_t> && !std::same_as<T, char32_t> && sizeof(T) <= 8;

// No call waits, allocates or fails; each takes steps in proportion to what it writes.
class writer {
 public:
  // Writes into `buffer`, which must outlive the writer.
  ROWE_RT explicit writer(std::span<char> buffer) noexcept
      : begin_{buffer.data()}, at_{buffer.data()}, end_{buffer.data() + buffer.size()} {}

  ROWE_RT void begin_object() noexcept { open('{'); }
  ROWE_RT void end_object() noexcept { close('}'); }
  ROWE_RT void begin_array() noexcept { open('['); }
  ROWE_RT void end_array() noexcept { close(']'); }
  // Of a member.
  ROWE_RT void begin_object(std::string_view name) noexcept {
    key(name);
    begin_object();
  }
  ROWE_RT void begin_array(std::string_view name) noexcept {
    key(name);
    begin_array();
  }

  // The name of the member whose value is written next; quoted and escaped like a string.
  ROWE_RT [[gnu::always_inline]] void key(std::string_view name) noexcept {
    quoted(name);
    put(':');
    comma_ = false;
  }

  // The same for a name that is escaped already.
  ROWE_RT void key_raw(std::string_view escaped) noexcept {
    place_comma();
    put('"');
    append(escaped);
    append("\":");
    comma_ = false;
  }

  // A string value: quoted, and escaped where JSON demands it ('"', '\\', control characters). Each maximal
  // piece of `utf8` that is not UTF-8 is written as U+FFFD.
  ROWE_RT [[gnu::always_inline]] void string(std::string_view utf8) noexcept {
    quoted(utf8);
    comma_ = true;
  }

  // A number. NaN and the infinities, which JSON does not have, are written as null and counted in
  // nonfinite().
  ROWE_RT void number(double x) noexcept;
  ROWE_RT void number(float x) noexcept;
  template <integer T>
  ROWE_RT void number(T x) noexcept {
    if constexpr (std::is_signed_v<T>) {
      number_signed(x);
    } else {
      number_unsigned(x);
    }
  }

  ROWE_RT void boolean(bool b) noexcept { raw(b ? std::string_view{"true"} : std::string_view{"false"}); }
  ROWE_RT void null() noexcept { raw("null"); }

  // A complete value that is JSON already. It is written unchanged, with the comma before it.
  ROWE_RT void raw(std::string_view json) noexcept {
    place_comma();
    append(json);
    comma_ = true;
  }

  // A member: its name, then its value, which is a string, a number or a boolean.
  template <class Value>
  ROWE_RT [[gnu::always_inline]] void member(std::string_view name, const Value& value) noexcept {
    key(name);
    if constexpr (std::same_as<Value, bool>) {
      boolean(value);
    } else if constexpr (std::convertible_to<const Value&, std::string_view>) {
      string(value);
    } else {
      number(value);
    }
  }
  // A string, or null if that is empty.
  ROWE_RT void member_or_null(std::string_view name, std::string_view text) noexcept {
    key(name);
    text.empty() ? null() : string(text);
  }
  ROWE_RT void member_raw(std::string_view name, std::string_view json) noexcept {
    key(name);
    raw(json);
  }

  // A piece of text that is no value of its own: nothing is placed before it, and it does not count as a
  // value.
  ROWE_RT void append(std::string_view text) noexcept {
    if (text.empty()) return; // an empty view may point nowhere, which memcpy does not take
    if (text.size() > static_cast<std::size_t>(end_ - at_)) return overflow();
    std::memcpy(at_, text.data(), text.size());
    at_ += text.size();
  }

  // For formats that are not JSON: changes a byte that was written, which stands at `index`.
  ROWE_RT void replace(std::size_t index, char byte) noexcept {
    if (!overflowed_) begin_[index] = byte;
  }
  // What is to be written cannot be: as if it did not fit.
  ROWE_RT void fail() noexcept { overflow(); }

  // True once something did not fit. Nothing is written from then on; bytes() and text() are meaningless.
  ROWE_RT bool overflowed() const noexcept { return overflowed_; }

  ROWE_RT std::size_t bytes() const noexcept { return static_cast<std::size_t>(at_ - begin_); }
  ROWE_RT std::string_view text() const noexcept { return {begin_, bytes()}; }

  // NaN and infinities written as null.
  ROWE_RT std::uint64_t nonfinite() const noexcept { return nonfinite_; }

 private:
  friend class encoder;
  friend class encoder_pieces;
  friend class splice;

  static constexpr std::size_t word_bytes = 8;
  static constexpr std::size_t inline_bytes_max = 32; // of a string, for its words to be stored in line

  void open(char bracket) noexcept {
    place_comma();
    put(bracket);
    comma_ = false;
  }
  void close(char bracket) noexcept {
    put(bracket);
    comma_ = true;
  }
  void place_comma() noexcept {
    if (comma_) put(',');
  }
  void put(char c) noexcept {
    if (at_ == end_) return overflow();
    *at_++ = c;
  }
  // The rest of the span is not used any more, so no shorter piece is written behind a gap.
  void overflow() noexcept {
    overflowed_ = true;
    at_ = end_;
  }
  // The compiler usually knows the names. Then it looks for bytes to escape at compile time, and only some
  // words must be stored.
  [[gnu::always_inline]] void quoted(std::string_view utf8) noexcept {
    const std::size_t bytes = utf8.size();
    if (__builtin_constant_p(bytes) && bytes <= inline_bytes_max && has_ample_room(bytes) &&
        quoted_in_words(utf8)) {
      return;
    }
    quoted_at_length(utf8);
  }
  // Whether there is space for a string without escapes, a comma before it, and the rest of the last word.
  bool has_ample_room(std::size_t string_bytes) const noexcept {
    return static_cast<std::size_t>(end_ - at_) >= string_bytes + 3 + word_bytes;
  }
  char* begin_quoted() noexcept {
    const bool comma = comma_;
    char* to = at_;
    *to = ',';
    to += comma;
    *to = '"';
    return to + 1;
  }
  void end_quoted(char* to) noexcept {
    *to = '"';
    at_ = to + 1;
  }
  // False, and nothing written, when something must be escaped.
  [[gnu::always_inline]] bool quoted_in_words(std::string_view utf8) noexcept {
    char* const to = begin_quoted();
    const std::size_t bytes = utf8.size(), whole = bytes / word_bytes * word_bytes;
    for (std::size_t i = 0; i < bytes; i += word_bytes) {
      const std::uint64_t word =
          i < whole ? load_eight(utf8.data() + i) : load_fewer(utf8.data() + i, bytes - i);
      if (special_bytes(word) != 0) return false;
      std::memcpy(to + i, &word, word_bytes);
    }
    end_quoted(to + bytes);
    return true;
  }
  void quoted_at_length(std::string_view utf8) noexcept;
  void escaped(const char* at, const char* end) noexcept;
  template <class Write>
  bool number_with(Write write) noexcept;
  void not_finite() noexcept;
  void number_signed(std::int64_t x) noexcept;
  void number_unsigned(std::uint64_t x) noexcept;

  char* begin_;
  char* at_; // where the next byte goes
  char* end_;
  bool comma_ = false; // a value precedes the next one in the same object or array
  bool overflowed_ = false;
  std::uint64_t nonfinite_ = 0;
};

} // namespace rowe::json
