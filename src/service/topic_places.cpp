// SPDX-License-Identifier: Apache-2.0
#include "service/topic_places.hpp"

#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/check_sum.hpp"

namespace rowe::service {
namespace {

// Looking at one topic of a peer takes as long as composing so many bytes.
constexpr std::size_t held_topic_work_bytes = 4;

} // namespace

std::uint32_t topic_places::held_by(peer_index peer) const noexcept {
  std::uint32_t count = 0;
  for (subscription_id i = topics_.first_subscription(peer); i; i = topics_.subscription_at(i).next_on_peer)
    count += topics_.of_peers(topics_.subscription_at(i).topic);
  for (const advertisement& one : advertised_.of(peer)) count += topics_.of_peers(one.topic);
  return count;
}

// A topic that this process holds costs no place.
topic_id topic_places::topic_for(connection& c, const wire::request& asked) noexcept {
  const topic_id known = topics_.find(asked.topic);
  if (known && (!topics_.of_peers(known) || holds({c.id.index}, known))) return known;
  const std::uint32_t share = share_of_peers(bounds_.topics_max, bounds_.lanes_max + own_topics);
  const std::uint32_t left = left_of(share, topics_.topics_of_peers());
  const std::uint32_t held = held_by({c.id.index});
  const claims all = claims_now(share);
  // A topic that exists takes no new place; but the peer may become its last holder.
  const bool may = all.may_take(held, left) || (known && held < all.claim());
  const topic_id found = may || ROWE_MUTANT(made_up_topics) ? topics_.find_or_add(asked.topic) : topic_id{};
  if (!found) {
    refusals_.refuse_share(c, asked,
                           {.what = "topics",
                            .held = held,
                            .left = left,
                            .for_peers = share,
                            .kept = all.kept(),
                            .option = "topics_max"});
  }
  return found;
}

// Computed anew each time, because what counts for peers also changes when handles of this process come and
// go. The place of a topic is charged to one of its holders.
claims topic_places::claims_now(std::uint32_t share) noexcept {
  claims all{share, claimants_};
  ++charged_;
  for (const peer_index peer : peers_.ids()) {
    const auto mine = advertised_.of(peer);
    cycle_.work_bytes += held_topic_work_bytes * (1 + topics_.subscriptions_of(peer) + mine.size());
    if (peers_[peer].state == connection::phase::free) continue;
    std::uint32_t charged = 0;
    const auto charge = [&](topic_id index) {
      topic& on = topics_.at(index);
      if (topics_.of_peers(index) && std::exchange(on.charged_in, charged_) != charged_) all.take(charged);
    };
    for (subscription_id i = topics_.first_subscription(peer); i; i = topics_.subscription_at(i).next_on_peer)
      charge(topics_.subscription_at(i).topic);
    for (const advertisement& one : mine) charge(one.topic);
  }
  return all;
}

bool topic_places::check(std::uint64_t own_held) const noexcept {
  std::uint64_t held = 0;
  for (const peer_index peer : peers_.ids()) {
    for (const advertisement& a : advertised_.of(peer)) held += weight(a.topic);
    for (subscription_id s = topics_.first_subscription(peer); s; s = topics_.subscription_at(s).next_on_peer)
      held += weight(topics_.subscription_at(s).topic);
    const bool free = peers_[peer].state == connection::phase::free;
    if (free && (!advertised_.of(peer).empty() || latches_.held_by(peer) != 0)) return false;
  }
  std::uint64_t holders = 0;
  std::uint64_t own_holders = 0;
  std::uint32_t blocks = 0;
  for (const topic_id i : topics_.topic_ids()) {
    const topic& t = topics_.at(i);
    holders += weight(i) * t.holders;
    own_holders += weight(i) * t.own_holders;
    blocks += t.last.blocks;
    if (t.holders == 0 && !t.last.empty()) return false;
  }
  return holders == held + own_held && own_holders == own_held && blocks == latches_.in_use();
}

} // namespace rowe::service
