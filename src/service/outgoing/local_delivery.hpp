// SPDX-License-Identifier: Apache-2.0
// Deliveries to this process: values and messages into the inboxes of handles, and the outcomes of calls and
// sends to the handles and threads that began them. Service thread only; nothing waits or allocates. A user
// thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/result.hpp>

#include "service/state/core_state.hpp"
#include "json/structs/decoder.hpp"

namespace rowe::service {

class local_delivery {
 public:
  explicit local_delivery(core_state& state) noexcept : state_{state} {}

  // Delivers a message into the inbox of a handle, and decodes it if the handle reads values. In a window it
  // replaces an older value. Errors: full; too_big; those of the decoder, and then `why` has the diagnostic.
  status deliver(pair_index pair, const detail::value_header& header, std::string_view body,
                 json::decoder::diagnosis& why) noexcept;

  // Whether a peer may have one more message in the inbox of a handle. This process always may.
  bool may_deliver(pair_index pair, detail::peer_ref from) noexcept {
    return from.generation == 0 || has_share(pair, from);
  }
  // The two ends of a delivery whose value somebody else writes: takes a slot of the inbox of a handle for
  // texts, and hands it over. None: the inbox is full, or such a delivery is under way.
  std::optional<std::uint32_t> take_slot(pair_index pair) noexcept;
  void hand_over(pair_index pair, std::uint32_t slot, const detail::value_header& header) noexcept;

  // Ends a call, or a send that waits. `whom` began it: a handle, which knows it as `own`; a thread that
  // submitted it; or nobody. With an error, `text` is the diagnostic.
  void complete(const call_endpoint& whom, detail::call_ref own, const status& outcome,
                std::string_view text = {}) noexcept {
    if (whom.who != call_endpoint::kind::nobody) deliver_completion(whom, own, outcome, text);
  }

 private:
  bool has_share(pair_index pair, detail::peer_ref from) noexcept;
  void deliver_completion(const call_endpoint& whom, detail::call_ref own, const status& outcome,
                          std::string_view text) noexcept;
  void complete_at_pair(const call_endpoint& whom, detail::call_ref own, status outcome,
                        std::string_view text) noexcept;

  core_state& state_;
};

// ---- inline definitions

inline std::optional<std::uint32_t> local_delivery::take_slot(pair_index index) noexcept {
  const detail::producer_end& end = state_.pairs[index].service.in;
  pair_row& row = state_.pair_rows[index];
  if (row.busy) return std::nullopt;
  if (end.newest != nullptr) return end.newest->begin_write();
  if (row.spare) return std::exchange(row.spare, {}).value;
  return end.free_ring->try_take();
}

inline void local_delivery::hand_over(pair_index index, std::uint32_t slot,
                                      const detail::value_header& header) noexcept {
  detail::queue_pair& queues = state_.pairs[index];
  const detail::producer_end& end = queues.service.in;
  *end.memory.header(slot) = header;
  if (end.newest != nullptr) {
    end.newest->end_write(slot);
    queues.arrival.notify();
  } else if (end.ring->try_push(slot)) { // there is a place for every slot
    queues.arrival.notify();
  }
}

} // namespace rowe::service
