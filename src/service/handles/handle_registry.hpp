// SPDX-License-Identifier: Apache-2.0
// Folder handles: what handles and other threads of this process submit. It writes to no socket.
// The life of handles. Set-up offers a queue pair; this part attaches or refuses it. When the handle is
// closed, the pair is emptied and detached, and it is free again when the user's loop has released all slots.
// Service thread only; nothing waits or allocates. A user thread that sleeps is woken, which enters the
// kernel.
#pragma once
#include <cstdint>

#include <rowe/detail/queue_pair.hpp>
#include <rowe/result.hpp>

#include "service/calls/call_completion.hpp"
#include "service/calls/service_providers.hpp"
#include "service/handles/handle_submissions.hpp"
#include "service/incoming/receiver.hpp"
#include "service/outgoing/outbox.hpp"
#include "service/requests/call_requests.hpp"
#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/stop/stop_service.hpp"
#include "service/topics/publish_predictor.hpp"
#include "service/topics/topic_handles.hpp"

namespace rowe::service {

struct handle_registry_needs {
  core_state& state_;
  service_directory& service_directory_;
  outbox& outbox_;
  receiver& receiver_;
  publish_predictor& publish_predictor_;
  call_completion& call_completion_;
  call_requests& call_requests_;
  service_providers& service_providers_;
  stop_service& stop_service_;
  topic_handles& topic_handles_;
  handle_submissions& handle_submissions_;
};

class handle_registry : handle_registry_needs {
 public:
  explicit handle_registry(const handle_registry_needs& parts) noexcept : handle_registry_needs{parts} {}

  // Once a cycle: attaches and detaches handles, and takes what the others submit.
  void scan() noexcept;
  // In a client: announces all handles to the server.
  void announce_all(connection& c) noexcept;
  // How many handles belong to no topic: callers, responders and lanes. A peer may wait for what they submit.
  std::uint32_t talking() const noexcept { return talking_; }
  // If handles wake this thread: nothing was submitted since scan() looked.
  bool quiet() const noexcept;

 private:
  void attach(pair_index pair) noexcept;
  status attach_to_part(pair_index pair) noexcept;
  status attach_talker(pair_index pair) noexcept;
  status provide(pair_index pair) noexcept;
  void detach(pair_index pair) noexcept;
  void detach_talker(pair_index pair) noexcept;
  void count_refusals(const detail::queue_pair& queues) noexcept;
  void take_over_inbox(pair_index pair) noexcept;
  void announce_service(connection& c, pair_index pair, bool begins) noexcept;

  std::uint32_t talking_ = 0;
  std::uint64_t attached_ = 0; // so far
};

} // namespace rowe::service
