// SPDX-License-Identifier: Apache-2.0
// What this process is given: values and messages in the inboxes of its handles, and what became of the calls
// and sends that its handles and threads began. Service thread only; nothing waits or allocates; whoever
// sleeps on the other side is woken, which enters the kernel.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/detail/lane.hpp>
#include <rowe/result.hpp>

#include "service/calls.hpp"
#include "service/counters.hpp"
#include "service/cycle_state.hpp"
#include "service/front_door.hpp"
#include "service/pair_table.hpp"
#include "json/decoder.hpp"

namespace rowe::service {

class local_delivery {
 public:
  struct needs {
    const cycle_state& cycle;
    counters& counts;
    std::span<detail::lane> lanes;
    std::span<lane_view> views;
    front_door& door;
  };
  explicit local_delivery(const needs& parts) noexcept
      : cycle_{parts.cycle},
        counts_{parts.counts},
        lanes_{parts.lanes},
        views_{parts.views},
        door_{parts.door} {}

  // Into the inbox of a handle, decoded where that reads values; a window takes it in the place of an older
  // one. Errors: full; too_big; what the decoder says, and then `why` says how.
  status deliver(std::uint32_t pair, const detail::value_header& header, std::string_view body,
                 json::decoder::diagnosis& why) noexcept;

  // The end of a call, or of a send that waits, for whom it is: a handle, which knows it as `own`, a thread
  // of the front door, or nobody. Of an error, `text` is the sentence.
  void complete(const party& whom, detail::call_ref own, const status& outcome,
                std::string_view text = {}) noexcept {
    if (whom.who != party::kind::nobody) tell(whom, own, outcome, text);
  }

 private:
  void tell(const party& whom, detail::call_ref own, const status& outcome, std::string_view text) noexcept;
  void complete_at_pair(const party& whom, detail::call_ref own, status outcome,
                        std::string_view text) noexcept;

  const cycle_state& cycle_;
  counters& counts_;
  std::span<detail::lane> lanes_;
  std::span<lane_view> views_;
  front_door& door_;
};

} // namespace rowe::service
