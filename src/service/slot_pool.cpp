// SPDX-License-Identifier: Apache-2.0
#include "service/slot_pool.hpp"

#include "service/service_limits.hpp"
#include "service/shares.hpp"

namespace rowe::service {
namespace {

// The headroom, the text, and the bytes that a JSON parser may read behind it; rounded up, so that each slot
// starts on a cache line of its own.
constexpr std::size_t stride(std::size_t bytes) noexcept {
  const std::size_t whole = slot_pool::headroom_bytes + bytes + transport_sink::tailroom_bytes;
  return (whole + rt::line_bytes - 1) / rt::line_bytes * rt::line_bytes;
}

// A relayed message gains an envelope: a name, which may have to be escaped, and an id.
constexpr std::size_t envelope_bytes_max(const limits& bounds) noexcept {
  return envelope_bytes_fixed + escaped_bytes_max * bounds.topic_bytes_max + call_id_bytes_max;
}

std::size_t large_slot_bytes(const limits& bounds) noexcept {
  return bounds.message_bytes_max + envelope_bytes_max(bounds);
}

std::size_t slots_bytes(const limits& bounds) noexcept {
  const std::size_t small = slot_pool::first_large(bounds);
  return small * stride(bounds.small_slot_bytes) +
         (slot_pool::count(bounds) - small) * stride(large_slot_bytes(bounds));
}

} // namespace

std::size_t slot_pool::large_bytes(const limits& bounds) noexcept { return large_slot_bytes(bounds); }

std::size_t slot_pool::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<slot>(count(bounds)) + rt::arena::bytes_for(slots_bytes(bounds));
}

slot_pool::slot_pool(rt::arena& memory, const limits& bounds) noexcept
    : slots_{memory.carve<slot>(count(bounds))},
      memory_{memory.carve_bytes(slots_bytes(bounds))},
      small_bytes_{bounds.small_slot_bytes},
      large_bytes_{large_slot_bytes(bounds)},
      small_stride_{stride(small_bytes_)},
      large_stride_{stride(large_bytes_)},
      small_count_{first_large(bounds)},
      free_{free_slots{slots_, 0, small_count_}, free_slots{slots_, small_count_, slots_.size()}} {
  for (const slot_class of : {slot_class::small, slot_class::large})
    partial_max_[static_cast<std::size_t>(of)] = partial_slots_max(count(of), bounds.connections_max);
}

std::optional<std::uint32_t> slot_pool::expire(slot_id index) noexcept {
  const slot& expired = slots_[index];
  if (expired.partial != 0) return std::nullopt;
  const std::uint32_t deliveries = expired.references - (expired.pinned ? 1 : 0);
  free(index);
  return deliveries;
}

bool slot_pool::check() const noexcept {
  for (const free_slots& free : free_) {
    if (!free.check([](const slot& one) { return one.references == 0 && one.partial == 0; })) return false;
  }
  std::array<std::uint32_t, 2> partial{};
  std::array<std::uint32_t, 2> in_use{};
  for (const slot_id one : slots_.ids()) {
    partial[static_cast<std::size_t>(class_of(one))] += slots_[one].partial != 0;
    in_use[static_cast<std::size_t>(class_of(one))] += slots_[one].references != 0;
  }
  if (partial[0] > partial_max_[0] || partial[1] > partial_max_[1]) return false;
  return partial == partial_ && in_use[0] == free_[0].in_use() && in_use[1] == free_[1].in_use();
}

} // namespace rowe::service
