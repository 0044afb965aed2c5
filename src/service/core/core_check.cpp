// SPDX-License-Identifier: Apache-2.0
// Whether the structures of all parts are consistent. For tests, after every step.
#include "service/base/check_sum.hpp"
#include "service/core/core_parts.hpp"

namespace rowe::service {

std::string_view core_parts::inconsistency() const noexcept {
  if (!state_.peers.check()) return "the number of peers";
  if (!state_.topics.check()) return "topics";
  if (!state_.subscriptions.check()) return "the subscriptions of topics and of peers";
  if (!state_.calls.check()) return "calls";
  if (!state_.due.check()) return "the wheel";
  if (!service_providers_.check()) return "who provides services";
  if (!call_completion_.check()) return "who asks and who answers";
  if (!message_store_.check()) return "slots";
  if (!outbox_.check()) return "queues and the slots in them";
  if (!subscription_queues_.check()) return "subscriptions that are ready";
  if (!sender_.check()) return "who has something to write";
  if (!stop_service_.check()) return "who waits for the answer to a stop";
  if (!command_gate_.check()) return "who drives";
  if (!direct_messages_.check()) return "direct messages";
  if (!receiver_.check()) return "what peers have with whoever receives";
  if (!check_holders()) return "who holds topics";
  if (!advertisement_table_.check()) return "who advertises topics";
  if (!advertisements_.check()) return "topics of the program that peers advertise";
  if (!connection_graph_.check()) return "who is told of the connection graph";
  if (!ingress_.check()) return "what is read and not carried out";
  if (!state_.chunks.check() || !long_ingress_.check()) return "the texts of long messages";
  if (!fragment_ingress_.check()) return "messages in fragments";
  return {};
}

// Each topic is held by its subscriptions, advertisements and handles; its own ones by the endpoint.
bool core_parts::check_holders() const noexcept {
  std::uint64_t own_held = 0;
  for (const topic_id own : {statistics_topic_, stop_topic_, parameters_feed_.topic(), control_feed_.topic()})
    own_held += own ? weight(own) : 0; // a client has none
  for (const pair_row& row : state_.pair_rows) {
    if (row.attached && row.topic) own_held += weight(row.topic);
  }
  return topic_places_.check(own_held) && subscriptions_.check();
}

} // namespace rowe::service
