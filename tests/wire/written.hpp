// SPDX-License-Identifier: Apache-2.0
// What a function writes into a json::writer, as a text in a room of the test's; empty where it does not fit.
#pragma once
#include <span>
#include <string_view>
#include <type_traits>

#include "json/writing/writer.hpp"

namespace rowe::wire {

template <class... Takes>
std::string_view written(std::span<char> buffer, void (*write)(json::writer&, Takes...) noexcept,
                         std::type_identity_t<Takes>... args) {
  json::writer out{buffer};
  write(out, args...);
  return out.overflowed() ? std::string_view{} : out.text();
}

} // namespace rowe::wire
