// SPDX-License-Identifier: Apache-2.0
// Which names of a list are written where all do not fit into one message. Each row of the table has an equal
// share of the room, so no name that takes no more than that is left out, whatever others are called. Longer
// ones get what is left: those of this process first, then those of peers, in the order of the list. Service
// thread only.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace rowe::service {

class fitting_names {
 public:
  // There are `rows` at most.
  fitting_names(std::size_t room, std::size_t rows) noexcept
      : room_{room}, share_{room / std::max<std::size_t>(rows, 1)} {}

  // First, of all names that are to be listed: how much one takes.
  void add(std::size_t bytes, bool own) noexcept {
    (bytes <= share_ ? short_ : own ? own_long_ : long_) += bytes;
  }
  // Then, before each walk through them in the same order.
  void begin() noexcept {
    const std::size_t left = left_of(room_, short_);
    own_left_ = left;
    left_ = left_of(left, own_long_);
    left_out_ = 0;
  }
  // Whether that one is written.
  bool take(std::size_t bytes, bool own) noexcept {
    if (bytes <= share_) return true;
    std::size_t& left = own ? own_left_ : left_;
    if (bytes <= left) {
      left -= bytes;
      return true;
    }
    ++left_out_;
    return false;
  }
  // How many were not, in this walk.
  std::uint32_t left_out() const noexcept { return left_out_; }

 private:
  static std::size_t left_of(std::size_t room, std::size_t taken) noexcept {
    return room > taken ? room - taken : 0;
  }

  std::size_t room_;
  std::size_t share_;
  std::size_t short_ = 0, own_long_ = 0, long_ = 0; // bytes of all
  std::size_t own_left_ = 0, left_ = 0;
  std::uint32_t left_out_ = 0;
};

} // namespace rowe::service
