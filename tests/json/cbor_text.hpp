// SPDX-License-Identifier: Apache-2.0
// A decoder of CBOR that shares no code with what is tested: it reads an item and says it as JSON. Typed
// arrays (RFC 8746) become arrays, byte strings arrays of numbers. Nothing for what is not well-formed.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace rowe::tests {

class cbor_reader {
 public:
  // With `wide`, a float of 32 bits is said with the digits of the double that it is.
  cbor_reader(std::string_view bytes, bool wide) : in_{bytes}, wide_{wide} {}

  // The first item, and the rest.
  std::optional<std::string> item() {
    std::string said;
    if (!read(said, 0)) return std::nullopt;
    return said;
  }
  std::string_view rest() const { return in_; }

 private:
  static constexpr unsigned depth_max = 1100;

  bool take(std::size_t n, std::string_view& into) {
    if (n > in_.size()) return false;
    into = in_.substr(0, n);
    in_.remove_prefix(n);
    return true;
  }
  template <class T>
  static T big(std::string_view bytes) {
    std::uint64_t x = 0;
    for (const char c : bytes) x = x << 8 | static_cast<std::uint8_t>(c);
    return static_cast<T>(x);
  }
  // The number of a head; false as well where it could have been shorter, unless it may be longer.
  bool number(unsigned form, std::uint64_t& n, bool longer = false) {
    std::string_view bytes;
    if (form < 24) return n = form, true;
    if (form > 27 || !take(std::size_t{1} << (form - 24), bytes)) return false;
    n = big<std::uint64_t>(bytes);
    return longer || n >= (form == 24 ? 24 : std::uint64_t{1} << (8 << (form - 25)));
  }
  template <class T>
  static std::string said(T x) {
    std::string text(64, ' ');
    json::writer w{text};
    w.number(x);
    return std::string{w.text()};
  }
  std::string said_float(float x) const { return wide_ ? said(static_cast<double>(x)) : said(x); }

  template <class T>
  bool typed(std::string_view bytes, std::string& into) const {
    if (bytes.size() % sizeof(T) != 0) return false;
    into += '[';
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(T)) {
      T x;
      std::memcpy(&x, bytes.data() + i, sizeof x); // little-endian, as this machine is
      if (i != 0) into += ',';
      into += said(x);
    }
    into += ']';
    return true;
  }
  bool tagged(std::uint64_t tag, std::string& into) {
    if (in_.empty() || static_cast<std::uint8_t>(in_[0]) >> 5 != 2) return false;
    const unsigned form = static_cast<std::uint8_t>(in_[0]) & 31;
    in_.remove_prefix(1);
    std::uint64_t n = 0;
    std::string_view bytes;
    if (!number(form, n) || !take(n, bytes)) return false;
    switch (tag) {
    case 69: return typed<std::uint16_t>(bytes, into);
    case 70: return typed<std::uint32_t>(bytes, into);
    case 71: return typed<std::uint64_t>(bytes, into);
    case 72: return typed<std::int8_t>(bytes, into);
    case 77: return typed<std::int16_t>(bytes, into);
    case 78: return typed<std::int32_t>(bytes, into);
    case 79: return typed<std::int64_t>(bytes, into);
    case 85: return typed<float>(bytes, into);
    case 86: return typed<double>(bytes, into);
    default: return false;
    }
  }
  bool text(std::uint64_t n, std::string& into) {
    std::string_view utf8;
    if (!take(n, utf8)) return false;
    for (const char* at = utf8.data(); at != utf8.data() + utf8.size();) {
      const auto piece = json::next_utf8(at, utf8.data() + utf8.size());
      if (!piece.valid) return false;
      at += piece.bytes;
    }
    std::string quoted(utf8.size() * 6 + 2, ' ');
    json::writer w{quoted};
    w.string(utf8);
    into += w.text();
    return true;
  }
  bool at_end(unsigned form, std::uint64_t n, std::uint64_t i) {
    if (form != 31) return i == n;
    if (in_.empty() || in_[0] != '\xff') return false;
    in_.remove_prefix(1);
    return true;
  }
  bool simple(unsigned form, std::string& into) {
    std::string_view bytes;
    switch (form) {
    case 20: return into += "false", true;
    case 21: return into += "true", true;
    case 22: return into += "null", true;
    case 26:
      if (!take(4, bytes)) return false;
      return into += said_float(std::bit_cast<float>(big<std::uint32_t>(bytes))), true;
    case 27:
      if (!take(8, bytes)) return false;
      return into += said(std::bit_cast<double>(big<std::uint64_t>(bytes))), true;
    default: return false;
    }
  }

  bool read(std::string& into, unsigned depth) {
    if (in_.empty() || depth > depth_max) return false;
    const auto first = static_cast<std::uint8_t>(in_[0]);
    in_.remove_prefix(1);
    const unsigned kind = first >> 5;
    const unsigned form = first & 31;
    if (kind == 7) return simple(form, into);
    std::uint64_t n = 0;
    const bool open = form == 31 && (kind == 4 || kind == 5);
    if (!open && !number(form, n, kind == 2)) return false; // ROS 1: known behind them
    std::string_view bytes;
    switch (kind) {
    case 0: return into += said(n), true;
    case 1:
      if (n == UINT64_MAX) return into += "-18446744073709551616", true;
      return into += "-" + said(n + 1), true;
    case 2: return take(n, bytes) && typed<std::uint8_t>(bytes, into);
    case 3: return text(n, into);
    case 6: return tagged(n, into);
    default: break;
    }
    into += kind == 4 ? '[' : '{';
    for (std::uint64_t i = 0; !at_end(form, n, i); ++i) {
      if (i != 0) into += ',';
      if (kind == 5) {
        if (in_.empty() || static_cast<std::uint8_t>(in_[0]) >> 5 != 3 || !read(into, depth + 1))
          return false;
        into += ':';
      }
      if (!read(into, depth + 1)) return false;
    }
    into += kind == 4 ? ']' : '}';
    return true;
  }

  std::string_view in_;
  const bool wide_;
};

// One whole item.
inline std::optional<std::string> cbor_text(std::string_view bytes, bool wide = true) {
  cbor_reader reader{bytes, wide};
  auto said = reader.item();
  if (!reader.rest().empty()) return std::nullopt;
  return said;
}

} // namespace rowe::tests
