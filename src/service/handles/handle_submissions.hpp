// SPDX-License-Identifier: Apache-2.0
// Takes what handles of this process submit: values to publish, messages, requests and replies, a stated
// budget of each in a cycle. What finds no room is parked. Parked slots form a list, linked through their
// headers. They belong to the service thread until released. So one peer that does not read delays neither
// messages to other peers nor the expiry of messages. Service thread only; nothing waits or allocates. A user
// thread that sleeps is woken, which enters the kernel.
#pragma once
#include <cstddef>

#include <rowe/detail/queue_pair.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/direct_messages.hpp"
#include "service/handles/long_publications.hpp"
#include "service/incoming/receiver.hpp"
#include "service/outgoing/local_delivery.hpp"
#include "service/outgoing/sender.hpp"
#include "service/requests/call_router.hpp"
#include "service/state/core_state.hpp"
#include "service/topics/publish_predictor.hpp"
#include "service/topics/topic_handles.hpp"
#include "service/topics/value_publisher.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {

struct handle_submissions_needs {
  core_state& state_;
  sender& sender_;
  local_delivery& local_delivery_;
  receiver& receiver_;
  direct_messages& direct_messages_;
  value_publisher& value_publisher_;
  topic_handles& topic_handles_;
  call_completion& call_completion_;
  call_router& call_router_;
  publish_predictor& publish_predictor_;
  long_publications& long_publications_;
};

class handle_submissions : handle_submissions_needs {
 public:
  explicit handle_submissions(const handle_submissions_needs& parts) noexcept
      : handle_submissions_needs{parts} {}

  // Begins a cycle: all handles are looked at once.
  void begin_cycle() noexcept { more_left_ = waits_ = false; }
  void take(pair_index pair) noexcept;
  // Tries all parked messages again, as if they came now.
  void retry_all() noexcept {
    for (const pair_index pair : state_.pairs.ids()) retry(pair);
  }
  // Whether the handle has submitted something since.
  bool has_new(pair_index pair) const noexcept {
    return state_.pairs[pair].service.out.ring->pending_at_least() != 0;
  }
  // Whether something that a closing handle submitted is still to be taken, or to be written to a server.
  // What other handles publish on the same topic meanwhile does not count.
  bool has_unsent(pair_index pair) noexcept;
  // At the end of a cycle: wakes handles that wait for room: there may be some. `anywhere`: there is new room
  // at a peer, or elsewhere outside the handle.
  void notify_room(bool anywhere) noexcept {
    if (std::exchange(some_ask_room_, false)) notify_those_who_wait(anywhere);
  }

  // A handle had more than its budget of this cycle; the next cycle is needed at once.
  bool more_left() const noexcept { return more_left_; }
  // Something stays with a handle until there is room for it.
  bool waits() const noexcept { return waits_; }
  void note_waits() noexcept { waits_ = true; }
  void note_more_left() noexcept { more_left_ = true; }
  // Nothing is parked or still to be taken.
  bool drained() const noexcept;

 private:
  void retry(pair_index pair) noexcept;
  void take_values(pair_index pair) noexcept;
  void take_newest(pair_index pair) noexcept;
  void take_long(pair_index pair) noexcept;
  void take_entries(pair_index pair) noexcept;
  std::size_t take_new_entries(pair_index pair) noexcept;
  bool take_entry(pair_index pair, pair_slot slot, bool parked) noexcept;
  void notify_those_who_wait(bool anywhere) noexcept;
  void answer(pair_index pair, pair_slot slot, const call_endpoint& us, const call_endpoint& waits) noexcept;

  bool some_ask_room_ = false; // a handle sleeps until there is room
  bool more_left_ = false;
  bool waits_ = false;
};

} // namespace rowe::service
