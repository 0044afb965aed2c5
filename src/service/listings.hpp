// SPDX-License-Identifier: Apache-2.0
// Numbers in place of names, and who is told them: where a protocol says so, a client learns at once who we
// are, and which topics and services there are, and then what has changed. A topic's number is its channel;
// the endpoint's own services have fixed numbers, those in the directory get theirs as they come. Service
// thread only; nothing waits or allocates.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/clock.hpp>

#include "service/advertisement_table.hpp"
#include "service/core_state.hpp"
#include "service/outbox.hpp"
#include "service/rate_limit.hpp"
#include "service/service_directory.hpp"
#include "service/stop_rules.hpp"
#include "wire/codec.hpp"
#include "wire/request.hpp"

namespace rowe::service {

class listings {
 public:
  struct needs {
    core_state& state;
    const service_directory& directory;
    const stop_rules& rules;
    const advertisement_table& advertised;
    outbox& out;
    std::string_view endpoint_name; // outlives this
  };
  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<std::uint32_t>(bounds.topics_max) +
           rt::arena::bytes_for<std::uint32_t>(std::size_t{service_directory::first_number} +
                                               bounds.services_max) +
           rt::arena::bytes_for<bool>(bounds.connections_max);
  }
  listings(rt::arena& memory, const needs& parts) noexcept;

  // A peer that wants to be told has come: who we are, and what there is. A peer that does not read it is
  // closed.
  void greet(connection& c) noexcept;
  void forget(peer_index peer) noexcept {
    if (std::exchange(told_[peer], false) && --told_count_ == 0) due_ = rt::never;
  }
  // Once a cycle: tells peers what is gone and what is new. Where changes never pause it waits in between:
  // else they would fill the queues of peers that do not read fast enough, and those would be closed.
  void tell_changes() noexcept {
    if (told_count_ != 0) tell_news();
  }
  // When tell_changes() is needed at the latest.
  rt::time_point due() const noexcept { return due_; }
  // Puts the names of what a request names by numbers. Empty, or why there is no such thing.
  std::string_view put_names(const connection& c, wire::request& asked) const noexcept;

 private:
  template <class Write>
  void send(connection& c, Write&& write) noexcept;
  template <class Of>
  void tell(connection& c, bool topics, bool added, Of&& of) noexcept;
  void tell_news() noexcept;
  void list_changes() noexcept;
  wire::listed topic_in(topic_id row) const noexcept;
  wire::listed service_in(std::uint32_t row) const noexcept;
  std::string_view service_numbered(std::uint32_t number) const noexcept;
  topic_id topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept;
  std::uint64_t changes() const noexcept {
    return state_.topics.changes() + service_directory_.changes() + (stop_rules_.in_use() ? 1 : 0);
  }

  core_state& state_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const advertisement_table& advertisement_table_;
  outbox& outbox_;
  const std::string_view name_;
  const topic_id stop_topic_; // shown only where there is a stop
  const std::size_t message_bytes_max_;
  // The numbers that peers were told, by row; and after how many changes.
  std::span<std::uint32_t> listed_topics_;
  std::span<std::uint32_t> listed_services_;
  std::uint64_t listed_at_ = 0;
  rows<peer_index, bool> told_; // who is told
  std::uint32_t told_count_ = 0;
  rate_limit tells_{listings_period, listings_burst};
  rt::time_point due_ = rt::never;
};

} // namespace rowe::service
