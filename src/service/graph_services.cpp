// SPDX-License-Identifier: Apache-2.0
#include "service/graph_services.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include <rowe/detail/queue_pair.hpp>

#include "service/listed_topics.hpp"
#include "service/names.hpp"
#include "service/topic_holders.hpp"
#include "wire/own_names.hpp"
#include "json/reader.hpp"

namespace rowe::service {
namespace {

constexpr std::array names{wire::nodes_name,
                           wire::node_details_name,
                           wire::topics_for_type_name,
                           wire::services_for_type_name,
                           wire::publishers_name,
                           wire::subscribers_name,
                           wire::service_providers_name,
                           wire::service_node_name,
                           wire::action_servers_name,
                           wire::topics_and_raw_types_name,
                           wire::get_time_name};

std::int64_t floor_of(std::int64_t ns) noexcept {
  return ns / 1'000'000'000 - (ns % 1'000'000'000 < 0 ? 1 : 0);
}

} // namespace

std::string_view graph_services::find(std::string_view asked) noexcept {
  const auto* const found = std::find_if(names.begin(), names.end(), [asked](std::string_view own) {
    return asked == own || asked == own.substr(1);
  });
  return found == names.end() ? std::string_view{} : *found;
}

// ---- who sees what

bool graph_services::sees(const connection* c, topic_id topic) const noexcept {
  return topic && (c == nullptr || state_.rights.sees(*c, state_.topics.name(topic)));
}

bool graph_services::calls(const connection* c, service_index service) const noexcept {
  return service && (c == nullptr || state_.rights.calls(*c, service_directory_.name(service)));
}

bool graph_services::sees_node(const connection* c, const connection& peer) const noexcept {
  return peer.open() && (c == nullptr || c == &peer || state_.rights.sees_everything(c->who));
}

graph_services::node graph_services::find_node(const connection* c, std::string_view name) const noexcept {
  if (without_slash(name) == statistics_report_.name()) return {.known = true};
  for (const connection& peer : state_.peers) {
    if (sees_node(c, peer) && without_slash(name) == peer.peer()) return {&peer, true};
  }
  return {};
}

// ---- who does what

bool graph_services::is_published(const node& by, topic_id topic) const noexcept {
  if (by.peer == nullptr) return topic_holders{state_, stop_rules_}.published_here(topic);
  return advertisement_table_.find({by.peer->id.index}, topic) != nullptr;
}

bool graph_services::is_subscribed(const node& by, topic_id topic) const noexcept {
  if (by.peer == nullptr) return topic_holders{state_, stop_rules_}.subscribed_here(topic);
  return static_cast<bool>(state_.subscriptions.find(topic, {by.peer->id.index}));
}

bool graph_services::is_provided(const node& by, service_index service) const noexcept {
  const service_entry& one = service_directory_.at(service);
  return by.peer == nullptr ? static_cast<bool>(one.pair) : !one.pair && one.peer == by.peer->id;
}

// The name of the node; empty: nobody, or the peer may not call the service.
std::string_view graph_services::provider_of(const connection* c, std::string_view service) const noexcept {
  const service_index found = service_directory_.find(service);
  if (!found) return is_own_name(service) ? statistics_report_.name() : std::string_view{};
  if (!calls(c, found)) return {};
  const service_entry& one = service_directory_.at(found);
  if (one.pair) return statistics_report_.name();
  const connection* const peer = state_.peers.find(one.peer);
  return peer != nullptr ? peer->peer() : std::string_view{};
}

// ---- writing

template <class Shown>
void graph_services::write_topics(json::writer& into, std::string_view key, const connection* c,
                                  const Shown& shown) const noexcept {
  const listed_topics held{state_.topics, stop_rules_};
  into.key(key);
  into.begin_array();
  for (const topic_id i : state_.topics.topic_ids()) {
    if (held(i) && shown(i) && sees(c, i)) into.string(state_.topics.name(i));
  }
  into.end_array();
}

template <class Shown>
void graph_services::write_services(json::writer& into, std::string_view key, const connection* c,
                                    const Shown& shown) const noexcept {
  into.key(key);
  into.begin_array();
  for (const service_index i : service_directory_.ids()) {
    if (service_directory_.is_service(i) && shown(i) && calls(c, i)) into.string(service_directory_.name(i));
  }
  into.end_array();
}

template <class Shown>
void graph_services::write_nodes(json::writer& into, std::string_view key,
                                 const Shown& shown) const noexcept {
  into.key(key);
  into.begin_array();
  if (shown(node{.known = true})) into.string(statistics_report_.name());
  for (const connection& peer : state_.peers) {
    if (peer.open() && shown(node{&peer, true})) into.string(peer.peer());
  }
  into.end_array();
}

void graph_services::write_details(json::writer& into, const connection* c,
                                   std::string_view name) const noexcept {
  const node of = find_node(c, name);
  write_topics(into, "subscribing", c, [&](topic_id i) { return of.known && is_subscribed(of, i); });
  write_topics(into, "publishing", c, [&](topic_id i) { return of.known && is_published(of, i); });
  write_services(into, "services", c, [&](service_index i) { return of.known && is_provided(of, i); });
}

// What the types are made of nobody has told us.
void graph_services::write_raw_types(json::writer& into, const connection* c) const noexcept {
  const listed_topics held{state_.topics, stop_rules_};
  const auto list = [&](std::string_view key, const auto& text_of) {
    into.key(key);
    into.begin_array();
    for (const topic_id i : state_.topics.topic_ids()) {
      if (held(i) && sees(c, i)) into.string(text_of(i));
    }
    into.end_array();
  };
  list("topics", [&](topic_id i) { return state_.topics.name(i); });
  list("types", [&](topic_id i) { return state_.topics.type(i); });
  list("typedefs_full_text", [](topic_id) { return std::string_view{}; });
}

// As both ROS 1 and ROS 2 call the members.
void graph_services::write_time(json::writer& into) const noexcept {
  const std::int64_t ns = rt::nanoseconds_of(state_.cycle.now) + state_.options.wall_offset_ns;
  const std::int64_t seconds = floor_of(ns);
  const std::int64_t rest = ns - seconds * 1'000'000'000;
  into.key("time");
  into.begin_object();
  for (const auto& [key, number] :
       {std::pair{"secs", seconds}, {"nsecs", rest}, {"sec", seconds}, {"nanosec", rest}}) {
    into.key(key);
    into.number(number);
  }
  into.end_object();
}

void graph_services::write(json::writer& into, std::string_view service, const wire::call_args& what,
                           const connection* c) const noexcept {
  std::array<char, 2 * detail::queue_pair::name_bytes_max> buffer;
  const auto named = [&](std::string_view member) -> std::string_view {
    const auto found = what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, member);
    const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  if (service == wire::nodes_name)
    return write_nodes(into, "nodes",
                       [&](const node& one) { return one.peer == nullptr || sees_node(c, *one.peer); });
  if (service == wire::node_details_name) return write_details(into, c, named("node"));
  if (service == wire::get_time_name) return write_time(into);
  if (service == wire::topics_and_raw_types_name) return write_raw_types(into, c);
  if (service == wire::topics_for_type_name) {
    const std::string_view type = named("type");
    return write_topics(into, "topics", c,
                        [&](topic_id i) { return same_type(state_.topics.type(i), type); });
  }
  if (service == wire::services_for_type_name) {
    const std::string_view type = named("type");
    return write_services(into, "services", c,
                          [&](service_index i) { return same_type(service_directory_.type(i), type); });
  }
  if (service == wire::publishers_name || service == wire::subscribers_name) {
    const bool publishers = service == wire::publishers_name;
    const topic_id topic = state_.topics.find(named("topic"));
    return write_nodes(into, publishers ? "publishers" : "subscribers", [&](const node& one) {
      return sees(c, topic) && (publishers ? is_published(one, topic) : is_subscribed(one, topic));
    });
  }
  if (service == wire::action_servers_name) {
    into.key("action_servers"); // those of ROS 1 are topics, and look like any other
    into.begin_array();
    for (const service_index i : service_directory_.ids()) {
      const bool action = service_directory_.in_use(i) && !service_directory_.is_service(i);
      if (action && calls(c, i)) into.string(service_directory_.name(i));
    }
    return into.end_array();
  }
  const std::string_view provider = provider_of(c, named("service"));
  if (service == wire::service_node_name) {
    into.key("node");
    return into.string(provider);
  }
  into.key("providers");
  into.begin_array();
  if (!provider.empty()) into.string(provider);
  into.end_array();
}

} // namespace rowe::service
