// SPDX-License-Identifier: Apache-2.0
#include "service/base/slot_pool.hpp"

#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"

namespace rowe::service {
namespace {

// The headroom, the text, and the bytes that a JSON parser may read behind it; rounded up, so that each slot
// starts on a cache line of its own.
constexpr std::size_t stride(std::size_t bytes) noexcept {
  const std::size_t whole = slot_pool::headroom_bytes + bytes + tailroom_bytes;
  return (whole + rt::line_bytes - 1) / rt::line_bytes * rt::line_bytes;
}

// A relayed message gains an envelope: a name, which may have to be escaped,
constexpr std::size_t topic_envelope_bytes_max(const limits& bounds) noexcept {
  return envelope_bytes_fixed + escaped_bytes_max * bounds.topic_bytes_max;
}
// and, if it is no topic's, an id.
constexpr std::size_t envelope_bytes_max(const limits& bounds) noexcept {
  return topic_envelope_bytes_max(bounds) + call_id_bytes_max;
}

std::size_t large_slot_bytes(const limits& bounds) noexcept {
  return bounds.message_bytes_max + envelope_bytes_max(bounds);
}

std::size_t slots_bytes(const limits& bounds) noexcept {
  const std::size_t small = slot_pool::first_large(bounds);
  const std::size_t chunked = slot_pool::first_chunked(bounds);
  return small * stride(bounds.small_slot_bytes) + (chunked - small) * stride(large_slot_bytes(bounds)) +
         (slot_pool::count(bounds) - chunked) * stride(topic_envelope_bytes_max(bounds));
}

} // namespace

std::size_t slot_pool::large_bytes(const limits& bounds) noexcept { return large_slot_bytes(bounds); }

std::size_t slot_pool::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<slot>(count(bounds)) + rt::arena::bytes_for(slots_bytes(bounds));
}

slot_pool::slot_pool(rt::arena& memory, chunk_store& texts, const limits& bounds) noexcept
    : slots_{memory.carve<slot>(count(bounds))},
      memory_{memory.carve_bytes(slots_bytes(bounds))},
      chunks_{texts},
      bytes_{bounds.small_slot_bytes, large_slot_bytes(bounds), topic_envelope_bytes_max(bounds)},
      small_count_{first_large(bounds)},
      first_chunked_{slot_pool::first_chunked(bounds)},
      free_{free_slots{slots_, 0, small_count_}, free_slots{slots_, small_count_, first_chunked_},
            free_slots{slots_, first_chunked_, slots_.size()}} {
  for (const slot_class of : {slot_class::small, slot_class::large, slot_class::chunked})
    partial_max_[index_of(of)] = partial_slots_max(count(of), bounds.connections_max);
  std::size_t line = 0;
  for (const slot_id one : slots_.ids()) {
    slots_[one].line = static_cast<std::uint32_t>(line);
    line += stride(bytes_of(class_of(one))) / rt::line_bytes;
  }
}

void slot_pool::give_back_chunked(slot_id index) noexcept {
  chunks_.release(std::exchange(slots_[index].chunks, {}));
  free_[index_of(slot_class::chunked)].give_back(index);
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
  by_class<std::uint32_t> partial{};
  by_class<std::uint32_t> in_use{};
  for (const slot_id one : slots_.ids()) {
    partial[index_of(class_of(one))] += slots_[one].partial != 0;
    in_use[index_of(class_of(one))] += slots_[one].references != 0;
    if (static_cast<bool>(slots_[one].chunks) != (chunked(one) && slots_[one].references != 0)) return false;
  }
  for (std::size_t of = 0; of != slot_classes; ++of) {
    if (partial[of] > partial_max_[of] || in_use[of] != free_[of].in_use()) return false;
  }
  return partial == partial_;
}

} // namespace rowe::service
