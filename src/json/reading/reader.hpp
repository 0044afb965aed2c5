// SPDX-License-Identifier: Apache-2.0
// Reads JSON that others wrote, in two separate steps. First a reader *validates* a whole text, once, on the
// service thread. Then whoever holds the text *walks* it lazily and in place, without a tree, a copy or an
// allocation. So malformed text never leaves the service thread, and members that nobody reads cost nothing.
//
// Validation has two parts. simdjson's first stage finds the tokens, the strings and wrong UTF-8. Then a
// check of the tokens (token_check.hpp) also makes an index of the members of the whole object. If the two do
// not accept a text, a scanner decides by the grammar alone, and says where the text is wrong.
//
// What is accepted is RFC 8259 with these decisions: UTF-8 only, no byte order mark, no unpaired surrogate in
// an escape, no number beyond the range of a double; duplicate names are accepted (codecs refuse them for the
// names they reserve).
#pragma once
#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <rowe/result.hpp>

namespace rowe::json {

enum class kind : std::uint8_t { object, array, string, number, boolean, null };

// A value inside a validated text. Valid as long as the text is.
struct value {
  kind type = kind::null;
  std::string_view raw; // as written: quotes included for strings, brackets for objects and arrays
};

struct member {
  std::string_view name_raw; // without quotes, still escaped: compare with name_is()
  value what;
};

// A validated text, and what its validation has indexed: the first members, when it is an object. Valid as
// long as the text is, and the index as long as the reader says.
struct document {
  constexpr document() noexcept = default;
  template <std::convertible_to<std::string_view> Text>
  document(const Text& validated) noexcept : text{validated} {}

  std::string_view text;
  std::span<const member> indexed;
  const char* behind_index = nullptr; // where the other members are, if any were indexed
};

struct placed_member; // scanner.hpp

// Validates texts. Belongs to one thread at a time.
class reader {
 public:
  // Bytes behind every text that must be readable (their values do not matter).
  static constexpr std::size_t tailroom_bytes = 64;
  static constexpr std::size_t depth_max_default = 64;

  // Allocates all that it takes to validate texts of up to `bytes_max` bytes: about 4 bytes for each byte.
  // For set-up. Errors: bad_argument if bytes_max is not in [1, 4 GiB) or depth_max not in [1, 1024];
  // no_memory.
  [[nodiscard]] static result<reader> create(std::size_t bytes_max,
                                             std::size_t depth_max = depth_max_default);

  reader(reader&&) noexcept;
  reader& operator=(reader&&) noexcept;
  ~reader();

  // Is `text` one valid JSON value and nothing else? Never waits, never allocates; less than 1 ns a byte.
  // Errors: too_big (value: its bytes, limit: bytes_max); too_deep (limit: depth_max, the number of objects
  // and arrays that may be open at once); malformed (value: the index of the first byte that is wrong, or the
  // length when the text ends too early).
  [[nodiscard]] status validate(std::string_view text) noexcept;

  // As validate(), but it also refuses the few valid texts that token_check.hpp names, and does not look for
  // what is wrong, which takes up to 55 instructions a byte (scanner.hpp).
  [[nodiscard]] bool validate_tokens(std::string_view text) noexcept;

  // The first members of the object that validate() refused last, those that are complete before its fault.
  std::span<const placed_member> members_before_fault() const noexcept;

  // How many tokens the text had that was looked at last: brackets, commas, colons, and all that
  // stands between them. 0: it was found wrong before they were counted, or is longer than bytes_max.
  std::size_t tokens() const noexcept { return tokens_; }

  // The text that was looked at last, if it was accepted. Its index is valid until the next call.
  const document& last() const noexcept;

 private:
  struct state;
  reader(std::unique_ptr<state> s, std::size_t bytes_max, std::size_t depth_max) noexcept;

  std::unique_ptr<state> state_;
  std::size_t bytes_max_;
  std::size_t depth_max_;
  std::size_t tokens_ = 0;
};

// All that follows works on text that validate() accepted, on any thread. Nothing waits or allocates, or
// writes outside the given scratch. Text that was not validated is never read beyond its end, and every walk
// of it ends; but what is found there means nothing.

// The value of `validated`, without the white space around it.
ROWE_RT value root(std::string_view validated) noexcept;

ROWE_RT inline bool is_object(std::string_view validated) noexcept {
  const std::size_t begin = validated.find_first_not_of(" \t\n\r");
  return begin != std::string_view::npos && validated[begin] == '{';
}

// Walks the members of an object, in the order of the text.
class object_walk {
 public:
  // Of anything but an object there are no members.
  ROWE_RT explicit object_walk(const document& validated_object) noexcept;
  // The next member; false, and `into` untouched, when there is none.
  ROWE_RT bool next(member& into) noexcept {
    if (indexed_ == indexed_end_) return at_ != end_ && find_next(into);
    into = *indexed_++;
    return true;
  }

 private:
  bool find_next(member& into) noexcept;

  const member* indexed_;
  const member* indexed_end_;
  const char* at_;
  const char* end_;
};

class array_walk {
 public:
  // Of anything but an array there are no elements.
  ROWE_RT explicit array_walk(std::string_view validated_array) noexcept;
  // Goes on from `place`, which another walk of an array in this text had, up to the end of that array.
  ROWE_RT array_walk(std::string_view validated_text, std::size_t place) noexcept
      : at_{validated_text.data() + std::min(place, validated_text.size())},
        end_{validated_text.data() + validated_text.size()} {}
  // Where this walk is in the text in which its array lies.
  ROWE_RT std::size_t place_in(std::string_view text) const noexcept {
    return static_cast<std::size_t>(at_ - text.data());
  }
  // The next element; false, and `into` untouched, when there is none.
  ROWE_RT bool next(value& into) noexcept;

 private:
  const char* at_;
  const char* end_;
};

// Does `escaped` (the text between the quotes) mean `plain`? Every escape is longer than its character. So
// the length and the first byte distinguish most texts; they are compared inline, because the compiler often
// knows `plain`.
ROWE_RT bool says_by_escapes(std::string_view escaped, std::string_view plain) noexcept;
ROWE_RT inline bool says(std::string_view escaped, std::string_view plain) noexcept {
  if (escaped.size() == plain.size()) return escaped == plain && plain.find('\\') == std::string_view::npos;
  if (escaped.size() < plain.size() || plain.empty()) return false;
  if (escaped.front() != plain.front() && escaped.front() != '\\') return false;
  return says_by_escapes(escaped, plain);
}

// Is this the member's name? Escapes are understood: {"\u006fp":1} has a member "op".
ROWE_RT inline bool name_is(const member& m, std::string_view name) noexcept {
  return says(m.name_raw, name);
}
// Is this value a string that says `text`? Escapes are understood ("\/odom" says "/odom").
ROWE_RT inline bool text_is(const value& v, std::string_view text) noexcept {
  return v.type == kind::string && v.raw.size() >= 2 && says(v.raw.substr(1, v.raw.size() - 2), text);
}

// The first member with this name, searched from the start of the object each time.
ROWE_RT std::optional<value> find(const document& validated_object, std::string_view name) noexcept;

// Resolves escapes. `escaped` is the text between the quotes. The answer is `escaped` itself if it has no
// backslash, else it is in `scratch`; nothing if scratch is too small (escaped.size() bytes are always
// enough).
ROWE_RT std::optional<std::string_view> unescape(std::string_view escaped, std::span<char> scratch) noexcept;

// Resolves as many escapes as fit into `scratch`, which has room for a character (4 bytes), and takes them
// off the front of `escaped`. So a long string can be read in parts, which end between characters of it that
// were escaped, but perhaps within others.
ROWE_RT std::string_view unescape_some(std::string_view& escaped, std::span<char> scratch) noexcept;

// The string's text, as unescape(). Nothing when the value is no string.
ROWE_RT std::optional<std::string_view> to_string(const value& v, std::span<char> scratch) noexcept;
// The number's nearest double; -0.0 keeps its sign. Nothing when the value is no number.
ROWE_RT std::optional<double> to_double(const value& v) noexcept;
// Nothing when the value is no number, has a fraction or an exponent, or lies outside the type.
ROWE_RT std::optional<std::int64_t> to_integer(const value& v) noexcept;
ROWE_RT std::optional<std::uint64_t> to_unsigned(const value& v) noexcept;
ROWE_RT std::optional<bool> to_boolean(const value& v) noexcept;

} // namespace rowe::json
