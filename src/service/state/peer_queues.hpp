// SPDX-License-Identifier: Apache-2.0
// What waits for one peer. Service thread only.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "service/base/index_list.hpp"
#include "service/base/message_queue.hpp"
#include "service/state/topic_rows.hpp"

namespace rowe::service {

// The subscriptions of one peer and priority that have something to write, served in turn.
using ready_list = index_queue<subscription_id, subscription, &subscription::next_ready>;

// Whose newest message to the peer was evicted.
class lost_messages {
 public:
  void begin(announcer by) noexcept { lost_[static_cast<std::size_t>(by)] = false; }
  void note(announcer by) noexcept { lost_[static_cast<std::size_t>(by)] = true; }
  bool has(announcer by) const noexcept { return lost_[static_cast<std::size_t>(by)]; }

 private:
  std::array<bool, announcers> lost_{};
};

struct peer_queues {
  queue replies;               // what only it gets: answers, refusals, announcements, lists
  queue long_replies;          // long answers and requests: one that is evicted takes no other one with it
  std::array<queue, 3> direct; // messages to it, by priority
  std::array<ready_list, 3> ready;
  std::uint32_t latched_pending = 0; // how many subscriptions still wait for latched values
  std::uint32_t dropped = 0;         // messages of its topics so far, for which it read too slowly
  // A longer text is sent in fragments, each a text of its own, and no frame so long is gathered.
  std::uint32_t whole_bytes_max = UINT32_MAX;
  std::uint32_t group_bytes_max = write_work_bytes;
  bool scheduled = false;      // it has something to write, and is in the ring of such peers
  bool blocked = false;        // the transport has no room; on_writable() comes
  bool out_of_credit = false;  // its credit is used up, but for urgent frames; a pong comes
  bool marked_full = false;    // senders get `full`: its share is used up by what is parked
  bool waits_to_begin = false; // it may not begin a frame: others hold too many partial frames
  lost_messages lost;          // of announcers

  bool any_replies() const noexcept { return (replies.count | long_replies.count) != 0; }
  // The subscription that is ready, if it is the only one and nothing else waits.
  subscription_id only_ready() const noexcept {
    if ((replies.count | long_replies.count | latched_pending) != 0) return {};
    subscription_id found{};
    for (std::size_t p = 0; p != ready.size(); ++p) {
      if (!direct[p].empty()) return {};
      if (ready[p].empty()) continue;
      if (found || ready[p].head != ready[p].tail) return {};
      found = ready[p].head;
    }
    return found;
  }
  void send_in_fragments(std::uint32_t bytes) noexcept {
    whole_bytes_max = bytes;
    group_bytes_max = std::min(whole_bytes_max, std::uint32_t{write_work_bytes});
  }
  // It reads more slowly than we could write.
  bool reads_slowly() const noexcept { return blocked || out_of_credit; }
  // It does, or it waits for peers that do.
  bool backpressured() const noexcept { return reads_slowly() || waits_to_begin; }
};

} // namespace rowe::service
