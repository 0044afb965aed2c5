// SPDX-License-Identifier: Apache-2.0
#include "service/graph/graph_services.hpp"

#include <array>
#include <optional>

#include <rowe/detail/queue_pair.hpp>

#include "service/base/names.hpp"
#include "service/graph/topic_holders.hpp"
#include "service/topics/listed_topics.hpp"
#include "wire/codec/own_names.hpp"
#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

std::int64_t floor_of(std::int64_t ns) noexcept {
  return ns / 1'000'000'000 - (ns % 1'000'000'000 < 0 ? 1 : 0);
}

} // namespace

// ---- who sees what

bool graph_services::sees(const connection* c, topic_id topic) const noexcept {
  return topic && (c == nullptr || state_.rights.sees(*c, state_.topics.name(topic)));
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

// ---- services

std::uint32_t graph_services::services_max() const noexcept {
  return state_.bounds().services_max + static_cast<std::uint32_t>(own_service_types().size());
}

graph_services::listed_service graph_services::service(const connection* c,
                                                       std::uint32_t number) const noexcept {
  const std::uint32_t given_max = state_.bounds().services_max;
  if (number >= given_max) return own(c, own_service_types()[number - given_max]);
  return service_directory_.is_service({number}) ? given(c, {number}) : listed_service{};
}

graph_services::listed_service graph_services::find(const connection* c,
                                                    std::string_view service) const noexcept {
  if (const service_index found = service_directory_.find(service)) return given(c, found);
  const own_service_type* const its = own_type_of_service(service);
  return its != nullptr ? own(c, *its) : listed_service{};
}

graph_services::listed_service graph_services::given(const connection* c,
                                                     service_index service) const noexcept {
  const std::string_view name = service_directory_.name(service);
  if (c != nullptr && !state_.rights.calls(*c, name)) return {};
  const service_entry& one = service_directory_.at(service);
  return {.name = name,
          .type = service_directory_.type(service),
          .own = static_cast<bool>(one.pair),
          .provider = one.pair ? nullptr : state_.peers.find(one.peer)};
}

// One that a handle provides instead is listed as that one's.
graph_services::listed_service graph_services::own(const connection* c,
                                                   const own_service_type& service) const noexcept {
  const bool may = c == nullptr || state_.rights.calls(*c, service.name);
  if (!may || (service.of_stop && !stop_rules_.in_use()) || service_directory_.find(service.name)) return {};
  return {.name = service.name, .type = service.type, .own = true};
}

// ---- writing

template <class Shown>
void graph_services::write_topics(json::writer& into, std::string_view key, const connection* c,
                                  const Shown& shown) const noexcept {
  const listed_topics held = listed();
  into.begin_array(key);
  for (const topic_id i : state_.topics.topic_ids()) {
    if (held(i) && shown(i) && sees(c, i)) into.string(state_.topics.name(i));
  }
  into.end_array();
}

template <class Shown>
void graph_services::write_services(json::writer& into, std::string_view key, const connection* c,
                                    const Shown& shown) const noexcept {
  into.begin_array(key);
  for (std::uint32_t i = 0; i != services_max(); ++i) {
    if (const listed_service one = service(c, i); !one.name.empty() && shown(one)) into.string(one.name);
  }
  into.end_array();
}

template <class Shown>
void graph_services::write_nodes(json::writer& into, std::string_view key,
                                 const Shown& shown) const noexcept {
  into.begin_array(key);
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
  write_services(into, "services", c, [&](const listed_service& one) {
    return of.known && (of.peer == nullptr ? one.own : one.provider == of.peer);
  });
}

// Nobody has announced what the types are made of.
void graph_services::write_raw_types(json::writer& into, const connection* c) const noexcept {
  const listed_topics held = listed();
  const auto list = [&](std::string_view key, const auto& text_of) {
    into.begin_array(key);
    for (const topic_id i : state_.topics.topic_ids()) {
      if (held(i) && sees(c, i)) into.string(text_of(i));
    }
    into.end_array();
  };
  list("topics", [&](topic_id i) { return state_.topics.name(i); });
  list("types", [&](topic_id i) { return state_.topics.type(i); });
  list("typedefs_full_text", [](topic_id) { return std::string_view{}; });
}

// The types of topics and services. Each is written once, unless there are very many of them.
void graph_services::write_interfaces(json::writer& into, const connection* c) const noexcept {
  std::array<std::uint32_t, 1024> written{}; // hashes; 0: free
  const auto write = [&](std::string_view type) {
    const std::uint32_t hash = hash_of_type(type);
    for (std::size_t i = 0; hash != 0 && i != 8; ++i) {
      std::uint32_t& place = written[(hash + i) % written.size()];
      if (place == hash) return;
      if (place != 0) continue;
      place = hash;
      break;
    }
    if (hash != 0) into.string(type);
  };
  const listed_topics held = listed();
  into.begin_array("interfaces");
  for (const topic_id i : state_.topics.topic_ids())
    if (held(i) && sees(c, i)) write(state_.topics.type(i));
  for (std::uint32_t i = 0; i != services_max(); ++i) write(service(c, i).type);
  into.end_array();
}

// Neither it is, but its clients ask how types are spelled here and what a time has as its members.
void graph_services::write_version(json::writer& into) const noexcept {
  bool as_ros2 = false;
  for (const topic_id i : state_.topics.topic_ids())
    as_ros2 |= state_.topics.at(i).holders != 0 && parts_of_type(state_.topics.type(i)).kind == "msg";
  into.member("version", as_ros2 ? 2 : 1);
  into.member("distro", "rowe");
}

// As both ROS 1 and ROS 2 call the members.
void graph_services::write_time(json::writer& into) const noexcept {
  const std::int64_t ns = rt::nanoseconds_of(state_.cycle.now) + state_.options.wall_offset_ns;
  const std::int64_t seconds = floor_of(ns);
  const std::int64_t rest = ns - seconds * 1'000'000'000;
  into.begin_object("time");
  for (const auto& [key, number] :
       {std::pair{"secs", seconds}, {"nsecs", rest}, {"sec", seconds}, {"nanosec", rest}}) {
    into.member(key, number);
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
  if (service == wire::interfaces_name) return write_interfaces(into, c);
  if (service == wire::ros_version_name) return write_version(into);
  if (service == wire::topics_for_type_name) {
    const std::string_view type = named("type");
    return write_topics(into, "topics", c,
                        [&](topic_id i) { return same_type(state_.topics.type(i), type); });
  }
  if (service == wire::services_for_type_name) {
    const std::string_view type = named("type");
    return write_services(into, "services", c,
                          [&](const listed_service& one) { return same_type(one.type, type); });
  }
  if (service == wire::publishers_name || service == wire::subscribers_name) {
    const bool publishers = service == wire::publishers_name;
    const topic_id topic = state_.topics.find(named("topic"));
    return write_nodes(into, publishers ? "publishers" : "subscribers", [&](const node& one) {
      return sees(c, topic) && (publishers ? is_published(one, topic) : is_subscribed(one, topic));
    });
  }
  if (service == wire::action_servers_name) {
    into.begin_array("action_servers"); // those of ROS 1 are topics, and look like any other
    for (const service_index i : service_directory_.ids()) {
      const bool action = service_directory_.in_use(i) && !service_directory_.is_service(i);
      if (action && !given(c, i).name.empty()) into.string(service_directory_.name(i));
    }
    return into.end_array();
  }
  if (service == wire::action_type_name) {
    const service_index action = service_directory_.find(named("action"), offer::action);
    into.key("type");
    return into.string(action ? given(c, action).type : std::string_view{});
  }
  const listed_service its = find(c, named("service"));
  const std::string_view provider = its.own                   ? statistics_report_.name()
                                    : its.provider != nullptr ? its.provider->peer()
                                                              : std::string_view{};
  if (service == wire::service_node_name) {
    into.key("node");
    return into.string(provider);
  }
  if (service == wire::service_host_name) {
    into.key("host");
    return into.string(its.own ? provider : provider.substr(0, provider.rfind(':')));
  }
  into.begin_array("providers");
  if (!provider.empty()) into.string(provider);
  into.end_array();
}

} // namespace rowe::service
