// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/long_deliveries.hpp"

#include <algorithm>
#include <utility>

namespace rowe::service {

status long_deliveries::begin(pair_index pair, const detail::value_header& header, text_id value) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const std::size_t bytes = state_.chunks.bytes(value);
  const std::size_t most =
      queues.decoder != nullptr ? state_.bounds().message_bytes_max : queues.service.in.memory.bytes_max;
  if (bytes > most || queues.decoder != nullptr)
    return error{errc::too_big, static_cast<std::int64_t>(bytes), static_cast<std::int64_t>(most)};
  if (!local_delivery_.may_deliver(pair, header.peer)) return errc::full;
  const auto slot = local_delivery_.take_slot(pair);
  if (!slot) return errc::full;
  delivery& begun = rows_[pair];
  if (begun.value) end(pair); // of a handle that is gone
  begun.value = value;
  begun.generation = state_.pair_rows[pair].generation;
  begun.slot = *slot;
  begun.done = 0;
  begun.place = {};
  begun.header = header;
  begun.header.bytes = static_cast<std::uint32_t>(bytes);
  state_.chunks.retain(value);
  state_.pair_rows[pair].busy = true;
  if (!std::exchange(begun.in_turns, true)) turns_.push(pair);
  return {};
}

pair_index long_deliveries::advance(std::size_t& left) noexcept {
  while (left != 0 && !turns_.empty()) {
    const pair_index pair = turns_.pop();
    delivery& one = rows_[pair];
    one.in_turns = false;
    if (!one.value) continue; // another one began, and ended
    if (one.generation != state_.pair_rows[pair].generation || !state_.pair_rows[pair].busy) {
      end(pair);
      continue;
    }
    std::byte* const value = state_.pairs[pair].service.in.memory.value(one.slot);
    const std::size_t bytes = std::min<std::size_t>(left, one.header.bytes - one.done);
    state_.chunks.copy(one.value, one.done, one.place, {value + one.done, bytes});
    one.done += bytes;
    left -= bytes;
    if (one.done == one.header.bytes) {
      local_delivery_.hand_over(pair, one.slot, one.header);
      end(pair);
      return pair;
    }
    one.in_turns = true;
    turns_.push(pair);
  }
  return {};
}

void long_deliveries::end(pair_index pair) noexcept {
  state_.chunks.release(std::exchange(rows_[pair].value, {}));
  state_.pair_rows[pair].busy = false;
}

} // namespace rowe::service
