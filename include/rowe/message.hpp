// SPDX-License-Identifier: Apache-2.0
// Messages built in place, without the heap:
//
//   rowe::message{"service", "add-two-numbers", "a", 38, "b", 4}
//   rowe::message{"goal", rowe::object("x", 1.5, "y", -2), "path", rowe::array(1, 2, 3), "note", nullptr}
//
// Names and values alternate. An odd number of arguments does not compile, nor does a value that JSON does
// not have. Values are: bool, integers, float and double (the fewest digits that read back the same; NaN and
// infinities become null), strings of UTF-8 (wrong bytes become U+FFFD), nullptr, std::optional (null while
// empty), rowe::object, rowe::array, ranges of such values, another message, and rowe::raw_json.
#pragma once
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include <rowe/result.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe {

// A value that is JSON already, and is written unchanged. If it is no JSON, the service thread refuses the
// whole message.
struct raw_json {
  std::string_view text;
};

template <std::size_t Bytes>
class message_of;

namespace detail {

// Writes JSON behind what is in `buffer` already. If a piece does not fit, nothing more is written. Every
// function: never waits, never allocates, steps in proportion to what is written.
class message_writer {
 public:
  message_writer(char* buffer, std::size_t used, std::size_t buffer_bytes) noexcept
      : buffer_{buffer}, used_{used}, buffer_bytes_{buffer_bytes} {}

  void begin(char bracket) noexcept; // '{' or '['
  void end(char bracket) noexcept;
  void comma() noexcept; // between a value that stands there already and the next
  void key(std::string_view name) noexcept;
  void string(std::string_view utf8) noexcept;
  void number(double x) noexcept;
  void number(float x) noexcept;
  void number(std::int64_t x) noexcept;
  void number(std::uint64_t x) noexcept;
  void raw(std::string_view json) noexcept;

  std::size_t used() const noexcept { return used_; }
  bool overflowed() const noexcept { return overflowed_; }

 private:
  template <class Write>
  void with_writer(Write&& write) noexcept;

  char* buffer_;
  std::size_t used_;
  std::size_t buffer_bytes_;
  bool overflowed_ = false;
};

template <class... Arguments>
struct json_object {
  std::tuple<Arguments...> pairs;
};
template <class... Values>
struct json_array {
  std::tuple<Values...> values;
};

template <class T>
inline constexpr bool is_json_object = false;
template <class... Arguments>
inline constexpr bool is_json_object<json_object<Arguments...>> = true;
template <class T>
inline constexpr bool is_json_array = false;
template <class... Values>
inline constexpr bool is_json_array<json_array<Values...>> = true;
template <class T>
inline constexpr bool is_message = false;
template <std::size_t Bytes>
inline constexpr bool is_message<message_of<Bytes>> = true;

template <class T>
concept json_optional = std::same_as<T, std::optional<typename T::value_type>>;
namespace range_access { // begin() and end() as the range-based for finds them
using std::begin, std::end;
template <class T>
concept range = requires(const T& values) {
  begin(values) != end(values);
  *begin(values);
};
} // namespace range_access
template <class T>
concept json_string = std::convertible_to<const T&, std::string_view> && !std::same_as<T, std::nullptr_t>;
template <class T>
concept json_integer =
    std::integral<T> && !std::same_as<T, bool> && !std::same_as<T, char> && !std::same_as<T, wchar_t> &&
    !std::same_as<T, char8_t> && !std::same_as<T, char16_t> && !std::same_as<T, char32_t>;

template <class T>
void write_value(message_writer& to, const T& value) noexcept;

template <class Pairs, std::size_t... I>
void write_pairs(message_writer& to, const Pairs& pairs, std::index_sequence<I...>) noexcept {
  [[maybe_unused]] const auto one = [&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    if constexpr (N != 0) to.comma();
    to.key(std::get<2 * N>(pairs));
    write_value(to, std::get<2 * N + 1>(pairs));
  };
  (one(std::integral_constant<std::size_t, I>{}), ...);
}

template <class Values, std::size_t... I>
void write_list(message_writer& to, const Values& values, std::index_sequence<I...>) noexcept {
  [[maybe_unused]] const auto one = [&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    if constexpr (N != 0) to.comma();
    write_value(to, std::get<N>(values));
  };
  (one(std::integral_constant<std::size_t, I>{}), ...);
}

template <class T>
void write_value(message_writer& to, const T& value) noexcept {
  using type = std::remove_cvref_t<T>;
  if constexpr (std::same_as<type, std::nullptr_t> || std::same_as<type, std::nullopt_t>) {
    to.raw("null");
  } else if constexpr (std::same_as<type, bool>) {
    to.raw(value ? std::string_view{"true"} : std::string_view{"false"});
  } else if constexpr (json_integer<type>) {
    if constexpr (std::is_signed_v<type>) {
      to.number(static_cast<std::int64_t>(value));
    } else {
      to.number(static_cast<std::uint64_t>(value));
    }
  } else if constexpr (std::same_as<type, float> || std::same_as<type, double>) {
    to.number(value);
  } else if constexpr (std::same_as<type, raw_json>) {
    to.raw(value.text);
  } else if constexpr (is_message<type>) {
    to.raw(value.text());
  } else if constexpr (json_optional<type>) {
    value ? write_value(to, *value) : to.raw("null");
  } else if constexpr (is_json_object<type>) {
    to.begin('{');
    write_pairs(to, value.pairs, std::make_index_sequence<std::tuple_size_v<decltype(value.pairs)> / 2>{});
    to.end('}');
  } else if constexpr (is_json_array<type>) {
    to.begin('[');
    write_list(to, value.values, std::make_index_sequence<std::tuple_size_v<decltype(value.values)>>{});
    to.end(']');
  } else if constexpr (json_string<type>) {
    to.string(value);
  } else if constexpr (range_access::range<type>) {
    bool first = true;
    to.begin('[');
    for (const auto& element : value) {
      if (!first) to.comma();
      first = false;
      write_value(to, element);
    }
    to.end(']');
  } else {
    static_assert(json_string<type>, "a message has no such values: see rowe/message.hpp");
  }
}

// Whether every second argument, from the first, can be a name.
template <class... Arguments>
consteval bool names_and_values() noexcept {
  if constexpr (sizeof...(Arguments) % 2 != 0) {
    return false;
  } else {
    std::size_t at = 0;
    bool good = true;
    ((good = good && (at++ % 2 != 0 || json_string<std::remove_cvref_t<Arguments>>)), ...);
    return good;
  }
}

} // namespace detail

// A nested object: rowe::object("x", 1, "y", 2). It stores temporaries, and refers to other arguments. Use it
// only within the expression that makes the message.
template <class... Arguments>
requires(detail::names_and_values<Arguments...>()) ROWE_RT detail::json_object<Arguments...> object(
    Arguments&&... names_and_values)
noexcept { return {std::tuple<Arguments...>{std::forward<Arguments>(names_and_values)...}}; }

// An array, of values of any kind: rowe::array(1, "two", nullptr). As object().
template <class... Values>
ROWE_RT detail::json_array<Values...> array(Values&&... values) noexcept {
  return {std::tuple<Values...>{std::forward<Values>(values)...}};
}

// A JSON object of up to `Bytes` bytes of text, in place. A plain value, one thread at a time.
template <std::size_t Bytes>
class message_of {
  static_assert(Bytes >= 2 && Bytes < (std::size_t{1} << 31), "from {} to 2 GiB");

 public:
  // {}
  ROWE_RT message_of() noexcept = default;

  // The object with these members, in this order. overflowed() says whether it did not fit. Never waits,
  // never allocates, no system call.
  template <class... Arguments>
  requires(sizeof...(Arguments) >= 2 && detail::names_and_values<Arguments...>()) ROWE_RT
      explicit message_of(const Arguments&... names_and_values) noexcept {
    detail::message_writer to{text_, 0, Bytes};
    detail::write_value(to, detail::json_object<const Arguments&...>{std::tie(names_and_values...)});
    complete(to);
  }

  // Adds a member behind the others, without checking whether its name occurs already. Returns *this. Never
  // waits, never allocates.
  template <class Value>
  ROWE_RT message_of& add(std::string_view name, const Value& value) noexcept {
    if (overflowed_) return *this;
    detail::message_writer to{text_, bytes_ - 1U, Bytes}; // over the closing brace
    if (bytes_ > 2) to.comma();
    to.key(name);
    detail::write_value(to, value);
    to.end('}');
    complete(to);
    return *this;
  }

  // The text; {} if it overflowed. Valid until the message changes.
  ROWE_RT std::string_view text() const noexcept { return {text_, bytes_}; }
  // True if something did not fit. Sending it says errc::too_big.
  ROWE_RT bool overflowed() const noexcept { return overflowed_; }
  ROWE_RT static constexpr std::size_t capacity() noexcept { return Bytes; }

 private:
  void complete(const detail::message_writer& written) noexcept {
    overflowed_ = written.overflowed();
    bytes_ = overflowed_ ? 2U : static_cast<std::uint32_t>(written.used());
    if (overflowed_) text_[0] = '{', text_[1] = '}';
  }

  char text_[Bytes] = {'{', '}'};
  std::uint32_t bytes_ = 2;
  bool overflowed_ = false;
};

// A message that is large enough for small services and status messages, and takes 1 KiB of stack in all.
using message = message_of<1008>;

// A parameter type for what is sent: made from a message, or from text that is JSON already. Refers to it.
class body {
 public:
  // NOLINTBEGIN(google-explicit-constructor): lane.try_send(message{...}), lane.try_send("{}")
  ROWE_RT body(std::string_view json) noexcept : text_{json} {}
  ROWE_RT body(const char* json) noexcept : text_{json} {}
  ROWE_RT body(const std::string& json) noexcept : text_{json} {}
  template <std::size_t Bytes>
  ROWE_RT body(const message_of<Bytes>& built) noexcept
      : text_{built.text()}, outgrown_{built.overflowed() ? Bytes : 0} {}
  // NOLINTEND(google-explicit-constructor)

  ROWE_RT std::string_view text() const noexcept { return text_; }
  // The capacity that the message overflowed; 0 if it did not.
  ROWE_RT std::size_t outgrown() const noexcept { return outgrown_; }

 private:
  std::string_view text_;
  std::size_t outgrown_ = 0;
};

} // namespace rowe
