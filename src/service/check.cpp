// SPDX-License-Identifier: Apache-2.0
// Whether the core's structures agree with each other. For tests, the simulation and the fuzzer, after every
// step; nothing else calls it.
#include <algorithm>
#include <array>

#include "service/core.hpp"

namespace rowe::service {

namespace {

// References are counted for all slots, or topics, at once: each weighs something of its own, so that two
// sums are equal only where each one's count is. No memory, and every place is looked at once.
constexpr std::uint64_t weight(std::uint32_t of) noexcept {
  std::uint64_t z = (of + std::uint64_t{1}) * 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

} // namespace

std::string_view core::inconsistency() const noexcept {
  if (!peers_.check()) return "the number of peers";
  if (!slots_.check()) return "free slots";
  if (!router_.check()) return "topics and their subscriptions";
  if (!letters_.check()) return "letters that wait";
  if (!calls_.check()) return "calls";
  if (!timers_.check()) return "the wheel";
  if (!check_calls()) return "who asks and who answers";
  if (!check_queues()) return "the entries of queues";
  if (!check_references()) return "references to slots";
  if (!check_listed()) return "who has something to write";
  if (!check_holders()) return "who holds topics";
  if (!check_shares()) return "what peers are charged for";
  if (!check_receiving()) return "what peers have with whoever receives";
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
         agrees(service_claims_, &connection::services) && agrees(call_claims_, &connection::calls_asked) &&
         agrees(inbox_claims_, &connection::untaken);
}

// Each call in flight has somebody who asked and somebody who may still answer, and the counts of those that
// peers asked are right.
bool core::check_calls() const noexcept {
  const auto there = [this](const party& p) {
    if (p.who == party::kind::lane)
      return views_[p.index].attached && views_[p.index].generation == p.generation;
    if (p.who == party::kind::peer)
      return peers_[peer_index{p.index}].state != connection::phase::free && p.is(peers_[peer_index{p.index}].id);
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

// The counts of what peers have with whoever receives are sums over them; who is parked is in the list of
// these, and not read.
bool core::check_receiving() const noexcept {
  std::uint32_t untaken = 0;
  std::uint32_t answers = 0;
  std::uint32_t told_full = 0;
  std::uint32_t in_turn = 0;
  for (const connection& c : peers_) {
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

// Each queue is as long as it says, all together as many as are taken from the pool, and each connection is
// charged for what its queues hold.
bool core::check_queues() const noexcept {
  std::uint32_t left = entries_.in_use();
  std::array<std::array<std::uint32_t, 2>, 2> held{}; // of one connection: how it queues, size class
  const auto fits = [&](const queue& one) {
    std::uint32_t length = 0;
    entry_id last{};
    for (entry_id at = one.entries.head; at; last = at, at = entries_.after(at)) {
      if (left == 0 || entries_.at(at).index >= slots_.count()) return false;
      --left;
      ++length;
      ++held[one.owner % 2][static_cast<std::size_t>(slots_.class_of(entries_.at(at).index))];
    }
    return length == one.count && one.entries.tail == last;
  };
  const auto charged = [&](std::uint32_t connection) {
    for (const queued_as what : {queued_as::evictable, queued_as::direct_message}) {
      for (const slot_class size : {slot_class::small, slot_class::large}) {
        if (entries_.held_by(connection, what, size) !=
            held[static_cast<std::size_t>(what)][static_cast<std::size_t>(size)])
          return false;
      }
    }
    return true;
  };
  for (const connection& c : peers_) {
    held = {};
    if (c.state == connection::phase::free) {
      if (!charged(static_cast<std::uint32_t>(&c - &*peers_.begin()))) return false;
      continue;
    }
    if (!fits(c.direct)) return false;
    for (const queue& letters : c.letters) {
      if (!fits(letters)) return false;
    }
    std::uint32_t subscriptions = 0;
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = router_.subscription_at(s).next_on_connection) {
      if (++subscriptions > c.subscriptions || !fits(router_.subscription_at(s).waiting)) return false;
    }
    if (subscriptions != c.subscriptions || !charged(c.id.index)) return false;
  }
  return left == 0;
}

// Whoever has something to write is on the list, or waits for something that will put it there: room in its
// carrier, a pong, or the end of a frame that is begun.
bool core::check_listed() const noexcept {
  const auto any_due = [this](const queue& in) {
    for (entry_id at = in.entries.head; at; at = entries_.after(at)) {
      if (is_due(entries_.at(at))) return true;
    }
    return false;
  };
  for (const connection& c : peers_) {
    if (!c.open() || c.listed || c.blocked) continue;
    if (c.begun.slot != no_index || !c.control.rest().empty() || !c.stop_out.rest().empty()) return false;
    const bool others_end = begins_wait_ && timers_.armed(timer::partial_frames);
    if ((c.held && c.credit.ping_under_way()) || (c.waits_to_begin && others_end)) continue;
    if (any_due(c.direct) || std::any_of(c.letters.begin(), c.letters.end(), any_due)) return false;
    for (std::uint32_t i = c.first_subscription; i != no_index;
         i = router_.subscription_at(i).next_on_connection) {
      const subscription& s = router_.subscription_at(i);
      if (s.ready && (s.owes_last || any_due(s.waiting))) return false;
    }
  }
  return true;
}

// Each slot has as many references as there are live entries of queues, frames that a socket has the
// beginning of, and things that keep it; and as many frames and keepers as it says.
bool core::check_references() const noexcept {
  std::uint64_t queued = 0;
  std::uint64_t begun = 0;
  std::uint64_t kept = 0;
  const auto count = [&](const queue& in) {
    for (entry_id at = in.entries.head; at; at = entries_.after(at)) {
      if (slots_.alive(entries_.at(at))) queued += weight(entries_.at(at).index);
    }
  };
  for (const connection& c : peers_) {
    if (c.state == connection::phase::free) continue;
    if (c.begun.slot != no_index) begun += weight(c.begun.slot);
    count(c.direct);
    for (const queue& letters : c.letters) count(letters);
    for (std::uint32_t s = c.first_subscription; s != no_index;
         s = router_.subscription_at(s).next_on_connection)
      count(router_.subscription_at(s).waiting);
  }
  std::uint64_t references = 0;
  std::uint64_t own_begun = 0;
  std::uint64_t own_kept = 0;
  for (std::uint32_t i = 0; i < slots_.count(); ++i) {
    if (letters_.under_way(i)) kept += weight(i);
    references += weight(i) * slots_.references(i);
    own_begun += weight(i) * slots_.begun(i);
    own_kept += slots_.references(i) != 0 && slots_.kept(i) ? weight(i) : 0;
  }
  return references == queued + begun + kept && own_begun == begun && own_kept == kept;
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
