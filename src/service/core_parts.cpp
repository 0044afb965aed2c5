// SPDX-License-Identifier: Apache-2.0
#include "service/core_parts.hpp"

#include <array>
#include <bit>

#include "service/check_sum.hpp"

namespace rowe::service {
namespace {

std::uint64_t draw(entropy& from) noexcept {
  std::array<std::byte, sizeof(std::uint64_t)> dice;
  from.fill(dice);
  return std::bit_cast<std::uint64_t>(dice);
}

} // namespace

std::size_t core_parts::footprint_bytes(const limits& bounds) noexcept {
  using rt::arena;
  return timers::footprint_bytes(bounds) + peer_table::footprint_bytes(bounds) +
         latch_store::footprint_bytes(bounds) + topic_table::footprint_bytes(bounds) +
         message_store::footprint_bytes(bounds) + outbox::footprint_bytes(bounds) +
         sender::footprint_bytes(bounds) + refusals::footprint_bytes(bounds) +
         ingress::footprint_bytes(bounds) + advertisement_table::footprint_bytes(bounds) +
         arena::bytes_for<pair_row>(bounds.lanes_max) + //
         publish_predictor::footprint_bytes(bounds) +   //
         receiver::footprint_bytes(bounds) + direct_messages::footprint_bytes(bounds) +
         call_completion::footprint_bytes(bounds) + //
         service_directory::footprint_bytes(bounds) + service_providers::footprint_bytes(bounds) +
         call_table::footprint_bytes(bounds) + //
         thread_submissions::footprint_bytes(bounds) + dispatcher::footprint_bytes(bounds) +
         listings::footprint_bytes(bounds) + stop_state_feed::footprint_bytes(bounds) +
         stop_service::footprint_bytes(bounds);
}

core_parts::core_parts(rt::arena& memory, const core_options& options, rows<pair_index, detail::lane> lanes,
                       shared_state& shown, submission_queue& submissions, shared_inbox& inbox,
                       const core_seams& seams, frame_handler& handler, rt::time_point start) noexcept
    : options_{options},
      bounds_{options.bounds},
      shown_{shown},
      cycle_{.now = start},
      events_{cycle_, shown},
      timers_{memory, bounds_, start},
      peers_{memory, bounds_},
      latches_{memory, bounds_},
      topics_{memory, bounds_, seams.protocols.envelope},
      statistics_topic_{options.ours == side::server ? own_topic(wire::stats_name) : topic_id{}},
      stop_topic_{own_topic(wire::stop_state_name)},
      rates_{{.cycle = cycle_,
              .due = timers_,
              .topics = topics_,
              .period = options.stats_period,
              .statistics_topic = statistics_topic_}},
      store_{memory,
             bounds_,
             {.cycle = cycle_,
              .counts = shown.counts,
              .due = timers_,
              .text_bytes_max = seams.protocols.message_bytes_max}},
      outbox_{memory,
              bounds_,
              {.cycle = cycle_,
               .counts = shown.counts,
               .due = timers_,
               .store = store_,
               .peers = peers_,
               .topics = topics_,
               .latches = latches_}},
      sender_{memory,
              bounds_,
              {.cycle = cycle_,
               .counts = shown.counts,
               .due = timers_,
               .peers = peers_,
               .topics = topics_,
               .store = store_,
               .out = outbox_,
               .to_peers = seams.to_peers,
               .random = seams.random,
               .protocols = seams.protocols}},
      refusals_{memory,
                bounds_,
                {.cycle = cycle_,
                 .counts = shown.counts,
                 .events = events_,
                 .peers = peers_,
                 .out = outbox_,
                 .protocols = seams.protocols}},
      lanes_{lanes},
      views_{memory.carve<pair_row>(bounds_.lanes_max)},
      calls_{memory, bounds_, claimants()},
      delivery_{
          {.cycle = cycle_, .counts = shown.counts, .lanes = lanes, .views = views_, .queue = submissions}},
      receiver_{memory,
                bounds_,
                {.cycle = cycle_,
                 .counts = shown.counts,
                 .peers = peers_,
                 .calls = calls_,
                 .out = outbox_,
                 .lanes = lanes,
                 .views = views_,
                 .queue = submissions,
                 .shared = inbox,
                 .delivery = delivery_,
                 .claimants = claimants(),
                 .answers_any = options.answers_any}},
      ingress_{memory,
               bounds_,
               {.cycle = cycle_,
                .counts = shown.counts,
                .peers = peers_,
                .to_peers = seams.to_peers,
                .out = outbox_,
                .writer = sender_,
                .inbox = receiver_,
                .handler = handler}},
      messages_{memory,
                bounds_,
                {.cycle = cycle_,
                 .shown = shown,
                 .peers = peers_,
                 .calls = calls_,
                 .store = store_,
                 .out = outbox_,
                 .delivery = delivery_,
                 .inbox = receiver_,
                 .validator = seams.validator,
                 .claimants = claimants()}},
      liveness_{{.options = options_,
                 .cycle = cycle_,
                 .counts = shown.counts,
                 .due = timers_,
                 .peers = peers_,
                 .out = outbox_,
                 .writer = sender_,
                 .refused = refusals_,
                 .in = ingress_}},
      completion_{memory,
                  bounds_,
                  {.cycle = cycle_,
                   .counts = shown.counts,
                   .due = timers_,
                   .peers = peers_,
                   .calls = calls_,
                   .store = store_,
                   .out = outbox_,
                   .refused = refusals_,
                   .messages = messages_,
                   .delivery = delivery_,
                   .lanes = lanes,
                   .views = views_,
                   .validator = seams.validator,
                   .protocols = seams.protocols}},
      phases_{memory, bounds_, shown.counts},
      audiences_{{.lanes = lanes, .views = views_, .topics = topics_, .phases = phases_}},
      advertised_{memory, bounds_},
      places_{bounds_,
              {.cycle = cycle_,
               .peers = peers_,
               .topics = topics_,
               .advertised = advertised_,
               .latches = latches_,
               .refused = refusals_,
               .claimants = claimants()}},
      subscriptions_{bounds_,
                     {.counts = shown.counts,
                      .peers = peers_,
                      .topics = topics_,
                      .out = outbox_,
                      .refused = refusals_,
                      .audience = audiences_,
                      .rates = rates_,
                      .places = places_,
                      .claimants = claimants()}},
      advertisements_{{.peers = peers_,
                       .topics = topics_,
                       .table = advertised_,
                       .refused = refusals_,
                       .places = places_,
                       .readers = subscriptions_}},
      broker_{{.options = options_,
               .cycle = cycle_,
               .counts = shown.counts,
               .events = events_,
               .peers = peers_,
               .topics = topics_,
               .latches = latches_,
               .store = store_,
               .out = outbox_,
               .refused = refusals_,
               .delivery = delivery_,
               .views = views_,
               .advertised = advertised_}},
      topic_handles_{{.options = options_,
                      .events = events_,
                      .lanes = lanes,
                      .views = views_,
                      .peers = peers_,
                      .topics = topics_,
                      .store = store_,
                      .out = outbox_,
                      .phases = phases_,
                      .audience = audiences_,
                      .rates = rates_,
                      .places = places_,
                      .readers = subscriptions_,
                      .advertised = advertisements_,
                      .values = broker_}},
      directory_{memory, bounds_},
      providers_{memory,
                 bounds_,
                 {.peers = peers_, .directory = directory_, .refused = refusals_, .claimants = claimants()}},
      stop_{options.stop, start, draw(seams.random)},
      stop_service_{memory,
                    bounds_,
                    {.options = options_,
                     .cycle = cycle_,
                     .events = events_,
                     .shown = shown,
                     .queue = submissions,
                     .lanes = lanes,
                     .views = views_,
                     .peers = peers_,
                     .calls = calls_,
                     .writer = sender_,
                     .completion = completion_,
                     .protocols = seams.protocols,
                     .rules = stop_}},
      report_{bounds_,
              options.name,
              {.cycle = cycle_,
               .shown = shown,
               .lanes = lanes,
               .peers = peers_,
               .topics = topics_,
               .calls = calls_,
               .stop = stop_,
               .out = outbox_,
               .protocols = seams.protocols,
               .rates = rates_}},
      statistics_{{.cycle = cycle_,
                   .due = timers_,
                   .topics = topics_,
                   .rates = rates_,
                   .values = broker_,
                   .report = report_,
                   .period = options.stats_period}},
      own_services_{options.ours,
                    {.cycle = cycle_,
                     .peers = peers_,
                     .calls = calls_,
                     .topics = topics_,
                     .directory = directory_,
                     .stop = stop_,
                     .store = store_,
                     .out = outbox_,
                     .completion = completion_,
                     .report = report_,
                     .advertised = advertised_,
                     .lanes = lanes,
                     .views = views_}},
      requests_{{.cycle = cycle_,
                 .counts = shown.counts,
                 .peers = peers_,
                 .calls = calls_,
                 .store = store_,
                 .out = outbox_,
                 .delivery = delivery_,
                 .inbox = receiver_,
                 .messages = messages_,
                 .completion = completion_,
                 .stop = stop_service_,
                 .lanes = lanes,
                 .views = views_}},
      callers_{{.cycle = cycle_,
                .options = options_,
                .counts = shown.counts,
                .peers = peers_,
                .calls = calls_,
                .directory = directory_,
                .refused = refusals_,
                .inbox = receiver_,
                .delivery = delivery_,
                .completion = completion_,
                .requests = requests_,
                .own = own_services_,
                .stop = stop_service_,
                .validator = seams.validator,
                .protocols = seams.protocols}},
      listings_{memory,
                bounds_,
                {.cycle = cycle_,
                 .peers = peers_,
                 .topics = topics_,
                 .directory = directory_,
                 .stop = stop_,
                 .advertised = advertised_,
                 .out = outbox_,
                 .endpoint_name = report_.name()}},
      state_feed_{memory,
                  bounds_,
                  {.options = options_,
                   .cycle = cycle_,
                   .peers = peers_,
                   .topics = topics_,
                   .writer = sender_,
                   .values = broker_,
                   .stop = stop_,
                   .protocols = seams.protocols,
                   .topic = stop_topic_}},
      handles_{{.options = options_,
                .cycle = cycle_,
                .counts = shown.counts,
                .lanes = lanes,
                .views = views_,
                .topics = topics_,
                .writer = sender_,
                .delivery = delivery_,
                .inbox = receiver_,
                .messages = messages_,
                .values = broker_,
                .handles = topic_handles_,
                .completion = completion_,
                .calls = callers_,
                .phases = phases_,
                .validator = seams.validator}},
      threads_{memory,
               bounds_,
               {.cycle = cycle_,
                .counts = shown.counts,
                .queue = submissions,
                .shared = inbox,
                .inbox = receiver_,
                .messages = messages_,
                .completion = completion_,
                .calls = callers_}},
      registry_{bounds_,
                {.cycle = cycle_,
                 .shown = shown,
                 .lanes = lanes,
                 .views = views_,
                 .shared = inbox,
                 .peers = peers_,
                 .calls = calls_,
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
                  bounds_,
                  {.options = options_,
                   .cycle = cycle_,
                   .counts = shown.counts,
                   .events = events_,
                   .peers = peers_,
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
                   .stop = stop_service_,
                   .validator = seams.validator,
                   .protocols = seams.protocols}} {
  calls_.begin(draw(seams.random));
  if (statistics_topic_) topics_.at(statistics_topic_).keep = keep::newest;
}

// A topic of the endpoint itself.
topic_id core_parts::own_topic(std::string_view name) noexcept {
  const topic_id topic = topics_.find_or_add(name);
  topics_.hold_as_own(topic);
  return topic;
}

// ---- consistency

std::string_view core_parts::inconsistency() const noexcept {
  if (!peers_.check()) return "the number of peers";
  if (!topics_.check()) return "topics and their subscriptions";
  if (!calls_.check()) return "calls";
  if (!timers_.check()) return "the wheel";
  if (!providers_.check()) return "who provides services";
  if (!completion_.check()) return "who asks and who answers";
  if (!store_.check()) return "slots";
  if (!outbox_.check()) return "queues and the slots in them";
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
  for (const pair_row& view : views_) {
    if (view.attached && view.topic) own_held += weight(view.topic);
  }
  return places_.check(own_held) && subscriptions_.check();
}

} // namespace rowe::service
