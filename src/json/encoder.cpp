// SPDX-License-Identifier: Apache-2.0
// The interpreter of the program that a schema was flattened into. It runs once for each message and dialect,
// on the service thread, and most of its time should go into the digits of doubles. So literals are copied in
// chunks of fixed size, room is looked at once for each piece, and nothing is called but what writes a
// number.
#include "encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "digits.hpp"
#include "encoder_program.hpp"

namespace rowe::json {
namespace {

template <class T>
T load(const char* at) noexcept {
  T x;
  std::memcpy(&x, at, sizeof x);
  return x;
}

char* write_text(char* at, std::string_view text) noexcept { return std::copy(text.begin(), text.end(), at); }

} // namespace

class encoder::run {
 public:
  run(const encoder& program, writer& into) noexcept
      : literals_{program.literals_.get()}, into_{into}, at_{into.at_}, end_{into.end_} {}

  // Runs the steps from `first` to `last` on the object at `base`. False when the room is used up.
  bool steps(const step* first, const step* last, const char* base) noexcept {
    for (const step* s = first; s != last; s += 1 + s->body) {
      if (!literal(*s)) return false;
      const char* const at = base + s->offset;
      bool fits = true;
      switch (s->what) {
      case operation::nothing: break;
      case operation::text: fits = text(s->text_of(base + s->argument)); break;
      case operation::scalars: fits = scalars(*s, at, count(*s, base)); break;
      case operation::repeat: fits = repeat(*s, at, count(*s, base)); break;
      case operation::perhaps: fits = perhaps(*s, base); break;
      default: fits = scalar(*s, s->what, at); break;
      }
      if (!fits) return false;
    }
    return true;
  }

  void finish() noexcept { into_.at_ = at_; }

 private:
  std::size_t room() const noexcept { return static_cast<std::size_t>(end_ - at_); }

  bool copy(std::string_view text) noexcept {
    if (text.size() > room()) return false;
    at_ = write_text(at_, text);
    return true;
  }

  bool literal(const step& s) noexcept {
    // No value ends in an opening brace: after one, this is the first member that is written.
    if (s.comma_if_needed && at_[-1] != '{' && !copy(",")) return false;
    const char* const from = literals_ + s.literal;
    if (room() < s.literal_bytes + literal_chunk_bytes) return copy({from, s.literal_bytes});
    for (std::size_t i = 0; i < s.literal_bytes; i += literal_chunk_bytes) {
      std::memcpy(at_ + i, from + i, literal_chunk_bytes);
    }
    at_ += s.literal_bytes;
    return true;
  }

  static std::size_t count(const step& s, const char* base) noexcept {
    return s.count_of == nullptr ? s.count : std::min<std::size_t>(s.count_of(base + s.argument), s.count);
  }

  bool scalars(const step& s, const char* at, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i, at += s.stride) {
      if (i != 0 && !copy(",")) return false;
      if (!scalar(s, s.element, at)) return false;
    }
    return true;
  }

  bool repeat(const step& s, const char* at, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i, at += s.stride) {
      if (i != 0 && !copy(",")) return false;
      if (!steps(&s + 1, &s + 1 + s.body, at)) return false;
    }
    return true;
  }

  bool perhaps(const step& s, const char* base) noexcept {
    const void* const inside = s.engaged(base + s.argument);
    if (inside == nullptr) return !s.else_null || copy("null");
    return steps(&s + 1, &s + 1 + s.body, static_cast<const char*>(inside));
  }

  // Strings are the writer's business.
  bool text(std::string_view utf8) noexcept {
    into_.at_ = at_;
    into_.quoted(utf8);
    at_ = into_.at_;
    return !into_.overflowed_;
  }

  // As in the writer: in place where the room is ample, else beside it and copied.
  bool scalar(const step& s, operation what, const char* from) noexcept {
    constexpr std::size_t room_wanted = number_room_bytes + 2; // with quotes
    if (room() >= room_wanted) [[likely]] {
      at_ = write_scalar(at_, s, what, from);
      return true;
    }
    char scratch[room_wanted];
    return copy({scratch, static_cast<std::size_t>(write_scalar(scratch, s, what, from) - scratch)});
  }

  char* write_scalar(char* at, const step& s, operation what, const char* from) noexcept {
    switch (what) {
    case operation::float64: return write_real(at, s, load<double>(from));
    case operation::float32: return write_real(at, s, load<float>(from));
    case operation::boolean: return write_text(at, load<std::uint8_t>(from) != 0 ? "true" : "false");
    default: break;
    }
    if (!s.as_string) return write_integer(at, what, from);
    *at++ = '"';
    at = write_integer(at, what, from);
    *at++ = '"';
    return at;
  }

  template <class Real>
  char* write_real(char* at, const step& s, Real x) noexcept {
    if (!std::isfinite(x)) {
      ++into_.nonfinite_;
      return write_text(at, "null");
    }
    if (s.decimals >= 0) return write_fixed(at, static_cast<double>(x), s.decimals);
    if constexpr (sizeof x == sizeof(double)) {
      return write_double(at, x);
    } else {
      return write_float(at, x);
    }
  }

  static char* write_integer(char* at, operation what, const char* from) noexcept {
    switch (what) {
    case operation::int8: return write_signed(at, load<std::int8_t>(from));
    case operation::int16: return write_signed(at, load<std::int16_t>(from));
    case operation::int32: return write_signed(at, load<std::int32_t>(from));
    case operation::int64: return write_signed(at, load<std::int64_t>(from));
    case operation::uint8: return write_unsigned(at, load<std::uint8_t>(from));
    case operation::uint16: return write_unsigned(at, load<std::uint16_t>(from));
    case operation::uint32: return write_unsigned(at, load<std::uint32_t>(from));
    default: return write_unsigned(at, load<std::uint64_t>(from));
    }
  }

  const char* const literals_;
  writer& into_;
  char* at_;
  char* const end_;
};

encoder::encoder() noexcept = default;
encoder::encoder(encoder&&) noexcept = default;
encoder& encoder::operator=(encoder&&) noexcept = default;
encoder::~encoder() = default;

void encoder::encode(const void* object, writer& into) const noexcept {
  into.place_comma();
  run r{*this, into};
  const step* const first = program_.get();
  if (!into.overflowed_ && r.steps(first, first + step_count_, static_cast<const char*>(object))) {
    r.finish();
  } else {
    into.overflow();
  }
  into.comma_ = true;
}

} // namespace rowe::json
