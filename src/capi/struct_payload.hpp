// SPDX-License-Identifier: Apache-2.0
// What a handle carries whose type only run time knows: the bytes of a struct. The templates of C++'s handles
// then work for C's as they are.
#pragma once
#include <cstddef>

#include <rowe/detail/pair_request.hpp>
#include <rowe/detail/payload.hpp>
#include <rowe/endpoint.hpp>

namespace rowe::capi {

// A struct of the program, by its address.
struct raw_struct {
  const void* at;
  std::size_t bytes;
};

} // namespace rowe::capi

namespace rowe::detail {

template <>
struct payload<capi::raw_struct> {
  using given = capi::raw_struct;
  using view = value_view<std::byte>; // of the first byte

  static const void* data(given value) noexcept { return value.at; }
  static std::size_t bytes(given value) noexcept { return value.bytes; }
  static constexpr std::size_t outgrown(given) noexcept { return 0; }
};

struct pair_opener {
  static result<pair_handle> open(endpoint& on, const pair_request& asked) { return on.open(asked); }
};

} // namespace rowe::detail
