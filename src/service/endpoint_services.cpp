// SPDX-License-Identifier: Apache-2.0
#include "service/endpoint_services.hpp"

#include <array>
#include <optional>

#include "service/listed_topics.hpp"
#include "wire/own_names.hpp"

#include "service/service_limits.hpp"

namespace rowe::service {
namespace {

constexpr std::array names{wire::stats_name,      wire::list_topics_name, wire::list_services_name,
                           wire::topic_type_name, wire::publishers_name,  wire::service_type_name};

} // namespace

endpoint_services::endpoint_services(const needs& parts) noexcept
    : state_{parts.state},
      service_directory_{parts.service_directory},
      stop_rules_{parts.stop_rules},
      message_store_{parts.message_store},
      outbox_{parts.outbox},
      call_completion_{parts.call_completion},
      statistics_report_{parts.statistics_report},
      advertisement_table_{parts.advertisement_table} {}

std::string_view endpoint_services::find(std::string_view asked) noexcept {
  for (const std::string_view own : names) {
    if (asked == own || asked == own.substr(1)) return own;
  }
  return {};
}

void endpoint_services::answer(call_index index, std::string_view service,
                               const wire::call_args& what) noexcept {
  state_.calls.at(index).callee = {.who = call_endpoint::kind::core};
  if (const call& one = state_.calls.at(index); one.caller.who == call_endpoint::kind::peer) {
    connection* const c = state_.peers.find(one.caller.connection());
    if (c != nullptr && !outbox_.has_place_for_reply({c->id.index}))
      return call_completion_.fail_for_room(index);
  }
  state_.cycle.work_bytes += answer_work;
  std::array<char, 2 * detail::queue_pair::name_bytes_max> buffer; // the call's own names are elsewhere
  const auto named = [&](std::string_view member) -> std::string_view {
    const auto found = what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, member);
    const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  const auto list = [](json::writer& into, std::string_view key, const auto ids, const auto& shown,
                       const auto& text_of) {
    into.key(key);
    into.begin_array();
    for (const auto i : ids) {
      if (shown(i)) into.string(text_of(i));
    }
    into.end_array();
  };
  const slot_id slot = outbox_.compose(rt::never, [&](json::writer& into) {
    if (service == wire::stats_name) return statistics_report_.write_for_service(into);
    into.begin_object();
    if (service == wire::list_topics_name) {
      const listed_topics shown{state_.topics, stop_rules_};
      list(into, "topics", state_.topics.topic_ids(), shown,
           [&](topic_id i) { return state_.topics.name(i); });
      list(into, "types", state_.topics.topic_ids(), shown,
           [&](topic_id i) { return state_.topics.type(i); });
    } else if (service == wire::list_services_name) {
      const auto shown = [&](service_index i) { return service_directory_.in_use(i); };
      list(into, "services", service_directory_.ids(), shown,
           [&](service_index i) { return service_directory_.name(i); });
    } else if (service == wire::topic_type_name) {
      const topic_id topic = state_.topics.find(named("topic"));
      into.key("type");
      into.string(!topic ? std::string_view{} : state_.topics.type(topic));
    } else if (service == wire::publishers_name) {
      into.key("publishers");
      into.begin_array();
      write_publishers(into, state_.topics.find(named("topic")));
      into.end_array();
    } else {
      const service_index found = service_directory_.find(named("service"));
      into.key("type");
      into.string(!found ? std::string_view{} : service_directory_.type(found));
    }
    into.end_object();
  });
  if (!slot) return call_completion_.fail_for_room(index);
  call_completion_.complete(
      index, {message_store_.slots().text(slot).data(), message_store_.slots().text(slot).size()});
  message_store_.release(slot);
}

void endpoint_services::write_publishers(json::writer& into, topic_id topic) noexcept {
  if (!topic) return;
  bool here = (state_.options.ours == side::server && topic == state_.topics.find(wire::stats_name)) ||
              (stop_rules_.in_use() && topic == state_.topics.find(wire::stop_state_name));
  for (const pair_index i : state_.pairs.ids())
    here = here || (state_.pair_rows[i].attached && state_.pair_rows[i].topic == topic &&
                    detail::publishes(state_.pairs[i].kind));
  if (here) into.string(statistics_report_.name());
  for (const connection& c : state_.peers) {
    if (c.open() && advertisement_table_.find({c.id.index}, topic) != nullptr) into.string(c.peer());
  }
}

} // namespace rowe::service
