// SPDX-License-Identifier: Apache-2.0
// Text inside a struct: up to `Capacity` bytes of UTF-8, in place and trivially copyable. So a real-time loop
// can copy a message that has such texts through a slot.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <rowe/rt/attributes.hpp>

namespace rowe {

template <std::size_t Capacity>
class fixed_string {
  static_assert(Capacity >= 1 && Capacity <= UINT32_MAX);

 public:
  constexpr fixed_string() noexcept = default;

  // From a literal. A literal that does not fit does not compile.
  template <std::size_t N>
  requires(N >= 1 && N - 1 <= Capacity)
      // NOLINTNEXTLINE(google-explicit-constructor): `pose.frame_id = "map";`
      ROWE_RT constexpr fixed_string(const char (&literal)[N]) noexcept {
    (void)assign(std::string_view{literal, N - 1}); // fits: the constraint says so
  }

  // False, and nothing changed, if `text` is longer than the capacity: text is never cut silently.
  ROWE_RT [[nodiscard]] constexpr bool assign(std::string_view text) noexcept {
    if (text.size() > Capacity) return false;
    text.copy(text_, text.size());
    bytes_ = static_cast<std::uint32_t>(text.size());
    return true;
  }
  // Sets the length of the text, so it can be written in place; its bytes stay. False, and nothing changed,
  // if `bytes` exceeds the capacity.
  ROWE_RT [[nodiscard]] constexpr bool resize(std::size_t bytes) noexcept {
    if (bytes > Capacity) return false;
    bytes_ = static_cast<std::uint32_t>(bytes);
    return true;
  }
  ROWE_RT constexpr void clear() noexcept { bytes_ = 0; }

  // The first of `size()` bytes, which may be changed; they must be UTF-8.
  ROWE_RT constexpr char* data() noexcept { return text_; }
  // Valid until the string changes.
  ROWE_RT constexpr std::string_view view() const noexcept { return {text_, bytes_}; }
  ROWE_RT constexpr operator std::string_view() const noexcept {
    return view();
  } // NOLINT(google-explicit-constructor)

  ROWE_RT constexpr std::size_t size() const noexcept { return bytes_; }
  ROWE_RT constexpr bool empty() const noexcept { return bytes_ == 0; }
  ROWE_RT static constexpr std::size_t capacity() noexcept { return Capacity; }

  ROWE_RT friend constexpr bool operator==(const fixed_string& a, std::string_view b) noexcept {
    return a.view() == b;
  }
  ROWE_RT friend constexpr bool operator==(const fixed_string& a, const fixed_string& b) noexcept {
    return a.view() == b.view();
  }

 private:
  std::uint32_t bytes_ = 0;
  char text_[Capacity] = {};
};

} // namespace rowe
