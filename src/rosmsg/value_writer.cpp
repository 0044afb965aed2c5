// SPDX-License-Identifier: Apache-2.0
#include "rosmsg/value_writer.hpp"

#include <array>
#include <limits>

#include "json/reading/base64.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/times.hpp"
#include "json/text/utf8.hpp"

namespace rowe::rosmsg {
namespace {

bool begins_number(char c) noexcept { return c == '-' || json::is_digit(c); }

// Of a character in UTF-8.
std::uint32_t code_point(std::string_view utf8) noexcept {
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<std::uint8_t>(utf8[i])}; };
  if (utf8.size() == 1) return byte(0);
  std::uint32_t code = byte(0) & (0x7fU >> utf8.size());
  for (std::size_t i = 1; i < utf8.size(); ++i) code = code << 6 | (byte(i) & 0x3f);
  return code;
}

} // namespace

[[gnu::cold]] bool value_writer::too_big() {
  const auto limit = static_cast<std::int64_t>(wire_.to().limit());
  return why_.set({errc::too_big, limit + 1, limit}, "is longer than " + std::to_string(limit) + " bytes");
}

bool value_writer::value(const member& m, const char*& at) {
  switch (m.what) {
  case kind::boolean: return boolean(m, at);
  case kind::int8: return whole<std::int8_t>(m, at);
  case kind::uint8: return whole<std::uint8_t>(m, at);
  case kind::int16: return whole<std::int16_t>(m, at);
  case kind::uint16: return whole<std::uint16_t>(m, at);
  case kind::int32: return whole<std::int32_t>(m, at);
  case kind::uint32: return whole<std::uint32_t>(m, at);
  case kind::int64: return whole<std::int64_t>(m, at);
  case kind::uint64: return whole<std::uint64_t>(m, at);
  case kind::float32: return real<float>(m, at);
  case kind::float64: return real<double>(m, at);
  case kind::text: return text(m, at);
  case kind::wide_text: return wire_.is_cdr() ? wide_text(m, at) : text(m, at);
  case kind::time:
  case kind::duration: return time(m, at);
  case kind::object: break;
  }
  return wrong(errc::misuse, m, at);
}

bool value_writer::zero(const member& m, std::uint32_t count) {
  const bool is_time = m.what == kind::time || m.what == kind::duration;
  if (m.what != kind::text && m.what != kind::wide_text) {
    const std::size_t each = bytes_of(m.what);
    return fits(wire_.align(is_time ? 4 : each) && wire_.to().zeros(each * count));
  }
  const bool has_terminator = wire_.is_cdr() && m.what == kind::text;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!fits(wire_.put(std::uint32_t{has_terminator}) && (!has_terminator || wire_.to().append('\0'))))
      return false;
  }
  return true;
}

bool value_writer::boolean(const member& m, const char*& at) {
  const bool is_true = *at == 't';
  if (!is_true && *at != 'f') return wrong(errc::wrong_type, m, at);
  at = behind(at, is_true ? 4 : 5);
  return fits(wire_.put(std::uint8_t{is_true}));
}

template <class T>
bool value_writer::whole(const member& m, const char*& at) {
  if (!begins_number(*at)) return wrong(errc::wrong_type, m, at);
  const json::decimal d = json::read_decimal(at, end_);
  const json::whole_number n = json::to_whole(d);
  if (n.what == json::whole_number::form::fraction) return wrong(errc::wrong_type, m, at);
  constexpr auto most = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
  const std::uint64_t limit = !n.negative ? most : std::is_signed_v<T> ? most + 1 : 0;
  if (n.what == json::whole_number::form::too_large || n.magnitude > limit)
    return wrong(errc::out_of_range, m, at);
  at = d.end;
  return fits(wire_.put(static_cast<T>(n.negative ? 0 - n.magnitude : n.magnitude)));
}

template <class T>
bool value_writer::real(const member& m, const char*& at) {
  T x = std::numeric_limits<T>::quiet_NaN();
  if (*at == 'n') {
    at = behind(at, 4);
  } else if (!begins_number(*at)) {
    return wrong(errc::wrong_type, m, at);
  } else {
    const json::decimal d = json::read_decimal(at, end_);
    if (!json::to_real(d, x)) {
      if (!is_default_) return wrong(errc::out_of_range, m, at);
      x = d.negative ? -std::numeric_limits<T>::infinity() : std::numeric_limits<T>::infinity();
    }
    at = d.end;
  }
  return fits(wire_.put(x));
}

// The text between the quotes, with its escapes.
bool value_writer::take_string(const member& m, const char*& at, std::string_view& into) {
  if (*at != '"') return wrong(errc::wrong_type, m, at);
  const char* const quote = json::find_quote(at + 1, end_);
  into = json::between(at + 1, quote);
  at = behind(quote, 1);
  return true;
}

bool value_writer::text(const member& m, const char*& at) {
  std::string_view escaped;
  if (!take_string(m, at, escaped)) return false;
  const bool is_plain = escaped.find('\\') == escaped.npos;
  const std::size_t bytes = is_plain ? escaped.size() : json::unescaped_bytes(escaped);
  if (bytes > std::min(m.text_max, unbounded - 1)) return too_long(wanted_one(m), bytes, m.text_max);
  const std::size_t terminator = wire_.is_cdr() ? 1 : 0;
  if (!fits(wire_.put(static_cast<std::uint32_t>(bytes + terminator)))) return false;
  char* const to = wire_.to().room(bytes + terminator);
  if (!fits(to != nullptr)) return false;
  if (is_plain) {
    escaped.copy(to, bytes);
  } else {
    (void)json::unescape(escaped, {to, bytes}); // fits: so many bytes were counted
  }
  if (terminator != 0) to[bytes] = '\0';
  wire_.to().advance_to(to + bytes + terminator);
  return true;
}

bool value_writer::wide_text(const member& m, const char*& at) {
  std::string_view escaped;
  std::size_t count_at = 0;
  if (!take_string(m, at, escaped) || !fits(wire_.begin_count(count_at))) return false;
  std::size_t units = 0;
  const char* from = escaped.data();
  for (const char* const last = from + escaped.size(); from != last;) {
    std::array<char, 4> character;
    std::size_t bytes = 0;
    if (*from == '\\') {
      bytes = json::take_escape(from, last, character);
    } else {
      bytes = json::next_utf8(from, last).bytes;
      from = std::copy_n(from, bytes, character.begin()) - character.begin() + from;
    }
    const std::uint32_t code = code_point({character.data(), bytes});
    const std::uint32_t beyond = code - 0x10000;
    const bool is_pair = code > 0xffff;
    units += is_pair ? 2 : 1;
    if (!fits(is_pair ? wire_.put(static_cast<std::uint16_t>(0xd800 + (beyond >> 10))) &&
                            wire_.put(static_cast<std::uint16_t>(0xdc00 + (beyond & 0x3ff)))
                      : wire_.put(static_cast<std::uint16_t>(code))))
      return false;
  }
  if (units > m.text_max) return too_long(wanted_one(m), units, m.text_max);
  wire_.set_count(count_at, static_cast<std::uint32_t>(units));
  return true;
}

bool value_writer::base64(const member& m, const char*& at) {
  const char* const quote = json::find_quote(at + 1, end_);
  const json::base64_text text{json::between(at + 1, quote)};
  const auto bytes = text.bytes();
  if (!bytes) return wrong(errc::wrong_type, wanted_array(m), at);
  if (*bytes > m.count || (m.many == form::fixed && *bytes != m.count))
    return too_long(wanted_array(m), *bytes, m.count);
  if (m.many == form::sequence && !fits(wire_.put(static_cast<std::uint32_t>(*bytes)))) return false;
  char* const to = wire_.to().room(*bytes);
  if (!fits(to != nullptr)) return false;
  if (!text.read(to)) return wrong(errc::wrong_type, wanted_array(m), at);
  wire_.to().advance_to(to + *bytes);
  at = behind(quote, 1);
  return true;
}

// With ROS 1's names or those of ROS 2.
bool value_writer::time(const member& m, const char*& at) {
  if (*at != '{') return wrong(errc::wrong_type, m, at);
  std::array<const char*, 2> places{};
  at = json::skip_space(at + 1, end_);
  for (bool more = at != end_ && *at == '"'; more; more = next(at)) {
    std::array<char, 16> scratch;
    const auto name = json::unescape(take_name(at), scratch);
    if (at == end_) break;
    const std::string_view unit = name ? json::sec_or_nsec(*name) : std::string_view{};
    if (!unit.empty()) {
      const char*& place = places[unit == "sec" ? 0 : 1];
      if (place != nullptr) return twice(*name);
      place = at;
    }
    at = json::skip_value(at, end_);
  }
  at = behind(at, 1);
  if (version_ == ros_version::ros2)
    return part_of_time("sec", kind::int32, places[0]) && part_of_time("nanosec", kind::uint32, places[1]);
  const kind part = m.what == kind::time ? kind::uint32 : kind::int32;
  return part_of_time("secs", part, places[0]) && part_of_time("nsecs", part, places[1]);
}

bool value_writer::part_of_time(std::string_view name, kind what, const char* at) {
  member part;
  part.what = what;
  return (at == nullptr ? zero(part, 1) : value(part, at)) || why_.in(name);
}

} // namespace rowe::rosmsg
