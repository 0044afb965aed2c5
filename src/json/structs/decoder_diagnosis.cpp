// SPDX-License-Identifier: Apache-2.0
// The diagnostic for a text that could not be decoded, for a status, an event or a refusal. It is made only
// when it is needed.
#include <limits>

#include "json/reading/cursor.hpp"
#include "json/structs/decoder_program.hpp"
#include "json/text/words.hpp"

namespace rowe::json {
namespace {

constexpr std::size_t path_bytes_max = 128;
constexpr std::size_t value_bytes_max = 48;

template <class Integer>
words& add_integer(words& to) noexcept {
  return to.add("a whole number from ")
      .add(std::numeric_limits<Integer>::min())
      .add(" to ")
      .add(std::numeric_limits<Integer>::max());
}

} // namespace

std::string_view decoder::diagnosis::write(std::span<char> buffer, piece asked) const noexcept {
  words to{buffer};
  const auto add_elements = [&](const step& s) {
    to.add(s.base64 ? "base64 of " : "an array of ").add(s.all_of_it ? "" : "at most ").add(s.count);
    to.add(s.base64 ? " byte" : " element").add(s.count == 1 ? "" : "s");
  };
  const auto add_seconds = [&](const step& s) {
    const auto index = static_cast<int>(s.what) - static_cast<int>(value_kind::int8);
    const bool has_sign = s.what <= value_kind::int64;
    const int bits = 8 << index % 4;
    std::uint64_t most = std::numeric_limits<std::uint64_t>::max() >> (64 - bits + has_sign);
    for (int i = 0; i < s.decimals; ++i) most /= 10;
    to.add("a number of seconds from ").add(has_sign ? "-" : "").add(has_sign ? most : 0);
    to.add(" to ").add(most);
  };
  const auto add_kind = [&](const step& s) {
    switch (s.what) {
    case value_kind::boolean: to.add("true or false"); break;
    case value_kind::int8: add_integer<std::int8_t>(to); break;
    case value_kind::int16: add_integer<std::int16_t>(to); break;
    case value_kind::int32: add_integer<std::int32_t>(to); break;
    case value_kind::int64: to.add("a whole number of 64 bits"); break;
    case value_kind::uint8: add_integer<std::uint8_t>(to); break;
    case value_kind::uint16: add_integer<std::uint16_t>(to); break;
    case value_kind::uint32: add_integer<std::uint32_t>(to); break;
    case value_kind::uint64: to.add("a whole number of 64 bits that is not negative"); break;
    case value_kind::float32:
      to.add(why_.code == errc::out_of_range ? "a number of single precision" : "a number");
      break;
    case value_kind::float64: to.add("a number"); break;
    case value_kind::text: to.add("a string of at most ").add(s.count).add(" bytes"); break;
    case value_kind::object: to.add("an object"); break;
    case value_kind::array: add_elements(s); break;
    case value_kind::optional: break;
    }
  };
  const auto add_wanted = [&](const step& wanted) {
    const step* s = &wanted;
    while (s->what == value_kind::optional) s = s->element;
    if (s->object != nullptr && s->what != value_kind::object) {
      add_names(to, s->object->count, value_bytes_max,
                [&](std::size_t i) { return s->object->members[i].view(); });
    } else if (s->decimals >= 0) {
      add_seconds(*s);
    } else {
      add_kind(*s);
    }
    if (s != &wanted) to.add(" or null");
  };
  const auto add_found = [&] {
    const char* const last = found_ == end_ ? end_ : skip_value(found_, end_);
    to.add_shortened(between(found_, last), value_bytes_max);
  };

  if (asked == piece::found) {
    const bool is_wrong = why_.code == errc::wrong_type || why_.code == errc::out_of_range || parts_ == 0;
    if (is_wrong) add_found();
    return to.text();
  }
  if (asked == piece::wanted && parts_ != 0) {
    add_wanted(*wanted_);
    return to.text();
  }
  if (parts_ == 0) {
    if (asked != piece::all) return to.add(asked == piece::wanted ? "an object" : "").text();
    to.add("a JSON object is wanted; it is ");
    add_found();
    return to.text();
  }
  std::array<char, path_bytes_max + 64> path_buffer;
  words path{path_buffer};
  for (std::size_t i = parts_; i-- > 0;) {
    const part& p = path_[i];
    if (p.named == nullptr) {
      path.add("[").add(p.element).add("]");
    } else {
      path.add(i + 1 == parts_ ? "" : ".").add_shortened(p.named->view(), path_bytes_max);
    }
  }
  if (asked == piece::path) return to.add(path.text()).text();
  to.add("the member \"").add_shortened(path.text(), path_bytes_max).add("\" ");
  switch (why_.code) {
  case errc::missing_member:
    to.add("is missing; ");
    add_wanted(*wanted_);
    to.add(" is wanted");
    break;
  case errc::duplicate_member: to.add("occurs twice"); break;
  case errc::too_long:
    to.add("must be ");
    // It is counted together with another array, so it must be as long as that one.
    if (wanted_->what == value_kind::array && why_.limit != static_cast<std::int64_t>(wanted_->count)) {
      to.add("as long as the array that is counted with it, ").add(why_.limit);
    } else {
      add_wanted(*wanted_);
    }
    to.add("; it has ").add(why_.value);
    break;
  default:
    to.add("must be ");
    add_wanted(*wanted_);
    to.add("; it is ");
    add_found();
  }
  return to.text();
}

} // namespace rowe::json
