// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/slab.hpp>

#include <algorithm>

namespace rowe::rt {

const char* slab::check() const noexcept {
  if (slots_ == 0) return nullptr;
  if (stride_ % line_bytes != 0) return "slots share no line";
  if (stride_ < headroom_bytes + payload_bytes_ + tailroom_bytes) return "a slot has room for all its parts";
  for (std::uint32_t number = 0; number < slots_; ++number) {
    const std::byte* const behind = slot(number).data() + payload_bytes_;
    const std::byte* const next = base_ + (number + 1) * stride_;
    if (!std::all_of(behind, next, [](std::byte b) { return b == std::byte{0}; }))
      return "nothing was written behind a payload";
  }
  return nullptr;
}

pool::pool(std::span<node> nodes) noexcept
    : nodes_{nodes}, free_count_{static_cast<std::uint32_t>(nodes.size())} {
  // Number 0 lies on top of the stack, so that the first slots taken are neighbours.
  for (std::uint32_t number = 0; number < slots(); ++number)
    nodes_[number] = {.next = number + 1, .generation = 0};
}

const char* pool::check() const noexcept {
  const auto taken = std::count_if(nodes_.begin(), nodes_.end(),
                                   [](const node& each) { return (each.generation & 1U) != 0; });
  if (slots() - static_cast<std::uint32_t>(taken) != free_count_) return "what is not taken is free";
  // As many different free nodes as there are free slots: then the list holds each of them once.
  std::uint32_t at = first_;
  for (std::uint32_t walked = 0; walked < free_count_; ++walked) {
    if (at >= slots()) return "the list of free slots is as long as there are free slots";
    if ((nodes_[at].generation & 1U) != 0) return "no taken slot is in the list of free ones";
    std::uint32_t earlier = first_;
    for (std::uint32_t i = 0; i < walked; ++i, earlier = nodes_[earlier].next)
      if (earlier == at) return "no slot is in the list of free ones twice";
    at = nodes_[at].next;
  }
  return nullptr;
}

} // namespace rowe::rt
