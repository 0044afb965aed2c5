// SPDX-License-Identifier: Apache-2.0
// Views that C programs hold: the C++ view that owns its slot lies in the struct of the C program. Real-time.
#pragma once
#include <cstddef>
#include <new>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/loop.h>
#include <rowe/message_view.hpp>
#include <rowe/result.hpp>

#include "capi/error.hpp"

namespace rowe::capi {

// Whether a view holds something stands in the last word, so that one of zeroes holds nothing.
inline constexpr std::size_t held_words = std::extent_v<decltype(rowe_view::reserved)> - 1;
static_assert(sizeof(message_view) <= held_words * sizeof(void*) && alignof(message_view) <= alignof(void*));

inline message_view& held(rowe_view& view) noexcept {
  return *std::launder(reinterpret_cast<message_view*>(view.reserved));
}

inline void put(message_view&& taken, rowe_view& into) noexcept {
  const std::string_view text = taken.value();
  const connection from = taken.from();
  into.text = text.data();
  into.bytes = text.size();
  into.arrived_ns = rt::nanoseconds_of(taken.arrived());
  into.from = {from.index, from.generation};
  into.wants_reply = taken.wants_reply();
  new (into.reserved) message_view{std::move(taken)};
  into.reserved[held_words] = into.reserved;
}

inline int give(result<message_view>&& taken, rowe_view* into) noexcept {
  if (!taken) return number_of(taken.code());
  put(std::move(*taken), *into);
  return rowe_ok;
}

inline bool holds(const rowe_view* view) noexcept {
  return view != nullptr && view->reserved[held_words] != nullptr;
}

} // namespace rowe::capi
