// SPDX-License-Identifier: Apache-2.0
// The interpreter of a flattened schema. It runs once for each message and codec, on the service thread, and
// should spend most of its time on the digits of doubles. So literals are copied in chunks of fixed size, the
// space is checked once for each piece, and only functions that write a number are called.
#pragma once
#include <algorithm>
#include <string_view>

#include "json/reading/base64.hpp"
#include "json/structs/encoder_program.hpp"
#include "json/structs/stored.hpp"
#include "json/structs/times.hpp"
#include "json/text/digits.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {

// Each function is passed the address to write to and returns the next one, so it stays in a register. Null
// says that the space is used up.
class encoder::run {
 public:
  run(const encoder& program, writer& into) noexcept
      : names_{program.names_.get()}, literals_{program.literals_.get()}, into_{into}, end_{into.end_} {}

  // Runs the steps from `first` to `last` on the object at `base`.
  char* steps(const step* first, const step* last, const char* base, char* at) noexcept {
    const step* s = first;
    while (s != last) {
      if (s->doubles > 0 && left(at) >= s->ample_bytes) [[likely]] {
        // The most frequent values, and most of the time. So there are few instructions around the digits.
        const step* const end = std::min(s + s->doubles, last);
        do {
          at = copy_literal(*s, at);
          at = or_null(at, write_double(at, load<double>(base + s->offset)));
        } while (++s != end);
        continue;
      }
      at = literal(*s, at);
      if (at != nullptr) at = value(*s, base, at);
      if (at == nullptr) return nullptr;
      s += 1 + s->body;
    }
    return at;
  }

  // Of an array with as many elements as it has now.
  static std::size_t count(const step& s, const char* base) noexcept {
    return s.count_of == nullptr ? s.count : std::min<std::size_t>(s.count_of(base + s.argument), s.count);
  }

  // A value without a name is written as its number.
  char* named(const step& s, const char* base, char* at) noexcept {
    const char* const from = base + s.offset;
    const std::string_view found = name_of(s, from);
    return found.empty() ? scalar(s, s.plain, from, at) : copy(found, at);
  }

  // As in the writer: in place if there is enough space, else in a buffer, and copied.
  char* scalar(const step& s, operation what, const char* from, char* at) noexcept {
    if (left(at) >= scalar_buffer_bytes) [[likely]]
      return write_scalar(at, s, what, from);
    char scratch[scalar_buffer_bytes];
    return copy({scratch, static_cast<std::size_t>(write_scalar(scratch, s, what, from) - scratch)}, at);
  }

  // The name of an enum's value, in quotes; empty: it has none.
  std::string_view name_of(const step& s, const char* from) const noexcept {
    const std::int64_t value = load_integer(from, static_cast<value_kind>(s.plain));
    const name* const end = names_ + s.argument + s.count;
    const name* const found = std::lower_bound(names_ + s.argument, end, value,
                                               [](const name& one, std::int64_t v) { return one.value < v; });
    if (found == end || found->value != value) return {};
    return {literals_ + found->literal, found->literal_bytes};
  }

 private:
  static char* write_plain(char* at, std::string_view text) noexcept {
    return std::copy(text.begin(), text.end(), at);
  }
  std::size_t left(const char* at) const noexcept { return static_cast<std::size_t>(end_ - at); }

  char* copy(std::string_view text, char* at) const noexcept {
    return text.size() <= left(at) ? write_plain(at, text) : nullptr;
  }

  char* literal(const step& s, char* at) const noexcept {
    if (left(at) >= s.literal_bytes + literal_chunk_bytes) [[likely]]
      return copy_literal(s, at);
    return copy({literals_ + s.literal, s.literal_bytes}, at);
  }

  char* copy_literal(const step& s, char* at) const noexcept {
    return copy_chunks(literals_ + s.literal, s.literal_bytes, at);
  }

  char* value(const step& s, const char* base, char* at) noexcept {
    switch (s.what) {
    case operation::nothing: return at;
    case operation::comma: return at[-1] == '{' ? at : copy(",", at); // no value ends in an opening brace
    case operation::text: return text(s.text_of(base + s.argument), at);
    case operation::c_text: return text(c_text(base + s.argument, s.count), at);
    case operation::named: return named(s, base, at);
    case operation::scalars: return array(s, base, at);
    case operation::base64: return base64(s, base, at);
    case operation::repeat: return repeat(s, base, at);
    case operation::perhaps: return perhaps(s, base, at);
    default: return scalar(s, s.what, base + s.offset, at);
    }
  }

  char* array(const step& s, const char* base, char* at) noexcept {
    return scalars(s, base + s.offset, count(s, base), at);
  }

  char* base64(const step& s, const char* base, char* at) const noexcept {
    const std::size_t n = count(s, base);
    return base64_text_bytes(n) <= left(at) ? write_base64(at, base + s.offset, n) : nullptr;
  }

  char* scalars(const step& s, const char* from, std::size_t n, char* at) noexcept {
    if (left(at) / (scalar_buffer_bytes + 1) >= n) [[likely]] {
      if (s.element == operation::float64) return reals<double>(from, n, at);
      if (s.element == operation::float32) return reals<float>(from, n, at);
    }
    for (std::size_t i = 0; i < n && at != nullptr; ++i, from += s.stride) {
      if (i != 0) at = copy(",", at);
      if (at != nullptr) at = scalar(s, s.element, from, at);
    }
    return at;
  }

  // For covariances and laser scans; there must be space for any numbers.
  template <class Real>
  char* reals(const char* from, std::size_t n, char* at) noexcept {
    for (std::size_t i = 0; i < n; ++i, from += sizeof(Real)) {
      *at = ',';
      at += i != 0;
      at = or_null(at, write(at, load<Real>(from)));
    }
    return at;
  }
  static char* write(char* at, double x) noexcept { return write_double(at, x); }
  static char* write(char* at, float x) noexcept { return write_float(at, x); }

  char* repeat(const step& s, const char* base, char* at) noexcept {
    const char* from = base + s.offset;
    for (std::size_t i = 0, n = count(s, base); i < n && at != nullptr; ++i, from += s.stride) {
      if (i != 0) at = copy(",", at);
      if (at != nullptr) at = steps(&s + 1, &s + 1 + s.body, from, at);
    }
    return at;
  }

  char* perhaps(const step& s, const char* base, char* at) noexcept {
    const void* const inside = s.engaged(base + s.argument);
    if (inside == nullptr) return s.else_null ? copy("null", at) : at;
    return steps(&s + 1, &s + 1 + s.body, static_cast<const char*>(inside), at);
  }

  // The writer writes strings.
  char* text(std::string_view utf8, char* at) noexcept {
    into_.at_ = at;
    into_.quoted(utf8);
    return into_.overflowed_ ? nullptr : into_.at_;
  }

  char* write_scalar(char* at, const step& s, operation what, const char* from) noexcept {
    switch (what) {
    case operation::boolean: return write_plain(at, load<std::uint8_t>(from) != 0 ? "true" : "false");
    case operation::int8: return write_signed(at, load<std::int8_t>(from));
    case operation::int16: return write_signed(at, load<std::int16_t>(from));
    case operation::int32: return write_signed(at, load<std::int32_t>(from));
    case operation::int64: return write_signed(at, load<std::int64_t>(from));
    case operation::uint8: return write_unsigned(at, load<std::uint8_t>(from));
    case operation::uint16: return write_unsigned(at, load<std::uint16_t>(from));
    case operation::uint32: return write_unsigned(at, load<std::uint32_t>(from));
    case operation::uint64: return write_unsigned(at, load<std::uint64_t>(from));
    case operation::float32: return or_null(at, write_float(at, load<float>(from)));
    case operation::float64: return or_null(at, write_double(at, load<double>(from)));
    case operation::rounded_float32:
      return or_null(at, write_fixed(at, static_cast<double>(load<float>(from)), s.decimals));
    case operation::rounded_float64: return or_null(at, write_fixed(at, load<double>(from), s.decimals));
    default: break;
    }
    if (what == operation::seconds)
      return write_seconds(at, load_integer(from, static_cast<value_kind>(s.plain)),
                           s.plain != operation::uint64, s.decimals);
    if (what == operation::sec_nsec)
      return write_sec_nsec(at, load_integer(from, static_cast<value_kind>(s.plain)),
                            s.plain != operation::uint64, s.decimals);
    // An integer as a string.
    *at++ = '"';
    at = write_scalar(at, s, s.plain, from);
    *at++ = '"';
    return at;
  }

  // `end` is the end of a number's text, or null if JSON has no text for it.
  char* or_null(char* at, char* end) noexcept {
    if (end != nullptr) [[likely]]
      return end;
    ++into_.nonfinite_;
    return write_plain(at, "null");
  }

  const name* const names_;
  const char* const literals_;
  writer& into_;
  char* const end_;
};

} // namespace rowe::json
