// SPDX-License-Identifier: Apache-2.0
// What the decoder should do, told plainly: member by member with the walkers, names compared with every
// member's, numbers as strings of digits and by the C library, the description asked at every step. It shares
// nothing with the decoder but the walkers, which are tested against simdjson.
#pragma once
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/result.hpp>
#include <rowe/schema.hpp>

#include "json/reading/reader.hpp"
#include "json/structs/times.hpp"

namespace rowe::tests {

class slow_decoder {
 public:
  static status decode(const schema_description& schema, std::string_view text, void* object) {
    schema.set_default(object);
    const json::value whole = json::root(text);
    if (whole.type != json::kind::object) return errc::not_an_object;
    return slow_decoder{text}.read_object(schema, whole, static_cast<char*>(object), 0);
  }

 private:
  explicit slow_decoder(std::string_view text) : text_{text} {}

  status at(errc code, const char* where) const { return error{code, where - text_.data()}; }
  status wrong_type(const json::value& v) const { return at(errc::wrong_type, v.raw.data()); }
  static status too_long(std::size_t count, std::size_t limit) {
    return error{errc::too_long, static_cast<std::int64_t>(count), static_cast<std::int64_t>(limit)};
  }

  static std::string unescaped(std::string_view escaped) {
    std::string scratch(escaped.size(), '\0');
    return std::string{json::unescape(escaped, scratch).value()};
  }

  // How many members are described inside of one.
  static std::int64_t members_in(const value_description& d) {
    if (d.kind == value_kind::array || d.kind == value_kind::optional) return members_in(*d.element);
    if (d.kind != value_kind::object) return 0;
    std::int64_t count = 0;
    for (const member_description& m : d.object->members) count += 1 + members_in(*m.type);
    return count;
  }

  // `number`: of the last member before the object's.
  status read_object(const schema_description& schema, const json::value& v, char* object,
                     std::int64_t number) const {
    std::vector<std::int64_t> numbers;
    for (const member_description& m : schema.members) {
      numbers.push_back(++number);
      number += members_in(*m.type);
    }
    std::vector<bool> seen(schema.members.size());
    std::vector<std::pair<const void*, std::size_t>> counts; // of counting members that were set
    json::object_walk walk{v.raw};
    for (json::member found; walk.next(found);) {
      const std::string name = unescaped(found.name_raw);
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const member_description& m = schema.members[i];
        if (m.name != name && (m.other_name.empty() || m.other_name != name)) continue;
        if (seen[i]) return at(errc::duplicate_member, found.name_raw.data() - 1);
        seen[i] = true;
        if (const status s = read_member(m, found.what, object, numbers[i], counts); !s) return s;
      }
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const value_description& type = *schema.members[i].type;
      if (!seen[i] && schema.members[i].or_default) continue;
      if (!seen[i] && type.kind != value_kind::optional) return error{errc::missing_member, numbers[i]};
      if (!seen[i]) type.reset(const_cast<void*>(schema.members[i].address(object)));
    }
    for (const member_description& m : schema.members) {
      for (const auto& [counting, count] : counts) {
        if (m.count_address != nullptr && m.count_address(object) == counting) m.set_count(object, count);
      }
    }
    return {};
  }

  status read_member(const member_description& m, const json::value& v, char* object, std::int64_t number,
                     std::vector<std::pair<const void*, std::size_t>>& counts) const {
    auto* const where = static_cast<char*>(const_cast<void*>(m.address(object)));
    if (m.count == nullptr) return read(*m.type, v, where, m, number);
    std::size_t count = 0;
    json::array_walk walk{v.raw};
    for (json::value e; walk.next(e);) ++count;
    const bool is_text = v.type == json::kind::string && takes_base64(*m.type, m);
    if (is_text) {
      const auto bytes = bytes_in(v);
      if (!bytes) return wrong_type(v);
      count = bytes->size();
    }
    if ((is_text || v.type == json::kind::array) && count <= m.count_limit) {
      // As if the array were no longer.
      value_description type = *m.type;
      type.count_max = count;
      if (const status s = read(type, v, where, m, number); !s) return s;
    } else {
      value_description type = *m.type;
      type.count_max = m.count_limit;
      return read(type, v, where, m, number);
    }
    for (const auto& [counting, before] : counts) {
      if (counting == m.count_address(object) && before != count) return too_long(count, before);
    }
    counts.emplace_back(m.count_address(object), count);
    return {};
  }

  status read(const value_description& d, const json::value& v, char* where, const member_description& form,
              std::int64_t number) const {
    using json::kind;
    switch (d.kind) {
    case value_kind::boolean: {
      if (v.type != kind::boolean) return wrong_type(v);
      const bool yes = v.raw == "true";
      std::memcpy(where, &yes, sizeof yes);
      return {};
    }
    case value_kind::int8: return read_integer<std::int8_t>(d, v, where, form);
    case value_kind::int16: return read_integer<std::int16_t>(d, v, where, form);
    case value_kind::int32: return read_integer<std::int32_t>(d, v, where, form);
    case value_kind::int64: return read_integer<std::int64_t>(d, v, where, form);
    case value_kind::uint8: return read_integer<std::uint8_t>(d, v, where, form);
    case value_kind::uint16: return read_integer<std::uint16_t>(d, v, where, form);
    case value_kind::uint32: return read_integer<std::uint32_t>(d, v, where, form);
    case value_kind::uint64: return read_integer<std::uint64_t>(d, v, where, form);
    case value_kind::float32: return read_real<float>(v, where, std::strtof);
    case value_kind::float64: return read_real<double>(v, where, std::strtod);
    case value_kind::text: {
      if (v.type != kind::string) return wrong_type(v);
      const std::string text = unescaped(v.raw.substr(1, v.raw.size() - 2));
      if (text.size() > d.count_max) return too_long(text.size(), d.count_max);
      text.copy(d.resize_text(where, text.size()), text.size());
      return {};
    }
    case value_kind::object:
      return v.type == kind::object ? read_object(*d.object, v, where, number) : wrong_type(v);
    case value_kind::array: return read_array(d, v, where, form, number);
    case value_kind::optional: break;
    }
    if (v.type != kind::null) {
      return read(*d.element, v, static_cast<char*>(d.emplace(where)), form, number);
    }
    d.reset(where);
    return {};
  }

  static bool takes_base64(const value_description& d, const member_description& form) {
    return d.is_bytes && !form.as_string && !form.by_name;
  }

  // Bit by bit. What is no digit stays in the text, as '?', until its length was looked at.
  static std::optional<std::string> bytes_in(const json::value& v) {
    std::string text = unescaped(v.raw.substr(1, v.raw.size() - 2));
    if (text.size() % 4 != 0) return std::nullopt;
    std::size_t padding = 0;
    for (; text.ends_with('='); ++padding) text.pop_back();
    if (padding > 2) return std::nullopt;
    static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<bool> bits;
    for (const char c : text)
      for (int bit = 5; bit >= 0; --bit) bits.push_back((digits.find(c) >> bit & 1) != 0);
    std::string bytes;
    for (std::size_t i = 0; i + 8 <= bits.size(); i += 8) {
      unsigned byte = 0;
      for (std::size_t k = 0; k < 8; ++k) byte = byte << 1 | (bits[i + k] ? 1U : 0U);
      bytes += static_cast<char>(byte);
    }
    return bytes;
  }
  static bool has_only_digits(const json::value& v) {
    std::string text = unescaped(v.raw.substr(1, v.raw.size() - 2));
    while (text.ends_with('=')) text.pop_back();
    return std::all_of(text.begin(), text.end(), [](char c) {
      return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' ||
             c == '/';
    });
  }

  status read_array(const value_description& d, const json::value& v, char* where,
                    const member_description& form, std::int64_t number) const {
    if (v.type == json::kind::string && takes_base64(d, form)) {
      const auto bytes = bytes_in(v);
      if (!bytes) return wrong_type(v);
      if (bytes->size() > d.count_max) return too_long(bytes->size(), d.count_max);
      if (!has_only_digits(v)) return wrong_type(v);
      if (d.resize == nullptr && bytes->size() != d.count_max) return too_long(bytes->size(), d.count_max);
      bytes->copy(static_cast<char*>(const_cast<void*>(d.elements(where))), bytes->size());
      if (d.resize != nullptr) (void)d.resize(where, bytes->size());
      return {};
    }
    if (v.type != json::kind::array) return wrong_type(v);
    auto* const elements = static_cast<char*>(const_cast<void*>(d.elements(where)));
    std::size_t count = 0;
    json::array_walk walk{v.raw};
    for (json::value e; walk.next(e); ++count) {
      if (count >= d.count_max) continue;
      if (const status s = read(*d.element, e, elements + count * d.element->bytes, form, number); !s) {
        return s;
      }
    }
    if (count > d.count_max || (d.resize == nullptr && count != d.count_max))
      return too_long(count, d.count_max);
    if (d.resize != nullptr) (void)d.resize(where, count);
    return {};
  }

  template <class Real, class Convert>
  status read_real(const json::value& v, char* where, Convert convert) const {
    Real x = std::numeric_limits<Real>::quiet_NaN();
    if (v.type == json::kind::number) {
      x = convert(std::string{v.raw}.c_str(), nullptr);
      if (std::isinf(x)) return at(errc::out_of_range, v.raw.data());
    } else if (v.type != json::kind::null) {
      return wrong_type(v);
    }
    std::memcpy(where, &x, sizeof x);
    return {};
  }

  template <class Integer>
  status read_integer(const value_description& d, const json::value& v, char* where,
                      const member_description& form) const {
    if (form.by_name) return read_named<Integer>(d, v, where, form);
    std::string digits;
    if (v.type == json::kind::string && form.as_string) {
      digits = unescaped(v.raw.substr(1, v.raw.size() - 2));
      const std::string_view magnitude = std::string_view{digits}.substr(digits.starts_with('-'));
      if (magnitude.empty() || magnitude.find_first_not_of("0123456789") != std::string_view::npos ||
          (magnitude.size() > 1 && magnitude.front() == '0')) {
        return wrong_type(v);
      }
    } else if (v.type == json::kind::number) {
      digits = v.raw;
    } else if (v.type == json::kind::object && json::is_time(d)) { // times_test.cpp has what that is
      const auto time = json::read_sec_nsec(v.raw, rowe::detail::decimals_of(d.unit));
      if (!time) return wrong_type(v);
      if (time->what != json::whole_number::form::whole) return at(errc::out_of_range, v.raw.data());
      digits = (time->negative ? "-" : "") + std::to_string(time->magnitude);
    } else {
      return wrong_type(v);
    }
    if (v.type != json::kind::object && !(form.as_seconds ? make_units(digits, d.unit) : make_plain(digits)))
      return wrong_type(v);
    if (digits == "-0" || (std::is_unsigned_v<Integer> && digits.starts_with('-'))) {
      if (digits != "-0") return at(errc::out_of_range, v.raw.data());
      digits = "0";
    }
    Integer x = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (read.ec != std::errc{}) return at(errc::out_of_range, v.raw.data());
    std::memcpy(where, &x, sizeof x);
    return {};
  }

  template <class Integer>
  status read_named(const value_description& d, const json::value& v, char* where,
                    member_description form) const {
    form.by_name = false;
    Integer x = 0;
    const std::string name =
        v.type == json::kind::string ? unescaped(v.raw.substr(1, v.raw.size() - 2)) : std::string{};
    if (v.type != json::kind::string) {
      const status s = read_integer<Integer>(d, v, reinterpret_cast<char*>(&x), form);
      if (!s) return s;
    }
    for (const enumerator_description& e : d.enumerators) {
      if (v.type == json::kind::string ? e.name != name : static_cast<Integer>(e.value) != x) continue;
      x = static_cast<Integer>(e.value);
      std::memcpy(where, &x, sizeof x);
      return {};
    }
    return at(errc::out_of_range, v.raw.data());
  }

  // A number as one writes it by hand: digits with zeros behind them, or a point among them.
  struct hand_written {
    bool negative;
    std::string digits;
    long long exponent; // bounded: texts are not that long

    explicit hand_written(const std::string& number) : negative{number.starts_with('-')} {
      constexpr long long far = 1'000'000'000;
      const std::size_t e = std::min(number.find_first_of("eE"), number.size());
      exponent = e == number.size() ? 0 : std::strtoll(number.c_str() + e + 1, nullptr, 10);
      exponent = std::min(std::max(exponent, -far), far);
      digits = number.substr(negative, e - negative);
      if (const std::size_t point = digits.find('.'); point != std::string::npos) {
        exponent -= static_cast<long long>(digits.size() - point - 1);
        digits.erase(point, 1);
      }
    }
    // False when it is no integer. What is too large by far is given so many digits that it is too large.
    bool write(std::string& number) {
      digits.erase(0, digits.find_first_not_of('0'));
      for (; !digits.empty() && digits.back() == '0'; ++exponent) digits.pop_back();
      if (digits.empty()) exponent = 0;
      if (exponent < 0) return false;
      digits.append(static_cast<std::size_t>(std::min(exponent, 30LL)), '0');
      number = (negative ? "-" : "") + (digits.empty() ? "0" : digits);
      return true;
    }
    // What is behind the point goes, or makes the rest one more.
    void round() {
      const auto behind = static_cast<std::size_t>(std::max(-exponent, 0LL));
      if (behind == 0) return;
      const bool up = behind <= digits.size() && digits[digits.size() - behind] >= '5';
      digits = "0" + digits.substr(0, digits.size() - std::min(behind, digits.size()));
      std::size_t last = digits.size() - 1;
      for (; up && digits[last] == '9'; --last) digits[last] = '0';
      if (up) ++digits[last];
      exponent = 0;
    }
  };

  // From seconds to the digits of the integer of units.
  static bool make_units(std::string& number, const unit_description& unit) {
    hand_written parts{number};
    parts.exponent += static_cast<long long>(std::to_string(unit.denominator).size()) - 1;
    parts.round();
    return parts.write(number);
  }

  // From any way to write a number to the digits of the integer that it is; false when it is none.
  static bool make_plain(std::string& number) { return hand_written{number}.write(number); }

  std::string_view text_;
};

} // namespace rowe::tests
