// SPDX-License-Identifier: Apache-2.0
#include "service/core_parts.hpp"

#include <array>
#include <bit>

#include "service/check_sum.hpp"

namespace rowe::service {
namespace {

std::uint64_t draw(entropy& from) noexcept {
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
      rates_{{.state = state_, .statistics_topic = statistics_topic_}},
      store_{memory, state_},
      outbox_{memory, state_, store_},
      subscription_queues_{{.state = state_, .store = store_, .out = outbox_}},
      sender_{memory, {.state = state_, .store = store_, .out = outbox_, .queues = subscription_queues_}},
      refusals_{memory, {.state = state_, .out = outbox_}},
      delivery_{state_},
      receiver_{memory, {.state = state_, .out = outbox_, .delivery = delivery_}},
      ingress_{memory,
               {.state = state_, .out = outbox_, .writer = sender_, .inbox = receiver_, .handler = handler}},
      messages_{
          memory,
          {.state = state_, .store = store_, .out = outbox_, .delivery = delivery_, .inbox = receiver_}},
      liveness_{{.state = state_, .out = outbox_, .writer = sender_, .refused = refusals_, .in = ingress_}},
      completion_{memory,
                  {.state = state_,
                   .store = store_,
                   .out = outbox_,
                   .refused = refusals_,
                   .messages = messages_,
                   .delivery = delivery_}},
      phases_{memory, state_.bounds(), with_threads.shown.counts},
      audiences_{{.state = state_, .phases = phases_}},
      advertised_{memory, state_.bounds()},
      places_{{.state = state_, .advertised = advertised_, .refused = refusals_}},
      subscriptions_{{.state = state_,
                      .queues = subscription_queues_,
                      .refused = refusals_,
                      .audience = audiences_,
                      .rates = rates_,
                      .places = places_}},
      advertisements_{{.state = state_,
                       .table = advertised_,
                       .refused = refusals_,
                       .places = places_,
                       .readers = subscriptions_}},
      broker_{{.state = state_,
               .store = store_,
               .out = outbox_,
               .queues = subscription_queues_,
               .refused = refusals_,
               .delivery = delivery_,
               .advertised = advertised_}},
      topic_handles_{{.state = state_,
                      .store = store_,
                      .out = outbox_,
                      .phases = phases_,
                      .audience = audiences_,
                      .rates = rates_,
                      .places = places_,
                      .readers = subscriptions_,
                      .advertised = advertisements_,
                      .values = broker_}},
      directory_{memory, state_.bounds()},
      providers_{memory, {.state = state_, .directory = directory_, .refused = refusals_}},
      stop_{options.stop, start, draw(seams.random)},
      stop_service_{memory, {.state = state_, .writer = sender_, .completion = completion_, .rules = stop_}},
      report_{{.state = state_, .stop = stop_, .out = outbox_, .rates = rates_}},
      statistics_{{.state = state_, .rates = rates_, .values = broker_, .report = report_}},
      own_services_{{.state = state_,
                     .directory = directory_,
                     .stop = stop_,
                     .store = store_,
                     .out = outbox_,
                     .completion = completion_,
                     .report = report_,
                     .advertised = advertised_}},
      requests_{{.state = state_,
                 .store = store_,
                 .out = outbox_,
                 .delivery = delivery_,
                 .inbox = receiver_,
                 .messages = messages_,
                 .completion = completion_,
                 .stop = stop_service_}},
      callers_{{.state = state_,
                .directory = directory_,
                .refused = refusals_,
                .inbox = receiver_,
                .delivery = delivery_,
                .completion = completion_,
                .requests = requests_,
                .own = own_services_,
                .stop = stop_service_}},
      listings_{memory,
                {.state = state_,
                 .directory = directory_,
                 .stop = stop_,
                 .advertised = advertised_,
                 .out = outbox_,
                 .endpoint_name = report_.name()}},
      state_feed_{
          memory,
          {.state = state_, .writer = sender_, .values = broker_, .stop = stop_, .topic = stop_topic_}},
      handles_{{.state = state_,
                .writer = sender_,
                .delivery = delivery_,
                .inbox = receiver_,
                .messages = messages_,
                .values = broker_,
                .handles = topic_handles_,
                .completion = completion_,
                .calls = callers_,
                .phases = phases_}},
      threads_{memory,
               {.state = state_,
                .inbox = receiver_,
                .messages = messages_,
                .completion = completion_,
                .calls = callers_}},
      registry_{{.state = state_,
                 .directory = directory_,
                 .out = outbox_,
                 .inbox = receiver_,
                 .phases = phases_,
                 .completion = completion_,
                 .requests = requests_,
                 .providers = providers_,
                 .stop = stop_service_,
                 .topics = topic_handles_,
                 .submissions = handles_}},
      dispatcher_{memory,
                  {.state = state_,
                   .refused = refusals_,
                   .inbox = receiver_,
                   .in = ingress_,
                   .messages = messages_,
                   .values = broker_,
                   .readers = subscriptions_,
                   .writers = advertisements_,
                   .providers = providers_,
                   .listed = listings_,
                   .completion = completion_,
                   .calls = callers_,
                   .stop = stop_service_}} {
  state_.calls.begin(draw(seams.random));
  if (statistics_topic_) state_.topics.at(statistics_topic_).keep = keep::newest;
}

// A topic of the endpoint itself.
topic_id core_parts::own_topic(std::string_view name) noexcept {
  const topic_id topic = state_.topics.find_or_add(name);
  state_.topics.hold_as_own(topic);
  return topic;
}

// ---- consistency

std::string_view core_parts::inconsistency() const noexcept {
  if (!state_.peers.check()) return "the number of peers";
  if (!state_.topics.check()) return "topics and their subscriptions";
  if (!state_.calls.check()) return "calls";
  if (!state_.due.check()) return "the wheel";
  if (!providers_.check()) return "who provides services";
  if (!completion_.check()) return "who asks and who answers";
  if (!store_.check()) return "slots";
  if (!outbox_.check()) return "queues and the slots in them";
  if (!subscription_queues_.check()) return "subscriptions that are ready";
  if (!sender_.check()) return "who has something to write";
  if (!stop_service_.check()) return "who waits for the answer to a stop";
  if (!messages_.check()) return "direct messages";
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
  for (const pair_row& view : state_.views) {
    if (view.attached && view.topic) own_held += weight(view.topic);
  }
  return places_.check(own_held) && subscriptions_.check();
}

} // namespace rowe::service
