// SPDX-License-Identifier: Apache-2.0
// Who provides what: the services that peers advertise, those of this process's handles, and those that the
// endpoint answers itself.
#include <algorithm>
#include <array>
#include <cstdio>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "service/shares.hpp"
#include "wire/object_form.hpp"

namespace rowe::service {
namespace {

using detail::entry;

constexpr std::array own_services{wire::stats_name,      wire::list_topics_name, wire::list_services_name,
                                  wire::topic_type_name, wire::publishers_name,  wire::service_type_name};

// Counted as so many bytes: the endpoint's answers walk all topics, services or counters.
constexpr std::size_t own_answer_work = 10 * 1024;

} // namespace

// ---- the directory

void core::advertise_service(connection& c, const wire::request& asked) noexcept {
  if (is_own_name(asked.service))
    return refuse(c, asked.id_raw, "advertise_service: services below /rowe/ are the endpoint's own");
  if (const std::uint32_t found = services_.find(asked.service); found != no_index) {
    const service_entry& there = services_.at(found);
    // Clients that reconnect say it again.
    if (there.lane == no_index && there.peer == c.id) return;
    std::array<char, 192> text;
    const int bytes = std::snprintf(text.data(), text.size(), "advertise_service: %.*s is provided already",
                                    static_cast<int>(std::min<std::size_t>(asked.service.size(), 128)),
                                    asked.service.data());
    return refuse(c, asked.id_raw, {text.data(), static_cast<std::size_t>(bytes)});
  }
  const std::uint32_t share = services_of_peers(bounds_);
  const std::uint32_t left = left_of(share, services_.of_peers());
  const bool may = service_claims_.may_take(c.services, left) || ROWE_MUTANT(made_up_services);
  const std::uint32_t added = may ? services_.add(asked.service, asked.type, no_index, c.id).index : no_index;
  if (added == no_index) {
    return refuse_share(c, asked,
                        {.what = "services",
                         .held = c.services,
                         .left = left,
                         .for_peers = share,
                         .kept = service_claims_.kept(),
                         .option = "services_max"});
  }
  services_.at(added).speaks = asked.codec;
  service_claims_.take(c.services);
}

// A handle provides what a peer did until now: the peer is told. Calls that it was given go on.
void core::take_service_from_peer(std::uint32_t index) noexcept {
  std::array<char, 192> text;
  const std::string_view name = services_.name(index);
  const int bytes =
      std::snprintf(text.data(), text.size(), "advertise_service: this process provides %.*s now",
                    static_cast<int>(std::min<std::size_t>(name.size(), 128)), name.data());
  connection* const c = find(services_.at(index).peer);
  services_.remove(index);
  if (c == nullptr) return;
  service_claims_.give_back(c->services);
  refuse(*c, {}, {text.data(), static_cast<std::size_t>(bytes)});
}

void core::unadvertise_service(connection& c, const wire::request& asked) noexcept {
  const std::uint32_t index = services_.find(asked.service);
  if (index == no_index || services_.at(index).lane != no_index || services_.at(index).peer != c.id)
    return refuse(c, asked.id_raw, "unadvertise_service: this peer does not provide the service");
  services_.remove(index);
  service_claims_.give_back(c.services);
}

// ---- what the endpoint itself answers

std::string_view core::own_service(std::string_view asked) noexcept {
  for (const std::string_view own : own_services) {
    if (asked == own || asked == own.substr(1)) return own;
  }
  return {};
}

void core::answer_own(std::uint32_t index, std::string_view service, const wire::call_args& what) noexcept {
  calls_.at(index).provider = {.who = party::kind::core};
  if (const call& one = calls_.at(index); one.asked_by.who == party::kind::peer) {
    connection* const c = find(one.asked_by.connection());
    if (c != nullptr && !outbox_.has_place_for_reply({c->id.index}))
      return end_without_room(index, errc::full);
  }
  work_bytes_ += own_answer_work;
  std::array<char, 2 * detail::lane::name_bytes_max> room; // scratch_ has the names of the call itself
  const auto named = [&](std::string_view member) -> std::string_view {
    const auto found = what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, member);
    const auto text = found ? json::to_string(*found, room) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  const auto list = [&](json::writer& into, std::string_view key, bool topics, bool types) {
    into.key(key);
    into.begin_array();
    const std::uint32_t places = topics ? router_.topic_places() : services_.places();
    for (std::uint32_t i = 0; i < places; ++i) {
      if (topics ? !is_listed(i) : !services_.in_use(i)) continue;
      into.string(topics ? (types ? router_.type(i) : router_.name(i))
                         : (types ? services_.type(i) : services_.name(i)));
    }
    into.end_array();
  };
  const std::uint32_t slot = compose(rt::never, [&](json::writer& into) {
    if (service == wire::stats_name) return write_report(into);
    into.begin_object();
    if (service == wire::list_topics_name) {
      list(into, "topics", true, false);
      list(into, "types", true, true);
    } else if (service == wire::list_services_name) {
      list(into, "services", false, false);
    } else if (service == wire::topic_type_name) {
      const std::uint32_t topic = router_.find(named("topic"));
      into.key("type");
      into.string(topic == no_index ? std::string_view{} : router_.type(topic));
    } else if (service == wire::publishers_name) {
      into.key("publishers");
      into.begin_array();
      write_publishers(into, router_.find(named("topic")));
      into.end_array();
    } else {
      const std::uint32_t found = services_.find(named("service"));
      into.key("type");
      into.string(found == no_index ? std::string_view{} : services_.type(found));
    }
    into.end_object();
  });
  if (slot == no_index) return end_without_room(index, errc::full);
  end_without_room(index, finish_with(index, {slots_.text(slot).data(), slots_.text(slot).size()}));
  release(slot);
}

// This endpoint by its name, and peers that advertise by their addresses.
void core::write_publishers(json::writer& into, std::uint32_t topic) noexcept {
  if (topic == no_index) return;
  bool here = topic == statistics_topic_ || (topic == stop_topic_ && stop_.in_use());
  for (std::uint32_t i = 0; i < lanes_.size(); ++i)
    here = here || (views_[i].attached && views_[i].topic == topic && detail::publishes(lanes_[i].kind));
  if (here) into.string({name_.data(), name_bytes_});
  for (const connection& c : peers_) {
    const auto advertised = c.advertised.first(c.advertisements);
    const bool there = std::any_of(advertised.begin(), advertised.end(),
                                   [&](const advertisement& one) { return one.topic == topic; });
    if (c.open() && there) into.string(c.peer());
  }
}

// A call of this process; a peer's does not come so far.
void core::answer_stop_call(std::uint32_t index, stop_service which, const wire::call_args& what) noexcept {
  calls_.at(index).provider = {.who = party::kind::core};
  const stop_asker asker{.who = calls_.at(index).asked_by, .call = calls_.ref(index)};
  if (what.is != wire::call_args::form::value) return carry_out_stop(which, asker, what.text);
  const std::uint32_t slot = compose(
      rt::never, [&](json::writer& into) { wire::write_args(into, what); }, slot_use::stop);
  if (slot == no_index) return carry_out_stop(which, asker, {}); // a stop all the same
  carry_out_stop(which, asker, {slots_.text(slot).data(), slots_.text(slot).size()});
  release(slot);
}

// ---- handles that talk, respond and call

void core::attach_talker(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  lane_view& view = views_[index];
  if (detail::is_latch(lane.kind)) {
    if (const status done = attach_latch(index); !done) return lane.lifecycle.refuse(done.error(), lane.news);
    view.attached = true;
    return lane.lifecycle.accept(lane.news);
  }
  if (detail::responds(lane.kind)) {
    const std::uint32_t found = services_.find(lane.name());
    if (found != no_index && services_.at(found).lane == no_index && !ROWE_MUTANT(pinned_service))
      take_service_from_peer(found);
    const auto [at, why] = services_.add(lane.name(), lane.type(), index, {});
    if (why != services::refusal::none) {
      return lane.lifecycle.refuse(
          why == services::refusal::taken
              ? error{errc::service_taken}
              : error{errc::too_many_services, services_.count(), bounds_.services_max},
          lane.news);
    }
    view.service = at;
  }
  view.attached = true;
  receiver_.attach();
  ++talking_lanes_;
  lane.audience.set(detail::audience::somebody);
  if (connection* const c = server_connection()) announce_service(*c, index, true);
  if (receiver_.pair() == index && !door_.manned()) take_over_inbox(index);
  lane.lifecycle.accept(lane.news);
}

// What came before anybody received is for the first who does.
void core::take_over_inbox(std::uint32_t index) noexcept {
  const party us{.who = party::kind::lane, .index = index, .generation = views_[index].generation};
  while (const auto slot = door_.take_back(now_)) {
    const door_header& came = door_.inbound_header(*slot);
    call* const asked = calls_.find(came.call);
    const bool is_call = came.what == door_request::invocation;
    if (asked != nullptr) asked->provider = us;
    if (!is_call || asked != nullptr) {
      const status done = receiver_.deliver({.stamped_ns = rt::nanoseconds_of(came.stamped),
                                             .expires_ns = rt::nanoseconds_of(came.expires),
                                             .what = is_call ? entry::invocation : entry::message,
                                             .peer = came.peer,
                                             .call = came.call},
                                            door_.inbound_text(*slot));
      if (!done && is_call) finish_badly(came.call.index, {errc::refused}, "the inbox is full");
    }
    (void)door_.give_back_inbound(*slot); // this thread need not be woken
  }
}

void core::detach_talker(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  if (view.loop != no_index) return detach_latch(index);
  end_calls_of_lane(index);
  receiver_.detach(index);
  if (view.service != no_index) services_.remove(view.service);
  if (connection* const c = server_connection()) announce_service(*c, index, false);
  --talking_lanes_;
}

// As a client: a server learns which services this process provides.
void core::announce_service(connection& c, std::uint32_t index, bool begins) noexcept {
  const detail::lane& lane = lanes_[index];
  if (!detail::responds(lane.kind) || !c.protocol->can.topics) return;
  std::array<char, wire::announcement_bytes_max> room;
  json::writer text{room};
  c.protocol->topics.write_provision(text, {.name = lane.name(), .type = lane.type(), .begins = begins});
  send_direct(c, text);
}

} // namespace rowe::service
