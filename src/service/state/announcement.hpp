// SPDX-License-Identifier: Apache-2.0
// For those that announce to a peer by one message at a time: what it says is known when it is written. If it
// is evicted, all is announced again, as it is then. Service thread only.
#pragma once
#include <cstdint>

#include "service/state/peer_queues.hpp"

namespace rowe::service {

class announcement {
 public:
  enum class fate : std::uint8_t { none, waits, written, lost };

  // It was queued just now.
  void begin(const peer_queues& of) noexcept { last_ = of.replies.popped + of.replies.count; }
  // One waits, or its fate was not asked for.
  bool is_begun() const noexcept { return last_ != 0; }
  // Says once what became of it.
  fate take_fate(const peer_queues& of, announcer by) noexcept {
    if (!is_begun()) return fate::none;
    if (of.replies.popped < last_) return fate::waits;
    last_ = 0;
    return of.lost.has(by) ? fate::lost : fate::written;
  }

 private:
  std::uint64_t last_ = 0; // when so many replies have left their queue, it has, too; 0: none
};

} // namespace rowe::service
