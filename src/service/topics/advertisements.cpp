// SPDX-License-Identifier: Apache-2.0
#include "service/topics/advertisements.hpp"

#include <algorithm>
#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {

void advertisements::forget(peer_index peer) noexcept {
  for (const topic_id i : state_.topics.topic_ids())
    if (!ROWE_MUTANT(latch_of_the_gone))
      topic_places_.forget_latched(i, {latch_owner::kind::peer, peer.value});
  while (!advertisement_table_.of(peer).empty()) {
    const topic_id topic = advertisement_table_.of(peer).back().topic;
    advertisement_table_.remove(peer, advertisement_table_.of(peer).back());
    state_.topics.changes().note_publishers(state_.topics.at(topic));
    topic_places_.let_go(topic);
  }
}

bool advertisements::refuse(connection& c, const wire::request& asked, std::string_view why,
                            std::string_view value) noexcept {
  wire::text_of<detail::diagnostic_bytes_max> text;
  text.add(asked.verb_text).add(": ").add(why).add_name(value, name_bytes_shown);
  refusals_.refuse(c, asked.id_raw, text.text());
  return false;
}

bool advertisements::advertise(connection& c, const wire::request& asked) noexcept {
  if (is_own_name(asked.topic)) return refuse(c, asked, "topics below /rowe/ are the endpoint's own");
  if (is_own_service(asked.topic))
    return refuse(c, asked, "the endpoint's own service has this name: ", asked.topic);
  if (const topic_id known = state_.topics.find(asked.topic);
      known && state_.topics.at(known).own_alone != 0 && !state_.rights.publishes_beside(c, asked.topic)) {
    refusals_.refuse_own_topic(c, asked.id_raw, asked.verb_text, asked.topic);
    return false;
  }
  const topic_id topic = topic_places_.topic_for(c, asked);
  if (!topic) return false;
  const bool typed = !state_.topics.type(topic).empty();
  const bool keeps_all = asked.latch && asked.what == wire::verb::advertise; // else this one message
  const peer_index peer{c.id.index};
  const auto mine = advertisement_table_.of(peer);
  advertisement* const known = advertisement_table_.find(peer, topic);
  topic_places_.hold(topic); // the advertisement's
  const auto lets_go = [&](bool done) {
    topic_places_.let_go(topic);
    return done;
  };
  if (!state_.topics.set_type(topic, asked.type))
    return lets_go(refuse(c, asked, "the topic exists with the type ", state_.topics.type(topic)));
  if (!typed) subscriptions_.report_other_types(topic);
  const bool renumbers = std::any_of(mine.begin(), mine.end(), [&](const advertisement& a) {
    return asked.tag != wire::no_number && (a.topic == topic) != (a.tag == asked.tag);
  });
  if (renumbers)
    return lets_go(
        refuse(c, asked, "this peer has this topic by another number, or another topic by this one"));
  if (known != nullptr) {
    known->latched = known->latched || keeps_all;
    if (asked.lifespan_ns > 0) known->lifespan_ns = asked.lifespan_ns;
    return lets_go(true);
  }
  if (advertisement_table_.full(peer)) {
    refusals_.refuse_limit(c, asked.id_raw, "topics advertised by one peer", advertisement_table_.places(),
                           "advertisements_per_connection_max");
    return lets_go(false);
  }
  advertisement_table_.add(
      peer, {.topic = topic, .lifespan_ns = asked.lifespan_ns, .latched = keeps_all, .tag = asked.tag});
  state_.topics.changes().note_publishers(state_.topics.at(topic));
  (void)state_.recordings.look(topic); // so that its first message finds who records it
  return true;
}

// A client's server relays what others publish.
bool advertisements::advertise_published(connection& c, const wire::request& asked) noexcept {
  if (c.ours == side::client) return true;
  const topic_id topic = state_.topics.find(asked.topic);
  const advertisement* const known = topic ? advertisement_table_.find({c.id.index}, topic) : nullptr;
  const bool says_new =
      known == nullptr || !(asked.type.empty() || same_type(state_.topics.type(topic), asked.type));
  if (!says_new || !state_.rights.allow(c, access::right::advertise, asked.topic)) return true;
  return advertise(c, asked);
}

void advertisements::unadvertise(connection& c, const wire::request& asked) noexcept {
  if (withdraw({c.id.index}, state_.topics.find(asked.topic))) return;
  state_.cycle.work_bytes +=
      state_.rights.policy().patterns(c.who.role, access::right::advertise) * pattern_work_bytes;
  if (state_.rights.allow(c, access::right::advertise, asked.topic))
    return refusals_.refuse(c, asked.id_raw, "unadvertise: this peer does not advertise the topic");
  // A status said that it may not advertise. Counted all the same, and too many may close it.
  state_.counts.add(counter::refused_requests);
  (void)refusals_.within_rate(c);
}

bool advertisements::withdraw(peer_index peer, topic_id topic) noexcept {
  advertisement* const one = topic ? advertisement_table_.find(peer, topic) : nullptr;
  if (one == nullptr) return false;
  advertisement_table_.remove(peer, *one);
  state_.topics.changes().note_publishers(state_.topics.at(topic));
  topic_places_.forget_latched(topic, {latch_owner::kind::peer, peer.value});
  topic_places_.let_go(topic);
  return true;
}

void advertisements::withdraw_others(topic_id topic) noexcept {
  const std::string_view name = state_.topics.name(topic);
  for (const peer_index peer : state_.peers.ids()) {
    connection& c = state_.peers[peer];
    if (!c.open() || state_.rights.publishes_beside(c, name)) continue;
    topic_places_.forget_latched(topic, {latch_owner::kind::peer, peer.value}); // also of who only publishes
    if (withdraw(peer, topic)) refusals_.refuse_own_topic(c, {}, "advertise", name);
  }
}

void advertisements::replace_type(topic_id topic, std::string_view type) noexcept {
  std::array<char, replaced_type_text_bytes_max> why;
  const std::string_view name = state_.topics.name(topic);
  const std::string_view before = state_.topics.type(topic);
  wire::text_out text{why};
  text.add("advertise: the topic ").add_name(name, replaced_name_bytes_shown).add(" has the type ");
  text.add_name(type, replaced_name_bytes_shown).add(" here now; it was advertised as ");
  text.add_name(before, replaced_name_bytes_shown);
  state_.topics.replace_type(topic, type);
  for (const peer_index peer : state_.peers.ids()) {
    topic_places_.forget_latched(topic, {latch_owner::kind::peer, peer.value}); // also of who only publishes
    // Never the topic's last holder: the handle holds it.
    if (state_.peers[peer].open() && withdraw(peer, topic))
      refusals_.refuse(state_.peers[peer], {}, text.text());
  }
}

// Frees a place for a topic of this process. Only topics without a handle of this process count. The peer
// that holds most of them loses one, and all holders of that topic get a report. Peers can have more than
// their share, because a handle may leave a topic to the peers that subscribed. False if there is no such
// topic.
bool advertisements::take_back_topic() noexcept {
  peer_index most{};
  std::uint32_t held_by_most = 0;
  for (const peer_index peer : state_.peers.ids()) {
    const std::uint32_t held = topic_places_.held_by(peer);
    if (held <= held_by_most) continue;
    most = peer;
    held_by_most = held;
  }
  if (!most || ROWE_MUTANT(made_up_topics)) return false;
  topic_id taken{};
  for (const advertisement& one : advertisement_table_.of(most)) {
    if (state_.topics.of_peers(one.topic)) taken = one.topic;
  }
  for (subscription_id i = state_.subscriptions.first_of(most); i;
       i = state_.subscriptions.at(i).next_on_peer) {
    if (state_.topics.of_peers(state_.subscriptions.at(i).topic)) taken = state_.subscriptions.at(i).topic;
  }
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("the topic ").add_name(state_.topics.name(taken), topic_bytes_shown);
  why.add(" is given up: this process needs its place (limit topics_max)");
  topic_places_.hold(taken); // until all know
  for (const peer_index peer : state_.peers.ids()) {
    const bool advertised = withdraw(peer, taken);
    const bool had = subscriptions_.end(peer, taken) || advertised;
    if (had && state_.peers[peer].open()) refusals_.refuse(state_.peers[peer], {}, why.text());
  }
  topic_places_.let_go(taken);
  return true;
}

// ---- checks

bool advertisements::check() const noexcept {
  for (const connection& c : state_.peers) {
    if (!c.open() || c.ours == side::client) continue;
    for (const advertisement& one : advertisement_table_.of({c.id.index})) {
      const bool spelled =
          state_.rights.apply_to(c) &&
          state_.rights.policy().spells(c.who.role, access::right::publish, state_.topics.name(one.topic));
      if (state_.topics.at(one.topic).own_alone != 0 && !spelled) return false;
    }
  }
  return true;
}

} // namespace rowe::service
