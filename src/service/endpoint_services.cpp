// SPDX-License-Identifier: Apache-2.0
#include "service/endpoint_services.hpp"

#include <array>
#include <optional>

#include "service/listed_topics.hpp"
#include "service/own_types.hpp"
#include "wire/own_names.hpp"

#include "service/service_limits.hpp"

namespace rowe::service {
namespace {

constexpr std::array names{wire::stats_name,           wire::list_topics_name,
                           wire::list_services_name,   wire::topic_type_name,
                           wire::service_type_name,    wire::get_param_names_name,
                           wire::get_param_name,       wire::set_param_name,
                           wire::has_param_name,       wire::delete_param_name,
                           wire::types_name,           wire::message_details_name,
                           wire::request_details_name, wire::response_details_name,
                           wire::search_param_name};

} // namespace

// Of a service of the endpoint itself; empty: it is none, or the peer may not call it.
std::string_view endpoint_services::own_type_for(const connection* c,
                                                 std::string_view service) const noexcept {
  const own_service_type* const own = own_type_of_service(service);
  if (own == nullptr) return {};
  const bool may = c == nullptr || state_.rights.calls(*c, own->name);
  return may && (!own->of_stop || stop_rules_.in_use()) ? own->type : std::string_view{};
}

endpoint_services::endpoint_services(const needs& parts) noexcept
    : state_{parts.state},
      service_directory_{parts.service_directory},
      stop_rules_{parts.stop_rules},
      outbox_{parts.outbox},
      call_completion_{parts.call_completion},
      statistics_report_{parts.statistics_report},
      graph_services_{parts.graph_services},
      parameter_services_{parts.parameter_services},
      type_services_{parts.type_services} {}

std::string_view endpoint_services::find(std::string_view asked) noexcept {
  for (const std::string_view own : names) {
    if (asked == own || asked == own.substr(1)) return own;
  }
  return graph_services::find(asked);
}

void endpoint_services::answer(call_index index, std::string_view service,
                               const wire::call_args& what) noexcept {
  state_.calls.at(index).callee = {.who = call_endpoint::kind::core};
  const connection* c = nullptr; // a peer with a role; null: whoever asks sees everything
  if (const call& one = state_.calls.at(index); one.caller.who == call_endpoint::kind::peer) {
    c = state_.peers.find(one.caller.connection());
    if (c != nullptr && !outbox_.has_place_for_reply({c->id.index}))
      return call_completion_.fail_for_room(index);
    if (c != nullptr && !state_.rights.apply_to(*c)) c = nullptr;
  }
  if (parameter_services::answers(service)) return parameter_services_.answer(index, service, what);
  if (type_services::answers(service)) return type_services_.answer(index, service, what, c);
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
  const auto sees = [&](topic_id i) {
    return i && (c == nullptr || state_.rights.sees(*c, state_.topics.name(i)));
  };
  const auto calls = [&](service_index i) {
    return i && (c == nullptr || state_.rights.calls(*c, service_directory_.name(i)));
  };
  const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) {
    if (service == wire::stats_name) {
      const statistics_report::reader by{.who = c != nullptr ? c->who : access::subject{}, .peer = c};
      return statistics_report_.write_for_service(into, c != nullptr ? &by : nullptr);
    }
    into.begin_object();
    if (service == wire::list_topics_name) {
      const listed_topics held{state_.topics, stop_rules_};
      const auto shown = [&](topic_id i) { return held(i) && sees(i); };
      list(into, "topics", state_.topics.topic_ids(), shown,
           [&](topic_id i) { return state_.topics.name(i); });
      list(into, "types", state_.topics.topic_ids(), shown,
           [&](topic_id i) { return state_.topics.type(i); });
    } else if (service == wire::list_services_name) {
      const auto shown = [&](service_index i) { return service_directory_.is_service(i) && calls(i); };
      list(into, "services", service_directory_.ids(), shown,
           [&](service_index i) { return service_directory_.name(i); });
    } else if (service == wire::topic_type_name) {
      const topic_id topic = state_.topics.find(named("topic"));
      into.key("type");
      into.string(!sees(topic) ? std::string_view{} : state_.topics.type(topic));
    } else if (service != wire::service_type_name) {
      graph_services_.write(into, service, what, c);
    } else {
      const service_index found = service_directory_.find(named("service"));
      into.key("type");
      into.string(found ? (calls(found) ? service_directory_.type(found) : std::string_view{})
                        : own_type_for(c, named("service")));
    }
    into.end_object();
  });
  if (!slot) return call_completion_.fail_for_room(index);
  call_completion_.complete(index, slot);
}

} // namespace rowe::service
