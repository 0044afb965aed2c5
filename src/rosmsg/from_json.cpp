// SPDX-License-Identifier: Apache-2.0
// JSON to bytes. The bytes of a message are in the order of its definition, the members of JSON in any. While
// they come in that order, each is written when it is met. From the first on that does not, the places of the
// others are looked up before they are written, 64 in a pass, so that nothing is allocated.
#include "rosmsg/from_json.hpp"

#include <algorithm>
#include <array>

#include "rosmsg/value_writer.hpp"
#include "json/reading/cursor.hpp"
#include "json/reading/reader.hpp"

namespace rowe::rosmsg {
namespace {

using json::skip_space;

class message_writer : value_writer {
 public:
  message_writer(const std::vector<type>& types, ros_version version, ros_encoding in, std::string_view text,
                 output& to, failure& why) noexcept
      : value_writer{version, in, text, to, why}, types_{types} {}

  bool message(const char* at) {
    at = skip_space(at, end_);
    if (at == end_ || *at != '{') return wrong(errc::not_an_object, "an object", at);
    return fits(wire_.head()) && object(types_[0], at);
  }
  bool default_of(const member& m) { return fits(wire_.head()) && absent(m); }

 private:
  // `at` is the brace; it becomes what is behind the object. So it is with all values.
  bool object(const type& t, const char*& at) {
    if (t.members.empty() && wire_.is_cdr() && !fits(wire_.put(std::uint8_t{0}))) return false;
    std::size_t written = 0;
    at = skip_space(at + 1, end_);
    bool more = at != end_ && *at == '"';
    while (more && written < t.members.size()) {
      const member& m = t.members[written];
      const char* value_at = at;
      if (take_name(value_at) != m.name || value_at == end_) break;
      at = value_at;
      if (!any(m, at)) return why_.in(m.name);
      ++written;
      more = next(at);
    }
    if (more) {
      if (!others(t, written, at)) return false;
    } else {
      for (; written < t.members.size(); ++written)
        if (!absent(t.members[written])) return why_.in(t.members[written].name);
    }
    at = behind(at, 1);
    return true;
  }

  // Writes the members from `first` on. Their values come in any order, from the name at `at` on.
  bool others(const type& t, std::size_t first, const char*& at) {
    constexpr std::size_t window = 64;
    const char* const names = at;
    const std::size_t before = first;
    do {
      const std::size_t last = std::min(t.members.size(), first + window);
      std::array<const char*, window> places{};
      at = names;
      for (bool more = true; more; more = next(at)) {
        const std::size_t m = find(t, take_name(at));
        if (at == end_) break;
        if (m < before) return twice(t.members[m].name);
        if (m >= first && m < last) {
          if (places[m - first] != nullptr) return twice(t.members[m].name);
          places[m - first] = at;
        }
        at = json::skip_value(at, end_);
      }
      for (std::size_t m = first; m < last; ++m) {
        const char* value_at = places[m - first];
        if (!(value_at == nullptr ? absent(t.members[m]) : any(t.members[m], value_at)))
          return why_.in(t.members[m].name);
      }
      first = last;
    } while (first < t.members.size());
    return true;
  }

  // The place of the member of this name, which may have escapes; beyond all if there is none.
  static std::size_t find(const type& t, std::string_view escaped) noexcept {
    std::array<char, name_bytes_max> scratch;
    const auto name = json::unescape(escaped, scratch);
    if (!name) return t.members.size();
    const auto found =
        std::lower_bound(t.by_name.begin(), t.by_name.end(), *name,
                         [&](std::size_t m, std::string_view n) { return t.members[m].name < n; });
    const bool is_it = found != t.by_name.end() && t.members[*found].name == *name;
    return is_it ? *found : t.members.size();
  }

  bool any(const member& m, const char*& at) {
    if (m.many != form::one) return m.is_bytes() && *at == '"' ? base64(m, at) : array(m, at);
    return element(m, at);
  }
  bool element(const member& m, const char*& at) {
    if (m.what != kind::object) return value(m, at);
    return *at == '{' ? object(types_[m.object], at) : wrong(errc::wrong_type, m, at);
  }

  bool array(const member& m, const char*& at) {
    if (*at != '[') return wrong(errc::wrong_type, wanted_array(m), at);
    std::size_t count_at = 0;
    if (m.many == form::sequence && !fits(wire_.begin_count(count_at))) return false;
    const char* const begin = at;
    std::size_t count = 0;
    at = skip_space(at + 1, end_);
    for (bool more = at != end_ && *at != ']'; more; more = next(at)) {
      if (count == m.count) return too_long(wanted_array(m), elements(begin), m.count);
      if (!element(m, at)) return why_.in(count);
      ++count;
    }
    at = behind(at, 1);
    if (m.many == form::fixed && count != m.count) return too_long(wanted_array(m), count, m.count);
    if (m.many == form::sequence) wire_.set_count(count_at, static_cast<std::uint32_t>(count));
    return true;
  }
  std::size_t elements(const char* array) const noexcept {
    json::array_walk walk{json::between(array, end_)};
    std::size_t count = 0;
    for (json::value one; walk.next(one);) ++count;
    return count;
  }

  // ---- what the JSON leaves out ----

  bool absent(const member& m) {
    if (!m.default_json.empty()) return default_value(m);
    if (m.many == form::sequence) return fits(wire_.put(std::uint32_t{0}));
    const std::uint32_t count = m.many == form::fixed ? m.count : 1;
    if (m.what != kind::object) return zero(m, count);
    const type& inner = types_[m.object];
    if (inner.least(wire_.how()) == 0) return true; // whatever is in it takes no bytes
    for (std::uint32_t i = 0; i < count; ++i)
      if (!absent(inner)) return false;
    return true;
  }
  bool absent(const type& t) {
    if (t.members.empty()) return fits(wire_.put(std::uint8_t{0})); // in CDR only: else it takes no bytes
    for (const member& m : t.members)
      if (!absent(m)) return why_.in(m.name);
    return true;
  }
  bool default_value(const member& m) {
    const char* const text_end = end_;
    const char* at = m.default_json.data();
    end_ = at + m.default_json.size();
    is_default_ = true;
    const bool good = any(m, at);
    is_default_ = false;
    end_ = text_end;
    return good;
  }

  const std::vector<type>& types_;
};

} // namespace

bool from_json(const definition& of, ros_encoding in, std::string_view validated, output& to, failure& why) {
  return message_writer{of.types, of.version, in, validated, to, why}.message(validated.data());
}

bool check_default(ros_version version, const member& of, failure& why) {
  std::string scratch;
  output to{scratch, least_bytes_max};
  return message_writer{{}, version, ros_encoding::cdr, {}, to, why}.default_of(of);
}

} // namespace rowe::rosmsg
