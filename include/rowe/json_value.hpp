// SPDX-License-Identifier: Apache-2.0
// Reads JSON text in place: without a tree, without a copy, and without a schema where there is none. What
// was received (rowe::received, rowe::message_view, a request of json_text) has these functions itself:
//
//   const auto sum = reply->get<double>("result");      // {"result":42}
//   if (!sum) log(sum.error().message());               // the member "result" is missing; a number is wanted
//
//   if (const auto pose = message->find("robots[2].pose")) {
//     for (const auto [name, value] : pose->members()) show(name.text(), value.text());
//   }
//   const auto goal = message->as<point>("goal");       // a struct that has a schema
//
// A path is names and indices from 0, `a.b[2]`. A name may also be written `['a']`, or `["a"]`; so must those
// that are empty, or have `.` or `[` in them. The empty path is the value itself. Names are compared by what
// they mean: {"\u0061":1} has a member `a`. Of members with the same name the first counts; whoever must not
// be fooled by another parser that takes the last one reads with as<T>(), which refuses them.
//
// Nothing here waits or allocates, but for get<std::string>() and json_error::message(). A path is followed
// in one pass over the text. A value is a view: it is valid as long as the text is, and as cheap to copy as a
// std::string_view. Any number of threads may read the same text.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include <rowe/detail/json_access.hpp>
#include <rowe/fixed_string.hpp>
#include <rowe/json_error.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

enum class json_kind : std::uint8_t { object, array, string, number, boolean, null };

class json_value;
struct json_member;
template <class Item>
class json_range;

// What get<T>() reads:
//
//   bool                    true, false
//   integers, enums         a number that is whole, however it is written (3, 3.0, 3e0), exact to the last
//                           digit, beyond 2^53, too. An enum whose names are listed (rowe::names) is read
//                           from a name, or from the number of one, as by_name() does. Any other is read as
//                           its number; whether that is one of its own is not looked at
//   std::chrono             durations, and times of system_clock: their count, as a schema reads them
//   double, float           any number, rounded once; -0 keeps its sign. null is none (as<T>() reads it as
//                           NaN): ask for an optional
//   fixed_string            a string that is no longer, its escapes resolved
//   std::string_view        a string that is written without escapes, in place. For any other: get(path,
//                           scratch), fixed_string, or std::string, which allocates
//   std::array, bounded_array of std::uint8_t or std::byte
//                           base64, with padding; or an array of numbers. Errors: also too_long (value: its
//                           bytes, limit: those that it has; of a std::array exactly so many)
//   std::optional           nothing where nothing or null stands; anything but that must be as above
//   json_value              any value
template <class T>
concept json_readable = detail::json_wanted<T>::readable;

class json_value {
 public:
  // The value null.
  ROWE_RT constexpr json_value() noexcept = default;

  // The value that `text` is; valid as long as that is. For texts that were not received; what was is checked
  // already. Never waits, never allocates; about 5 ns a byte. Errors: malformed (value: the index of the
  // first byte that is wrong, or of a number that no double can hold, or the length when the text ends too
  // early); too_deep (more than `depth_max` objects and arrays are open at once; value: as of malformed);
  // bad_argument (depth_max is beyond 1024).
  ROWE_RT static result<json_value> parse(std::string_view text, std::size_t depth_max = 64) noexcept;

  ROWE_RT json_kind kind() const noexcept;
  // As it is written: a string in quotes and with its escapes, an object with its brackets.
  ROWE_RT constexpr std::string_view text() const noexcept { return text_; }
  // Is it a string that means `text`? Escapes are understood.
  ROWE_RT bool says(std::string_view text) const noexcept;

  // What stands at `path`; nothing where nothing does, or where the path is wrong. Steps in proportion to the
  // text.
  ROWE_RT std::optional<json_value> find(std::string_view path) const noexcept;

  // What stands at `path`, as a T. Steps in proportion to the text. Errors: see json_error.
  template <json_readable T>
  ROWE_RT json_result<T> get(std::string_view path = {}) const noexcept;

  // Says in one sentence why a T cannot be read.
  template <class T>
  requires(!json_readable<T> && !std::same_as<T, std::string>) json_result<T> get(std::string_view = {})
  const noexcept {
    static_assert(json_readable<T>, "rowe: get<T>() reads bool, numbers, enums, durations, strings, "
                                    "bytes, std::optional of these, and json_value; a struct with a "
                                    "schema is read by as<T>()");
    return json_error{};
  }

  // The string at `path`: in place where it has no escapes, else in `scratch`. As many bytes as the string
  // has, as written, are enough. Errors: also too_long, if `scratch` is too small.
  template <std::same_as<std::string_view> T>
  ROWE_RT json_result<T> get(std::string_view path, std::span<char> scratch) const noexcept;

  // The string at `path`. Allocates; throws std::bad_alloc only. Not for real-time loops.
  template <std::same_as<std::string> T>
  json_result<T> get(std::string_view path = {}) const;

  // The object at `path`, read by the schema of T as a subscriber would: each member must be there once, and
  // fit; those that the schema does not know are passed over. Errors: those of get(), whose path says which
  // member it is, and duplicate_member. Each T that is read so anywhere in the program has its schema
  // compiled before main() (or when its library is loaded); what that allocates is kept. So this never
  // allocates, on a real-time thread either. Before main(), and when there was no memory or the schema is too
  // large: misuse, no_memory, bad_argument (without a path).
  template <described T>
  ROWE_RT json_result<T> as(std::string_view path = {}) const noexcept;

  // The members of an object, the elements of an array, in the order of the text; of anything else none.
  ROWE_RT json_range<json_member> members() const noexcept;
  ROWE_RT json_range<json_value> elements() const noexcept;

 private:
  friend struct detail::json_access;
  constexpr explicit json_value(std::string_view validated) noexcept : text_{validated} {}

  std::string_view text_ = "null";
};

// A member of an object. Its name is a string: `name.says("x")`, `name.get<std::string_view>()`.
struct json_member {
  json_value name;
  json_value value;
};

// The members of an object or the elements of an array, for one pass after the other.
template <class Item>
class json_range {
 public:
  class iterator {
   public:
    using value_type = Item;
    using difference_type = std::ptrdiff_t;

    ROWE_RT constexpr iterator() noexcept = default;
    ROWE_RT const Item& operator*() const noexcept { return item_; }
    ROWE_RT iterator& operator++() noexcept {
      there_ = detail::json_access::next(rest_, item_);
      return *this;
    }
    ROWE_RT iterator operator++(int) noexcept {
      const iterator before = *this;
      ++*this;
      return before;
    }
    ROWE_RT bool operator==(std::default_sentinel_t) const noexcept { return !there_; }
    ROWE_RT bool operator==(const iterator& other) const noexcept {
      return there_ == other.there_ && (!there_ || rest_.data() == other.rest_.data());
    }

   private:
    friend json_range;
    explicit iterator(std::string_view inside) noexcept : rest_{inside} { ++*this; }

    std::string_view rest_; // behind the item
    Item item_{};
    bool there_ = false;
  };

  ROWE_RT iterator begin() const noexcept { return iterator{inside_}; }
  ROWE_RT std::default_sentinel_t end() const noexcept { return {}; }

 private:
  friend class json_value;
  explicit json_range(std::string_view inside) noexcept : inside_{inside} {}

  std::string_view inside_; // behind the opening bracket; empty: none
};

template <json_readable T>
json_result<T> json_value::get(std::string_view path) const noexcept {
  using wanted = detail::json_wanted<T>;
  detail::json_place at = detail::json_access::follow(text_, path);
  if constexpr (wanted::optional) {
    if (at.is == detail::json_outcome::missing) return T{};
    if (at.is == detail::json_outcome::there && at.value.starts_with('n')) return T{};
  }
  typename wanted::value_type value{};
  if (at.is == detail::json_outcome::there && wanted::read(at, value)) return T{value};
  return detail::json_access::failure(at, path, wanted::bounds);
}

template <std::same_as<std::string_view> T>
json_result<T> json_value::get(std::string_view path, std::span<char> scratch) const noexcept {
  detail::json_place at = detail::json_access::follow(text_, path);
  std::string_view value;
  if (at.is == detail::json_outcome::there && detail::json_access::read(at, scratch, value)) return value;
  return detail::json_access::failure(at, path, {.what = detail::json_form::text, .most = scratch.size()});
}

template <std::same_as<std::string> T>
json_result<T> json_value::get(std::string_view path) const {
  detail::json_place at = detail::json_access::follow(text_, path);
  if (at.is == detail::json_outcome::there) {
    std::string value(at.value.size(), '\0');
    std::string_view in_place;
    if (detail::json_access::read(at, value, in_place)) return std::string{in_place};
  }
  return detail::json_access::failure(at, path, {.what = detail::json_form::text});
}

template <described T>
json_result<T> json_value::as(std::string_view path) const noexcept {
  static_assert(describe<T>().decodable,
                "rowe: a T that is read may have no const member, and needs a default value");
  const detail::json_place at = detail::json_access::follow(text_, path);
  if (at.is != detail::json_outcome::there) {
    return detail::json_access::failure(at, path, {.what = detail::json_form::object});
  }
  T object;
  if (const auto why = detail::decoder_of<T>.decode(at.value, path, &object)) return *why;
  return object;
}

namespace detail {

inline bool json_wanted<json_value>::read(json_place& at, json_value& into) noexcept {
  into = json_access::value_of(at.value);
  return true;
}

// The functions of json_value for a class whose value() is a validated text. All are valid as long as that
// is.
template <class Holder>
class reads_json {
 public:
  // The text as a value.
  ROWE_RT json_value json() const noexcept {
    return json_access::value_of(static_cast<const Holder&>(*this).value());
  }

  // As json_value::get(), find(), as(), members() and elements() of it.
  template <json_readable T>
  ROWE_RT json_result<T> get(std::string_view path = {}) const noexcept {
    return json().template get<T>(path);
  }
  template <std::same_as<std::string_view> T>
  ROWE_RT json_result<T> get(std::string_view path, std::span<char> scratch) const noexcept {
    return json().template get<T>(path, scratch);
  }
  template <class T>
  requires(!json_readable<T>) json_result<T> get(std::string_view path = {})
  const { return json().template get<T>(path); }
  ROWE_RT std::optional<json_value> find(std::string_view path) const noexcept { return json().find(path); }
  template <described T>
  ROWE_RT json_result<T> as(std::string_view path = {}) const noexcept {
    return json().template as<T>(path);
  }
  ROWE_RT json_range<json_member> members() const noexcept { return json().members(); }
  ROWE_RT json_range<json_value> elements() const noexcept { return json().elements(); }
};

// For a class that holds a struct.
class reads_none {};

} // namespace detail
} // namespace rowe
