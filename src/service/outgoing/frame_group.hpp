// SPDX-License-Identifier: Apache-2.0
// Frames that are gathered for several peers before the first of them is written. A message to many peers is
// one frame for each. A call of the kernel needs more code and data than the first caches hold, so all that
// runs between two such calls is slow. Hence the sender hands these frames to the transport one straight
// after the other, and commits them behind all of them (decision 0032).
//
// Only a peer that gets one message, and nothing else, is a member. Service thread only; nothing waits or
// allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "service/base/transport.hpp"
#include "service/outgoing/batch.hpp"
#include "service/outgoing/message_frames.hpp"
#include "service/outgoing/message_store.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/outgoing/partial_frames.hpp"
#include "service/outgoing/urgent_frames.hpp"
#include "service/state/core_state.hpp"

namespace rowe::service {

struct frame_group_needs {
  core_state& state_;
  message_store& message_store_;
  outbox& outbox_;
  urgent_frames& urgent_frames_;
  partial_frames& partial_frames_;
  const message_frames& message_frames_;
};

class frame_group : frame_group_needs {
 public:
  explicit frame_group(const frame_group_needs& parts) noexcept
      : frame_group_needs{parts}, subscription_rows_{state_.subscriptions.all()} {}

  // A peer, its frame, and what the transport took of it.
  struct member {
    peer_index peer{};
    connection_id id{};
    batch_piece piece{};
    std::span<const std::byte> frame;
    std::size_t taken = 0;
  };

  std::uint32_t count() const noexcept { return count_; }
  bool full() const noexcept { return count_ == members_.size(); }
  // Gathers the message that waits for a peer, in the queue of this subscription, where it is the only one
  // that is ready; not when full. False: it has none or several, or something goes before it, or the frame
  // may not be begun. The peer counts as scheduled until its frame is committed. Nothing may be queued,
  // dropped or evicted before that.
  bool add(peer_index peer, subscription_id only) noexcept;
  // All members. The group is empty then; they stay valid until the next add().
  std::span<member> take() noexcept {
    slots_ = 0;
    return std::span{members_}.first(std::exchange(count_, 0));
  }

 private:
  const rows<subscription_id, subscription> subscription_rows_;
  std::array<member, group_max> members_;
  std::uint32_t count_ = 0;
  std::uint32_t slots_ = 0; // of the members, each counted once where they stand side by side
};

} // namespace rowe::service
