// SPDX-License-Identifier: Apache-2.0
#include "service/state/last_value_store.hpp"

#include <algorithm>
#include <utility>

#include "service/base/service_limits.hpp"

namespace rowe::service {
namespace {

// Of the blocks for the texts, which are nobody's share.
limits limits_of_texts(const limits& bounds) noexcept {
  limits of = bounds;
  const std::size_t blocks = bounds.message_bytes_max / latch_block_bytes_max + 1;
  of.latched_bytes = last_values_messages * blocks * sizeof(latch_block);
  of.connections_max = 1;
  return of;
}

constexpr latch_owner keeper{latch_owner::kind::handle, 0};

} // namespace

std::size_t last_value_store::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<row>(asked_topics_max) + latch_store::footprint_bytes(limits_of_texts(bounds));
}

last_value_store::last_value_store(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept
    : chunks_{chunks},
      rows_{memory.carve<row>(asked_topics_max)},
      free_{rows_},
      texts_{memory, chunks, limits_of_texts(bounds)} {}

last_value_id last_value_store::add(topic_id topic, rt::time_point now) noexcept {
  const last_value_id added = free_.take();
  if (!added) return added;
  rows_[added] = {};
  rows_[added].topic = topic;
  rows_[added].asked_at = now;
  return added;
}

topic_id last_value_store::replaceable(rt::time_point now) const noexcept {
  const auto waited_for = [now](const row& one) { return one.awaited && now - one.asked_at < page_wait_max; };
  const auto goes_first = [&](const row& one, const row& other) {
    return std::pair{waited_for(one), one.asked_at} < std::pair{waited_for(other), other.asked_at};
  };
  const row* found = nullptr;
  for (const row& one : rows_)
    if (one.topic && (found == nullptr || goes_first(one, *found))) found = &one;
  return found != nullptr ? found->topic : topic_id{};
}

topic_id last_value_store::unasked(rt::time_point now) const noexcept {
  const auto found = std::find_if(rows_.begin(), rows_.end(), [now](const row& one) {
    return one.topic && now - one.asked_at >= asked_topic_retained_for;
  });
  return found != rows_.end() ? found->topic : topic_id{};
}

void last_value_store::remove(last_value_id which) noexcept {
  if (!which) return;
  row& one = rows_[which];
  texts_.clear(one.value);
  if (one.awaited) ++came_; // it is to hear that
  one.topic = {};
  free_.give_back(which);
}

void last_value_store::keep(last_value_id which, std::string_view body, rt::time_point published,
                            rt::time_point expires) noexcept {
  row& one = rows_[which];
  while (!texts_.store(one.value, body, keeper, expires))
    if (!drop_oldest_but(which, false)) return;
  one.value.published = published;
  one.long_bytes = 0;
  if (std::exchange(one.awaited, false)) ++came_;
}

void last_value_store::keep_long(last_value_id which, text_id value, rt::time_point published,
                                 rt::time_point expires) noexcept {
  row& one = rows_[which];
  one.long_bytes = chunks_.bytes(value);
  if (std::exchange(one.awaited, false)) ++came_;
  while (!texts_.store_long(one.value, value, keeper, expires))
    if (!drop_oldest_but(which, true)) return;
  one.value.published = published;
  while (chunks_.left() < 0 && drop_oldest_but(which, true)) {
  }
  if (chunks_.left() < 0)
    texts_.clear(one.value);
  else
    one.long_bytes = 0;
}

bool last_value_store::give_up_long() noexcept { return drop_oldest_but({}, true); }

const latched_value& last_value_store::ask(last_value_id which, rt::time_point now, bool waits) noexcept {
  row& one = rows_[which];
  one.asked_at = now;
  if (!one.value.empty() && one.value.expires <= now) texts_.clear(one.value);
  one.awaited = one.awaited || (waits && one.value.empty());
  return one.value;
}

bool last_value_store::drop_oldest_but(last_value_id kept, bool long_ones) noexcept {
  if (long_ones && texts_.chunks_in_use() == 0) return false;
  const row* const spared = kept ? &rows_[kept] : nullptr;
  row* oldest = nullptr;
  for (row& one : rows_) {
    if (&one == spared || one.value.empty() || static_cast<bool>(one.value.chunks) != long_ones) continue;
    if (oldest == nullptr || one.asked_at < oldest->asked_at) oldest = &one;
  }
  if (oldest == nullptr) return false;
  texts_.clear(oldest->value);
  return true;
}

bool last_value_store::check() const noexcept {
  std::uint32_t blocks = 0;
  std::uint32_t chunks = 0;
  for (const row& one : rows_) {
    if (!one.topic && !one.value.empty()) return false;
    (one.value.chunks ? chunks : blocks) += one.value.blocks;
  }
  return blocks == texts_.in_use() && chunks == texts_.chunks_in_use() &&
         free_.check([](const row& one) { return !one.topic; });
}

} // namespace rowe::service
