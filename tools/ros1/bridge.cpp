// SPDX-License-Identifier: Apache-2.0
#include "bridge.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "../rowe/text/json_values.hpp"

namespace rowe::ros1 {
namespace {

using namespace std::chrono_literals;
using tools::joined;
using tools::printable;

constexpr rt::duration list_timeout = 1s;
constexpr rt::duration pump_period = 1ms;   // nothing tells of several subscribers
constexpr rt::duration report_period = 10s; // of what goes on being dropped
constexpr std::size_t failures_max = 1024;

bool is_own(std::string_view name) {
  return name.starts_with("/rowe/") || name.starts_with("/rosapi/") ||
         name.starts_with(ros::this_node::getName() + "/");
}
// What every node of ROS has for its own sake: bridged when named, not by a pattern.
bool is_machinery(std::string_view name) {
  return name.starts_with("/rosout") || name.ends_with("/get_loggers") || name.ends_with("/set_logger_level");
}

std::string with_slash(const std::string& name) { return name.starts_with('/') ? name : "/" + name; }

} // namespace

bridge::bridge(endpoint& hub, const bridge_options& how, const installed_definitions& installed,
               const tools::console& to)
    : hub_{hub}, how_{how}, installed_{installed}, to_{to} {
  const auto client = [&](const char* name) {
    auto opened = hub_.client<json_text, json_text>(
        name, {.depth = 1, .text_bytes_max = static_cast<std::uint32_t>(how_.bytes_max)});
    if (!opened) to_.error("cannot ask ", name, ": ", opened.error().message());
    return opened ? std::move(*opened) : caller<json_text, json_text>{};
  };
  ask_topics_ = client("/rosapi/topics");
  ask_services_ = client("/rosapi/services");
  ask_type_ = client("/rosapi/service_type");
  spinner_.start();
  pump_thread_ = std::thread{[this] { pump(); }};
}

bridge::~bridge() {
  over_ = true;
  pump_thread_.join();
  forget();
}

void bridge::follow(const ros_graph& graph) {
  if (how_.stop && !stop_) {
    auto stop = hub_.client<json_text, json_text>("/rowe/stop", {.depth = 1});
    if (stop) stop_ = std::make_unique<stop_from_ros>(node_, std::move(*stop));
    if (stop_ && stop_->is_open()) to_.note("/rowe/stop (std_srvs/Trigger): a service in ROS");
    if (!stop_ || !stop_->is_open()) cannot("/rowe/stop", stop ? "ROS refuses it" : stop.error().message());
  }
  if (!how_.topics_from_ros.empty()) follow_topics_from_ros(graph);
  if (!how_.services_from_ros.empty()) follow_services_from_ros(graph);
  if (!how_.topics_to_ros.empty()) follow_topics_to_ros(graph);
  if (!how_.services_to_ros.empty()) follow_services_to_ros(graph);
}

void bridge::forget() {
  stop_.reset();
  services_to_ros_.clear();
  for (auto& [name, row] : services_from_ros_) retire(std::move(row));
  services_from_ros_.clear();
  from_ros_.clear();
  const std::lock_guard guard{pumping_};
  to_ros_.clear();
  failures_.clear();
}

bool bridge::is_wanted(const wanted_names& names, const std::string& name) const {
  if (!names.match(name) || is_own(name)) return false;
  return names.names(name) || (!is_machinery(name) && !how_.except.match(name));
}

bool bridge::has_room(std::size_t used, std::size_t most, const std::string& name) {
  if (used < most) return true;
  cannot(name, joined("there are ", most, " already; name fewer, or run another bridge"));
  return false;
}

// Said once.
void bridge::cannot(const std::string& name, const std::string& why) {
  if (failures_.size() >= failures_max) failures_.clear();
  std::string& said = failures_[name];
  if (said != why) to_.error(printable(name), " is not bridged: ", printable(why));
  said = why;
}

// ---- topics ----

void bridge::follow_topics_from_ros(const ros_graph& graph) {
  std::erase_if(from_ros_, [&](auto& row) {
    const auto there = graph.topics.find(row.first);
    const bool same = there != graph.topics.end() && there->second == row.second->what().type;
    if (!same) to_.note(printable(row.first), ": gone from ROS");
    return !same;
  });
  for (const auto& [name, type] : graph.topics) {
    if (!is_wanted(how_.topics_from_ros, name) || to_ros_.contains(name)) continue;
    const auto there = from_ros_.find(name);
    if (there == from_ros_.end()) {
      if (has_room(from_ros_.size() + to_ros_.size(), topics_max, name)) add_from_ros({name, type, false});
    } else if (there->second->turned_out_latched()) {
      from_ros_.erase(there);
      add_from_ros({name, type, true});
    }
  }
}

void bridge::add_from_ros(const topic_from_ros::description& what) {
  const std::string type = plain_type_name(what.type);
  auto opened =
      hub_.advertise<json_text>(what.name, {.depth = topic_depth,
                                            .latched = what.latched,
                                            .type = type,
                                            .text_bytes_max = static_cast<std::uint32_t>(how_.bytes_max)});
  if (!opened) return cannot(what.name, opened.error().message());
  auto row = std::make_unique<topic_from_ros>(what, std::move(*opened), how_.bytes_max, installed_);
  if (!row->subscribe(node_, queue_)) return cannot(what.name, "ROS refuses the subscription");
  from_ros_[what.name] = std::move(row);
  failures_.erase(what.name);
  to_.note(printable(what.name), " (", printable(what.type), what.latched ? ", latched" : "", "): from ROS");
}

void bridge::follow_topics_to_ros(const ros_graph& graph) {
  std::map<std::string, std::string> wanted;
  for (const auto& one : how_.topics_to_ros.all()) {
    const auto in_ros = graph.types.find(one.pattern);
    if (one.is_name && !one.type.empty()) {
      wanted[one.pattern] = one.type;
    } else if (one.is_name && in_ros != graph.types.end()) {
      wanted[one.pattern] = plain_type_name(in_ros->second); // a node of ROS waits for it; empty for `*`
    }
  }
  const std::string text = ask(ask_topics_, "{}");
  const json_value answer = tools::read_json(text);
  const auto names = answer.find("topics");
  const auto types = answer.find("types");
  if (names && types) {
    auto type = types->elements().begin();
    for (const json_value name : names->elements()) {
      if (type == std::default_sentinel) break;
      const auto spelt = name.get<std::string>();
      const auto its_type = (*type).get<std::string>();
      ++type;
      if (!spelt || !its_type || !is_wanted(how_.topics_to_ros, with_slash(*spelt))) continue;
      std::string& known = wanted[with_slash(*spelt)];
      if (known.empty()) known = how_.topics_to_ros.type_of(with_slash(*spelt));
      if (known.empty()) known = plain_type_name(*its_type);
    }
  }
  for (const auto& [name, type] : wanted) {
    if (from_ros_.contains(name) || to_ros_.contains(name)) continue;
    if (how_.topics_from_ros.match(name) && graph.topics.contains(name)) continue; // it goes the other way
    if (type.empty()) {
      cannot(name, "no side states its type; give it with --to-ros NAME=package/Type");
    } else if (has_room(from_ros_.size() + to_ros_.size(), topics_max, name)) {
      add_to_ros(name, type);
    }
  }
}

void bridge::add_to_ros(const std::string& name, const std::string& type) {
  std::string why;
  const message_type_ptr definition = installed_.message(type, why);
  if (!definition) return cannot(name, why);
  auto opened = hub_.subscribe<json_text>(
      name,
      {.depth = topic_depth, .type = type, .text_bytes_max = static_cast<std::uint32_t>(how_.bytes_max)});
  if (!opened) return cannot(name, opened.error().message());
  auto row = std::make_unique<topic_to_ros>(name, definition, std::move(*opened), how_.bytes_max);
  if (!row->advertise(node_)) return cannot(name, "ROS refuses the publisher");
  const std::lock_guard guard{pumping_};
  to_ros_[name] = std::move(row);
  failures_.erase(name);
  to_.note(printable(name), " (", printable(type), "): to ROS");
}

void bridge::pump() {
  while (!over_) {
    bool any = false;
    {
      const std::lock_guard guard{pumping_};
      for (auto& [name, row] : to_ros_) any = row->pump() || any;
    }
    if (!any) std::this_thread::sleep_for(pump_period);
  }
}

// ---- services ----

void bridge::follow_services_from_ros(const ros_graph& graph) {
  for (auto row = services_from_ros_.begin(); row != services_from_ros_.end();) {
    if (graph.services.contains(row->first)) {
      ++row;
      continue;
    }
    to_.note("the service ", printable(row->first), ": gone from ROS");
    retire(std::move(row->second));
    row = services_from_ros_.erase(row);
  }
  std::erase_if(retired_, [](const auto& one) { return one->has_ended(); });
  for (const auto& [name, uri] : graph.services) {
    if (!is_wanted(how_.services_from_ros, name) || services_from_ros_.contains(name) ||
        services_to_ros_.contains(name))
      continue;
    if (has_room(services_from_ros_.size() + services_to_ros_.size() + retired_.size(), services_max, name))
      add_service_from_ros(name, uri);
  }
}

// Its provider may never return; this thread goes on.
void bridge::retire(std::unique_ptr<service_from_ros> row) {
  row->end();
  retired_.push_back(std::move(row));
}

void bridge::add_service_from_ros(const std::string& name, const std::string& uri) {
  const auto said = type_of_service(name, uri);
  if (!said) return cannot(name, joined("its provider at ", uri, " does not say its type"));
  std::string why;
  auto type = installed_.service(*said, why);
  if (!type) return cannot(name, why);
  auto opened = hub_.serve<json_text, json_text>(
      name,
      {.depth = service_depth, .type = *said, .text_bytes_max = static_cast<std::uint32_t>(how_.bytes_max)});
  if (!opened) return cannot(name, opened.error().message());
  services_from_ros_[name] =
      std::make_unique<service_from_ros>(name, std::move(*type), std::move(*opened), how_.bytes_max);
  failures_.erase(name);
  to_.note("the service ", printable(name), " (", printable(*said), "): from ROS");
}

void bridge::follow_services_to_ros(const ros_graph& graph) {
  std::map<std::string, std::string> wanted;
  for (const auto& one : how_.services_to_ros.all()) {
    if (one.is_name) wanted[one.pattern] = one.type;
  }
  const std::string text = ask(ask_services_, "{}");
  const json_value answer = tools::read_json(text);
  if (const auto names = answer.find("services")) {
    for (const json_value name : names->elements()) {
      const auto spelt = name.get<std::string>();
      if (!spelt || !is_wanted(how_.services_to_ros, with_slash(*spelt))) continue;
      wanted.try_emplace(with_slash(*spelt), how_.services_to_ros.type_of(with_slash(*spelt)));
    }
  }
  for (auto& [name, type] : wanted) {
    if (services_from_ros_.contains(name) || services_to_ros_.contains(name)) continue;
    if (graph.services.contains(name)) continue; // another node of ROS provides it
    if (type.empty()) {
      const std::string said = ask(ask_type_, joined("{\"service\":", tools::json_string_of(name), "}"));
      if (const auto its_type = tools::read_json(said).get<std::string>("type"))
        type = plain_type_name(*its_type);
    }
    if (type.empty()) {
      cannot(name, "no side states its type; give it with --service-to-ros NAME=package/Type");
    } else if (has_room(services_from_ros_.size() + services_to_ros_.size(), services_max, name)) {
      add_service_to_ros(name, type);
    }
  }
}

void bridge::add_service_to_ros(const std::string& name, const std::string& type) {
  std::string why;
  auto definition = installed_.service(type, why);
  if (!definition) return cannot(name, why);
  auto opened = hub_.client<json_text, json_text>(
      name, {.depth = service_depth, .text_bytes_max = static_cast<std::uint32_t>(how_.bytes_max)});
  if (!opened) return cannot(name, opened.error().message());
  auto row = std::make_unique<service_to_ros>(node_, name, std::move(*definition), std::move(*opened),
                                              how_.bytes_max, how_.timeout);
  if (!row->is_open()) return cannot(name, "ROS refuses the service");
  services_to_ros_[name] = std::move(row);
  failures_.erase(name);
  to_.note("the service ", printable(name), " (", printable(type), "): to ROS");
}

std::string bridge::ask(caller<json_text, json_text>& of, std::string_view request) {
  const auto reply = of.call(request, list_timeout);
  return reply ? std::string{reply->value()} : std::string{};
}

// ---- what was lost ----

template <class Each>
void bridge::for_each_tally(const Each& each) {
  for (auto& [name, row] : from_ros_) each(name, name + ", from ROS", row->counted());
  for (auto& [name, row] : to_ros_) each(name, name + ", to ROS", row->counted());
  for (auto& [name, row] : services_from_ros_)
    each("service " + name, "the service " + name + ", from ROS", row->counted());
  for (auto& [name, row] : services_to_ros_)
    each("service " + name, "the service " + name + ", to ROS", row->counted());
  if (stop_) each("service /rowe/stop", "the service /rowe/stop, from ROS", stop_->counted());
}

void bridge::report_losses() {
  for_each_tally([this](const std::string& key, const std::string& what, tally& counted) {
    const std::uint64_t now = counted.dropped();
    reported& before = reported_[key];
    const auto time = rt::monotonic_clock::now();
    if (now <= before.dropped || time < before.again) return;
    const std::string why = counted.take_reason();
    to_.error(printable(what), ": ", now - before.dropped, " dropped", why.empty() ? "" : ": ", why);
    before = {now, time + report_period};
  });
}

void bridge::summarise() {
  for_each_tally([this](const std::string&, const std::string& what, tally& counted) {
    std::string losses;
    const auto add = [&](std::uint64_t count, std::string_view name) {
      if (count != 0) losses += joined(", ", name, " ", count);
    };
    add(counted.no_peer, "no_peer");
    add(counted.full, "full");
    add(counted.too_big, "too_big");
    add(counted.wrong, "wrong");
    add(counted.failed, "failed");
    to_.note(printable(what), ": passed ", counted.passed.load(), losses);
  });
}

} // namespace rowe::ros1
