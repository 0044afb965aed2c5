// SPDX-License-Identifier: Apache-2.0
#include "service/handles/long_publications.hpp"

#include <array>
#include <span>
#include <string_view>

#include "service/base/rate_limit.hpp"
#include "service/base/service_limits.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

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

// Up to a value that took more than one step, or as much as one cycle encodes: then others have their turn.
void long_publications::take_values(pair_index pair) noexcept {
  const detail::consumer_end& end = state_.pairs[pair].service.out;
  std::size_t encoded = 0;
  for (std::size_t left = values_per_cycle; left != 0 && encoded < long_encode_bytes; --left) {
    const bool goes_on = static_cast<bool>(pair_);
    if (!goes_on) {
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
    if (goes_on) return;
    encoded += done_;
  }
}

// Begins with the value in this slot, if it is a long text, or a struct whose text may be long and somebody
// wants it.
bool long_publications::begins(pair_index pair, pair_slot slot) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const bool is_struct = queues.kind == detail::pair_kind::publish_value;
  const std::size_t bytes = queues.service.out.memory.header(slot.value)->bytes;
  const bool wanted = queues.latched || state_.topics.at(state_.pair_rows[pair].topic).has_audience();
  if (is_struct ? !wanted : bytes <= state_.bounds().message_bytes_max) return false;
  pair_ = pair;
  slot_ = slot;
  done_ = 0;
  if (is_struct) {
    begin_struct();
    return true;
  }
  scanner_ = json::scanner{state_.bounds().depth_max};
  if (bytes > state_.chunks.text_bytes_max()) {
    drop_too_long(bytes);
    return true;
  }
  if (long_outbox_.make_room(chunk_store::chunks_for(bytes))) text_ = state_.chunks.begin(bytes);
  if (!text_) state_.counts.add(counter::no_chunks);
  return true;
}

void long_publications::begin_struct() noexcept {
  const detail::queue_pair& queues = state_.pairs[pair_];
  pieces_.begin(*queues.encoder, queues.service.out.memory.value(slot_.value));
  if (long_outbox_.make_room(1)) text_ = state_.chunks.begin(1);
  if (!text_) state_.counts.add(counter::no_chunks);
}

// Takes some of the value. True: it is published, or dropped and counted, and its slot is not needed any
// more.
bool long_publications::advance() noexcept {
  const bool is_struct = state_.pairs[pair_].kind == detail::pair_kind::publish_value;
  if (text_ && !(is_struct ? advance_struct() : advance_text())) return false;
  drop();
  return true;
}

bool long_publications::advance_text() noexcept {
  const detail::pair_slots& slots = state_.pairs[pair_].service.out.memory;
  const std::string_view all{reinterpret_cast<const char*>(slots.value(slot_.value)),
                             slots.header(slot_.value)->bytes};
  const std::string_view piece = all.substr(done_, long_scan_bytes);
  state_.chunks.append(text_, std::as_bytes(std::span{piece}));
  done_ += piece.size();
  if (scanner_.feed(piece) && done_ != all.size()) return false;
  if (scanner_.finish() && !scanner_.members().empty()) {
    publish();
  } else {
    state_.counts.add(counter::malformed);
  }
  return true;
}

// Its chunks are taken as they are needed, since most texts are shorter than they may be.
bool long_publications::advance_struct() noexcept {
  std::array<char, long_encode_bytes> buffer;
  json::writer out{buffer};
  const bool ends = pieces_.write(out);
  state_.counts.add(counter::nonfinite, out.nonfinite());
  done_ += out.bytes();
  if (done_ > state_.chunks.text_bytes_max()) {
    drop_too_long(done_);
    return true;
  }
  const std::uint32_t needed = chunk_store::chunks_for(done_);
  const std::uint32_t held = state_.chunks.chunks_of(text_);
  if (needed > held && !(long_outbox_.make_room(needed - held) && state_.chunks.grow(text_, done_))) {
    state_.counts.add(counter::no_chunks);
    return true;
  }
  state_.chunks.append(text_, std::as_bytes(std::span{out.text()}));
  if (ends) publish();
  return ends;
}

// A struct whose text is not long after all goes as others do.
void long_publications::publish() noexcept {
  const detail::queue_pair& queues = state_.pairs[pair_];
  const detail::value_header& header = *queues.service.out.memory.header(slot_.value);
  const topic_id topic = state_.pair_rows[pair_].topic;
  const rt::time_point published = time_of(header.stamped_ns);
  const rt::time_point expires = state_.cycle.expiry_of(published, time_of(header.expires_ns));
  const latch_owner latches =
      queues.latched ? latch_owner{latch_owner::kind::handle, pair_.value} : latch_owner{};
  if (done_ > state_.bounds().message_bytes_max)
    return broker_.publish_long(topic, published, expires, latches, text_);
  const auto write = [&](json::writer& into) {
    chunk_store::place place;
    for (std::size_t at = 0; at != done_;) {
      const auto here = state_.chunks.read(text_, at, place);
      into.append({reinterpret_cast<const char*>(here.data()), here.size()});
      at += here.size();
    }
  };
  broker_.publish(topic, published, expires, latches, write,
                  {.value = {queues.service.out.memory.value(slot_.value), queues.other_encoders}});
}

// An event, since publish() has succeeded already. `bytes`: of it, at least.
void long_publications::drop_too_long(std::size_t bytes) noexcept {
  state_.counts.add(counter::too_big);
  const topic_id index = state_.pair_rows[pair_].topic;
  if (!may_report_again(state_.topics.at(index).loss_reported_at, state_.cycle.now)) return;
  wire::text_of<event_text_bytes_max> text;
  text.add("publish ").add_name(state_.topics.name(index), event_topic_bytes_shown);
  text.add(": a value of ").add(bytes).add(" bytes or more is not sent; the limit is ");
  text.add(state_.chunks.text_bytes_max());
  state_.events.report(event::kind::warning, {}, text.text(), "raise the limit long_message_bytes_max", {});
}

void long_publications::drop() noexcept {
  if (text_) state_.chunks.release(text_);
  text_ = {};
  pair_ = {};
}

} // namespace rowe::service
