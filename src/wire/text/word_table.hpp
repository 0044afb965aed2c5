// SPDX-License-Identifier: Apache-2.0
// Words that are known when the program is compiled, each found by one comparison: a perfect hash, whose
// factors the compiler searches for. Nothing waits or allocates.
#pragma once
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace rowe::wire {

template <std::size_t Count>
class word_table {
 public:
  // Words must differ in their length, their byte in the middle or their last byte, and none may be empty;
  // else this does not compile.
  template <std::convertible_to<std::string_view>... Words>
  consteval explicit word_table(Words... words) : word_table{std::array<std::string_view, Count>{words...}} {}
  consteval explicit word_table(const std::array<std::string_view, Count>& words) : words_{words} {
    for (factors_ = {1, 1}; !place_all(); factors_ = next(factors_)) continue;
  }

  // The word's place in the table; Count if it is not there.
  constexpr std::size_t find(std::string_view text) const noexcept {
    if (text.empty()) return Count;
    const std::size_t place = places_[slot_of(text)];
    return place < Count && words_[place] == text ? place : Count;
  }
  constexpr std::string_view operator[](std::size_t place) const noexcept { return words_[place]; }
  static constexpr std::size_t size() noexcept { return Count; }

 private:
  static constexpr std::size_t slots = 64;
  static constexpr std::uint8_t nobody = 0xff;
  static_assert(Count < slots);

  struct factors {
    std::uint32_t middle, last;
  };

  static constexpr factors next(factors now) {
    if (now.last < slots) return {now.middle, now.last + 1};
    if (now.middle >= slots) throw "two words have the same length, byte in the middle and last byte";
    return {now.middle + 1, 1};
  }
  constexpr std::size_t slot_of(std::string_view text) const noexcept {
    const auto middle = static_cast<unsigned char>(text[text.size() / 2]);
    const auto last = static_cast<unsigned char>(text.back());
    return (text.size() + middle * factors_.middle + last * factors_.last) % slots;
  }
  // False when two words would have the same slot.
  constexpr bool place_all() {
    places_.fill(nobody);
    for (std::size_t place = 0; place < Count; ++place) {
      std::uint8_t& slot = places_[slot_of(words_[place])];
      if (slot != nobody) return false;
      slot = static_cast<std::uint8_t>(place);
    }
    return true;
  }

  std::array<std::string_view, Count> words_;
  std::array<std::uint8_t, slots> places_{};
  factors factors_{};
};

template <std::convertible_to<std::string_view>... Words>
word_table(Words...) -> word_table<sizeof...(Words)>;

} // namespace rowe::wire
