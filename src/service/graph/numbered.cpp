// SPDX-License-Identifier: Apache-2.0
#include "service/graph/numbered.hpp"

#include "service/base/service_limits.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/own_names.hpp"

namespace rowe::service {
namespace {

using wire::listed;

static_assert(numbered_own_services < first_service_number);

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
    if (name.empty()) return {};
    const own_service_type& its = own_service_types()[row - 1];
    return {.number = row, .name = name, .type = its.type, .schema = its.listed, .request = its.request};
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
  if (number == 0 || number > numbered_own_services) return {};
  const own_service_type& own = own_service_types()[number - 1];
  return own.of_stop && !stop_rules_.in_use() ? std::string_view{} : own.name;
}

topic_id numbered::topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept {
  for (subscription_id i = state_.subscriptions.first_of(peer); i;
       i = state_.subscriptions.at(i).next_on_peer) {
    if (state_.subscriptions.at(i).tag == tag) return state_.subscriptions.at(i).topic;
  }
  return {};
}

} // namespace rowe::service
