// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <type_traits>

#include <rowe/rt/attributes.hpp>

namespace rowe {

// Means messages, requests and replies that are JSON text already: publisher<json_text>,
// subscriber<json_text>, responder<json_text, json_text>, caller<json_text, json_text>. For tools, and for
// programs that make JSON, or read it in place (rowe/json_value.hpp).
struct json_text {};

namespace detail {
template <class T>
inline constexpr bool is_text = std::is_same_v<T, json_text>;
} // namespace detail

} // namespace rowe
