// SPDX-License-Identifier: Apache-2.0
// Structs of options from C programs, which may be older than the library: shorter, then, and what they lack
// is zero, the default. A longer one is of a newer program, which asks for what this library does not have.
#pragma once
#include <cstddef>
#include <cstring>
#include <type_traits>

#include <rowe/result.hpp>

namespace rowe::capi {

// What the program knew of `given`, which may be NULL: all defaults. Errors: bad_argument (`bytes` is none
// of a version of this struct).
template <class Options>
result<Options> whole(const Options* given) noexcept {
  static_assert(std::is_trivially_copyable_v<Options> &&
                std::is_same_v<decltype(Options::bytes), std::size_t>);
  Options all{};
  if (given == nullptr) return all;
  if (given->bytes < sizeof given->bytes || given->bytes > sizeof all) {
    return error{errc::bad_argument, static_cast<std::int64_t>(given->bytes), sizeof all};
  }
  std::memcpy(&all, given, given->bytes);
  return all;
}

// A value that stands for its default where it is 0.
template <class Number>
Number or_default(Number given, Number otherwise) noexcept {
  return given == Number{} ? otherwise : given;
}

} // namespace rowe::capi
