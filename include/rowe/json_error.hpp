// SPDX-License-Identifier: Apache-2.0
// Why a JSON value could not be read: where, what was wanted there, and what was found.
#pragma once
#include <cassert>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <rowe/fixed_string.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/attributes.hpp>

namespace rowe {

// Holds copies, so it outlives the text and the path. What is longer than the copies hold ends in "...".
struct json_error {
  // Enough for message().
  static constexpr std::size_t message_bytes_max = 512;

  // The code, and the numbers that belong to it:
  //   missing_member    nothing is there; value: of an array, how many elements it has
  //   wrong_type        another kind of value is there; so is a number with a fraction, for an integer
  //   out_of_range      the number does not fit the type
  //   too_long          the string (value: its bytes) is longer than what it is copied to (limit)
  //   bad_argument      the path is wrong; value: the byte where it goes wrong
  //   and what a schema refuses: duplicate_member, and too_long also of arrays (value: its elements)
  error reason{errc::misuse};
  fixed_string<160> path;   // how far the path led, with the step that failed: "pose.x"; empty: no step
  fixed_string<160> wanted; // "a whole number from 0 to 255"
  fixed_string<64> found;   // as it is written: "\"far\""; empty where nothing is there

  errc code() const noexcept { return reason.code; }

  // E.g. `the member "pose.x" must be a number; it is "far"`. Allocates; throws std::bad_alloc only.
  std::string message() const;
  // The same, written into `buffer` and cut where that ends, never within a character; returns the part
  // written. Never waits, never allocates.
  std::string_view message(std::span<char> buffer) const noexcept;
};

#if defined(__cpp_exceptions)
// The exception that json_result::value() throws. what() is the error's message.
class bad_json : public bad_result {
 public:
  explicit bad_json(const json_error& why) noexcept : bad_result{why.reason}, error_{why} {
    const std::span<char> buffer{text_, json_error::message_bytes_max};
    text_[why.message(buffer).size()] = '\0';
  }
  const char* what() const noexcept override { return text_; }
  const json_error& error() const noexcept { return error_; }

 private:
  json_error error_;
  char text_[json_error::message_bytes_max + 1];
};
#endif

namespace detail {
[[noreturn]] inline void fail(const json_error& why) {
#if defined(__cpp_exceptions)
  throw bad_json{why};
#else
  fail(why.reason);
#endif
}
} // namespace detail

// A value that was read, or why there is none; used as result<T>. It neither waits nor allocates, unless T
// does.
template <class T>
class [[nodiscard]] json_result {
 public:
  // NOLINTBEGIN(google-explicit-constructor): `return value;`, `return why;`
  json_result(T value) noexcept : value_{std::move(value)} {}
  json_result(const json_error& why) noexcept : error_{why} {}
  // NOLINTEND(google-explicit-constructor)

  ROWE_RT explicit operator bool() const noexcept { return value_.has_value(); }
  ROWE_RT bool has_value() const noexcept { return value_.has_value(); }
  // The value; undefined without one.
  ROWE_RT T& operator*() & noexcept { return *value_; }
  ROWE_RT const T& operator*() const& noexcept { return *value_; }
  ROWE_RT T&& operator*() && noexcept { return *std::move(value_); }
  ROWE_RT T* operator->() noexcept { return &*value_; }
  ROWE_RT const T* operator->() const noexcept { return &*value_; }
  // The error; undefined when there is a value.
  ROWE_RT const json_error& error() const noexcept {
    assert(!has_value());
    return *error_;
  }
  // The error's code; errc::misuse when there is a value.
  ROWE_RT errc code() const noexcept { return has_value() ? errc::misuse : error().code(); }

  // The value, or throws bad_json, which is a bad_result (aborts if exceptions are off). Not for real-time
  // loops.
  T& value() & { return checked(*this); }
  const T& value() const& { return checked(*this); }
  T value() && { return std::move(checked(*this)); }

 private:
  template <class Self>
  static auto& checked(Self& self) {
    if (!self.has_value()) detail::fail(self.error());
    return *self.value_;
  }

  std::optional<T> value_;
  std::optional<json_error> error_; // when there is no value: so large that it is not made before
};

} // namespace rowe
