// SPDX-License-Identifier: Apache-2.0
// Parameters: values that a loop reads in each cycle, and that its program and its peers can change while it
// runs: a gain, a limit, a mode. From endpoint::parameter(). Peers read and write them by the services of ROS
// (`/rosapi/get_param`, `/rosapi/set_param`); to write one takes the right `set` of a role. Each change is
// published on the topic `/rowe/parameters`.
#pragma once
#include <concepts>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/detail/parameter_cell.hpp>
#include <rowe/fixed_string.hpp>
#include <rowe/result.hpp>
#include <rowe/schema.hpp>

namespace rowe {

// The least and the most value of a number, both allowed. Neither may be NaN.
template <class T>
struct range {
  T least = std::numeric_limits<T>::lowest();
  T most = (std::numeric_limits<T>::max)();
};

namespace detail {

template <class T>
constexpr parameter_kind kind_of_parameter() noexcept {
  if constexpr (std::same_as<T, bool>) return parameter_kind::boolean;
  if constexpr (std::is_enum_v<T>) return parameter_kind::choice;
  if constexpr (std::floating_point<T>) return parameter_kind::real;
  if constexpr (is_fixed_string<T>) return parameter_kind::text;
  return std::is_signed_v<T> ? parameter_kind::integer : parameter_kind::natural;
}

template <class T>
parameter_value parameter_value_of(const T& value) noexcept {
  if constexpr (is_fixed_string<T>) {
    return parameter_value::of_text(value.view());
  } else if constexpr (std::floating_point<T>) {
    return parameter_value::of_number(static_cast<double>(value));
  } else if constexpr (std::is_enum_v<T> || std::is_signed_v<T>) {
    return parameter_value::of_number(static_cast<std::int64_t>(value));
  } else {
    return parameter_value::of_number(static_cast<std::uint64_t>(value));
  }
}
// The service thread has checked it: it fits.
template <class T>
void read_parameter(const parameter_value& from, T& into) noexcept {
  if constexpr (is_fixed_string<T>) {
    (void)into.assign(from.text());
  } else if constexpr (std::same_as<T, bool>) {
    into = from.number<std::uint64_t>() != 0;
  } else if constexpr (std::floating_point<T>) {
    into = static_cast<T>(from.number<double>());
  } else {
    into = static_cast<T>(from.number<std::int64_t>());
  }
}

} // namespace detail

// What a parameter may be: a bool, an integer, a float or a double, a fixed_string of up to 124 bytes, or an
// enum whose names are listed (rowe/schema.hpp), which peers read and write by name.
template <class T>
concept parameter_type = std::same_as<T, bool> || std::integral<T> || std::same_as<T, float> ||
                         std::same_as<T, double> ||
                         (std::is_enum_v<T> &&
                          !std::same_as<std::remove_cv_t<decltype(names<T>)>, detail::no_names>) ||
                         detail::is_fixed_string<T>;

// One parameter, for one thread at a time. Move-only. When it is destroyed, the parameter is gone.
template <parameter_type T>
class parameter {
 public:
  parameter() noexcept = default; // empty: get() gives T{}
  parameter(detail::parameter_handle cell, const T& first, const range<T>& allowed) noexcept
      : cell_{std::move(cell)}, value_{first}, allowed_{allowed} {}

  // The newest value. Valid until the next call. Never waits, never allocates, no system call: two loads, and
  // the copy of a value of 128 bytes where another one has come. The value that the handle had last after the
  // endpoint was closed.
  ROWE_RT const T& get() noexcept {
    (void)refresh();
    return value_;
  }
  // The same. True if a value has come that was not taken before, be it an equal one.
  ROWE_RT bool refresh() noexcept {
    if (!cell_) return false;
    detail::parameter_value fresh;
    if (cell_->user_in->read(fresh) != rt::freshness::fresh) return false;
    detail::read_parameter(fresh, value_);
    return true;
  }

  // Sets it, for peers too: these see it after the service thread's next cycle. What a peer writes in the
  // meantime is replaced, but get() may give it once. Never waits, never allocates; no system call, but one
  // under idle::wake. Errors: out_of_range (outside the range, NaN, or a value of an enum without a name),
  // closed, misuse (an empty handle). After an error nothing has changed.
  ROWE_RT status set(const T& value) noexcept {
    if (!cell_) return errc::misuse;
    // relaxed: advice; nothing is read that it guards
    if (cell_->closed.load(std::memory_order_relaxed)) return cell_->forked ? errc::forked : errc::closed;
    if (!is_allowed(value)) return errc::out_of_range;
    (void)refresh();
    value_ = value;
    detail::set_parameter(*cell_, detail::parameter_value_of(value));
    return {};
  }

 private:
  bool is_allowed(const T& value) const noexcept {
    if constexpr (std::is_enum_v<T>) {
      for (const enumerator_description& one : cell_->what.names)
        if (one.value == static_cast<std::int64_t>(value)) return true;
      return false;
    } else if constexpr (std::same_as<T, bool> || detail::is_fixed_string<T>) {
      return true;
    } else {
      return value >= allowed_.least && value <= allowed_.most; // false for NaN
    }
  }

  detail::parameter_handle cell_;
  T value_{};
  range<T> allowed_{};
};

namespace detail {

template <class T>
parameter_request parameter_request_of(std::string_view name, const T& first,
                                       const range<T>& allowed) noexcept {
  parameter_request asked{.name = name, .what = {.kind = kind_of_parameter<T>()}, .first = {}};
  if constexpr (is_fixed_string<T>) {
    static_assert(T::capacity() <= parameter_text_bytes_max, "rowe::parameter: a text has at most 124 bytes");
    asked.what.text_bytes_max = T::capacity();
  } else if constexpr (std::is_enum_v<T>) {
    asked.what.names = names_of<T, std::remove_cv_t<decltype(names<T>)>>::list;
  } else if constexpr (!std::same_as<T, bool>) {
    asked.what.single = std::same_as<T, float>;
    asked.what.least = parameter_value_of(allowed.least);
    asked.what.most = parameter_value_of(allowed.most);
  }
  asked.first = parameter_value_of(first);
  return asked;
}

} // namespace detail

} // namespace rowe
