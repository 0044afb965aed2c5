// SPDX-License-Identifier: Apache-2.0
#include "json/writing/splice.hpp"

#include <cassert>

#include "json/text/characters.hpp"

namespace rowe::json {

// If no member precedes, the opening bracket of the object is removed. The bracket of the value replaces it,
// or one that end() writes.
splice::splice(writer& into) noexcept
    : into_{into}, from_{into.bytes()}, members_precede_{into.comma_ || into.overflowed_} {
  if (!members_precede_) {
    assert(from_ > 0 && into_.at_[-1] == '{');
    --into_.at_;
    --from_;
  }
  into_.comma_ = false;
}

std::string_view splice::value() const noexcept {
  return {into_.begin_ + from_, static_cast<std::size_t>(into_.at_ - (into_.begin_ + from_))};
}

void splice::end(std::string_view name) noexcept { end(name, true); }
void splice::end_apart(std::string_view name) noexcept { end(name, false); }

void splice::end(std::string_view name, bool merges) noexcept {
  if (into_.overflowed_) return;
  assert(into_.bytes() >= from_);
  char* first = into_.begin_ + from_;
  char* last = into_.at_; // behind the value
  while (first != last && is_white_space(*first)) ++first;
  while (first != last && is_white_space(last[-1])) --last;
  if (merges && last - first >= 2 && *first == '{' && last[-1] == '}') return merge(first, last - 1);
  if (first != last) return wrap(name);
  into_.at_ = into_.begin_ + from_;
  into_.comma_ = members_precede_;
  if (!members_precede_) into_.put('{');
}

// Merges the members between the brackets at `first` and `last`. The closing bracket is removed. The opening
// one becomes the comma behind the preceding members, or it remains, as the bracket of the outer object.
void splice::merge(char* first, char* last) noexcept {
  while (last - first > 1 && is_white_space(last[-1])) --last;
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
