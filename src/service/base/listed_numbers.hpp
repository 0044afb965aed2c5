// SPDX-License-Identifier: Apache-2.0
// The numbers of topics and services, for codecs that have those. Each that is listed gets the next one, so a
// number that a peer still knows means what was announced, or nothing. When all were given they begin anew,
// and those that are in use are passed over. Service thread only; nothing waits or allocates.
#pragma once
#include <cstdint>

#include "wire/codec/request.hpp"

namespace rowe::service {

class listed_numbers {
 public:
  // The numbers are those from `first` on; `newest` was given last.
  constexpr listed_numbers(std::uint32_t first, std::uint32_t newest) noexcept
      : first_{first}, newest_{newest} {}

  std::uint32_t newest() const noexcept { return newest_; }
  // `in_use(number)` says whether something has it. It is asked only once numbers are given again.
  template <class InUse>
  std::uint32_t take(const InUse& in_use) noexcept {
    do {
      const bool ends = newest_ + 1 < first_ || newest_ + 1 == wire::no_number;
      again_ |= ends;
      newest_ = ends ? first_ : newest_ + 1;
    } while (again_ && in_use(newest_));
    return newest_;
  }
  // Whether a number was given after another one, by less than half of all.
  static constexpr bool is_newer(std::uint32_t number, std::uint32_t than) noexcept {
    return static_cast<std::int32_t>(number - than) > 0;
  }

 private:
  std::uint32_t first_;
  std::uint32_t newest_;
  bool again_ = false;
};

} // namespace rowe::service
