// SPDX-License-Identifier: Apache-2.0
// What a handle of T carries: a struct that has a schema, or JSON text for json_text. All differences between
// the two are here, so each handle is one template.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/json_text.hpp>
#include <rowe/message.hpp>
#include <rowe/message_view.hpp>
#include <rowe/schema.hpp>

namespace rowe::detail {

template <class T>
struct payload {
  static_assert(described<T>, "what a handle carries needs a schema: see rowe/schema.hpp");
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= value_alignment);

  using given = const T&; // as a user hands it over
  using taken = T;        // as a user gets it where the slot is released at once, or held by something else
  using view = value_view<T>; // as a user reads it in its slot
  using reply = T;

  static const void* data(given value) noexcept { return &value; }
  static constexpr std::size_t bytes(given) noexcept { return sizeof(T); }
  // The capacity that a message overflowed before it came here; 0 if it did not.
  static constexpr std::size_t outgrown(given) noexcept { return 0; }
  static taken read(const pair_slots& from, std::uint32_t slot) noexcept {
    T value;
    std::memcpy(static_cast<void*>(&value), from.value(slot), sizeof(T));
    return value;
  }
};

template <>
struct payload<json_text> {
  using given = body;
  using taken = std::string_view;
  using view = message_view;
  using reply = message_view;

  static const void* data(const body& text) noexcept { return text.text().data(); }
  static std::size_t bytes(const body& text) noexcept { return text.text().size(); }
  static std::size_t outgrown(const body& text) noexcept { return text.outgrown(); }
  static taken read(const pair_slots& from, std::uint32_t slot) noexcept {
    return {reinterpret_cast<const char*>(from.value(slot)), from.header(slot)->bytes};
  }
};

} // namespace rowe::detail
