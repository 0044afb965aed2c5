// SPDX-License-Identifier: Apache-2.0
// Validates a JSON text by the grammar of RFC 8259, and finds the byte that is wrong. The text may come in
// pieces and be of any length: no byte is looked at again, and no piece is needed any more once it was fed.
// The reader is several times as quick, but needs the whole text at once, and takes all of its time at once.
// Where the reader's check of tokens does not accept a text, a scanner decides. Whoever feeds a scanner
// decides by the size of the pieces how long each call takes: at most 55 instructions a byte; for numbers 12
// to 18, for long strings 1.2 (tests/counts/instructions.py). tests/fuzz/json_reader.cpp compares it with
// simdjson.
//
// It also makes an index of the first members of the outermost object, by their places in the text.
#pragma once
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "json/reading/double_range.hpp"
#include "json/reading/reader.hpp"

namespace rowe::json {

enum class fault_kind : std::uint8_t {
  none,
  malformed, // no JSON, no UTF-8, an unpaired surrogate, or a number that no double can hold
  too_deep,
};

struct fault {
  fault_kind what = fault_kind::none;
  std::size_t at = 0; // index of the first wrong byte; the text's length where it ends too early

  friend bool operator==(const fault&, const fault&) = default;
};

inline constexpr std::size_t fault_depth_limit = 1024; // the most levels that can be asked for

// A stretch of a text, in bytes from its beginning.
struct stretch {
  std::size_t at = 0;
  std::size_t bytes = 0;

  friend bool operator==(const stretch&, const stretch&) = default;
};

// A member of the outermost object: as json::member, by its places.
struct placed_member {
  stretch name; // without quotes, still escaped
  stretch raw;  // of the value: quotes included for strings, brackets for objects and arrays
  kind type = kind::null;
};

// One thread at a time. Nothing waits or allocates.
class scanner {
 public:
  static constexpr std::size_t members_max = 16; // that are indexed

  // `depth_max`: how many objects and arrays may be open at once, 1 to fault_depth_limit.
  explicit scanner(std::size_t depth_max = reader::depth_max_default) noexcept;

  // The next bytes of the text; reads nothing beyond them. Steps in proportion to them. False when no text
  // that begins so is valid: found() says why. Then nothing more is looked at.
  bool feed(std::string_view piece) noexcept;
  // The text ends here. Is it valid?
  bool finish() noexcept;

  // What came is a whole object or array; only white space may follow.
  bool is_closed() const noexcept {
    return state_ == state::behind_value && depth_ == 0 && found_.what == fault_kind::none;
  }

  const fault& found() const noexcept { return found_; }
  // Of the pieces that were accepted.
  std::size_t bytes() const noexcept { return before_; }

  // Those that are complete, in the order of the text.
  std::span<const placed_member> members() const noexcept { return {members_.data(), member_count_}; }
  // The object has had others behind these.
  bool has_more_members() const noexcept { return more_members_; }

 private:
  enum class state : std::uint8_t {
    value,         // a value, after white space
    first_element, // the same, or the end of the array
    name,          // of a member
    first_name,    // the same, or the end of the object
    colon,
    behind_value,
    // Those above are between tokens, where white space may be; those below are within one.
    string,
    character,     // the rest of one that is not ASCII
    escape,        // what follows a backslash
    unit,          // hexadecimal digits
    low_backslash, // the second half of a pair of surrogates must follow
    low_u,
    word,
    minus, // numbers: what the last character was
    zero,
    integer,
    point,
    fraction,
    exponent_mark,
    exponent_sign,
    exponent,
  };

  static constexpr state last_between = state::behind_value;

  // One step each: from `at` on, in the present state; they return how far they came. A step that fails
  // records the fault and returns nullptr.
  const char* step(const char* at, const char* end) noexcept;
  const char* between(const char* at, const char* end) noexcept; // tokens
  const char* begin_value(const char* at, const char* end) noexcept;
  const char* open(const char* at, bool object) noexcept;
  const char* close(const char* at) noexcept;
  const char* in_string(const char* at, const char* end) noexcept;
  const char* begin_character(const char* at, const char* end) noexcept;
  const char* in_character(const char* at) noexcept;
  const char* in_escape(const char* at) noexcept;
  const char* in_unit(const char* at) noexcept;
  const char* in_word(const char* at) noexcept;
  const char* begin_number(const char* at, const char* end) noexcept;
  const char* in_number(const char* at, const char* end) noexcept;
  const char* digits(const char* at, const char* end) noexcept;

  void end_value(std::size_t end) noexcept;
  bool end_number(std::size_t end) noexcept;

  bool is_indexed_level() const noexcept { return depth_ == 1 && is_object_[0]; }
  std::size_t place_of(const char* at) const noexcept {
    return before_ + static_cast<std::size_t>(at - piece_);
  }
  const char* wrong(const char* at) noexcept { return wrong_at(place_of(at)); }
  const char* wrong_at(std::size_t place, fault_kind what = fault_kind::malformed) noexcept {
    found_ = {what, place};
    return nullptr;
  }

  const char* piece_ = nullptr; // only during a feed()
  std::size_t before_ = 0;      // bytes before this piece
  std::size_t mark_ = 0;        // where the number, the escape or the character begins
  const char* word_ = nullptr;  // what of it must still come
  double_range range_;          // of the number
  std::uint32_t unit_ = 0;
  std::uint8_t unit_digits_ = 0;
  std::uint8_t missing_ = 0; // bytes of the character, and the bounds of the next
  std::uint8_t low_ = 0;
  std::uint8_t high_ = 0;
  state state_ = state::value;
  bool in_name_ = false;
  bool low_half_ = false; // of a pair of surrogates
  bool finished_ = false;
  bool more_members_ = false;

  std::uint16_t depth_ = 0;
  std::uint16_t depth_max_;
  bool in_object_ = false;                   // the innermost level is one
  std::bitset<fault_depth_limit> is_object_; // of each open level

  fault found_;
  std::size_t member_count_ = 0;
  placed_member next_; // the member that is not complete
  std::array<placed_member, members_max> members_;
};

// What a scanner finds in a whole text. `depth_max`: as the scanner's. Steps in proportion to the text; any
// thread; never waits or allocates.
fault find_fault(std::string_view text, std::size_t depth_max) noexcept;

} // namespace rowe::json
