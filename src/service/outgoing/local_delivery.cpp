// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/local_delivery.hpp"

#include <array>
#include <cstring>

#include "json/text/utf8.hpp"

namespace rowe::service {

void local_delivery::deliver_completion(const call_endpoint& whom, detail::call_ref own,
                                        const status& outcome, std::string_view text) noexcept {
  if (whom.who == call_endpoint::kind::pair) complete_at_pair(whom, own, outcome, text);
  if (whom.who == call_endpoint::kind::thread) state_.submissions.complete(whom.index, outcome, text);
}

inline void local_delivery::complete_at_pair(const call_endpoint& whom, detail::call_ref own, status outcome,
                                             std::string_view text) noexcept {
  const pair_row& row = state_.pair_rows[whom.pair()];
  if (own.generation == 0 || !row.attached || row.generation != whom.generation) return;
  detail::queue_pair& queues = state_.pairs[whom.pair()];
  const detail::producer_end& end = queues.service.completions;
  const auto slot = end.free_ring->try_take();
  if (!slot)
    return state_.counts.add(
        counter::inbox_full); // a place of the queue pair's table reserves one: only misuse gets here
  std::byte* const value = end.memory.value(*slot);
  std::size_t bytes = 0;
  std::array<char, json::decoder::diagnosis::text_bytes_max> buffer;
  if (outcome && queues.decoder != nullptr && !text.empty()) {
    bytes = end.memory.bytes_max;
    json::decoder::diagnosis why;
    outcome = queues.decoder->decode(text, value, &why);
    if (!outcome) {
      state_.counts.add(counter::undecodable);
      bytes = 0;
      text = why.text(buffer);
    }
  } else if (outcome && text.size() > end.memory.bytes_max) {
    state_.counts.add(counter::too_big);
    outcome = error{errc::too_big, static_cast<std::int64_t>(text.size()),
                    static_cast<std::int64_t>(end.memory.bytes_max)};
    text = {};
  }
  if (bytes == 0) {
    bytes = json::utf8_prefix(text, end.memory.bytes_max).size(); // a diagnostic may be cut
    if (bytes != 0) std::memcpy(value, text.data(), bytes);
  }
  *end.memory.header(*slot) = {.stamped_ns = rt::nanoseconds_of(state_.cycle.now),
                               .expires_ns = rt::nanoseconds_of(rt::never),
                               .bytes = static_cast<std::uint32_t>(bytes),
                               .what = detail::entry::completion,
                               .failed = !outcome,
                               .outcome = outcome ? errc::misuse : outcome.code(),
                               .own = own,
                               .outcome_value = outcome ? 0 : outcome.error().value,
                               .outcome_limit = outcome ? 0 : outcome.error().limit};
  if (end.ring->try_push(*slot)) queues.arrival.notify(); // there is a place for every slot
}

// Where there are several peers, one may have three times as many messages in an inbox as it leaves free
// places to others, without the last one; and always one. So a peer that sends without pause fills at most
// three quarters.
bool local_delivery::has_share(pair_index pair, detail::peer_ref from) noexcept {
  const detail::producer_end& inbox = state_.pairs[pair].service.in;
  if (inbox.newest != nullptr || 2 * inbox.ring->unpopped_at_most() < inbox.count || state_.peers.count() < 2)
    return true;
  std::size_t waiting = 0;
  std::size_t of_sender = 0;
  inbox.ring->each_unpopped([&](std::uint32_t slot) {
    ++waiting;
    of_sender += inbox.memory.header(slot)->peer == from;
  });
  state_.cycle.work_bytes += waiting * looked_at_work;
  return of_sender == 0 || waiting >= inbox.count || of_sender + 1 <= 3 * (inbox.count - waiting - 1);
}

status local_delivery::deliver(pair_index index, const detail::value_header& header, std::string_view body,
                               json::decoder::diagnosis& why) noexcept {
  detail::queue_pair& queues = state_.pairs[index];
  const detail::producer_end& end = queues.service.in;
  if (queues.decoder == nullptr && body.size() > end.memory.bytes_max) {
    return error{errc::too_big, static_cast<std::int64_t>(body.size()),
                 static_cast<std::int64_t>(end.memory.bytes_max)};
  }
  const auto taken = take_slot(index);
  if (!taken) return errc::full;
  const std::uint32_t slot = *taken;
  std::byte* const value = end.memory.value(slot);
  std::size_t bytes = body.size();
  if (queues.decoder != nullptr) {
    bytes = end.memory.bytes_max;
    if (const status read = queues.decoder->decode(body, value, &why); !read) {
      if (end.newest == nullptr) state_.pair_rows[index].spare = {slot};
      return read;
    }
  } else {
    std::memcpy(value, body.data(), bytes);
  }
  detail::value_header whole = header;
  whole.bytes = static_cast<std::uint32_t>(bytes);
  hand_over(index, slot, whole);
  return {};
}

} // namespace rowe::service
