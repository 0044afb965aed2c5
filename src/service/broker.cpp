// SPDX-License-Identifier: Apache-2.0
#include "service/broker.hpp"

#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "service/names.hpp"
#include "wire/refusal.hpp"
#include "wire/text_out.hpp"
#include "json/decoder.hpp"
#include "json/utf8.hpp"

#include "service/service_limits.hpp"

namespace rowe::service {

// Whether anybody takes a message of this topic now. Counts why not.
bool broker::is_wanted_now(const topic& on) noexcept {
  if (on.inboxes.head) return true;
  if (!on.subscriptions.head) {
    state_.counts.add(counter::no_peer);
    return false;
  }
  for (subscription_id i = on.subscriptions.head; i; i = state_.subscriptions.at(i).next_on_topic) {
    const subscription& s = state_.subscriptions.at(i);
    if (!s.discards || state_.cycle.now >= s.next_due) return true;
  }
  state_.counts.add(counter::throttled, on.subscriptions.count);
  return false;
}

// A peer's value does not replace one that a handle of this process latched.
void broker::keep_latched(topic& on, slot_id slot, latch_owner owner) noexcept {
  if (owner.who == latch_owner::kind::peer && on.last.owner.who == latch_owner::kind::handle) return;
  const std::span<const char> body = message_store_.slots().body(slot);
  if (!state_.latches.store(on.last, {body.data(), body.size()}, owner, message_store_.slots().expires(slot)))
    return state_.counts.add(counter::not_latched);
  on.last.published = message_store_.slots().published(slot);
}

void broker::relay(connection& c, const wire::request& asked) noexcept {
  if (is_own_name(asked.topic) && c.ours == side::server)
    return refusals_.refuse(c, asked.id_raw, "publish: topics below /rowe/ are the endpoint's own");
  const topic_id index = state_.topics.find(asked.topic);
  if (!index) return state_.counts.add(counter::no_peer); // nobody has asked for it
  const published_by who{.peer = {c.id.index, c.id.generation}, .id_raw = asked.id_raw};
  if (state_.options.relay && c.ours == side::server) {
    const advertisement* const mine = advertisement_table_.find({c.id.index}, index);
    const bool latches = asked.latch || (mine != nullptr && mine->latched) || ROWE_MUTANT(latch_of_others);
    const auto keeper = latches ? latch_owner{latch_owner::kind::peer, c.id.index} : latch_owner{};
    return publish(
        index, state_.cycle.now, rt::never, keeper, [&](json::writer& into) { into.raw(asked.body_raw); },
        who);
  }
  topic& on = state_.topics.at(index);
  topic_rates::note(on, state_.cycle.now);
  on.bytes = asked.body_raw.size();
  if (!on.inboxes.head) return state_.counts.add(counter::no_peer);
  deliver(on, asked.body_raw, who);
}

void broker::deliver_latched(pair_index pair) noexcept {
  const slot_id last = subscription_queues_.compose_latched(state_.pair_rows[pair].topic);
  if (!last) return;
  deliver_to(pair, message_store_.slots().body(last), {});
  message_store_.release(last);
}

void broker::deliver_to(pair_index pair, std::span<const char> body, const published_by& who) noexcept {
  json::decoder::diagnosis why;
  const status done = local_delivery_.deliver(
      pair,
      {.stamped_ns = rt::nanoseconds_of(state_.cycle.now),
       .expires_ns = rt::nanoseconds_of(state_.options.inbound_expiry(state_.cycle.now)),
       .peer = who.peer},
      {body.data(), body.size()}, why);
  if (done) return;
  if (done.code() == errc::full) return state_.counts.add(counter::inbox_full);
  std::array<char, json::decoder::diagnosis::text_bytes_max> buffer;
  if (done.code() == errc::too_big) {
    state_.counts.add(counter::too_big);
    wire::text_out text{buffer};
    text.add("the message has ").add(done.error().value).add(" bytes, its subscriber takes ");
    text.add(done.error().limit).add(": raise the option `text_bytes_max`");
    return tell_undecodable(pair, who, text.text());
  }
  state_.counts.add(counter::undecodable);
  tell_undecodable(pair, who, why.text(buffer));
}

// A handle that subscribed cannot decode a message: two programs disagree about the type. A status tells the
// sender, and an event tells this process. Each is told at most once a second for a topic, because usually
// every message fails.
void broker::tell_undecodable(pair_index pair, const published_by& who, std::string_view why) noexcept {
  const topic_id topic = state_.pair_rows[pair].topic;
  rt::time_point& told_at = state_.pair_rows[state_.topics.at(topic).inboxes.head]
                                .undecodable_at; // one place for all handles on the topic
  connection* const c = state_.peers.find({who.peer.index, who.peer.generation});
  const bool first = told_at == rt::time_point{} || state_.cycle.now - told_at >= undecodable_period;
  const bool tells =
      c != nullptr && c->open() && c->ours == side::server && c->may_be_told(topic, state_.cycle.now);
  if (!first && !tells) return;
  std::array<char, wire::refusal::text_bytes_max> buffer;
  wire::text_out text{buffer};
  text.add("publish ").add_shortened(state_.topics.name(topic), event_topic_bytes_shown);
  text.add(": ").add_shortened(why, diagnosis_bytes_shown);
  if (tells) refusals_.send_status(*c, who.id_raw, text.text());
  if (!first) return;
  told_at = state_.cycle.now;
  const bool by_peer = c != nullptr && c->ours == side::server;
  state_.events.report(by_peer ? event::kind::refused_request : event::kind::warning,
                       c != nullptr ? c->peer() : std::string_view{},
                       json::utf8_prefix(text.text(), event_text_bytes_max),
                       "publish what the subscriber's type says, or set its option `fill_missing`");
}

} // namespace rowe::service
