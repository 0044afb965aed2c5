// SPDX-License-Identifier: Apache-2.0
#include "service/connection_graph.hpp"

#include <algorithm>
#include <utility>

#include <rowe/detail/mutation_points.hpp>
#include <rowe/rt/timer_wheel.hpp>

#include "service/listed_topics.hpp"
#include "service/names.hpp"
#include "service/shares.hpp"
#include "service/topic_holders.hpp"
#include "wire/own_names.hpp"
#include "json/writer.hpp"

namespace rowe::service {

using wire::graph_list;

connection_graph::connection_graph(rt::arena& memory, const needs& parts) noexcept
    : state_{parts.state},
      outbox_{parts.outbox},
      refusals_{parts.refusals},
      advertisement_table_{parts.advertisement_table},
      service_directory_{parts.service_directory},
      stop_rules_{parts.stop_rules},
      endpoint_name_{parts.endpoint_name},
      rows_{memory.carve<row>(rows_of(state_.bounds()))},
      names_{memory.carve<char>(rows_.size() * gone_names::name_bytes_max(state_.bounds()))},
      gone_{memory, state_.bounds()},
      subscribers_{memory.carve<subscriber>(state_.bounds().connections_max)},
      marked_{memory.carve<std::uint64_t>(peer_set::words_for(state_.bounds().connections_max))},
      row_{static_cast<std::uint32_t>(rows_.size())} {}

std::string_view connection_graph::name(std::uint32_t of) const noexcept {
  return {names_.data() + of * gone_names::name_bytes_max(state_.bounds()), rows_[of].name_bytes};
}

void connection_graph::set_name(std::uint32_t of, std::string_view name) noexcept {
  rows_[of].name_bytes = static_cast<std::uint16_t>(name.size());
  name.copy(names_.data() + of * gone_names::name_bytes_max(state_.bounds()), name.size());
}

std::uint64_t connection_graph::changes() const noexcept {
  return service_directory_.changes() * 2 + state_.topics.holder_changes() + (stop_rules_.in_use() ? 1 : 0);
}

void connection_graph::use_work(std::size_t more) noexcept {
  work_left_ -= static_cast<std::uint32_t>(std::min<std::size_t>(work_left_, more));
}

// ---- requests

// Who asks again and again is told all as often as others are told changes.
void connection_graph::subscribe(connection& c, const wire::request& asked) noexcept {
  if (state_.bounds().message_bytes_max < graph_envelope_bytes)
    return refusals_.refuse(c, asked.id_raw,
                            "subscribeConnectionGraph: messages are too short here for that (limit "
                            "message_bytes_max)");
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

void connection_graph::tell_again(peer_index peer) noexcept {
  subscriber& of = subscribers_[peer];
  if (!of.subscribed) return;
  of.anew = true;
  of.from = 0;
  state_.due.arm(timer::graph, state_.cycle.now);
}

void connection_graph::show() noexcept {
  const rt::time_point now = state_.cycle.now;
  work_left_ = graph_work_per_cycle;
  messages_left_ = graph_messages_per_cycle;
  compare();
  const bool compared = row_ == rows_.size();
  rt::time_point next = compared ? tell_some() : now;
  if (compared) next = std::min(next, changes() != compared_ || held_up_ ? compare_at_ : now + graph_period);
  if (count_ != 0) state_.due.arm(timer::graph, std::max(next, now + rt::timer_wheel::tick));
}

// ---- comparing

void connection_graph::compare() noexcept {
  if (row_ == rows_.size()) {
    if (state_.cycle.now < compare_at_ || (changes() == compared_ && !held_up_ && version_ != 0)) return;
    begin_comparison();
  }
  const listed_topics listed{state_.topics, stop_rules_};
  for (; row_ != rows_.size() && work_left_ != 0; ++row_) {
    use_work(1);
    is_topic(row_) ? compare_topic(row_, listed({row_})) : compare_service(row_);
  }
  if (row_ == rows_.size()) end_comparison();
}

void connection_graph::begin_comparison() noexcept {
  if (std::exchange(stop_in_use_, stop_rules_.in_use()) != stop_rules_.in_use())
    state_.topics.note_publishers(state_.topics.find(wire::stop_state_name));
  compare_at_ = state_.cycle.now + graph_period;
  comparing_ = changes();
  changed_ = version_ == 0;
  held_up_ = false;
  drop_told_names();
  row_ = 0;
}

void connection_graph::compare_topic(std::uint32_t of, bool listed) noexcept {
  const topic& is = state_.topics.at({of});
  row& was = rows_[of];
  const bool same = was.publishers == is.publishers_at && was.subscribers == is.subscribers_at;
  const bool known = was.name_bytes != 0;
  if (known == listed && (!known || same)) return;
  if (!replace(of, listed ? state_.topics.name({of}) : std::string_view{}) || !listed) return;
  if (was.publishers != is.publishers_at) was.published_at = version_ + 1;
  if (was.subscribers != is.subscribers_at) was.subscribed_at = version_ + 1;
  was.publishers = is.publishers_at;
  was.subscribers = is.subscribers_at;
}

void connection_graph::compare_service(std::uint32_t of) noexcept {
  const service_index service = service_of(of);
  const bool listed = service_directory_.is_service(service);
  row& was = rows_[of];
  const bool known = was.name_bytes != 0;
  const std::uint32_t number = listed ? service_directory_.at(service).number : 0;
  if (known == listed && (!known || was.publishers == number)) return;
  if (!replace(of, listed ? service_directory_.name(service) : std::string_view{}) || !listed) return;
  was.published_at = version_ + 1;
  was.publishers = number;
}

// The row has another name from now on; empty: none. False: the name before finds no place yet, and so the row
// stays as it is. What comes again, in this row or another one, is not told to be gone.
bool connection_graph::replace(std::uint32_t of, std::string_view now) noexcept {
  const std::string_view before = name(of);
  if (before != now) {
    use_work(gone_.size());
    const bool moved = is_elsewhere(of) && !ROWE_MUTANT(graph_moved);
    if (!before.empty() && !nobody_knows_ && !moved && !ROWE_MUTANT(graph_gone) &&
        !gone_.add(before, is_topic(of), version_ + 1)) {
      held_up_ = true;
      return false;
    }
    if (!now.empty() && !ROWE_MUTANT(graph_moved)) gone_.drop(now, is_topic(of));
    rows_[of] = {.published_at = version_ + 1, .subscribed_at = version_ + 1};
    set_name(of, now);
  }
  changed_ = true;
  return true;
}

// Whether another row has the name of this one.
bool connection_graph::is_elsewhere(std::uint32_t of) const noexcept {
  if (is_topic(of)) {
    const topic_id found = state_.topics.find(name(of));
    return found && found.value != of && name(found.value) == name(of);
  }
  const service_index found = service_directory_.find(name(of));
  const std::uint32_t other = found ? state_.bounds().topics_max + found.value : of;
  return other != of && name(other) == name(of);
}

void connection_graph::drop_told_names() noexcept {
  std::uint32_t least = version_;
  nobody_knows_ = true;
  for (const subscriber& one : subscribers_) {
    if (!one.knows_some()) continue;
    nobody_knows_ = false;
    least = std::min(least, one.told_at);
  }
  if (gone_.drop_until(least)) held_up_since_ = rt::never;
}

void connection_graph::end_comparison() noexcept {
  compared_ = comparing_;
  if (changed_) ++version_;
  held_up_since_ = held_up_ ? std::min(held_up_since_, state_.cycle.now) : rt::never;
  if (held_up_ && state_.cycle.now - held_up_since_ >= graph_behind_max) leave_behind();
}

// Ends the subscriptions of those who have been told least.
void connection_graph::leave_behind() noexcept {
  std::uint32_t least = version_;
  for (const subscriber& one : subscribers_) {
    if (one.knows_some()) least = std::min(least, one.told_at);
  }
  for (const peer_index peer : subscribers_.ids()) {
    if (!subscribers_[peer].knows_some() || subscribers_[peer].told_at != least) continue;
    unsubscribe(peer);
    refusals_.warn(state_.peers[peer], {},
                   "subscribeConnectionGraph: this client reads too slowly what has changed, so it is told no "
                   "more; it may subscribe again",
                   wire::severity::warning);
  }
}

// ---- telling

// When that is to go on.
rt::time_point connection_graph::tell_some() noexcept {
  const rt::time_point now = state_.cycle.now;
  rt::time_point next = rt::never;
  for (std::uint32_t looked = 0; looked < state_.peers.size(); ++looked) {
    if (work_left_ == 0 || messages_left_ == 0) return now;
    use_work(1);
    const rt::time_point at = due(turn_);
    next = std::min(next, at <= now ? tell(turn_) : at);
    turn_ = {turn_.value + 1 == state_.peers.size() ? 0 : turn_.value + 1};
  }
  return next;
}

rt::time_point connection_graph::due(peer_index peer) const noexcept {
  const subscriber& of = subscribers_[peer];
  if (!of.subscribed || !state_.peers[peer].open()) return rt::never;
  if (of.telling == 0) {
    if (of.told_at == version_ && !of.anew) return rt::never;
    if (state_.cycle.now < of.earliest) return of.earliest;
  }
  const peer_queues& its = outbox_.of(peer);
  if (its.replies.count == 0) return state_.cycle.now;
  return state_.cycle.now + (its.backpressured() ? graph_retry_backpressured : graph_retry);
}

// One message at most. The rest, or all, is told later if there is too much of it. Returns when.
rt::time_point connection_graph::tell(peer_index peer) noexcept {
  connection& c = state_.peers[peer];
  subscriber& to = subscribers_[peer];
  if (to.telling == 0) {
    to.telling = version_;
    to.from = 0;
    to.from_gone = 0;
    to.said = false;
    to.earliest = state_.cycle.now + graph_period;
  }
  const part next = gather(c, to);
  const bool ends = next.to == rows_.size();
  if (next.count != 0 || (ends && to.told_at == 0 && !to.said)) {
    if (!send(c, next)) return state_.cycle.now + graph_retry;
    to.said = true;
    --messages_left_;
  }
  to.from = next.to;
  to.from_gone = next.to_gone;
  if (ends) {
    to.told_at = to.telling;
    to.telling = 0;
    to.anew = false;
  }
  return due(peer);
}

connection_graph::part connection_graph::gather(const connection& c, const subscriber& to) noexcept {
  part next{.to = to.from, .to_gone = to.from_gone, .bytes_max = part_bytes_max({c.id.index})};
  for (; next.to_gone != gone_.size(); ++next.to_gone) {
    if (work_left_ == 0 || !add_gone(c, to, next)) return next;
  }
  for (; next.to != rows_.size(); ++next.to) {
    if (work_left_ == 0 || !add_row(c, to, next)) return next;
  }
  return next;
}

// False: the message is full. What has gone since this round began is told in the next one.
bool connection_graph::add_gone(const connection& c, const subscriber& to, part& into) noexcept {
  use_work(1);
  const std::uint32_t gone_at = gone_.gone_at(into.to_gone);
  const std::string_view name = gone_.name(into.to_gone);
  if (to.told_at == 0 || gone_at <= to.told_at || gone_at > to.telling ||
      !sees(c, name, gone_.is_topic(into.to_gone)))
    return true;
  return add(into, {.at = into.to_gone, .gone = true}, graph_entry_bytes + bytes_in_json(name));
}

// Likewise. Who knows nothing is told nothing of a side that has nobody.
bool connection_graph::add_row(const connection& c, const subscriber& to, part& into) noexcept {
  use_work(1);
  const std::uint32_t of = into.to;
  const row& its = rows_[of];
  const bool topic = is_topic(of);
  entry one{.at = of,
            .published = to.anew || its.published_at > to.told_at,
            .subscribed = topic && (to.anew || its.subscribed_at > to.told_at)};
  if ((!one.published && !one.subscribed) || !holds(of) || !sees(c, name(of), topic)) return true;
  const bool fresh = to.told_at == 0 && !to.anew;
  std::size_t bytes = 0;
  const auto look_at = [&](bool& side, graph_list which) {
    if (!side) return;
    bool says = !fresh;
    const std::size_t more = measure(of, which, says);
    side = says && more != 0;
    if (side) bytes += more;
  };
  look_at(one.published, topic ? graph_list::published_topics : graph_list::advertised_services);
  look_at(one.subscribed, graph_list::subscribed_topics);
  if (bytes == 0) return true;
  return add(into, one, bytes);
}

bool connection_graph::add(part& into, const entry& one, std::size_t bytes) const noexcept {
  if (into.count == into.which.size()) return false;
  if (into.count != 0 && into.bytes + bytes > into.bytes_max) return false;
  into.bytes += bytes;
  into.which[into.count++] = one;
  return true;
}

// There are few large slots, so a message is small as long as the peer's share of small ones suffices. One
// topic may still need a large one.
std::size_t connection_graph::part_bytes_max(peer_index peer) const noexcept {
  const limits& bounds = state_.bounds();
  const std::uint32_t held = outbox_.entries().held_by(peer, queued_as::evictable, slot_class::small);
  const bool within_share = held < equal_share(bounds.small_slots, state_.peers.count());
  return within_share ? std::min(bounds.small_slot_bytes, bounds.message_bytes_max) : bounds.message_bytes_max;
}

bool connection_graph::sees(const connection& c, std::string_view name, bool topic) noexcept {
  if (state_.rights.apply_to(c))
    use_work(state_.rights.policy().patterns(c.who.role,
                                             topic ? access::right::subscribe : access::right::call));
  return topic ? state_.rights.sees(c, name) : state_.rights.calls(c, name);
}

// Whether the row is of what stands there now. Else the next comparison replaces it, and what is told then
// holds.
bool connection_graph::holds(std::uint32_t of) const noexcept {
  if (rows_[of].name_bytes == 0) return false;
  if (is_topic(of)) return state_.topics.at({of}).holders != 0 && state_.topics.name({of}) == name(of);
  const service_index service = service_of(of);
  return service_directory_.is_service(service) &&
         service_directory_.at(service).number == rows_[of].publishers;
}

// ---- holders

// Calls `take(name)` with each: this endpoint first, then peers.
template <class Take>
void connection_graph::for_each_holder(std::uint32_t of, graph_list which, const Take& take) const noexcept {
  const auto take_peer = [&](peer_index peer) {
    if (state_.peers[peer].open()) take(state_.peers[peer].peer());
  };
  if (which == graph_list::advertised_services) {
    const service_entry& one = service_directory_.at(service_of(of));
    if (one.pair) return take(endpoint_name_);
    if (const connection* const c = state_.peers.find(one.peer)) take_peer({c->id.index});
    return;
  }
  const topic_id topic{of};
  const topic_holders here{state_, stop_rules_};
  if (which == graph_list::published_topics) {
    if (here.published_here(topic)) take(endpoint_name_);
    return advertisement_table_.publishers_of(topic).for_each(take_peer);
  }
  if (here.subscribed_here(topic)) take(endpoint_name_);
  marked_.clear();
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i;
       i = state_.subscriptions.at(i).next_on_topic)
    marked_.add(state_.subscriptions.at(i).peer); // once, by whichever spelling
  marked_.for_each(take_peer);
}

// The same for as many as fit into half a message, so that both sides of a topic fit into one. False: not all
// do.
template <class Take>
bool connection_graph::for_each_told(std::uint32_t of, graph_list which, const Take& take) const noexcept {
  std::size_t left = (state_.bounds().message_bytes_max - graph_envelope_bytes) / 2;
  left -= std::min(left, graph_entry_bytes + bytes_in_json(name(of)));
  bool all = true;
  for_each_holder(of, which, [&](std::string_view holder) {
    const std::size_t bytes = graph_holder_bytes + bytes_in_json(holder);
    all = all && bytes <= left;
    if (!all) return;
    left -= bytes;
    take(holder);
  });
  return all;
}

// The bytes of one side; 0: not even its name fits. `says`: is set if it has anybody.
std::size_t connection_graph::measure(std::uint32_t of, graph_list which, bool& says) noexcept {
  std::size_t bytes = graph_entry_bytes + bytes_in_json(name(of));
  use_work(marked_.words() + (is_topic(of) ? state_.topics.at({of}).subscriptions.count : 0) +
           (is_topic(of) && !state_.topics.of_peers({of}) ? state_.pairs.size() : 0));
  if (bytes > (state_.bounds().message_bytes_max - graph_envelope_bytes) / 2) {
    state_.counts.add(counter::too_big);
    return 0;
  }
  const bool all = for_each_told(of, which, [&](std::string_view holder) {
    use_work(1);
    says = true;
    bytes += graph_holder_bytes + bytes_in_json(holder);
  });
  if (!all) state_.counts.add(counter::too_big);
  return bytes;
}

// ---- writing

// False: it is to be sent later.
bool connection_graph::send(connection& c, const part& what) noexcept {
  const wire::codec& codec = c.protocol->topics;
  const auto which = std::span<const entry>{what.which}.first(what.count);
  const auto add_row_to = [&](json::writer& into, graph_list list, std::uint32_t of) {
    const auto holders = [&](json::writer& out) {
      out.begin_array();
      (void)for_each_told(of, list, [&](std::string_view holder) { out.string(holder); });
      out.end_array();
    };
    codec.add_to_graph(into, list, name(of), wire::body{holders});
  };
  const auto belongs = [&](const entry& one, graph_list list) {
    switch (list) {
    case graph_list::published_topics: return one.published && is_topic(one.at);
    case graph_list::subscribed_topics: return one.subscribed;
    case graph_list::advertised_services:
      return one.published && !is_topic(one.at);
    case graph_list::removed_topics: return one.gone && gone_.is_topic(one.at);
    case graph_list::removed_services: break;
    }
    return one.gone && !gone_.is_topic(one.at);
  };
  const auto write = [&](json::writer& into) {
    codec.begin_graph(into);
    for (std::size_t i = 0; i < wire::graph_lists; ++i) {
      const auto list = static_cast<graph_list>(i);
      codec.begin_graph_list(into, list);
      for (const entry& one : which) {
        if (!belongs(one, list)) continue;
        if (one.gone) codec.add_to_graph(into, list, gone_.name(one.at), wire::body{std::string_view{}});
        else add_row_to(into, list, one.at);
      }
      codec.end_graph_list(into);
    }
    return codec.end_graph(into);
  };
  return static_cast<bool>(outbox_.reply({c.id.index}, write, rt::never, true));
}

bool connection_graph::check() const noexcept {
  std::uint32_t subscribed = 0;
  for (const peer_index peer : subscribers_.ids()) {
    const subscriber& one = subscribers_[peer];
    if (one.subscribed && state_.peers[peer].state == connection::phase::free) return false;
    if (one.told_at > version_ || one.telling > version_) return false;
    subscribed += one.subscribed;
  }
  return subscribed == count_ && (count_ != 0) == state_.due.armed(timer::graph);
}

} // namespace rowe::service
