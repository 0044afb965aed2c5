// SPDX-License-Identifier: Apache-2.0
#include "service/core/core_parts.hpp"

#include "service/topics/own_types.hpp"

namespace rowe::service {

core_parts::core_parts(rt::arena& memory, const core_options& options, const shared_parts& with_threads,
                       const core_seams& seams, frame_handler& handler, rt::time_point start) noexcept
    : state_{memory, options, with_threads, seams, start},
      statistics_topic_{options.ours == side::server ? own_topic(wire::stats_name) : topic_id{}},
      stop_topic_{own_topic(wire::stop_state_name)},
      topic_rates_{{state_, statistics_topic_}},
      message_store_{memory, state_},
      outbox_{memory, state_, message_store_},
      long_outbox_{{state_, message_store_, outbox_}},
      subscription_queues_{{state_, message_store_, outbox_, long_outbox_}},
      sender_{memory, {state_, message_store_, outbox_, subscription_queues_}},
      refusals_{memory, {state_, outbox_}},
      access_control_{{state_, refusals_}},
      stop_rules_{stop_options_, start, seams.random.number()},
      command_gate_{memory, {state_, stop_rules_, sender_, refusals_}},
      control_service_{{state_, stop_rules_, access_control_, command_gate_}},
      rights_service_{{state_, access_control_}},
      parameters_{memory, {state_}},
      parameter_requests_{memory, {state_, outbox_, refusals_, access_control_, parameters_}},
      local_delivery_{state_},
      long_deliveries_{memory, {state_, local_delivery_}},
      receiver_{memory, {state_, outbox_, local_delivery_}},
      ingress_{memory, {state_, outbox_, sender_, receiver_, handler}},
      long_ingress_{memory, state_},
      fragment_ingress_{memory, {state_, outbox_, refusals_, long_ingress_}},
      direct_messages_{memory, {state_, message_store_, outbox_, local_delivery_, receiver_}},
      liveness_{{state_, outbox_, sender_, refusals_, ingress_, fragment_ingress_}},
      call_completion_{memory,
                       {state_, message_store_, outbox_, refusals_, direct_messages_, local_delivery_}},
      long_calls_{{state_, long_outbox_, long_ingress_, direct_messages_, call_completion_}},
      publish_predictor_{memory, state_.bounds(), with_threads.shared.counts},
      audiences_{{state_, publish_predictor_}},
      advertisement_table_{memory, state_.bounds()},
      topic_places_{{state_, advertisement_table_, refusals_}},
      subscriptions_{memory,
                     {state_, subscription_queues_, refusals_, audiences_, topic_rates_, topic_places_}},
      advertisements_{{state_, advertisement_table_, refusals_, topic_places_, subscriptions_}},
      broker_{{state_, message_store_, outbox_, long_outbox_, subscription_queues_, refusals_,
               local_delivery_, long_deliveries_, command_gate_, advertisement_table_}},
      topic_handles_{{state_, message_store_, outbox_, publish_predictor_, audiences_, topic_rates_,
                      topic_places_, subscriptions_, advertisements_, command_gate_, broker_}},
      service_directory_{memory, state_.bounds()},
      service_providers_{memory, {state_, service_directory_, refusals_}},
      stop_service_{memory, {state_, sender_, access_control_, call_completion_, command_gate_, stop_rules_}},
      statistics_report_{{state_, stop_rules_, outbox_, topic_rates_}},
      metrics_report_{{state_, stop_rules_, statistics_report_}},
      topic_pages_{memory, {state_, audiences_, topic_rates_, stop_rules_}},
      own_pages_{memory, {state_, access_control_, metrics_report_, statistics_report_, topic_pages_}},
      statistics_feed_{{state_, topic_rates_, broker_, statistics_report_}},
      parameters_feed_{{state_, broker_, parameters_, parameter_requests_}},
      clock_feed_{{state_, outbox_}},
      control_feed_{{state_, broker_, command_gate_, control_service_}},
      connection_graph_{memory,
                        {state_, outbox_, refusals_, advertisement_table_, service_directory_, stop_rules_,
                         statistics_report_.name()}},
      parameter_services_{{state_, access_control_, outbox_, call_completion_, parameters_}},
      graph_services_{{state_, advertisement_table_, service_directory_, stop_rules_, statistics_report_}},
      type_services_{{state_, stop_rules_, outbox_, call_completion_, parameters_}},
      endpoint_services_{{state_, outbox_, call_completion_, statistics_report_, graph_services_,
                          parameter_services_, type_services_, control_service_, rights_service_}},
      call_requests_{{state_, message_store_, outbox_, local_delivery_, receiver_, direct_messages_,
                      call_completion_, long_calls_, stop_service_}},
      call_router_{{state_, service_directory_, refusals_, receiver_, local_delivery_, call_completion_,
                    long_calls_, call_requests_, endpoint_services_, stop_service_}},
      listings_{memory,
                {state_, service_directory_, stop_rules_, advertisement_table_, outbox_,
                 statistics_report_.name()}},
      registrations_{
          {parameter_requests_, subscriptions_, advertisements_, service_providers_, connection_graph_}},
      revocation_{{state_, listings_, stop_service_}},
      stop_state_feed_{memory, {state_, sender_, broker_, stop_rules_, stop_topic_}},
      value_publisher_{{state_, broker_, publish_predictor_}},
      long_publications_{{state_, long_outbox_, sender_, broker_, value_publisher_, topic_handles_}},
      handle_submissions_{{state_, sender_, local_delivery_, receiver_, direct_messages_, value_publisher_,
                           topic_handles_, call_completion_, call_router_, publish_predictor_,
                           long_publications_}},
      thread_submissions_{memory, {state_, receiver_, direct_messages_, call_completion_, call_router_}},
      handle_registry_{{state_, service_directory_, outbox_, receiver_, publish_predictor_, call_completion_,
                        call_requests_, service_providers_, stop_service_, topic_handles_,
                        handle_submissions_}},
      request_router_{{state_, refusals_, access_control_, receiver_, ingress_, fragment_ingress_,
                       direct_messages_, broker_, listings_, registrations_, call_router_, stop_service_}},
      dispatcher_{memory, {state_, ingress_, long_ingress_, fragment_ingress_, request_router_}} {
  state_.calls.begin(seams.random.number());
  state_.epoch = seams.random.number();
  if (statistics_topic_) state_.topics.at(statistics_topic_).keep = keep::newest;
}

topic_id core_parts::own_topic(std::string_view name) noexcept {
  const topic_id topic = state_.topics.find_or_add(name);
  describe_own(state_.topics, topic);
  state_.topics.hold_as_own(topic);
  return topic;
}

} // namespace rowe::service
