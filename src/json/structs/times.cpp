// SPDX-License-Identifier: Apache-2.0
#include "json/structs/times.hpp"

#include <algorithm>
#include <array>

#include "json/reading/reader.hpp"
#include "json/text/digits.hpp"

namespace rowe::json {
namespace {

bool is_plain_integer(const member_description& m) noexcept {
  return m.type->kind >= value_kind::int8 && m.type->kind <= value_kind::uint64 && !m.as_string &&
         !m.by_name && !m.as_seconds;
}

bool has_time_in(const value_description& d) noexcept {
  switch (d.kind) {
  case value_kind::object: return holds_time(*d.object);
  case value_kind::array:
  case value_kind::optional: return has_time_in(*d.element);
  default: return is_time(d);
  }
}

char* write_text(char* at, std::string_view text) noexcept { return std::copy(text.begin(), text.end(), at); }

// A time as its JSON says it: a count, in quotes or not, or seconds with a point.
std::optional<whole_number> count_of(const value& time, const member_description& m, int decimals) noexcept {
  if (m.as_string) {
    const bool quoted = time.type == kind::string;
    return quoted ? read_quoted_whole(time.raw.substr(1, time.raw.size() - 2)) : std::nullopt;
  }
  if (time.type != kind::number) return std::nullopt;
  const decimal read = read_decimal(time.raw.data(), time.raw.data() + time.raw.size());
  return m.as_seconds ? to_units(read, decimals) : to_whole(read);
}

void write_time(writer& into, const value& what, const value_description& d,
                const member_description& m) noexcept {
  const int decimals = rowe::detail::decimals_of(d.unit);
  const auto count = count_of(what, m, decimals);
  constexpr auto most = static_cast<std::uint64_t>(INT64_MAX);
  const bool fits = count && count->what == whole_number::form::whole &&
                    (d.kind == value_kind::uint64 ? !count->negative : count->magnitude <= most);
  if (!fits) return into.raw(what.raw);
  const auto magnitude = static_cast<std::int64_t>(count->magnitude);
  std::array<char, sec_nsec_bytes_max> text;
  const char* const end = write_sec_nsec(text.data(), count->negative ? -magnitude : magnitude,
                                         d.kind != value_kind::uint64, decimals);
  into.raw({text.data(), static_cast<std::size_t>(end - text.data())});
}

// Names stand mostly in the order of the type. Whoever makes up others pays for them with bytes: a text has
// so many comparisons, and what comes behind the last one is copied.
class rewriting {
 public:
  rewriting(writer& into, std::size_t comparisons) noexcept : into_{into}, left_{comparisons} {}

  void write_object(std::string_view json, const schema_description& type) noexcept {
    const bool is = is_time(type);
    std::size_t expected = 0;
    object_walk members{json};
    into_.begin_object();
    for (member one; members.next(one);) {
      const member_description* const m = find(type, one.name_raw, expected);
      if (m != nullptr && is)
        into_.key(sec_or_nsec(m->name));
      else
        into_.key_raw(one.name_raw);
      if (m != nullptr)
        write_value(one.what, *m->type, *m);
      else
        into_.raw(one.what.raw);
    }
    into_.end_object();
  }

 private:
  void write_value(const value& what, const value_description& d, const member_description& m) noexcept {
    switch (d.kind) {
    case value_kind::object:
      return what.type == kind::object ? write_object(what.raw, *d.object) : into_.raw(what.raw);
    case value_kind::optional: return write_value(what, *d.element, m);
    case value_kind::array: {
      if (what.type != kind::array || !has_time_in(*d.element)) return into_.raw(what.raw);
      array_walk elements{what.raw};
      into_.begin_array();
      for (value one; elements.next(one);) write_value(one, *d.element, m);
      return into_.end_array();
    }
    default: return is_time(d) ? write_time(into_, what, d, m) : into_.raw(what.raw);
    }
  }

  // Null: there is none, or it is not looked for any more. `expected` is where it looks first.
  const member_description* find(const schema_description& type, std::string_view escaped,
                                 std::size_t& expected) noexcept {
    std::array<char, 256> scratch; // a longer name with escapes is none that a type has
    const auto name = unescape(escaped, scratch);
    const std::size_t count = type.members.size();
    for (std::size_t i = 0; name && i < count && left_ != 0; ++i, --left_) {
      const std::size_t at = expected + i < count ? expected + i : expected + i - count;
      const member_description& m = type.members[at];
      if (*name != m.name && (m.other_name.empty() || *name != m.other_name)) continue;
      expected = at + 1 == count ? 0 : at + 1;
      return &m;
    }
    return nullptr;
  }

  writer& into_;
  std::size_t left_;
};

} // namespace

bool is_time(const schema_description& type) noexcept {
  if (type.members.size() != 2) return false;
  const member_description& a = type.members[0];
  const member_description& b = type.members[1];
  const std::string_view first = sec_or_nsec(a.name);
  const std::string_view second = sec_or_nsec(b.name);
  return !first.empty() && !second.empty() && first != second && is_plain_integer(a) && is_plain_integer(b);
}

bool holds_time(const schema_description& type) noexcept {
  return is_time(type) || std::any_of(type.members.begin(), type.members.end(),
                                      [](const member_description& m) { return has_time_in(*m.type); });
}

char* write_sec_nsec(char* at, std::int64_t count, bool is_signed, int decimals) noexcept {
  std::uint64_t in_second = 1;
  std::uint64_t to_ns = 1;
  for (int i = 0; i < 9; ++i) (i < decimals ? in_second : to_ns) *= 10;
  const bool before_1970 = is_signed && count < 0;
  const auto magnitude =
      before_1970 ? ~static_cast<std::uint64_t>(count) + 1 : static_cast<std::uint64_t>(count);
  std::uint64_t seconds = magnitude / in_second;
  std::uint64_t rest = magnitude % in_second;
  // Nanoseconds count forwards, also before 1970.
  if (before_1970 && rest != 0) {
    ++seconds;
    rest = in_second - rest;
  }
  at = write_text(at, before_1970 && seconds != 0 ? R"({"sec":-)" : R"({"sec":)");
  at = write_unsigned(at, seconds);
  at = write_text(at, R"(,"nsec":)");
  at = write_unsigned(at, rest * to_ns);
  return write_text(at, "}");
}

std::optional<whole_number> read_sec_nsec(std::string_view validated_object, int decimals) noexcept {
  std::optional<whole_number> seconds, rest;
  object_walk members{validated_object};
  for (member one; members.next(one);) {
    for (const std::string_view name : {"sec", "secs", "nsec", "nsecs", "nanosec"}) {
      if (!name_is(one, name)) continue;
      if (one.what.type != kind::number) return std::nullopt;
      auto& number = sec_or_nsec(name) == "sec" ? seconds : rest;
      if (number) return std::nullopt; // said twice
      number = to_whole(read_decimal(one.what.raw.data(), one.what.raw.data() + one.what.raw.size()));
      if (number->what == whole_number::form::fraction) return std::nullopt;
    }
  }
  constexpr std::uint64_t second = 1'000'000'000;
  if (!seconds || !rest || rest->what != whole_number::form::whole || rest->magnitude >= second ||
      (rest->negative && rest->magnitude != 0))
    return std::nullopt;
  std::uint64_t in_second = 1;
  std::uint64_t to_ns = 1;
  for (int i = 0; i < 9; ++i) (i < decimals ? in_second : to_ns) *= 10;
  const std::uint64_t more = rest->magnitude / to_ns; // nanoseconds count forwards, also before 1970
  whole_number count = *seconds;
  std::uint64_t product = 0;
  if (count.what != whole_number::form::whole ||
      __builtin_mul_overflow(seconds->magnitude, in_second, &product) ||
      (!count.negative && __builtin_add_overflow(product, more, &product)))
    return whole_number{.what = whole_number::form::too_large};
  count.negative = count.negative && product != 0;
  count.magnitude = !seconds->negative ? product : count.negative ? product - more : more;
  return count;
}

void write_sec_nsec(writer& into, std::string_view validated, const schema_description& type) noexcept {
  const value whole = root(validated);
  if (whole.type != kind::object) return into.raw(whole.raw);
  rewriting{into, sec_nsec_comparisons(whole.raw.size())}.write_object(whole.raw, type);
}

} // namespace rowe::json
