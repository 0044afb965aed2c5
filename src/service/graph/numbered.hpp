// SPDX-License-Identifier: Apache-2.0
// What has a number. A topic's number is its channel. The endpoint's own services have fixed numbers; those
// in the directory get theirs as they come. Service thread only.
#pragma once
#include <cstdint>
#include <string_view>

#include "service/state/core_state.hpp"
#include "service/state/service_directory.hpp"
#include "service/threads/stop_rules.hpp"
#include "wire/codec/codec.hpp"

namespace rowe::service {

class numbered {
 public:
  numbered(core_state& state, const service_directory& services, const stop_rules& stop) noexcept;

  // What is in a row; without a number: nothing that is listed. Services: the endpoint's own come first, by
  // their numbers, then those in the directory.
  wire::listed topic_in(topic_id row) const noexcept;
  wire::listed service_in(std::uint32_t row) const noexcept;
  // Empty: no service has this number.
  std::string_view service(std::uint32_t number) const noexcept;
  // The topic to which the peer subscribed by this number of its own; or none.
  topic_id topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept;
  // How often anything was added, removed or described anew.
  std::uint64_t changes() const noexcept {
    return state_.topics.changes().listed + service_directory_.changes() + (stop_rules_.in_use() ? 1 : 0);
  }
  std::uint32_t newest_topic() const noexcept { return state_.topics.changes().channels.newest(); }
  std::uint32_t newest_service() const noexcept { return service_directory_.newest_number(); }

 private:
  core_state& state_;
  const service_directory& service_directory_;
  const stop_rules& stop_rules_;
  const topic_id stop_topic_; // listed only where there is a stop
};

} // namespace rowe::service
