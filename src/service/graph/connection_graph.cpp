// SPDX-License-Identifier: Apache-2.0
#include "service/graph/connection_graph.hpp"

#include <algorithm>
#include <utility>

#include <rowe/rt/timer_wheel.hpp>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "service/base/shares.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

using wire::graph_list;

connection_graph::connection_graph(rt::arena& memory, const connection_graph_needs& parts) noexcept
    : connection_graph_needs{parts},
      record_{memory, {state_, service_directory_, stop_rules_}},
      message_{memory,
               {state_, advertisement_table_, service_directory_, stop_rules_, record_, endpoint_name_}},
      subscribers_{memory.carve<subscriber>(state_.bounds().connections_max)},
      policy_version_{state_.rights.policy().version()} {}

// ---- requests

void connection_graph::subscribe(connection& c, const wire::request& asked) noexcept {
  if (state_.bounds().message_bytes_max < graph_envelope_bytes)
    return refusals_.refuse(c, asked.id_raw,
                            "subscribeConnectionGraph: it needs messages of 160 bytes, and the limit "
                            "message_bytes_max is lower here");
  static_assert(graph_envelope_bytes == 160, "the text above says so");
  subscriber& of = subscribers_[{c.id.index}];
  if (of.subscribed) return;
  of = {.subscribed = true, .earliest = of.earliest};
  ++count_;
  state_.due.arm(timer::graph, state_.cycle.now);
}

void connection_graph::unsubscribe(peer_index peer) noexcept {
  subscriber& of = subscribers_[peer];
  if (!of.subscribed) return;
  of = {.earliest = of.earliest};
  if (--count_ == 0) state_.due.disarm(timer::graph);
}

void connection_graph::forget(peer_index peer) noexcept {
  unsubscribe(peer);
  subscribers_[peer] = {};
}

void connection_graph::show() noexcept {
  const rt::time_point now = state_.cycle.now;
  work_.left = graph_work_per_cycle;
  messages_left_ = graph_messages_per_cycle;
  announce_again_if_rights_changed();
  compare();
  rt::time_point next = now;
  if (record_.is_whole()) {
    next = announce_some();
    next = std::min(next, record_.is_old() ? record_.next_at() : now + graph_period);
  }
  if (count_ != 0) state_.due.arm(timer::graph, std::max(next, now + rt::timer_wheel::tick));
}

// Peers that are still there may see more than before.
void connection_graph::announce_again_if_rights_changed() noexcept {
  const auto version = state_.rights.policy().version();
  if (std::exchange(policy_version_, version) == version) return;
  for (subscriber& one : subscribers_) {
    if (!one.knows_some()) continue;
    one.anew = true;
    one.from = one.then = 0;
    one.ends = false;
  }
}

// ---- comparing

void connection_graph::compare() noexcept {
  const rt::time_point now = state_.cycle.now;
  if (record_.is_whole()) {
    if (now < record_.next_at() || !record_.is_old()) return;
    const bool known = std::any_of(subscribers_.begin(), subscribers_.end(),
                                   [](const subscriber& one) { return one.knows_some(); });
    if (record_.begin(known, least_announced())) held_up_since_ = rt::never;
  }
  record_.go_on(work_);
  if (!record_.is_whole()) return;
  held_up_since_ = record_.held_up() ? std::min(held_up_since_, now) : rt::never;
  if (record_.held_up() && now - held_up_since_ >= graph_behind_max) leave_behind();
}

std::uint32_t connection_graph::least_announced() const noexcept {
  std::uint32_t least = record_.version();
  for (const subscriber& one : subscribers_) {
    if (one.knows_some()) least = std::min(least, one.announced_at);
  }
  return least;
}

// Ends the subscriptions of the peers that are furthest behind.
void connection_graph::leave_behind() noexcept {
  const std::uint32_t least = least_announced();
  for (const peer_index peer : subscribers_.ids()) {
    if (!subscribers_[peer].knows_some() || subscribers_[peer].announced_at != least) continue;
    unsubscribe(peer);
    refusals_.warn(state_.peers[peer], {},
                   "subscribeConnectionGraph: this client reads changes too slowly, so its "
                   "subscription has ended; subscribe again",
                   wire::severity::warning);
  }
}

// ---- announcing

// When that is to go on.
rt::time_point connection_graph::announce_some() noexcept {
  const rt::time_point now = state_.cycle.now;
  rt::time_point next = rt::never;
  for (std::uint32_t looked = 0; looked < state_.peers.size(); ++looked) {
    if (work_.left == 0 || messages_left_ == 0) return now;
    work_.use(1);
    settle(turn_);
    const rt::time_point at = due(turn_);
    next = std::min(next, at <= now ? announce(turn_) : at);
    turn_ = {turn_.value + 1 == state_.peers.size() ? 0 : turn_.value + 1};
  }
  return next;
}

rt::time_point connection_graph::due(peer_index peer) const noexcept {
  const subscriber& of = subscribers_[peer];
  if (!of.subscribed || !state_.peers[peer].open()) return rt::never;
  if (of.announcing == 0) {
    if (of.announced_at == record_.version() && !of.anew) return rt::never;
    if (state_.cycle.now < of.earliest) return of.earliest;
  }
  const peer_queues& its = outbox_.of(peer);
  if (its.replies.count == 0 && !its.backpressured() && !of.message.is_begun()) return state_.cycle.now;
  return state_.cycle.now + (its.backpressured() ? graph_retry_backpressured : graph_retry);
}

// Announces by one message at most. The rest, or all, comes later if there is too much of it. Returns when.
rt::time_point connection_graph::announce(peer_index peer) noexcept {
  connection& c = state_.peers[peer];
  subscriber& to = subscribers_[peer];
  if (to.announcing == 0) {
    to.announcing = record_.version();
    to.from = to.from_gone = 0;
    to.said = false;
    to.earliest = state_.cycle.now + graph_period;
  }
  const graph_part next = gather(c, to);
  to.ends = next.to == record_.size();
  to.then = next.to;
  to.then_gone = next.to_gone;
  if (next.count != 0 || (to.ends && to.announced_at == 0 && !to.said)) {
    const auto write = [&](json::writer& into) { return message_.write(into, c.protocol->topics, next); };
    if (!outbox_.reply(peer, write, rt::never, announcer::connection_graph))
      return state_.cycle.now + graph_retry;
    to.message.begin(outbox_.of(peer));
    --messages_left_;
  } else {
    go_on(to);
  }
  return due(peer);
}

// What became of its last message. What a lost one said is announced again, as it is then.
void connection_graph::settle(peer_index peer) noexcept {
  subscriber& to = subscribers_[peer];
  const auto now = to.message.take_fate(outbox_.of(peer), announcer::connection_graph);
  if (now != announcement::fate::written) return;
  to.said = true;
  go_on(to);
}

// What the last message said is known.
void connection_graph::go_on(subscriber& to) noexcept {
  to.from = to.then;
  to.from_gone = to.then_gone;
  if (!to.ends) return;
  to.announced_at = to.announcing;
  to.announcing = 0;
  to.anew = to.ends = false;
}

graph_part connection_graph::gather(const connection& c, const subscriber& to) noexcept {
  graph_part next{.to = to.from, .to_gone = to.from_gone, .bytes_max = part_bytes_max({c.id.index})};
  for (; next.to_gone != record_.gone().size(); ++next.to_gone) {
    if (work_.left == 0 || !add_gone(c, to, next)) return next;
  }
  for (; next.to != record_.size(); ++next.to) {
    if (work_.left == 0 || !add_row(c, to, next)) return next;
  }
  return next;
}

// False: the message is full. What has gone since this round began is announced in the next one.
bool connection_graph::add_gone(const connection& c, const subscriber& to, graph_part& into) noexcept {
  work_.use(1);
  const gone_names& all = record_.gone();
  const std::uint32_t gone_at = all.gone_at(into.to_gone);
  const std::string_view name = all.name(into.to_gone);
  if (to.announced_at == 0 || gone_at <= to.announced_at || gone_at > to.announcing ||
      !sees(c, name, all.is_topic(into.to_gone)))
    return true;
  return into.add({.at = into.to_gone, .gone = true}, graph_entry_bytes + bytes_in_json(name));
}

// Likewise. To a peer that knows nothing, a side that has nobody is not announced.
bool connection_graph::add_row(const connection& c, const subscriber& to, graph_part& into) noexcept {
  work_.use(1);
  const std::uint32_t of = into.to;
  const bool topic = record_.is_topic(of);
  graph_part::entry one{.at = of,
                        .published = to.anew || record_.published_at(of) > to.announced_at,
                        .subscribed = topic && (to.anew || record_.subscribed_at(of) > to.announced_at)};
  if (!one.published && !one.subscribed) return true;
  if (!record_.holds(of) || !sees(c, record_.name(of), topic)) return true;
  const bool fresh = to.announced_at == 0 && !to.anew;
  std::size_t bytes = 0;
  const auto look_at = [&](bool& side, graph_list which) {
    if (!side) return;
    bool says = !fresh;
    const std::size_t more = message_.measure(of, which, says, work_);
    side = says && more != 0;
    if (side) bytes += more;
  };
  look_at(one.published, topic ? graph_list::published_topics : graph_list::advertised_services);
  look_at(one.subscribed, graph_list::subscribed_topics);
  return bytes == 0 || into.add(one, bytes);
}

// There are few large slots, so a message is small as long as the peer's share of small ones suffices. One
// topic may still need a large one.
std::size_t connection_graph::part_bytes_max(peer_index peer) const noexcept {
  const limits& bounds = state_.bounds();
  const std::uint32_t held = outbox_.entries().held_by(peer, queued_as::evictable, slot_class::small);
  const bool within_share = held < equal_share(bounds.small_slots, state_.peers.count());
  return within_share ? std::min(bounds.small_slot_bytes, bounds.message_bytes_max)
                      : bounds.message_bytes_max;
}

bool connection_graph::sees(const connection& c, std::string_view name, bool topic) noexcept {
  if (state_.rights.apply_to(c)) {
    const auto right = topic ? access::right::subscribe : access::right::call;
    work_.use(state_.rights.policy().patterns(c.who.role, right));
  }
  return topic ? state_.rights.sees(c, name) : state_.rights.calls(c, name);
}

bool connection_graph::check() const noexcept {
  std::uint32_t subscribed = 0;
  for (const peer_index peer : subscribers_.ids()) {
    const subscriber& one = subscribers_[peer];
    if (one.subscribed && state_.peers[peer].state == connection::phase::free) return false;
    if (one.announced_at > record_.version() || one.announcing > record_.version()) return false;
    subscribed += one.subscribed;
  }
  return subscribed == count_ && (count_ != 0) == state_.due.armed(timer::graph);
}

} // namespace rowe::service
