// SPDX-License-Identifier: Apache-2.0
// A core over sockets without a thread of its own: whoever measures it takes its turns.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <rowe/detail/pair_request.hpp>
#include <rowe/rt/arena.hpp>

#include "api/endpoint_state.hpp"
#include "api/pair_memory.hpp"
#include "net/transport/socket_transport.hpp"
#include "service/core/core.hpp"
#include "service/core/memory_plan.hpp"
#include "service/threads/shared_inbox.hpp"
#include "service/threads/shared_state.hpp"
#include "service/threads/submission_queue.hpp"
#include "json/reading/reader.hpp"

namespace rowe::bench {

class sending_core {
 public:
  explicit sending_core(const net::socket_limits& sockets)
      : memory_{service::plan_memory(options_.limits).arena() +
                    service::plan_memory(options_.limits).pair_memory,
                rt::page_lock::attempted},
        transport_{net::socket_transport::listen({.limits = sockets}).value()},
        pairs_{memory_.carve<detail::queue_pair>(options_.limits.handles_max)},
        pair_memory_{memory_.carve_bytes(options_.limits.handle_bytes)},
        shared_{*memory_.make<service::shared_state>(memory_, options_.limits)},
        submissions_{*memory_.make<service::submission_queue>(memory_, options_.limits)},
        inbox_{*memory_.make<service::shared_inbox>(memory_, options_.limits)},
        core_{*memory_.make<service::core>(
            memory_, service::core_options::from(options_, service::side::server, "robot"),
            service::shared_parts{pairs_, shared_, submissions_, inbox_},
            service::core_seams{*transport_, random_, validator_, nullptr,
                                wire::protocols_of(options_.profile), rights_},
            rt::monotonic_clock::now())} {}

  void cycle() { (void)core_.cycle(rt::monotonic_clock::now()); } // the next one comes at once
  bool idle() const { return core_.drained(); }
  std::uint32_t peers() const { return core_.peers(); }
  std::uint16_t port() const { return transport_->port(); }
  std::uint64_t lost() const {
    return shared_.counts.read(service::counter::outbox_full) +
           shared_.counts.read(service::counter::no_slot) + shared_.counts.read(service::counter::expired);
  }

  // Its only queue pair. Active after a cycle.
  detail::queue_pair& offer(const detail::pair_request& asked) {
    detail::queue_pair& one = pairs_[0];
    if (detail::pair_bytes(asked) > pair_memory_.size()) std::abort();
    one.memory = pair_memory_;
    detail::build_pair(one, asked, shared_.generations());
    codecs_.emplace(detail::pair_codecs::compile(asked, options_.limits).value());
    one.encoder = &*codecs_->encoder;
    shared_.use_pair(0);
    one.lifecycle.offer();
    return one;
  }
  // What a handle on it is made of. Such a handle does not give the queue pair back.
  static detail::pair_handle handle_of(detail::queue_pair& on) { return {nullptr, on}; }

 private:
  endpoint_options options_;
  access::policy access_; // everyone may do everything
  service::policy_handover<> rights_{access_};
  rt::arena memory_;
  detail::kernel_entropy random_;
  json::reader validator_ =
      json::reader::create(options_.limits.message_bytes_max, options_.limits.depth_max).value();
  std::unique_ptr<net::socket_transport> transport_;
  std::span<detail::queue_pair> pairs_;
  std::span<std::byte> pair_memory_;
  std::optional<detail::pair_codecs> codecs_;
  service::shared_state& shared_;
  service::submission_queue& submissions_;
  service::shared_inbox& inbox_;
  service::core& core_;
};

} // namespace rowe::bench
