// SPDX-License-Identifier: Apache-2.0
// Bytes that anybody may have written to JSON, in one pass. Each length is compared with what is left before
// anything is done by it. Elements that take no bytes (ROS 1 has messages without members) are counted, as
// the bytes do not bound them.
#include "rosmsg/to_json.hpp"

#include <bit>
#include <cstring>
#include <type_traits>

#include "json/reading/base64.hpp"
#include "json/text/digits.hpp"
#include "json/text/utf8.hpp"
#include "json/writing/writer.hpp"

namespace rowe::rosmsg {
namespace {

constexpr std::size_t head_bytes = 4;        // of a message in CDR
constexpr std::size_t padding_bytes_max = 7; // behind one
constexpr std::size_t empty_objects_max = 4096;

template <class T>
T swapped(T x) noexcept {
  if constexpr (sizeof(T) == 2) return __builtin_bswap16(x);
  if constexpr (sizeof(T) == 4) return __builtin_bswap32(x);
  if constexpr (sizeof(T) == 8) return __builtin_bswap64(x);
  return x;
}

template <std::size_t Bytes>
using word =
    std::conditional_t<Bytes == 1, std::uint8_t,
                       std::conditional_t<Bytes == 2, std::uint16_t,
                                          std::conditional_t<Bytes == 4, std::uint32_t, std::uint64_t>>>;

// How long the text is in JSON, without its quotes.
std::size_t escaped_bytes(std::string_view utf8) noexcept {
  constexpr std::string_view short_escapes = "\"\\\b\f\n\r\t";
  std::size_t bytes = 0;
  for (const char *at = utf8.data(), *const end = at + utf8.size(); at != end;) {
    const json::utf8_piece piece = json::next_utf8(at, end);
    if (!piece.valid) {
      bytes += 3; // U+FFFD
    } else if (piece.bytes == 1 && short_escapes.find(*at) != short_escapes.npos) {
      bytes += 2;
    } else {
      bytes += piece.bytes == 1 && static_cast<std::uint8_t>(*at) < ' ' ? 6 : piece.bytes;
    }
    at += piece.bytes;
  }
  return bytes;
}

template <wire Wire, bool Swap>
class to_json_run {
 public:
  to_json_run(const definition& of, std::string_view bytes, std::string_view body, output& to, failure& why)
      : of_{of},
        whole_{bytes},
        begin_{body.data()},
        at_{begin_},
        end_{begin_ + body.size()},
        to_{to},
        why_{why},
        empty_objects_{empty_objects_max + bytes.size()} {}

  bool message() {
    if (!object(of_.types[0])) return false;
    const std::size_t behind = left();
    if (behind <= (Wire == wire::cdr ? padding_bytes_max : 0)) return true;
    return wrong("is shorter than its bytes: " + std::to_string(behind) + " are left");
  }

 private:
  static constexpr bool is_cdr = Wire == wire::cdr;

  std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }

  // ---- errors ----

  [[gnu::cold, gnu::noinline]] bool wrong(std::string what) {
    const auto at = static_cast<std::int64_t>(at_ - whole_.data());
    what += " (at byte " + std::to_string(at) + " of " + std::to_string(whole_.size()) + ")";
    return why_.set({errc::bad_message, at}, std::move(what));
  }
  [[gnu::cold]] bool beyond(std::size_t count, std::size_t most, const char* of) {
    return wrong("has " + std::to_string(count) + of + "; " + std::to_string(most) + " are the most");
  }
  [[gnu::cold]] bool cut_off() { return wrong("is cut off"); }
  [[gnu::cold]] bool too_big() {
    const auto limit = static_cast<std::int64_t>(to_.limit());
    return why_.set({errc::too_big, limit + 1, limit},
                    "is longer than " + std::to_string(limit) + " bytes in JSON");
  }
  bool put(std::string_view text) { return to_.append(text) || too_big(); }
  bool put(char c) { return to_.append(c) || too_big(); }

  // ---- what bytes say ----

  template <class T>
  bool read(T& into) {
    if constexpr (is_cdr && sizeof(T) > 1) {
      const auto padding = static_cast<std::size_t>(begin_ - at_) & (sizeof(T) - 1);
      if (padding > left()) return cut_off();
      at_ += padding;
    }
    if (sizeof(T) > left()) return cut_off();
    word<sizeof(T)> bits;
    std::memcpy(&bits, at_, sizeof bits);
    if constexpr (Swap) bits = swapped(bits);
    into = std::bit_cast<T>(bits);
    at_ += sizeof(T);
    return true;
  }

  // The bytes of a text.
  bool read_text(const member& m, std::string_view& into) {
    std::uint32_t bytes = 0;
    if (!read(bytes)) return false;
    if (bytes > left()) return cut_off();
    into = {at_, bytes};
    at_ += bytes;
    if (is_cdr && into.ends_with('\0')) into.remove_suffix(1);
    return into.size() <= m.text_max || beyond(into.size(), m.text_max, " bytes");
  }

  // ---- values ----

  bool object(const type& t) {
    if constexpr (is_cdr) {
      std::uint8_t padding = 0;
      if (t.members.empty() && !read(padding)) return false;
    } else if (t.least(Wire) == 0) {
      if (empty_objects_ == 0) return wrong("has more empty messages than it has bytes");
      --empty_objects_;
    }
    if (t.members.empty()) return put("{}");
    for (const member& m : t.members) {
      if (!put(m.key) || !value(m)) return why_.in(m.name);
    }
    return put('}');
  }

  bool value(const member& m) {
    if (m.many == form::one) return one(m);
    std::uint32_t count = m.count;
    if (m.many == form::sequence) {
      if (!read(count)) return false;
      if (count > m.count) return beyond(count, m.count, " elements");
    }
    const std::uint64_t each = m.what == kind::object ? of_.types[m.object].least(Wire) : bytes_of(m.what);
    if (count * each > left()) return cut_off(); // no more than 2^32 times 2^28
    if (m.is_bytes()) return base64(count);
    return array(m, count);
  }

  bool array(const member& m, std::uint32_t count) {
    if (!put('[')) return false;
    switch (m.what) {
    case kind::int8: return numbers<std::int8_t>(count);
    case kind::int16: return numbers<std::int16_t>(count);
    case kind::uint16: return numbers<std::uint16_t>(count);
    case kind::int32: return numbers<std::int32_t>(count);
    case kind::uint32: return numbers<std::uint32_t>(count);
    case kind::int64: return numbers<std::int64_t>(count);
    case kind::uint64: return numbers<std::uint64_t>(count);
    case kind::float32: return numbers<float>(count);
    case kind::float64: return numbers<double>(count);
    default: break;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      if ((i != 0 && !put(',')) || !one(m)) return why_.in(std::size_t{i});
    }
    return put(']');
  }

  template <class T>
  bool numbers(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      if ((i != 0 && !put(',')) || !number<T>()) return why_.in(std::size_t{i});
    }
    return put(']');
  }

  bool one(const member& m) {
    switch (m.what) {
    case kind::boolean: return boolean();
    case kind::int8: return number<std::int8_t>();
    case kind::uint8: return number<std::uint8_t>();
    case kind::int16: return number<std::int16_t>();
    case kind::uint16: return number<std::uint16_t>();
    case kind::int32: return number<std::int32_t>();
    case kind::uint32: return number<std::uint32_t>();
    case kind::int64: return number<std::int64_t>();
    case kind::uint64: return number<std::uint64_t>();
    case kind::float32: return number<float>();
    case kind::float64: return number<double>();
    case kind::text: return text(m);
    case kind::wide_text: return is_cdr ? wide_text(m) : text(m);
    case kind::time: return time(true);
    case kind::duration: return time(false);
    case kind::object: break;
    }
    return object(of_.types[m.object]);
  }

  bool boolean() {
    std::uint8_t x = 0;
    return read(x) && put(x != 0 ? std::string_view{"true"} : std::string_view{"false"});
  }

  template <class T>
  bool number() {
    T x{};
    if (!read(x)) return false;
    char* const to = to_.room(json::number_buffer_bytes);
    if (to == nullptr) return too_big();
    char* end = nullptr;
    if constexpr (std::is_same_v<T, double>) {
      end = json::write_double(to, x);
    } else if constexpr (std::is_same_v<T, float>) {
      end = json::write_float(to, x);
    } else if constexpr (std::is_signed_v<T>) {
      end = json::write_signed(to, x);
    } else {
      end = json::write_unsigned(to, x);
    }
    if (end == nullptr) return put("null");
    to_.advance_to(end);
    return true;
  }

  // Seconds and nanoseconds; ROS 1's times have no sign, its durations have two.
  bool time(bool is_time) {
    if (of_.version == ros_version::ros2)
      return put("{\"sec\":") && number<std::int32_t>() && put(",\"nanosec\":") && number<std::uint32_t>() &&
             put('}');
    return put("{\"secs\":") && (is_time ? number<std::uint32_t>() : number<std::int32_t>()) &&
           put(",\"nsecs\":") && (is_time ? number<std::uint32_t>() : number<std::int32_t>()) && put('}');
  }

  bool text(const member& m) {
    std::string_view found;
    return read_text(m, found) && string(found);
  }

  bool string(std::string_view utf8) {
    constexpr std::size_t ample = 16; // quotes, and what the writer touches behind
    if (utf8.size() + 2 > to_.left()) return too_big();
    char* to = to_.room(utf8.size() + ample); // enough for most texts, which have nothing that becomes longer
    if (to == nullptr) return too_big();
    json::writer plain{{to, utf8.size() + ample}};
    plain.string(utf8);
    if (!plain.overflowed()) [[likely]] {
      to_.advance_to(to + plain.bytes());
      return true;
    }
    const std::size_t bytes = escaped_bytes(utf8) + ample;
    to = bytes > to_.left() + ample ? nullptr : to_.room(bytes);
    if (to == nullptr) return too_big();
    json::writer escaped{{to, bytes}};
    escaped.string(utf8);
    to_.advance_to(to + escaped.bytes());
    return true;
  }

  // UTF-16, without a terminator. A unit that is no character becomes U+FFFD.
  bool wide_text(const member& m) {
    std::uint32_t units = 0;
    if (!read(units)) return false;
    if (std::uint64_t{units} * 2 > left()) return cut_off();
    if (units > m.text_max) return beyond(units, m.text_max, " units");
    if (!put('"')) return false;
    for (const char* const last = at_ + std::size_t{units} * 2; at_ != last;) {
      std::uint32_t code = unit();
      if (code >= 0xd800 && code <= 0xdbff && at_ != last) {
        const char* const before = at_;
        const std::uint32_t low = unit();
        if (low >= 0xdc00 && low <= 0xdfff) {
          code = 0x10000 + ((code - 0xd800) << 10 | (low - 0xdc00));
        } else {
          at_ = before;
        }
      }
      if (code >= 0xd800 && code <= 0xdfff) code = 0xfffd;
      char utf8[4];
      char escaped[json::number_buffer_bytes];
      json::writer into{escaped};
      into.string({utf8, json::write_utf8(utf8, code)});
      if (!put(into.text().substr(1, into.bytes() - 2))) return false;
    }
    return put('"');
  }
  std::uint32_t unit() noexcept {
    std::uint16_t bits;
    std::memcpy(&bits, at_, sizeof bits);
    at_ += sizeof bits;
    return Swap ? swapped(bits) : bits;
  }

  bool base64(std::uint32_t count) {
    const std::size_t bytes = json::base64_text_bytes(count) + 2;
    if (bytes > to_.left()) return too_big();
    char* const to = to_.room(bytes);
    if (to == nullptr) return too_big();
    *to = '"';
    char* const end = json::write_base64(to + 1, at_, count);
    *end = '"';
    to_.advance_to(end + 1);
    at_ += count;
    return true;
  }

  const definition& of_;
  const std::string_view whole_;
  const char* const begin_; // from here on numbers are aligned
  const char* at_;
  const char* const end_;
  output& to_;
  failure& why_;
  std::size_t empty_objects_; // that may still come
};

// What the head of a message in CDR says, where that is not plain CDR.
std::string encapsulation(unsigned number) {
  const char* name = nullptr;
  switch (number & ~1U) {
  case 0x02: name = "PL_CDR (a parameter list)"; break;
  case 0x06:
  case 0x10: name = "CDR2 (plain XCDR2)"; break;
  case 0x08:
  case 0x14: name = "D_CDR2 (delimited XCDR2)"; break;
  case 0x0a:
  case 0x12: name = "PL_CDR2 (a parameter list of XCDR2)"; break;
  case 0x04: name = "XML"; break;
  default: return "is in the unknown encapsulation " + std::to_string(number);
  }
  return std::string{"is in "} + name + ", and only plain CDR is read";
}

} // namespace

bool to_json(const definition& of, ros_encoding in, std::string_view bytes, output& to, failure& why) {
  if (in == ros_encoding::ros1) return to_json_run<wire::ros1, false>{of, bytes, bytes, to, why}.message();
  if (bytes.size() < head_bytes)
    return why.set({errc::bad_message, static_cast<std::int64_t>(bytes.size())},
                   "has no head of CDR: it has " + std::to_string(bytes.size()) + " bytes");
  const unsigned number =
      static_cast<unsigned>(static_cast<std::uint8_t>(bytes[0])) << 8 | static_cast<std::uint8_t>(bytes[1]);
  const std::string_view body = bytes.substr(head_bytes);
  if (number == 0) return to_json_run<wire::cdr, true>{of, bytes, body, to, why}.message();
  if (number == 1) return to_json_run<wire::cdr, false>{of, bytes, body, to, why}.message();
  return why.set({errc::bad_message, 1}, encapsulation(number));
}

} // namespace rowe::rosmsg
