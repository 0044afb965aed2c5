// SPDX-License-Identifier: Apache-2.0
#include "service/long_publications.hpp"

#include <algorithm>
#include <string_view>

#include "service/service_limits.hpp"

namespace rowe::service {

long_publications::long_publications(const needs& parts) noexcept
    : state_{parts.state},
      long_outbox_{parts.long_outbox},
      sender_{parts.sender},
      broker_{parts.broker},
      value_publisher_{parts.value_publisher},
      topic_handles_{parts.topic_handles} {}

void long_publications::take(pair_index pair) noexcept {
  if ((pair_ && pair_ != pair) || sender_.round_open()) return;
  if (state_.pairs[pair].service.out.newest != nullptr) {
    take_newest(pair);
  } else {
    take_values(pair);
  }
}

void long_publications::take_newest(pair_index pair) noexcept {
  if (pair_) return (void)advance();
  const auto found = state_.pairs[pair].service.out.newest->begin_read();
  if (found.state != rt::freshness::fresh) return;
  value_publisher_.note_newest(pair, found.sequence);
  const pair_slot slot{found.slot};
  if (!begins(pair, slot)) value_publisher_.publish(pair, slot);
}

void long_publications::take_values(pair_index pair) noexcept {
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  for (std::size_t left = values_per_cycle; left != 0; --left) {
    if (!pair_) {
      if (topic_handles_.room_to_server(pair) == 0) return;
      const auto popped = end.ring->try_pop();
      if (!popped) return;
      const pair_slot slot{*popped};
      if (!begins(pair, slot)) {
        value_publisher_.publish(pair, slot);
        end.free_ring->release(*popped);
        continue;
      }
    }
    const pair_slot slot = slot_;
    if (!advance()) return;
    end.free_ring->release(slot.value);
  }
}

// Begins with the value in this slot, if it is a long text.
bool long_publications::begins(pair_index pair, pair_slot slot) noexcept {
  const std::size_t bytes = state_.pairs[pair].service.out.memory.header(slot.value)->bytes;
  if (bytes <= state_.bounds().message_bytes_max) return false;
  pair_ = pair;
  slot_ = slot;
  done_ = 0;
  scanner_ = json::scanner{state_.bounds().depth_max};
  if (bytes > state_.chunks.text_bytes_max()) {
    state_.counts.add(counter::too_big);
    return true;
  }
  if (long_outbox_.make_room(chunk_store::chunks_for(bytes))) text_ = state_.chunks.begin(bytes);
  if (!text_) state_.counts.add(counter::no_chunks);
  return true;
}

// Takes some of the text. True: it is published, or dropped and counted, and its slot is not needed any more.
bool long_publications::advance() noexcept {
  const detail::pair_slots& slots = state_.pairs[pair_].service.out.memory;
  const std::string_view all{reinterpret_cast<const char*>(slots.value(slot_.value)),
                             slots.header(slot_.value)->bytes};
  if (text_) {
    const std::string_view piece = all.substr(done_, long_scan_bytes);
    state_.chunks.append(text_, std::as_bytes(std::span{piece}));
    done_ += piece.size();
    if (scanner_.feed(piece) && done_ != all.size()) return false;
    if (scanner_.finish() && !scanner_.members().empty()) {
      publish();
    } else {
      state_.counts.add(counter::malformed);
    }
  }
  drop();
  return true;
}

void long_publications::publish() noexcept {
  const detail::queue_pair& queues = state_.pairs[pair_];
  const detail::value_header& header = *queues.service.out.memory.header(slot_.value);
  const rt::time_point published = time_of(header.stamped_ns);
  broker_.publish_long(
      state_.pair_rows[pair_].topic, published, state_.cycle.expiry_of(published, time_of(header.expires_ns)),
      queues.latched ? latch_owner{latch_owner::kind::handle, pair_.value} : latch_owner{}, text_);
}

void long_publications::drop() noexcept {
  if (text_) state_.chunks.release(text_);
  text_ = {};
  pair_ = {};
}

} // namespace rowe::service
