// SPDX-License-Identifier: Apache-2.0
// The interpreter of a flattened schema: one walk over the text. Each function is passed the position and
// returns the new one, so it stays in a register; null says that it failed, and failed_ says how. It relies
// on the text being JSON, but looks at the end before every byte and moves forward with every step.
#include "json/structs/decoder.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "json/reading/base64.hpp"
#include "json/reading/cursor.hpp"
#include "json/reading/numbers.hpp"
#include "json/reading/reader.hpp"
#include "json/structs/decoder_program.hpp"
#include "json/structs/stored.hpp"
#include "json/structs/times.hpp"

namespace rowe::json {
namespace {

bool begins_number(char c) noexcept { return c == '-' || (c >= '0' && c <= '9'); }

} // namespace

class decoder::run {
 public:
  run(std::string_view text, bool null_is_nan, diagnosis* why) noexcept
      : begin_{text.data()}, end_{begin_ + text.size()}, null_is_nan_{null_is_nan}, why_{why} {}

  status whole(const shape& s, char* into) noexcept {
    const char* const at = skip_space(begin_, end_);
    if (at == end_ || *at != '{') {
      fail(errc::not_an_object, 0);
      failed_.value = 0;
      found_ = at;
    } else if (object(s, into, at) != nullptr) {
      return {};
    }
    if (why_ != nullptr) {
      why_->why_ = failed_;
      why_->found_ = found_;
      why_->end_ = end_;
    }
    return failed_;
  }

 private:
  // ---- errors ----

  const char* fail(errc code, std::size_t value, std::size_t limit = 0) noexcept {
    failed_ = {code, static_cast<std::int64_t>(value), static_cast<std::int64_t>(limit)};
    return nullptr;
  }
  const char* fail_at(errc code, const char* at) noexcept {
    found_ = at;
    return fail(code, static_cast<std::size_t>(at - begin_));
  }

  // Records whose value failed, on the way out, for the diagnosis. Returns null, which callers return in
  // turn.
  [[gnu::cold]] const char* failed_in(const member* named, std::size_t element, const step& value) noexcept {
    if (why_ == nullptr) return nullptr;
    if (why_->parts_ == 0) why_->wanted_ = &value;
    if (why_->parts_ < why_->path_.size()) why_->path_[why_->parts_++] = {named, element};
    return nullptr;
  }
  const char* failed_in(const member& m) noexcept { return failed_in(&m, 0, m.value); }
  const char* wrong_type(const char* at) noexcept { return fail_at(errc::wrong_type, at); }

  // Behind a literal of so many bytes.
  const char* behind(const char* at, std::ptrdiff_t bytes) const noexcept {
    return at + std::min(bytes, end_ - at);
  }

  // ---- objects ----

  const char* object(const shape& s, char* base, const char* at) noexcept {
    return s.count <= 64 ? object<1>(s, base, at) : object<shape::words_max>(s, base, at);
  }

  template <std::size_t Words>
  const char* object(const shape& s, char* base, const char* at) noexcept {
    std::array<std::uint64_t, Words> seen{};
    const member* const members_end = s.members + s.count;
    const member* expected = s.members;
    at = skip_space(at + 1, end_);
    while (at != end_ && *at == '"') {
      const char* const quote = at;
      const char* const name = at + 1;
      const member* m = nullptr;
      if (expected != members_end && begins(*expected, name)) [[likely]] {
        m = expected;
        at = name + m->name_bytes + 1;
      } else {
        const char* const name_end = find_quote(name, end_);
        m = find(s, between(name, name_end));
        at = behind(name_end, 1);
      }
      at = skip_space(at, end_);
      if (at != end_ && *at == ':') at = skip_space(at + 1, end_);
      if (at == end_) break;

      if (m != nullptr) [[likely]] {
        const std::size_t index = m->index;
        std::uint64_t& word = seen[Words == 1 ? 0 : index / 64];
        const std::uint64_t bit = std::uint64_t{1} << index % 64;
        if ((word & bit) != 0) {
          fail_at(errc::duplicate_member, quote);
          return failed_in(*m);
        }
        if (m->shares_count) [[unlikely]] {
          at = counted_alike(s, seen, *m, base, at);
        } else {
          at = m->value.unused ? unused(m->value, at) : value(m->value, base, at);
        }
        if (at == nullptr) return failed_in(*m);
        word |= bit;
        expected = s.members + index + 1;
      } else {
        at = skip_value(at, end_);
      }
      at = skip_space(at, end_);
      if (at == end_ || *at != ',') break;
      at = skip_space(at + 1, end_);
    }
    return complete(s, seen, base) ? behind(at, 1) : nullptr;
  }

  // An array whose counting member also counts others must be as long as those that were seen.
  template <std::size_t Words>
  const char* counted_alike(const shape& s, const std::array<std::uint64_t, Words>& seen, const member& m,
                            char* base, const char* at) noexcept {
    bool counted = false;
    for (std::size_t i = 0; i < s.count; ++i) {
      const bool was_seen = (seen[Words == 1 ? 0 : i / 64] >> i % 64 & 1) != 0;
      counted |= was_seen && s.members[i].value.counted_as(m.value);
    }
    const std::size_t before = m.value.count_of(base + m.value.count_offset);
    at = value(m.value, base, at);
    if (at == nullptr || !counted) return at;
    const std::size_t count = m.value.count_of(base + m.value.count_offset);
    return count == before ? at : fail(errc::too_long, count, before);
  }

  // Does the text continue with the name and a quote?
  bool begins(const member& m, const char* at) const noexcept {
    if (!m.plain) return false;
    const auto left = static_cast<std::size_t>(end_ - at);
    if (left < member::head_bytes)
      return left > m.name_bytes && std::memcmp(at, m.name, m.name_bytes + 1) == 0;
    const std::uint64_t first = (load_eight(at) ^ m.head[0]) & m.mask[0];
    const std::uint64_t second = (load_eight(at + 8) ^ m.head[1]) & m.mask[1];
    if ((first | second) != 0) return false;
    if (m.name_bytes < member::head_bytes) return true;
    return left > m.name_bytes && std::memcmp(at + member::head_bytes, m.name + member::head_bytes,
                                              m.name_bytes + 1 - member::head_bytes) == 0;
  }

  // The member of this name, or null. Names with escapes, on either side, are rare, and compared one by one.
  static const member* find(const shape& s, std::string_view escaped) noexcept {
    const std::uint32_t hash = name_hash(escaped);
    for (std::uint32_t slot = hash; s.slots[slot & s.slot_mask] != 0; ++slot) {
      const member& m = s.members[s.slots[slot & s.slot_mask] - 1];
      if (m.hash == hash && m.view() == escaped) return &m;
    }
    if (escaped.find('\\') == std::string_view::npos) return nullptr;
    constexpr std::size_t escape_bytes = 6; // the most that stand for a byte: \u0061
    const auto is_it = [escaped](const member& m) {
      return escaped.size() <= escape_bytes * m.name_bytes && says(escaped, m.view());
    };
    const member* const end = s.members + s.names;
    const member* const found = std::find_if(s.members, end, is_it);
    return found == end ? nullptr : found;
  }

  // Checks that all required members were there. Optionals that were not there are emptied, unless they keep
  // their values.
  template <std::size_t Words>
  bool complete(const shape& s, const std::array<std::uint64_t, Words>& seen, char* base) noexcept {
    for (std::size_t i = 0; i < Words && i * 64 < s.count; ++i) {
      const std::uint64_t all =
          s.count - i * 64 >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << s.count % 64) - 1;
      const std::uint64_t missing = all & ~seen[i];
      if (missing == 0) [[likely]]
        continue;
      const member* const members = s.members + i * 64;
      if (const std::uint64_t fault = missing & s.required[i]; fault != 0) {
        const member& m = members[std::countr_zero(fault)];
        fail(errc::missing_member, m.number);
        failed_in(m);
        return false;
      }
      for (std::uint64_t left = missing; left != 0; left &= left - 1) {
        const member& m = members[std::countr_zero(left)];
        if (!m.keeps_default) m.value.reset(base + m.value.offset);
      }
    }
    return true;
  }

  // ---- values: `at` is their first byte ----

  const char* value(const step& s, char* base, const char* at) noexcept {
    // The most frequent values; a call would cost too much.
    if (s.what == value_kind::float64) return real<double>(base + s.offset, at);
    return other_value(s, base, at);
  }

  const char* other_value(const step& s, char* base, const char* at) noexcept {
    switch (s.what) {
    case value_kind::float32: return real<float>(base + s.offset, at);
    case value_kind::boolean: return boolean(base + s.offset, at);
    case value_kind::text: return text(s, base + s.offset, at);
    case value_kind::object: return *at == '{' ? object(*s.object, base + s.offset, at) : wrong_type(at);
    case value_kind::array: return array(s, base, at);
    case value_kind::optional: return optional(s, base + s.offset, at);
    default: return integer(s, base + s.offset, at);
    }
  }

  const char* unused(const step& s, const char* at) noexcept {
    char buffer[8]; // of an integer
    return value(s, buffer, at);
  }

  const char* boolean(char* into, const char* at) noexcept {
    if (*at != 't' && *at != 'f') return wrong_type(at);
    store<std::uint8_t>(into, *at == 't');
    return behind(at, *at == 't' ? 4 : 5);
  }

  template <class Real>
  const char* real(char* into, const char* at) noexcept {
    if (begins_number(*at)) [[likely]] {
      const decimal d = read_decimal(at, end_);
      Real x = 0;
      if (!to_real(d, x)) return fail_at(errc::out_of_range, at);
      store(into, x);
      return d.end;
    }
    if (*at != 'n' || !null_is_nan_) return wrong_type(at);
    store(into, std::numeric_limits<Real>::quiet_NaN());
    return behind(at, 4);
  }

  const char* integer(const step& s, char* into, const char* at) noexcept {
    if (s.object != nullptr) [[unlikely]]
      return named(s, into, at);
    return number(s, into, at);
  }

  const char* number(const step& s, char* into, const char* at) noexcept {
    whole_number n;
    const char* end = nullptr;
    if (begins_number(*at)) [[likely]] {
      const decimal d = read_decimal(at, end_);
      n = s.decimals < 0 ? to_whole(d) : to_units(d, s.decimals);
      end = d.end;
    } else if (*at == '"' && s.as_string) {
      const char* const quote = find_quote(at + 1, end_);
      const std::optional<whole_number> quoted = read_quoted_whole(between(at + 1, quote));
      if (!quoted) return wrong_type(at);
      n = *quoted;
      end = behind(quote, 1);
    } else if (*at == '{' && s.time_decimals >= 0) {
      end = skip_container(at, end_);
      const std::optional<whole_number> time = read_sec_nsec(between(at, end), s.time_decimals);
      if (!time) return wrong_type(at);
      n = *time;
    } else {
      return wrong_type(at);
    }
    if (n.what == whole_number::form::fraction) return wrong_type(at);
    if (n.what == whole_number::form::too_large || !store_if_it_fits(into, s.what, n)) {
      return fail_at(errc::out_of_range, at);
    }
    return end;
  }

  // A value of an enum: its name, or its number if that has a name.
  [[gnu::noinline]] const char* named(const step& s, char* into, const char* at) noexcept {
    if (*at == '"') {
      const char* const quote = find_quote(at + 1, end_);
      const member* const found = find(*s.object, between(at + 1, quote));
      if (found == nullptr) return fail_at(errc::out_of_range, at);
      store_integer(into, s.what, found->value.count);
      return behind(quote, 1);
    }
    char scratch[8];
    const char* const end = number(s, scratch, at);
    if (end == nullptr) return nullptr;
    const auto value = static_cast<std::uint64_t>(load_integer(scratch, s.what));
    const member* const last = s.object->members + s.object->count;
    const member* const found =
        std::lower_bound(s.object->members, last, value,
                         [](const member& one, std::uint64_t v) { return one.value.count < v; });
    if (found == last || found->value.count != value) return fail_at(errc::out_of_range, at);
    store_integer(into, s.what, value);
    return end;
  }

  const char* text(const step& s, char* string, const char* at) noexcept {
    if (*at != '"') return wrong_type(at);
    const char* const quote = find_quote(at + 1, end_);
    const std::string_view escaped = between(at + 1, quote);
    const bool has_escape = escaped.find('\\') != std::string_view::npos;
    const std::size_t bytes = has_escape ? unescaped_bytes(escaped) : escaped.size();
    char* const buffer = s.resize_text != nullptr ? s.resize_text(string, bytes)
                         : bytes <= s.count       ? string // what follows is 0 already
                                                  : nullptr;
    if (buffer == nullptr) return fail(errc::too_long, bytes, s.count);
    if (has_escape) {
      (void)unescape(escaped, {buffer, bytes}); // fits: so many bytes were counted
    } else {
      escaped.copy(buffer, bytes);
    }
    return behind(quote, 1);
  }

  // The array's offsets are counted from `base`. For a counted array that is the object that it is part of.
  const char* array(const step& s, char* base, const char* at) noexcept {
    if (*at != '[') [[unlikely]]
      return base64(s, base, at);
    const char* const begin = at;
    char* into = base + s.elements_offset;
    std::size_t count = 0;
    at = skip_space(at + 1, end_);
    bool more = at != end_ && *at != ']';
    while (more) {
      if (count == s.count) return fail(errc::too_long, elements(begin), s.count);
      at = value(*s.element, into, at);
      if (at == nullptr) return failed_in(nullptr, count, *s.element);
      into += s.stride;
      ++count;
      at = skip_space(at, end_);
      more = at != end_ && *at == ',';
      if (more) at = skip_space(at + 1, end_);
      more = more && at != end_;
    }
    if (s.all_of_it && count != s.count) return fail(errc::too_long, count, s.count);
    if (s.resize != nullptr) (void)s.resize(base + s.offset, count); // holds them: no more were written
    if (s.set_count != nullptr) s.set_count(base + s.count_offset, count);
    return behind(at, 1);
  }

  // Bytes as text.
  [[gnu::noinline]] const char* base64(const step& s, char* base, const char* at) noexcept {
    if (!s.base64 || *at != '"') return wrong_type(at);
    const char* const quote = find_quote(at + 1, end_);
    const base64_text text{between(at + 1, quote)};
    const std::optional<std::size_t> bytes = text.bytes();
    if (!bytes) return wrong_type(at);
    if (*bytes > s.count) return fail(errc::too_long, *bytes, s.count);
    if (!text.read(base + s.elements_offset)) return wrong_type(at);
    if (s.all_of_it && *bytes != s.count) return fail(errc::too_long, *bytes, s.count);
    if (s.resize != nullptr) (void)s.resize(base + s.offset, *bytes); // holds them, likewise
    if (s.set_count != nullptr) s.set_count(base + s.count_offset, *bytes);
    return behind(quote, 1);
  }

  std::size_t elements(const char* array) const noexcept {
    array_walk walk{between(array, end_)};
    std::size_t count = 0;
    for (json::value e; walk.next(e);) ++count;
    return count;
  }

  const char* optional(const step& s, char* into, const char* at) noexcept {
    if (*at == 'n') {
      s.reset(into);
      return behind(at, 4);
    }
    return value(*s.element, static_cast<char*>(s.emplace(into)), at);
  }

  const char* const begin_;
  const char* const end_;
  const bool null_is_nan_;
  const char* found_ = nullptr; // what stands where it failed
  diagnosis* const why_;
  error failed_{errc::misuse};
};

decoder::decoder() noexcept = default;
decoder::decoder(decoder&&) noexcept = default;
decoder& decoder::operator=(decoder&&) noexcept = default;
decoder::~decoder() = default;

status decoder::decode(std::string_view validated_object, void* object, diagnosis* why) const noexcept {
  if (set_default_ != nullptr) [[likely]]
    set_default_(object);
  else
    std::memset(object, 0, bytes_);
  if (why != nullptr) why->parts_ = 0;
  return run{validated_object, null_is_nan_, why}.whole(shapes_[0], static_cast<char*>(object));
}

} // namespace rowe::json
