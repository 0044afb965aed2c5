// SPDX-License-Identifier: Apache-2.0
#include "json/reading/scanner.hpp"

#include <cassert>

#include "json/text/characters.hpp"

namespace rowe::json {
namespace {

// Behind a number that is complete in this piece, with an exponent of two digits at most, and so few digits
// that no double is too small for it; nullptr if it is not so simple, or wrong.
const char* skip_short_number(const char* at, const char* end) noexcept {
  constexpr std::ptrdiff_t bytes_max = 200;
  if (end - at > bytes_max) end = at + bytes_max;
  at += *at == '-';
  if (at == end || !is_digit(*at)) return nullptr;
  if (*at++ != '0') {
    while (at != end && is_digit(*at)) ++at;
  }
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    while (at != end && is_digit(*at)) ++at;
    if (at == fraction) return nullptr;
  }
  if (at != end && (*at == 'e' || *at == 'E')) {
    if (++at != end && (*at == '+' || *at == '-')) ++at;
    const char* const exponent = at;
    while (at != end && is_digit(*at)) ++at;
    if (at == exponent || at - exponent > 2) return nullptr;
  }
  return at == end ? nullptr : at;
}

// Behind such numbers and the commas that follow each of them at once, in an array: where the next value may
// begin.
const char* skip_short_elements(const char* at, const char* end) noexcept {
  while (at != end && (is_digit(*at) || *at == '-')) {
    const char* const behind = skip_short_number(at, end);
    if (behind == nullptr || *behind != ',') break;
    at = behind + 1;
  }
  return at;
}

} // namespace

scanner::scanner(std::size_t depth_max) noexcept : depth_max_{static_cast<std::uint16_t>(depth_max)} {
  assert(depth_max >= 1 && depth_max <= fault_depth_limit);
}

bool scanner::feed(std::string_view piece) noexcept {
  assert(!finished_);
  if (found_.what != fault_kind::none) return false;
  piece_ = piece.data();
  const char* const end = piece_ + piece.size();
  for (const char* at = piece_; at != end;) {
    at = step(at, end);
    if (at == nullptr) return false;
  }
  before_ += piece.size();
  return true;
}

bool scanner::finish() noexcept {
  finished_ = true;
  if (found_.what != fault_kind::none) return false;
  switch (state_) {
  case state::zero:
  case state::integer:
  case state::fraction:
  case state::exponent:
    if (!end_number(before_)) return false;
    break;
  case state::unit:
    if (!low_half_) break;
    [[fallthrough]];
  case state::low_backslash:
  case state::low_u:
  case state::character: wrong_at(mark_); return false;
  default: break;
  }
  if (state_ == state::behind_value && depth_ == 0) return true;
  wrong_at(before_);
  return false;
}

const char* scanner::step(const char* at, const char* end) noexcept {
  if (state_ <= last_between) return between(at, end);
  switch (state_) {
  case state::string: return in_string(at, end);
  case state::character: return in_character(at);
  case state::escape:
  case state::unit:
  case state::low_backslash:
  case state::low_u: return in_escape(at);
  case state::word: return in_word(at);
  default: return in_number(at, end);
  }
}

// Goes on from token to token as long as each ends in this piece.
const char* scanner::between(const char* at, const char* end) noexcept {
  while (at != end && state_ <= last_between) {
    const char c = *at;
    if (is_white_space(c)) {
      ++at;
      continue;
    }
    switch (state_) {
    case state::behind_value:
      if (depth_ == 0) return wrong(at);
      if (c == ',') {
        state_ = in_object_ ? state::name : state::value;
        ++at;
        continue;
      }
      if (c != (in_object_ ? '}' : ']')) return wrong(at);
      at = close(at);
      continue;
    case state::first_element:
      if (c == ']') {
        at = close(at);
        continue;
      }
      state_ = state::value;
      [[fallthrough]];
    case state::value:
      if (!in_object_ && depth_ > 0) {
        const char* const next = skip_short_elements(at, end);
        if (next != at) {
          at = next;
          continue;
        }
      }
      at = begin_value(at, end);
      if (at == nullptr) return nullptr;
      continue;
    case state::first_name:
      if (c == '}') {
        at = close(at);
        continue;
      }
      [[fallthrough]];
    case state::name:
      if (c != '"') return wrong(at);
      if (is_indexed_level()) next_.name.at = place_of(at) + 1;
      in_name_ = true;
      state_ = state::string;
      return at + 1;
    default: // a colon
      if (c != ':') return wrong(at);
      state_ = state::value;
      ++at;
      continue;
    }
  }
  return at;
}

const char* scanner::begin_value(const char* at, const char* end) noexcept {
  kind type = kind::number;
  switch (*at) {
  case '{': type = kind::object; break;
  case '[': type = kind::array; break;
  case '"': type = kind::string; break;
  case 't':
  case 'f': type = kind::boolean; break;
  case 'n': type = kind::null; break;
  default: break;
  }
  if (is_indexed_level()) {
    next_.raw.at = place_of(at);
    next_.type = type;
  }
  switch (type) {
  case kind::object:
  case kind::array: return open(at, type == kind::object);
  case kind::string:
    in_name_ = false;
    state_ = state::string;
    return at + 1;
  case kind::boolean:
  case kind::null:
    word_ = *at == 't' ? "rue" : *at == 'f' ? "alse" : "ull";
    state_ = state::word;
    return at + 1;
  default: return begin_number(at, end);
  }
}

const char* scanner::open(const char* at, bool object) noexcept {
  if (depth_ == depth_max_) return wrong_at(place_of(at), fault_kind::too_deep);
  is_object_[depth_++] = object;
  in_object_ = object;
  state_ = object ? state::first_name : state::first_element;
  return at + 1;
}

const char* scanner::close(const char* at) noexcept {
  --depth_;
  in_object_ = depth_ > 0 && is_object_[depth_ - 1U];
  end_value(place_of(at) + 1);
  return at + 1;
}

void scanner::end_value(std::size_t end) noexcept {
  state_ = state::behind_value;
  if (!is_indexed_level()) return;
  if (member_count_ == members_max) {
    more_members_ = true;
    return;
  }
  next_.raw.bytes = end - next_.raw.at;
  members_[member_count_++] = next_;
}

const char* scanner::in_word(const char* at) noexcept {
  if (*at != *word_) return wrong(at);
  if (*++word_ == '\0') end_value(place_of(at) + 1);
  return at + 1;
}

const char* scanner::begin_number(const char* at, const char* end) noexcept {
  if (*at != '-' && !is_digit(*at)) return wrong(at);
  const char* const behind = skip_short_number(at, end);
  if (behind != nullptr) {
    end_value(place_of(behind));
    return behind;
  }
  mark_ = place_of(at);
  range_ = {};
  if (*at == '-') {
    state_ = state::minus;
  } else {
    state_ = *at == '0' ? state::zero : state::integer;
    range_.integer_digit(*at);
  }
  return at + 1;
}

const char* scanner::in_number(const char* at, const char* end) noexcept {
  switch (state_) {
  case state::minus:
    if (!is_digit(*at)) return wrong(at);
    state_ = *at == '0' ? state::zero : state::integer;
    range_.integer_digit(*at);
    return at + 1;
  case state::integer:
    if (is_digit(*at)) return digits(at, end);
    [[fallthrough]];
  case state::zero:
    if (*at == '.') {
      state_ = state::point;
      return at + 1;
    }
    break;
  case state::point:
    if (!is_digit(*at)) return wrong(at);
    state_ = state::fraction;
    return digits(at, end);
  case state::fraction:
    if (is_digit(*at)) return digits(at, end);
    break;
  case state::exponent_mark:
    if (*at == '+' || *at == '-') {
      range_.exponent_sign(*at);
      state_ = state::exponent_sign;
      return at + 1;
    }
    [[fallthrough]];
  case state::exponent_sign:
    if (!is_digit(*at)) return wrong(at);
    state_ = state::exponent;
    [[fallthrough]];
  default:
    for (; at != end && is_digit(*at); ++at) range_.exponent_digit(*at);
    return at == end || end_number(place_of(at)) ? at : nullptr;
  }
  if (*at == 'e' || *at == 'E') {
    state_ = state::exponent_mark;
    return at + 1;
  }
  return end_number(place_of(at)) ? at : nullptr;
}

const char* scanner::digits(const char* at, const char* end) noexcept {
  const bool whole = state_ == state::integer;
  for (; at != end && is_digit(*at) && range_.comparing(); ++at) {
    whole ? range_.integer_digit(*at) : range_.fraction_digit(*at);
  }
  const char* const rest = at;
  while (at != end && is_digit(*at)) ++at;
  if (whole) range_.integer_digits(static_cast<std::size_t>(at - rest));
  return at;
}

bool scanner::end_number(std::size_t end) noexcept {
  if (range_.exceeded()) {
    wrong_at(mark_);
    return false;
  }
  end_value(end);
  return true;
}

fault find_fault(std::string_view text, std::size_t depth_max) noexcept {
  scanner whole{depth_max};
  if (whole.feed(text)) whole.finish();
  return whole.found();
}

} // namespace rowe::json
