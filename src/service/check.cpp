// SPDX-License-Identifier: Apache-2.0
// Whether the core's structures agree with each other. For tests, the simulation and the fuzzer, after every
// step; nothing else calls it.
#include <algorithm>
#include <array>

#include "service/check_sum.hpp"
#include "service/core.hpp"

namespace rowe::service {

std::string_view core::inconsistency() const noexcept {
  if (!peers_.check()) return "the number of peers";
  if (!router_.check()) return "topics and their subscriptions";
  if (!calls_.check()) return "calls";
  if (!timers_.check()) return "the wheel";
  if (!check_calls()) return "who asks and who answers";
  if (!store_.check()) return "slots";
  if (!outbox_.check()) return "queues and the slots in them";
  if (!sender_.check()) return "who has something to write";
  if (!messages_.check()) return "direct messages";
  if (!receiver_.check()) return "what peers have with whoever receives";
  if (!check_holders()) return "who holds topics";
  if (!check_shares()) return "what peers are charged for";
  if (!ingress_.check()) return "what is read and not carried out";
  return {};
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
  for (const connection& c : peers_) {
    if (c.state == connection::phase::free) {
      if (latches_.held_by_peer(static_cast<std::uint32_t>(&c - &*peers_.begin())) != 0) return false;
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
  if (services != services_.of_peers()) return false;
  // What is kept for connections is what they have not taken.
  const auto agrees = [&](const claims& of, std::uint32_t connection::*held) {
    std::uint32_t wanted = of.connections() * of.claim();
    for (const connection& c : peers_) {
      if (c.state != connection::phase::free) wanted -= of.claim() - of.kept_for(c.*held);
    }
    return wanted == of.wanted();
  };
  return agrees(subscription_claims_, &connection::subscriptions) &&
         agrees(service_claims_, &connection::services) && agrees(call_claims_, &connection::calls_asked);
}

// Each call in flight has somebody who asked and somebody who may still answer, and the counts of those that
// peers asked are right.
bool core::check_calls() const noexcept {
  const auto there = [this](const party& p) {
    if (p.who == party::kind::lane)
      return views_[p.index].attached && views_[p.index].generation == p.generation;
    if (p.who == party::kind::peer)
      return peers_[peer_index{p.index}].state != connection::phase::free &&
             p.is(peers_[peer_index{p.index}].id);
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
  for (const connection& c : peers_) asked += c.state != connection::phase::free ? c.calls_asked : 0;
  return by_peers == peer_calls_ && asked == peer_calls_;
}

// Each topic is held by its subscriptions, advertisements and handles, and by the endpoint where it is its
// own.
bool core::check_holders() const noexcept {
  std::uint64_t own_held = 0;
  for (const std::uint32_t own : {statistics_topic_, stop_topic_})
    own_held += own != no_index ? weight(own) : 0; // a client has none
  std::uint64_t held = 0;
  for (const connection& c : peers_) {
    if (c.state == connection::phase::free) continue;
    for (std::uint32_t i = 0; i < c.advertisements; ++i) held += weight(c.advertised[i].topic);
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = router_.subscription_at(s).next_on_connection) {
      if (router_.subscription_at(s).connection != c.id.index) return false;
      held += weight(router_.subscription_at(s).topic);
    }
  }
  for (const lane_view& view : views_) {
    if (view.attached && view.topic != no_index) own_held += weight(view.topic);
  }
  std::uint64_t holders = 0;
  std::uint64_t own_holders = 0;
  for (std::uint32_t i = 0; i < router_.topic_places(); ++i) {
    holders += weight(i) * router_.at(i).holders;
    own_holders += weight(i) * router_.at(i).own_holders;
  }
  return holders == held + own_held && own_holders == own_held;
}

} // namespace rowe::service
