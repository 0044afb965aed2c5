// SPDX-License-Identifier: Apache-2.0
// The interpreter of a program for CBOR or ROS 1. It is that of JSON (encoder.cpp) without digits: numbers
// are copied, most arrays in one piece. The space is checked once for each step.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "json/reading/numbers.hpp"
#include "json/structs/binary.hpp"
#include "json/structs/encoder.hpp"
#include "json/structs/stored.hpp"
#include "json/text/digits.hpp"
#include "json/writing/writer.hpp"

namespace rowe::json {

template <encoding Into>
class encoder::binary_run {
 public:
  binary_run(const encoder& program, char* end) noexcept
      : names_{program.names_.get()}, literals_{program.literals_.get()}, end_{end} {}

  // Returns the next address, or null if the space is used up.
  char* steps(const step* first, const step* last, const char* base, char* at) noexcept {
    for (const step* s = first; s != last; s += 1 + s->body) {
      if (left(at) >= s->literal_bytes + literal_chunk_bytes + scalar_bytes) [[likely]] {
        at = copy_literal(*s, at);
        if (is_scalar(s->what)) {
          at = scalar(*s, s->what, base + s->offset, at);
          continue;
        }
      } else if (at = copy({literals_ + s->literal, s->literal_bytes}, at); at == nullptr) {
        return nullptr;
      }
      at = value(*s, base, at);
      if (at == nullptr) return nullptr;
    }
    return at;
  }

 private:
  static constexpr std::size_t scalar_bytes = 64; // may be written for one, beyond what it takes

  std::size_t left(const char* at) const noexcept { return static_cast<std::size_t>(end_ - at); }

  char* copy(std::string_view bytes, char* at) const noexcept {
    return bytes.size() <= left(at) ? std::copy(bytes.begin(), bytes.end(), at) : nullptr;
  }

  char* copy_literal(const step& s, char* at) const noexcept {
    return copy_chunks(literals_ + s.literal, s.literal_bytes, at);
  }

  char* value(const step& s, const char* base, char* at) noexcept {
    switch (s.what) {
    case operation::nothing:
    case operation::base64: // of text only
    case operation::comma: return at;
    case operation::text: return text(s.text_of(base + s.argument), at);
    case operation::c_text: return text(c_text(base + s.argument, s.count), at);
    case operation::named: return named(s, base, at);
    case operation::scalars: return scalars(s, base, at);
    case operation::repeat: return repeat(s, base, at);
    case operation::perhaps: return perhaps(s, base, at);
    default: return checked_scalar(s, s.what, base + s.offset, at);
    }
  }

  // How many elements follow, which the literal does not say.
  char* count(const step& s, const char* base, operation element, std::size_t& n, char* at) const noexcept {
    n = s.count;
    if (s.count_of == nullptr) return at;
    n = std::min<std::size_t>(s.count_of(base + s.argument), s.count);
    std::array<char, cbor::array_head_bytes_max> head;
    char* const end =
        Into == encoding::cbor ? write_array_head(head.data(), element, n) : store_length(head.data(), n);
    return copy({head.data(), static_cast<std::size_t>(end - head.data())}, at);
  }

  char* scalars(const step& s, const char* base, char* at) noexcept {
    std::size_t n = 0;
    at = count(s, base, s.element, n, at);
    if (at == nullptr) return nullptr;
    const char* from = base + s.offset;
    if (const std::size_t each = copied_bytes(s.element); each != 0) return copy({from, n * each}, at);
    for (std::size_t i = 0; i < n && at != nullptr; ++i, from += s.stride)
      at = checked_scalar(s, s.element, from, at);
    return at;
  }

  char* repeat(const step& s, const char* base, char* at) noexcept {
    std::size_t n = 0;
    at = count(s, base, operation::nothing, n, at);
    const char* from = base + s.offset;
    for (std::size_t i = 0; i < n && at != nullptr; ++i, from += s.stride)
      at = steps(&s + 1, &s + 1 + s.body, from, at);
    return at;
  }

  char* perhaps(const step& s, const char* base, char* at) noexcept {
    const void* const inside = s.engaged(base + s.argument);
    if (inside == nullptr) return s.else_null ? copy({&cbor::null, 1}, at) : at;
    return steps(&s + 1, &s + 1 + s.body, static_cast<const char*>(inside), at);
  }

  char* text(std::string_view utf8, char* at) const noexcept {
    const std::size_t bytes = utf8_bytes(utf8);
    if (bytes + cbor::head_bytes_max <= left(at)) [[likely]]
      return write_text(Into, at, utf8, bytes);
    // Its head may be shorter.
    std::array<char, cbor::head_bytes_max> head;
    const auto head_bytes = static_cast<std::size_t>(write_text_head(Into, head.data(), bytes) - head.data());
    return bytes + head_bytes <= left(at) ? write_text(Into, at, utf8, bytes) : nullptr;
  }

  char* checked_scalar(const step& s, operation what, const char* from, char* at) noexcept {
    if (left(at) >= scalar_bytes) [[likely]]
      return scalar(s, what, from, at);
    std::array<char, scalar_bytes> buffer;
    char* const end = scalar(s, what, from, buffer.data());
    return copy({buffer.data(), static_cast<std::size_t>(end - buffer.data())}, at);
  }

  static char* scalar(const step& s, operation what, const char* from, char* at) noexcept {
    if constexpr (Into == encoding::ros1) {
      if (const std::size_t bytes = copied_bytes(what); bytes != 0) {
        std::memcpy(at, from, bytes);
        return at + bytes;
      }
    }
    switch (what) {
    case operation::boolean: return boolean(at, load<std::uint8_t>(from) != 0);
    case operation::uint64: return cbor::write_head(at, cbor::major::whole, load<std::uint64_t>(from));
    case operation::float32: return real(at, load<float>(from));
    case operation::float64: return real(at, load<double>(from));
    case operation::rounded_float32:
      return real(at, static_cast<float>(rounded(load<float>(from), s.decimals)));
    case operation::rounded_float64: return real(at, rounded(load<double>(from), s.decimals));
    case operation::seconds: return seconds(s, from, at);
    case operation::in_quotes: return digits(s.plain, from, at);
    default: return cbor::write_signed(at, load_integer(from, static_cast<value_kind>(what)));
    }
  }

  static char* boolean(char* at, bool is) noexcept {
    *at = Into == encoding::cbor ? (is ? cbor::yes : cbor::no) : static_cast<char>(is);
    return at + 1;
  }
  static char* real(char* at, float x) noexcept {
    return Into == encoding::cbor ? cbor::write_float(at, x) : raw(at, x);
  }
  static char* real(char* at, double x) noexcept {
    return Into == encoding::cbor ? cbor::write_double(at, x) : raw(at, x);
  }
  template <class Real>
  static char* raw(char* at, Real x) noexcept {
    std::memcpy(at, &x, sizeof x);
    return at + sizeof x;
  }

  // The number that its JSON says.
  static double number_of(const char* begin, const char* end) noexcept {
    double x = 0;
    (void)to_real(read_decimal(begin, end), x);
    return x;
  }
  static double rounded(double x, int decimals) noexcept {
    std::array<char, number_buffer_bytes> text;
    if (!std::isfinite(x)) return x;
    return number_of(text.data(), write_fixed(text.data(), x, decimals));
  }

  static char* seconds(const step& s, const char* from, char* at) noexcept {
    std::array<char, number_buffer_bytes> text;
    const std::int64_t units = load_integer(from, static_cast<value_kind>(s.plain));
    return real(at, number_of(text.data(),
                              write_seconds(text.data(), units, s.plain != operation::uint64, s.decimals)));
  }

  // An integer as a text.
  static char* digits(operation plain, const char* from, char* at) noexcept {
    std::array<char, number_buffer_bytes> text;
    const std::int64_t x = load_integer(from, static_cast<value_kind>(plain));
    const char* const end = plain == operation::uint64
                                ? write_unsigned(text.data(), static_cast<std::uint64_t>(x))
                                : json::write_signed(text.data(), x);
    const auto bytes = static_cast<std::size_t>(end - text.data());
    return write_text(Into, at, {text.data(), bytes}, bytes);
  }

  // A value without a name is written as its number; in ROS, where the member is a text, as its digits.
  char* named(const step& s, const char* base, char* at) noexcept {
    const char* const from = base + s.offset;
    const std::int64_t value = load_integer(from, static_cast<value_kind>(s.plain));
    const name* const end = names_ + s.argument + s.count;
    const name* const found = std::lower_bound(names_ + s.argument, end, value,
                                               [](const name& one, std::int64_t v) { return one.value < v; });
    if (found != end && found->value == value)
      return copy({literals_ + found->literal, found->literal_bytes}, at);
    std::array<char, scalar_bytes> buffer;
    char* const to = buffer.data();
    char* const behind = Into == encoding::ros1 ? digits(s.plain, from, to) : scalar(s, s.plain, from, to);
    return copy({to, static_cast<std::size_t>(behind - to)}, at);
  }

  const name* const names_;
  const char* const literals_;
  char* const end_;
};

void encoder::encode_binary(const void* object, writer& into) const noexcept {
  if (into.overflowed_) return;
  const step* const first = program_.get();
  const step* const last = first + step_count_;
  const auto* const base = static_cast<const char*>(object);
  char* const at = into_ == encoding::cbor
                       ? binary_run<encoding::cbor>{*this, into.end_}.steps(first, last, base, into.at_)
                       : binary_run<encoding::ros1>{*this, into.end_}.steps(first, last, base, into.at_);
  if (at == nullptr) return into.overflow();
  into.at_ = at;
}

} // namespace rowe::json
