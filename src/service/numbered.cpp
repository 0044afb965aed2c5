// SPDX-License-Identifier: Apache-2.0
#include "service/numbered.hpp"

#include <array>

#include "service/service_limits.hpp"
#include "service/stop_gate.hpp"
#include "wire/own_names.hpp"

namespace rowe::service {
namespace {

using wire::listed;

// Their positions are their numbers, from 1 on.
constexpr std::array own_services{wire::stop_name,
                                  wire::stop_reset_name,
                                  wire::stop_lease_name,
                                  wire::stop_state_name,
                                  wire::stats_name,
                                  wire::list_topics_name,
                                  wire::list_services_name,
                                  wire::topic_type_name,
                                  wire::publishers_name,
                                  wire::service_type_name};
static_assert(own_services.size() < first_service_number);
static_assert(own_services[wire::stop_service_number - 1] == wire::stop_name);

} // namespace

numbered::numbered(core_state& state, const service_directory& services, const stop_rules& stop) noexcept
    : state_{state},
      service_directory_{services},
      stop_rules_{stop},
      stop_topic_{state.topics.find(wire::stop_state_name)} {}

listed numbered::topic_in(topic_id row) const noexcept {
  const topic& t = state_.topics.at(row);
  if (t.holders == 0 || (row == stop_topic_ && !stop_rules_.in_use())) return {};
  return {.number = t.channel,
          .name = state_.topics.name(row),
          .type = state_.topics.type(row),
          .schema = t.schema};
}

// The endpoint's own services come first, by their numbers, then those in the directory.
listed numbered::service_in(std::uint32_t row) const noexcept {
  if (row < first_service_number) {
    const std::string_view name = service(row);
    return name.empty() ? listed{} : listed{.number = row, .name = name};
  }
  const service_index index{row - first_service_number};
  if (!service_directory_.is_service(index)) return {};
  const service_entry& entry = service_directory_.at(index);
  const detail::queue_pair* by = entry.pair ? &state_.pairs[entry.pair] : nullptr;
  return {.number = entry.number,
          .name = service_directory_.name(index),
          .type = service_directory_.type(index),
          .schema = by != nullptr ? by->encoded : nullptr,
          .request = by != nullptr ? by->decoded : nullptr};
}

std::string_view numbered::service(std::uint32_t number) const noexcept {
  if (number >= first_service_number) {
    const service_index found = service_directory_.find_number(number);
    return !found ? std::string_view{} : service_directory_.name(found);
  }
  if (number == 0 || number > own_services.size()) return {};
  const std::string_view own = own_services[number - 1];
  const bool of_stop = stop_gate::service_named(own) != stop_verb::none;
  return of_stop && !stop_rules_.in_use() ? std::string_view{} : own;
}

topic_id numbered::topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept {
  for (subscription_id i = state_.subscriptions.first_of(peer); i;
       i = state_.subscriptions.at(i).next_on_peer) {
    if (state_.subscriptions.at(i).tag == tag) return state_.subscriptions.at(i).topic;
  }
  return {};
}

} // namespace rowe::service
