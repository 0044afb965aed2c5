// SPDX-License-Identifier: Apache-2.0
#include "service/topics/subscriptions.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"
#include "json/structs/encoder.hpp"
#include "json/structs/times.hpp"

namespace rowe::service {
namespace {

subscribe_request request_of(const wire::request& asked, wire::codec_id codec, std::uint64_t id) noexcept {
  return {.id_hash = id,
          .throttle = std::chrono::milliseconds{asked.throttle_ms},
          .queue_length =
              static_cast<std::uint32_t>(std::clamp<std::int64_t>(asked.queue_length, 0, UINT32_MAX)),
          .codec = codec};
}

// The index of the request with this id, or the index behind the last one.
std::uint8_t place_of(const subscription& s, std::uint64_t id) noexcept {
  std::uint8_t place = 0;
  while (place < s.request_count && s.requests[place].id_hash != id) ++place;
  return place;
}

} // namespace

subscriptions::subscriptions(rt::arena& memory, const subscriptions_needs& parts) noexcept
    : subscriptions_needs{parts},
      claims_{state_.bounds().subscriptions_max, state_.claimants()},
      ids_{memory, state_.bounds(), state_.claimants()} {}

void subscriptions::forget(peer_index peer) noexcept {
  while (const subscription_id s = state_.subscriptions.first_of(peer)) remove(peer, s);
}

void subscriptions::subscribe(connection& c, const wire::request& asked) noexcept {
  const topic_id topic = topic_places_.topic_for(c, asked);
  if (!topic) return;
  subscription_id index = state_.subscriptions.find(topic, {c.id.index}, !has_slash(asked.topic));
  const bool fresh = !index;
  if (fresh) index = add(c, asked, topic);
  if (!index) return;
  subscription& s = state_.subscriptions.at(index);
  if (s.tag != asked.tag)
    return refusals_.refuse(c, asked.id_raw,
                            "subscribe: this peer subscribes to the topic already, by another number");
  const std::uint64_t id = hash_of(asked.id_raw);
  const std::uint8_t place = place_of(s, id);
  if (place == s.requests.size()) {
    return refusals_.refuse(c, asked.id_raw,
                            "subscribe: one peer may hold 4 subscriptions to a topic, by their ids");
  }
  if (place == s.request_count) ++s.request_count;
  s.requests[place] = request_of(asked, codec_for(topic, asked), id);
  subscription_queues_.merge_requests(index);
  audiences_.update(topic);
  topic_rates_.begin_for(topic);
  if (asked.lifespan_ns > 0) s.lifespan_ns = asked.lifespan_ns;
  if (asked.deadline_ns > 0) watch_deadline(index, asked);
  if (s.whole) [[unlikely]]
    warn_without_type(c, asked.id_raw, s);
  s.type_hash = hash_of_type(asked.type);
  if (fresh && !state_.topics.at(topic).latched.empty()) subscription_queues_.schedule_latched(index);
  const std::string_view type = state_.topics.type(topic);
  if (!type.empty() && !asked.type.empty() && !same_type(asked.type, type))
    report_other_type(c, asked.id_raw, topic, asked.type);
}

// The codec of the messages that the peer is sent. If the topic's type becomes another one, the topic gets
// another number, and whoever knows it by the old one subscribes anew.
wire::codec_id subscriptions::codec_for(topic_id topic, const wire::request& asked) const noexcept {
  const wire::codec_id codec = asked.messages_in == wire::same_codec ? asked.codec : asked.messages_in;
  const wire::codec_id of_times = state_.seams.protocols.of(codec).of_times();
  if (of_times == wire::same_codec) return codec;
  const schema_description* const schema = state_.topics.at(topic).schema;
  return schema != nullptr && json::holds_time(*schema) ? of_times : codec;
}

// ---- deadlines

// The state of the stop comes by itself, however often it must.
void subscriptions::watch_deadline(subscription_id index, const wire::request& asked) noexcept {
  subscription& s = state_.subscriptions.at(index);
  if (state_.topics.name(s.topic) == wire::stop_state_name) return;
  s.deadline_ns = std::max<std::int64_t>(asked.deadline_ns, deadline_min.count());
  s.watched_at = state_.cycle.now;
  s.missed = false;
  ids_.keep(s.deadline_of, s.peer, asked.id_raw);
  state_.due.arm(deadline_id{index.value}, rt::deadline_after(s.watched_at, rt::duration{s.deadline_ns}));
}

// Each period without a message is counted. The first one is reported to the peer, and the next one after a
// message has come.
void subscriptions::check_deadline(subscription_id index) noexcept {
  subscription& s = state_.subscriptions.at(index);
  const rt::duration period{s.deadline_ns};
  const rt::time_point came = state_.topics.at(s.topic).newest_at;
  if (came > s.watched_at) {
    s.watched_at = came;
    s.missed = false;
  }
  const rt::time_point over = rt::deadline_after(s.watched_at, period);
  if (state_.cycle.now < over) return state_.due.arm(deadline_id{index.value}, over);
  state_.counts.add(counter::deadlines_missed);
  s.watched_at = state_.cycle.now;
  state_.due.arm(deadline_id{index.value}, rt::deadline_after(s.watched_at, period));
  connection& c = state_.peers[s.peer];
  if (std::exchange(s.missed, true) || !c.open() || !c.may_report(s.topic, state_.cycle.now)) return;
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("subscribe ").add_name(state_.topics.name(s.topic), topic_bytes_shown);
  why.add(": no message came within its deadline of ");
  why.add(std::chrono::duration_cast<std::chrono::milliseconds>(period).count()).add(" ms");
  std::array<char, call_id_bytes_max> id;
  refusals_.warn(c, ids_.read(s.deadline_of, id), why.text(), wire::severity::warning);
}

// The codec that it asked for can write structs only in the form that it asked for, and none is published.
void subscriptions::warn_without_type(connection& c, std::string_view id_raw,
                                      const subscription& s) noexcept {
  const std::string_view lacks = state_.seams.protocols.of(s.codec).lacks_without_type();
  if (lacks.empty()) return;
  for (const pair_index pair : state_.pairs.ids()) {
    const detail::queue_pair& one = state_.pairs[pair];
    if (state_.pair_rows[pair].attached && state_.pair_rows[pair].topic == s.topic &&
        one.other_encoders != nullptr && one.other_encoders->ros1)
      return;
  }
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("subscribe ").add_name(state_.topics.name(s.topic), topic_bytes_shown).add(": ").add(lacks);
  refusals_.warn(c, id_raw, why.text(), wire::severity::warning);
}

// Adds a subscription. None: the peer may not have one more, and a status said so.
subscription_id subscriptions::add(connection& c, const wire::request& asked, topic_id topic) noexcept {
  const peer_index peer{c.id.index};
  std::uint32_t held = state_.subscriptions.count_of(peer);
  subscription_id index{};
  topic_places_.hold(topic); // until the subscription does
  const bool too_many = held >= state_.bounds().subscriptions_per_connection_max;
  const std::uint32_t left = state_.bounds().subscriptions_max - state_.subscriptions.count();
  const bool may = claims_.may_take(held, left);
  if (!too_many && may) index = state_.subscriptions.add(topic, {c.id.index});
  topic_places_.let_go(topic);
  if (too_many) {
    refusals_.refuse_limit(c, asked.id_raw, "subscriptions of one peer",
                           state_.bounds().subscriptions_per_connection_max,
                           "subscriptions_per_connection_max");
  } else if (!index) {
    refusals_.refuse_share(c, asked,
                           {.what = "subscriptions",
                            .held = held,
                            .left = left,
                            .for_peers = state_.bounds().subscriptions_max,
                            .kept = claims_.kept(),
                            .option = "subscriptions_max"});
  } else {
    claims_.take(held);
    state_.subscriptions.set_form(state_.subscriptions.at(index), state_.seams.protocols.of(asked.codec),
                                  asked.tag, !has_slash(asked.topic));
  }
  return index;
}

void subscriptions::unsubscribe(connection& c, const wire::request& asked) noexcept {
  const peer_index peer{c.id.index};
  const topic_id topic = state_.topics.find(asked.topic);
  subscription_id index{};
  if (topic) {
    index = state_.subscriptions.find(topic, peer, !has_slash(asked.topic));
    if (!index) index = state_.subscriptions.find(topic, peer); // the other spelling
  }
  if (!index) return refusals_.refuse(c, asked.id_raw, "unsubscribe: there is no such subscription");
  subscription& s = state_.subscriptions.at(index);
  if (!asked.id_raw.empty()) {
    const std::uint8_t place = place_of(s, hash_of(asked.id_raw));
    if (place == s.request_count)
      return refusals_.refuse(c, asked.id_raw, "unsubscribe: there is no subscription with this id");
    s.requests[place] = s.requests[--s.request_count];
    if (s.request_count > 0) return subscription_queues_.merge_requests(index);
  }
  remove(peer, index);
}

void subscriptions::remove(peer_index peer, subscription_id index) noexcept {
  const topic_id topic = state_.subscriptions.at(index).topic;
  ids_.drop(state_.subscriptions.at(index).deadline_of, peer);
  state_.due.disarm(deadline_id{index.value});
  subscription_queues_.drop(index);
  std::uint32_t held = state_.subscriptions.count_of(peer);
  state_.subscriptions.remove(index);
  claims_.give_back(held);
  audiences_.update(topic);
  topic_places_.let_go(topic);
}

void subscriptions::merge_requests(topic_id topic) noexcept {
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i;
       i = state_.subscriptions.at(i).next_on_topic)
    subscription_queues_.merge_requests(i);
}

void subscriptions::subscribe_server(connection& c, topic_id topic, bool unslashed) noexcept {
  std::uint32_t held = state_.subscriptions.count_of({c.id.index});
  subscription_id index = state_.subscriptions.find(topic, {c.id.index});
  const bool fresh = !index;
  if (fresh) {
    index = state_.subscriptions.add(topic, {c.id.index});
    if (!index) return state_.counts.add(counter::no_slot);
    claims_.take(held);
    state_.subscriptions.set_form(state_.subscriptions.at(index), c.protocol->topics, wire::no_number,
                                  unslashed);
  }
  subscription_queues_.merge_requests(index);
  audiences_.update(topic);
  // A server retains nothing of a connection that is gone.
  if (fresh && !state_.topics.at(topic).latched.empty()) subscription_queues_.schedule_latched(index);
}

void subscriptions::unsubscribe_server(connection& c, topic_id topic) noexcept {
  const subscription_id index = state_.subscriptions.find(topic, {c.id.index});
  if (index) remove({c.id.index}, index);
  audiences_.update(topic);
}

// The peer gets the topic's messages nevertheless, and decides whether it can use them.
void subscriptions::report_other_type(connection& c, std::string_view id_raw, topic_id topic,
                                      std::string_view asked) noexcept {
  wire::text_of<wire::refusal::text_bytes_max> why;
  why.add("subscribe ").add_name(state_.topics.name(topic), topic_bytes_shown);
  why.add(": the topic has the type ");
  why.add_name(state_.topics.type(topic), type_bytes_shown);
  if (!asked.empty()) {
    why.add(", not ").add_name(asked, type_bytes_shown);
  } else {
    why.add(", not the one that was asked for");
  }
  refusals_.warn(c, id_raw, why.text());
}

void subscriptions::report_other_types(topic_id topic) noexcept {
  const std::uint32_t type = hash_of_type(state_.topics.type(topic));
  if (type == 0) return;
  for (subscription_id i = state_.topics.at(topic).subscriptions.head; i;
       i = state_.subscriptions.at(i).next_on_topic) {
    const subscription& s = state_.subscriptions.at(i);
    if (s.type_hash != 0 && s.type_hash != type) report_other_type(state_.peers[s.peer], {}, topic, {});
  }
}

bool subscriptions::end(peer_index peer, topic_id topic) noexcept {
  bool had = false;
  for (subscription_id s; (s = state_.subscriptions.find(topic, peer)); had = true) remove(peer, s);
  return had;
}

bool subscriptions::check() const noexcept {
  std::uint32_t unclaimed = claims_.connections() * claims_.claim();
  for (const peer_index peer : state_.peers.ids()) {
    std::uint32_t subscribed = 0;
    for (subscription_id s = state_.subscriptions.first_of(peer); s;
         s = state_.subscriptions.at(s).next_on_peer) {
      if (state_.subscriptions.at(s).peer != peer) return false;
      ++subscribed;
    }
    const bool free = state_.peers[peer].state == connection::phase::free;
    if (subscribed != state_.subscriptions.count_of(peer) || (free && subscribed != 0)) return false;
    if (!free) unclaimed -= claims_.claim() - claims_.kept_for(subscribed);
  }
  return unclaimed == claims_.unclaimed() && ids_.check();
}

} // namespace rowe::service
