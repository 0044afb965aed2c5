// SPDX-License-Identifier: Apache-2.0
// Whether the core's structures agree with each other. For tests, the simulation and the fuzzer, after every
// step; nothing else calls it.
#include "service/core.hpp"

namespace rowe::service {

bool core::check() const noexcept {
  std::uint32_t there = 0;
  for (const connection& c : connections_) there += c.state != connection::phase::free;
  return there == peers_ && slots_.check() && router_.check() && letters_.check() && calls_.check() &&
         wheel_.check() == nullptr && check_calls() && check_deliveries() && check_shares() &&
         check_receiving();
}

// What peers are charged for is what they hold.
bool core::check_shares() const noexcept {
  std::uint32_t blocks = 0;
  for (std::uint32_t i = 0; i < router_.topic_places(); ++i) {
    const latched_value& last = router_.at(i).last;
    blocks += last.blocks;
    if (router_.at(i).holders == 0 && !last.empty()) return false;
  }
  if (blocks != latches_.in_use()) return false;
  std::uint32_t services = 0;
  for (const connection& c : connections_) {
    if (c.state == connection::phase::free) {
      if (latches_.held_by_peer(static_cast<std::uint32_t>(&c - connections_.data())) != 0) return false;
      continue;
    }
    std::uint32_t provided = 0;
    for (std::uint32_t i = 0; i < services_.places(); ++i)
      provided += services_.in_use(i) && services_.at(i).lane == no_index && services_.at(i).peer == c.id;
    std::uint32_t subscribed = 0;
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = router_.subscription_at(s).next_on_connection)
      ++subscribed;
    if (provided != c.services || subscribed != c.subscriptions) return false;
    services += provided;
  }
  return services == services_.of_peers();
}

// Each call in flight has somebody who asked and somebody who may still answer, and the counts of those that
// peers asked are right.
bool core::check_calls() const noexcept {
  const auto there = [this](const party& p) {
    if (p.who == party::kind::lane)
      return views_[p.index].attached && views_[p.index].generation == p.generation;
    if (p.who == party::kind::peer)
      return connections_[p.index].state != connection::phase::free && p.is(connections_[p.index].id);
    return true;
  };
  std::uint32_t by_peers = 0;
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    const call& one = calls_.at(i);
    if (!one.open) continue;
    if (!there(one.asked_by) || !there(one.provider)) return false;
    by_peers += one.asked_by.who == party::kind::peer;
  }
  std::uint32_t asked = 0;
  for (const connection& c : connections_) asked += c.state != connection::phase::free ? c.calls_asked : 0;
  return by_peers == peer_calls_ && asked == peer_calls_;
}

// The counts of what peers have with whoever receives are sums over them; who is parked is in the list of
// these, and not read.
bool core::check_receiving() const noexcept {
  std::uint32_t untaken = 0;
  std::uint32_t answers = 0;
  std::uint32_t told_full = 0;
  std::uint32_t in_turn = 0;
  for (const connection& c : connections_) {
    in_turn += c.in_turn;
    if (c.state == connection::phase::free) continue;
    untaken += c.untaken;
    answers += c.answers_held;
    told_full += c.told_full;
    if (c.parked() && (!c.in_turn || !c.unheard)) return false;
    if (!c.unread.empty() && !c.in_turn) return false;
  }
  return untaken == untaken_ && answers == answers_held_ && told_full == told_full_ &&
         in_turn == unread_.count + parked_.count;
}

// Every reference to a slot that is no kept one belongs to a place in a queue, or to a frame that was begun.
bool core::check_deliveries() const noexcept {
  std::uint64_t queued = 0;
  const auto count = [&](const queue& in) {
    for (std::uint32_t at = in.head; at != no_index; at = entries_.after(at))
      queued += slots_.alive(entries_.at(at));
  };
  for (const connection& c : connections_) {
    if (c.state == connection::phase::free) continue;
    queued += c.begun.slot != no_index;
    count(c.direct);
    for (const queue& letters : c.letters) count(letters);
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = router_.subscription_at(s).next_on_connection)
      count(router_.subscription_at(s).waiting);
  }
  return queued == slots_.deliveries();
}

} // namespace rowe::service
