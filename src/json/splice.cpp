// SPDX-License-Identifier: Apache-2.0
#include "json/splice.hpp"

#include <cassert>

namespace rowe::json {
namespace {

constexpr bool is_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

} // namespace

// Where no member precedes, the bracket that opened the object is taken back, and that of the value, or one
// that end() writes, stands in its place.
splice::splice(writer& into) noexcept
    : into_{into}, from_{into.bytes()}, members_precede_{into.comma_ || into.overflowed_} {
  if (!members_precede_) {
    assert(from_ > 0 && into_.at_[-1] == '{');
    --into_.at_;
    --from_;
  }
  into_.comma_ = false;
}

void splice::end(std::string_view name) noexcept {
  if (into_.overflowed_) return;
  assert(into_.bytes() >= from_);
  char* first = into_.begin_ + from_;
  char* last = into_.at_; // behind the value
  while (first != last && is_space(*first)) ++first;
  while (first != last && is_space(last[-1])) --last;
  if (last - first >= 2 && *first == '{' && last[-1] == '}') return merge(first, last - 1);
  if (first != last) return wrap(name);
  into_.at_ = into_.begin_ + from_;
  into_.comma_ = members_precede_;
  if (!members_precede_) into_.put('{');
}

// Between the brackets at `first` and `last`. The closing one is taken back; the opening one becomes the
// comma behind the members that precede, or stays, as that of the object around.
void splice::merge(char* first, char* last) noexcept {
  while (last - first > 1 && is_space(last[-1])) --last;
  const bool empty = last - first == 1;
  if (!members_precede_) {
    into_.at_ = last;
    into_.comma_ = !empty;
  } else {
    *first = ',';
    into_.at_ = empty ? into_.begin_ + from_ : last;
    into_.comma_ = true;
  }
}

// Moves the value to make room for the member's name.
void splice::wrap(std::string_view name) noexcept {
  constexpr std::size_t marks = 4; // a comma or bracket, two quotes, a colon
  char* const value = into_.begin_ + from_;
  const auto value_bytes = static_cast<std::size_t>(into_.at_ - value);
  if (static_cast<std::size_t>(into_.end_ - into_.at_) < name.size() + marks) return into_.overflow();
  std::memmove(value + name.size() + marks, value, value_bytes);
  into_.at_ = value;
  into_.put(members_precede_ ? ',' : '{');
  into_.put('"');
  into_.append(name);
  into_.append("\":");
  into_.at_ += value_bytes;
  into_.comma_ = true;
}

} // namespace rowe::json
