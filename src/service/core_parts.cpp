// SPDX-License-Identifier: Apache-2.0
#include "service/core_parts.hpp"

#include <array>
#include <bit>

#include "service/check_sum.hpp"

namespace rowe::service {
namespace {

std::uint64_t random_number(entropy& from) noexcept {
  std::array<std::byte, sizeof(std::uint64_t)> bytes;
  from.fill(bytes);
  return std::bit_cast<std::uint64_t>(bytes);
}

} // namespace

std::size_t core_parts::footprint_bytes(const limits& bounds) noexcept {
  return core_state::footprint_bytes(bounds) + message_store::footprint_bytes(bounds) +
         outbox::footprint_bytes(bounds) + sender::footprint_bytes(bounds) +
         refusals::footprint_bytes(bounds) + ingress::footprint_bytes(bounds) +
         advertisement_table::footprint_bytes(bounds) + publish_predictor::footprint_bytes(bounds) + //
         receiver::footprint_bytes(bounds) + direct_messages::footprint_bytes(bounds) +
         call_completion::footprint_bytes(bounds) + //
         service_directory::footprint_bytes(bounds) + service_providers::footprint_bytes(bounds) +
         thread_submissions::footprint_bytes(bounds) + dispatcher::footprint_bytes(bounds) +
         listings::footprint_bytes(bounds) + stop_state_feed::footprint_bytes(bounds) +
         stop_service::footprint_bytes(bounds);
}

core_parts::core_parts(rt::arena& memory, const core_options& options, const shared_parts& with_threads,
                       const core_seams& seams, frame_handler& handler, rt::time_point start) noexcept
    : state_{memory, options, with_threads, seams, start},
      statistics_topic_{options.ours == side::server ? own_topic(wire::stats_name) : topic_id{}},
      stop_topic_{own_topic(wire::stop_state_name)},
      topic_rates_{{.state = state_, .statistics_topic = statistics_topic_}},
      message_store_{memory, state_},
      outbox_{memory, state_, message_store_},
      subscription_queues_{{.state = state_, .message_store = message_store_, .outbox = outbox_}},
      sender_{memory,
              {.state = state_,
               .message_store = message_store_,
               .outbox = outbox_,
               .subscription_queues = subscription_queues_}},
      refusals_{memory, {.state = state_, .outbox = outbox_}},
      access_control_{{.state = state_, .refusals = refusals_}},
      local_delivery_{state_},
      receiver_{memory, {.state = state_, .outbox = outbox_, .local_delivery = local_delivery_}},
      ingress_{memory,
               {.state = state_,
                .outbox = outbox_,
                .sender = sender_,
                .receiver = receiver_,
                .frame_handler = handler}},
      direct_messages_{memory,
                       {.state = state_,
                        .message_store = message_store_,
                        .outbox = outbox_,
                        .local_delivery = local_delivery_,
                        .receiver = receiver_}},
      liveness_{{.state = state_,
                 .outbox = outbox_,
                 .sender = sender_,
                 .refusals = refusals_,
                 .ingress = ingress_}},
      call_completion_{memory,
                       {.state = state_,
                        .message_store = message_store_,
                        .outbox = outbox_,
                        .refusals = refusals_,
                        .direct_messages = direct_messages_,
                        .local_delivery = local_delivery_}},
      publish_predictor_{memory, state_.bounds(), with_threads.shared.counts},
      audiences_{{.state = state_, .publish_predictor = publish_predictor_}},
      advertisement_table_{memory, state_.bounds()},
      topic_places_{{.state = state_, .advertisement_table = advertisement_table_, .refusals = refusals_}},
      subscriptions_{{.state = state_,
                      .subscription_queues = subscription_queues_,
                      .refusals = refusals_,
                      .audiences = audiences_,
                      .topic_rates = topic_rates_,
                      .topic_places = topic_places_}},
      advertisements_{{.state = state_,
                       .advertisement_table = advertisement_table_,
                       .refusals = refusals_,
                       .topic_places = topic_places_,
                       .subscriptions = subscriptions_}},
      broker_{{.state = state_,
               .message_store = message_store_,
               .outbox = outbox_,
               .subscription_queues = subscription_queues_,
               .refusals = refusals_,
               .local_delivery = local_delivery_,
               .advertisement_table = advertisement_table_}},
      topic_handles_{{.state = state_,
                      .message_store = message_store_,
                      .outbox = outbox_,
                      .publish_predictor = publish_predictor_,
                      .audiences = audiences_,
                      .topic_rates = topic_rates_,
                      .topic_places = topic_places_,
                      .subscriptions = subscriptions_,
                      .advertisements = advertisements_,
                      .broker = broker_}},
      service_directory_{memory, state_.bounds()},
      service_providers_{memory,
                         {.state = state_, .service_directory = service_directory_, .refusals = refusals_}},
      stop_rules_{options.stop, start, random_number(seams.random)},
      stop_service_{memory,
                    {.state = state_,
                     .sender = sender_,
                     .access_control = access_control_,
                     .call_completion = call_completion_,
                     .stop_rules = stop_rules_}},
      statistics_report_{
          {.state = state_, .stop_rules = stop_rules_, .outbox = outbox_, .topic_rates = topic_rates_}},
      statistics_feed_{{.state = state_,
                        .topic_rates = topic_rates_,
                        .broker = broker_,
                        .statistics_report = statistics_report_}},
      endpoint_services_{{.state = state_,
                          .service_directory = service_directory_,
                          .stop_rules = stop_rules_,
                          .message_store = message_store_,
                          .outbox = outbox_,
                          .call_completion = call_completion_,
                          .statistics_report = statistics_report_,
                          .advertisement_table = advertisement_table_}},
      call_requests_{{.state = state_,
                      .message_store = message_store_,
                      .outbox = outbox_,
                      .local_delivery = local_delivery_,
                      .receiver = receiver_,
                      .direct_messages = direct_messages_,
                      .call_completion = call_completion_,
                      .stop_service = stop_service_}},
      call_router_{{.state = state_,
                    .service_directory = service_directory_,
                    .refusals = refusals_,
                    .receiver = receiver_,
                    .local_delivery = local_delivery_,
                    .call_completion = call_completion_,
                    .call_requests = call_requests_,
                    .endpoint_services = endpoint_services_,
                    .stop_service = stop_service_}},
      listings_{memory,
                {.state = state_,
                 .service_directory = service_directory_,
                 .stop_rules = stop_rules_,
                 .advertisement_table = advertisement_table_,
                 .outbox = outbox_,
                 .endpoint_name = statistics_report_.name()}},
      stop_state_feed_{memory,
                       {.state = state_,
                        .sender = sender_,
                        .broker = broker_,
                        .stop_rules = stop_rules_,
                        .topic = stop_topic_}},
      handle_submissions_{{.state = state_,
                           .sender = sender_,
                           .local_delivery = local_delivery_,
                           .receiver = receiver_,
                           .direct_messages = direct_messages_,
                           .broker = broker_,
                           .topic_handles = topic_handles_,
                           .call_completion = call_completion_,
                           .call_router = call_router_,
                           .publish_predictor = publish_predictor_}},
      thread_submissions_{memory,
                          {.state = state_,
                           .receiver = receiver_,
                           .direct_messages = direct_messages_,
                           .call_completion = call_completion_,
                           .call_router = call_router_}},
      handle_registry_{{.state = state_,
                        .service_directory = service_directory_,
                        .outbox = outbox_,
                        .receiver = receiver_,
                        .publish_predictor = publish_predictor_,
                        .call_completion = call_completion_,
                        .call_requests = call_requests_,
                        .service_providers = service_providers_,
                        .stop_service = stop_service_,
                        .topic_handles = topic_handles_,
                        .handle_submissions = handle_submissions_}},
      dispatcher_{memory,
                  {.state = state_,
                   .refusals = refusals_,
                   .access_control = access_control_,
                   .receiver = receiver_,
                   .ingress = ingress_,
                   .direct_messages = direct_messages_,
                   .broker = broker_,
                   .subscriptions = subscriptions_,
                   .advertisements = advertisements_,
                   .service_providers = service_providers_,
                   .listings = listings_,
                   .call_router = call_router_,
                   .stop_service = stop_service_}} {
  state_.calls.begin(random_number(seams.random));
  if (statistics_topic_) state_.topics.at(statistics_topic_).keep = keep::newest;
}

// A topic of the endpoint itself.
topic_id core_parts::own_topic(std::string_view name) noexcept {
  const topic_id topic = state_.topics.find_or_add(name);
  state_.topics.hold_as_own(topic);
  return topic;
}

// ---- checks

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
  if (!direct_messages_.check()) return "direct messages";
  if (!receiver_.check()) return "what peers have with whoever receives";
  if (!check_holders()) return "who holds topics";
  if (!ingress_.check()) return "what is read and not carried out";
  return {};
}

// Each topic is held by its subscriptions, advertisements and handles, and by the endpoint where it is its
// own.
bool core_parts::check_holders() const noexcept {
  std::uint64_t own_held = 0;
  for (const topic_id own : {statistics_topic_, stop_topic_})
    own_held += own ? weight(own) : 0; // a client has none
  for (const pair_row& row : state_.pair_rows) {
    if (row.attached && row.topic) own_held += weight(row.topic);
  }
  return topic_places_.check(own_held) && subscriptions_.check();
}

} // namespace rowe::service
