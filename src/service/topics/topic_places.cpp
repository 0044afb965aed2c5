// SPDX-License-Identifier: Apache-2.0
#include "service/topics/topic_places.hpp"

#include <rowe/detail/mutation_points.hpp>

#include "service/base/check_sum.hpp"
#include "service/base/service_limits.hpp"

namespace rowe::service {

std::uint32_t topic_places::held_by(peer_index peer) const noexcept {
  std::uint32_t count = 0;
  for (subscription_id i = state_.subscriptions.first_of(peer); i;
       i = state_.subscriptions.at(i).next_on_peer)
    count += state_.topics.of_peers(state_.subscriptions.at(i).topic);
  for (const advertisement& one : advertisement_table_.of(peer)) count += state_.topics.of_peers(one.topic);
  return count;
}

// A topic that this process holds costs no place.
topic_id topic_places::topic_for(connection& c, const wire::request& asked) noexcept {
  const topic_id known = state_.topics.find(asked.topic);
  if (known && (!state_.topics.of_peers(known) || holds({c.id.index}, known))) return known;
  const std::uint32_t share =
      share_of_peers(state_.bounds().topics_max, state_.bounds().handles_max + endpoint_topics);
  const std::uint32_t left = left_of(share, state_.topics.topics_of_peers());
  const std::uint32_t held = held_by({c.id.index});
  const claims all = claims_now(share);
  // A topic that exists takes no new place; but the peer may become its last holder.
  const bool may = all.may_take(held, left) || (known && held < all.claim());
  const topic_id found =
      may || ROWE_MUTANT(made_up_topics) ? state_.topics.find_or_add(asked.topic) : topic_id{};
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
  claims all{share, state_.claimants()};
  ++charged_;
  for (const peer_index peer : state_.peers.ids()) {
    const auto mine = advertisement_table_.of(peer);
    state_.cycle.work_bytes +=
        held_topic_work_bytes * (1 + state_.subscriptions.count_of(peer) + mine.size());
    if (state_.peers[peer].state == connection::phase::free) continue;
    std::uint32_t charged = 0;
    const auto charge = [&](topic_id index) {
      topic& on = state_.topics.at(index);
      if (state_.topics.of_peers(index) && std::exchange(on.charged_in, charged_) != charged_)
        all.take(charged);
    };
    for (subscription_id i = state_.subscriptions.first_of(peer); i;
         i = state_.subscriptions.at(i).next_on_peer)
      charge(state_.subscriptions.at(i).topic);
    for (const advertisement& one : mine) charge(one.topic);
  }
  return all;
}

bool topic_places::check(std::uint64_t own_held) const noexcept {
  std::uint64_t held = 0;
  for (const peer_index peer : state_.peers.ids()) {
    for (const advertisement& a : advertisement_table_.of(peer)) held += weight(a.topic);
    for (subscription_id s = state_.subscriptions.first_of(peer); s;
         s = state_.subscriptions.at(s).next_on_peer)
      held += weight(state_.subscriptions.at(s).topic);
    const bool free = state_.peers[peer].state == connection::phase::free;
    const latch_store& kept = state_.latches.texts();
    const bool keeps = kept.held_by(peer) != 0 || kept.chunks_held_by(peer) != 0;
    if (free && (!advertisement_table_.of(peer).empty() || keeps)) return false;
  }
  std::uint64_t holders = 0;
  std::uint64_t own_holders = 0;
  std::uint32_t blocks = 0;
  std::uint32_t chunks = 0;
  std::uint32_t asked = 0;
  std::uint32_t values = 0;
  for (const topic_id i : state_.topics.topic_ids()) {
    const topic& t = state_.topics.at(i);
    holders += weight(i) * t.holders;
    own_holders += weight(i) * t.own_holders;
    for (latch_id v = t.latched.head; v; v = state_.latches.at(v).next) {
      const latched_value& value = state_.latches.at(v).value;
      (value.chunks ? chunks : blocks) += value.blocks;
      ++values;
    }
    if (t.holders == 0 && (!t.latched.empty() || t.asked)) return false;
    if (t.asked && state_.last_values.topic_of(t.asked) != i) return false;
    if (static_cast<bool>(t.asked) != ((t.aside & topic::asked_over_http) != 0)) return false;
    asked += static_cast<bool>(t.asked);
  }
  return holders == held + own_held && own_holders == own_held && values == state_.latches.count() &&
         blocks == state_.latches.texts().in_use() && chunks == state_.latches.texts().chunks_in_use() &&
         asked == state_.last_values.in_use() && state_.last_values.check();
}

} // namespace rowe::service
