// SPDX-License-Identifier: Apache-2.0
#include "service/core/memory_plan.hpp"

#include <rowe/detail/queue_pair.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/waker.hpp>

#include "service/base/service_limits.hpp"
#include "service/core/core.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/shared_state.hpp"
#include "service/threads/submission_queue.hpp"

namespace rowe::service {

std::size_t core_parts::footprint_bytes(const limits& bounds) noexcept {
  return core_state::footprint_bytes(bounds) + message_store::footprint_bytes(bounds) +
         outbox::footprint_bytes(bounds) + sender::footprint_bytes(bounds) +
         refusals::footprint_bytes(bounds) + ingress::footprint_bytes(bounds) +
         long_ingress::footprint_bytes(bounds) + fragment_ingress::footprint_bytes(bounds) +
         long_deliveries::footprint_bytes(bounds) + advertisement_table::footprint_bytes(bounds) +
         publish_predictor::footprint_bytes(bounds) + receiver::footprint_bytes(bounds) +
         direct_messages::footprint_bytes(bounds) + subscriptions::footprint_bytes(bounds) +
         call_completion::footprint_bytes(bounds) + service_directory::footprint_bytes(bounds) +
         service_providers::footprint_bytes(bounds) + thread_submissions::footprint_bytes(bounds) +
         dispatcher::footprint_bytes(bounds) + listings::footprint_bytes(bounds) +
         stop_state_feed::footprint_bytes(bounds) + stop_service::footprint_bytes(bounds) +
         command_gate::footprint_bytes(bounds) + topic_pages::footprint_bytes(bounds) +
         own_pages::footprint_bytes(bounds) + parameters::footprint_bytes(bounds) +
         parameter_requests::footprint_bytes(bounds) + connection_graph::footprint_bytes(bounds);
}

memory_plan plan_memory(const limits& bounds, transport_security with) noexcept {
  using rt::arena;
  return {
      .core = arena::bytes_for<core>() + core::footprint_bytes(bounds),
      .shared = arena::bytes_for<shared_state>() + shared_state::footprint_bytes(bounds),
      .threads = arena::bytes_for<submission_queue>() + submission_queue::footprint_bytes(bounds) +
                 arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(bounds),
      .waker = arena::bytes_for<rt::waker<>>(),
      .pairs = arena::bytes_for<detail::queue_pair>(bounds.handles_max),
      .pair_memory = arena::bytes_for(std::max<std::size_t>(bounds.handle_bytes, 1)),
      .handshakes = arena::bytes_for(bounds.handshake_bytes),
      .tls = with == transport_security::tls
                 ? tls_bytes + bounds.connections_max * tls_connection_bytes +
                       bounds.handshakes_max * (tls_place_bytes + tls_handshake_bytes)
                 : 0,
      .chunks = chunk_store::pool_bytes(bounds),
  };
}

} // namespace rowe::service

namespace rowe {

std::size_t limits::footprint_bytes(transport_security with) const noexcept {
  return service::plan_memory(*this, with).total();
}

} // namespace rowe
