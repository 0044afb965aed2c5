// SPDX-License-Identifier: Apache-2.0
#include "service/topics/broker.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/rate_limit.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"
#include "json/structs/decoder.hpp"
#include "json/text/utf8.hpp"

#include "service/base/service_limits.hpp"

namespace rowe::service {

// Whether anybody takes a message of this topic now. Counts why not.
bool broker::is_wanted_now(const topic& on) noexcept {
  if (on.inboxes.head || on.asked || on.is_recorded()) return true;
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

bool broker::keep_latched(topic_id index, slot_id slot, latch_owner owner, const published_by& who) noexcept {
  const std::span<const char> body = message_store_.slots().body(slot);
  const rt::time_point over = message_store_.slots().lifetime(slot).ttl_over();
  if (state_.latches.keep(state_.topics.at(index).latched, {body.data(), body.size()}, owner,
                          message_store_.slots().published(slot), over))
    return true;
  missed_.report_not_latched(index, body.size(), who);
  return false;
}

void broker::publish_whole(topic_id index, const whole_source& of, latch_owner latches,
                           const wire::body& text, const published_by& who) noexcept {
  topic& on = state_.topics.at(index);
  const bool keeps = latches.who != latch_owner::kind::nobody;
  const bool wants_json = of.value.others == nullptr || on.of_types != on.subscriptions.count || keeps ||
                          on.inboxes.head || on.aside != 0;
  if (!wants_json) return subscription_queues_.fan_out(index, {}, false, of);
  const auto write = [&](json::writer& out) { text.write(out); };
  const slot_id slot = outbox_.compose_message(index, of.published, of.expires, write);
  bool kept = false;
  if (slot) {
    on.bytes = message_store_.slots().body(slot).size();
    kept = keeps && keep_latched(index, slot, latches, who);
  }
  subscription_queues_.fan_out(index, slot, kept, of); // what is too long as JSON may fit
  if (!slot) return;
  const std::span<const char> body = message_store_.slots().body(slot);
  on.driven ? deliver_command(on, body, of.published, of.expires, who) : deliver(on, body, of.expires, who);
  if (on.aside != 0) keep_aside(index, body, of.published, of.expires);
  message_store_.release(slot);
}

[[gnu::noinline, gnu::cold]] void broker::keep_aside(topic_id index, std::span<const char> body,
                                                     rt::time_point published,
                                                     rt::time_point expires) noexcept {
  const topic& on = state_.topics.at(index);
  if (on.asked) state_.last_values.keep(on.asked, {body.data(), body.size()}, published, expires);
  (void)recorded_.keep(index, body, published); // who records has an audience of its own
}

// ---- long values

void broker::publish_long(topic_id index, rt::time_point published, rt::time_point expires,
                          latch_owner latches, text_id value, const published_by& who) noexcept {
  topic& on = state_.topics.at(index);
  topic_rates::note(on, published);
  if (expires < state_.cycle.now) return state_.counts.add(counter::expired);
  const bool keeps = latches.who != latch_owner::kind::nobody;
  if (!keeps && !is_wanted_now(on)) return;
  on.bytes = state_.chunks.bytes(value);
  bool kept = false;
  if (keeps) {
    const auto lifetime = message_lifetime::of_topic(expires, state_.cycle.now);
    kept = state_.latches.keep_long(on.latched, value, latches, published, lifetime.ttl_over());
    if (!kept) missed_.report_not_latched(index, on.bytes, who);
  }
  if (on.subscriptions.head) {
    if (const slot_id slot = long_outbox_.compose(index, published, expires, value)) {
      subscription_queues_.fan_out(index, slot, kept);
      message_store_.release(slot);
    } else {
      subscription_queues_.note_unsent(index);
    }
  }
  deliver_long(on, value, expires, who);
  if (on.asked) state_.last_values.keep_long(on.asked, value, published, expires);
  (void)recorded_.keep_long(index, value, published); // likewise
}

// Handles with a lease read structs, which are never long. So a peer's long command does not count.
void broker::deliver_long(const topic& on, text_id value, rt::time_point over,
                          const published_by& who) noexcept {
  for (pair_index i = on.inboxes.head; i; i = state_.pair_rows[i].next_inbox) {
    if (!on.driven || state_.pair_rows[i].driven || who.peer.generation == 0)
      (void)deliver_long_to(i, value, over, who);
  }
}

bool broker::deliver_long_to(pair_index pair, text_id value, rt::time_point over,
                             const published_by& who) noexcept {
  const bool always = over == state_.cycle.now; // as in deliver_to()
  const status done = long_deliveries_.begin(pair,
                                             {.stamped_ns = rt::nanoseconds_of(state_.cycle.now),
                                              .expires_ns = rt::nanoseconds_of(always ? rt::never : over),
                                              .peer = who.peer},
                                             value);
  if (!done && done.code() == errc::full) state_.counts.add(counter::inbox_full);
  if (!done && done.code() != errc::full) missed_.report_too_big(pair, done.error(), who);
  return static_cast<bool>(done);
}

// ---- relay

void broker::relay(connection& c, const wire::request& asked, text_id body) noexcept {
  if (is_own_name(asked.topic) && c.ours == side::server)
    return refusals_.refuse(c, asked.id_raw, "publish: topics below /rowe/ are the endpoint's own");
  if (is_own_service(asked.topic) && c.ours == side::server) [[unlikely]]
    return refusals_.refuse(c, asked.id_raw, "publish: the endpoint's own service has this name");
  const topic_id index = state_.topics.find(asked.topic);
  if (!index) return state_.counts.add(counter::no_peer); // nobody has asked for it
  if (state_.topics.at(index).own_alone != 0 && !state_.rights.publishes_beside(c, asked.topic)) [[unlikely]]
    return refusals_.refuse_own_topic(c, asked.id_raw, "publish", asked.topic);
  const advertisement* const mine =
      c.ours == side::server ? advertisement_table_.find({c.id.index}, index) : nullptr;
  rt::time_point over =
      ROWE_MUTANT(ttl_relayed) ? rt::never : rt::deadline_after(c.said_at, rt::duration{asked.ttl_ns});
  if (mine != nullptr && mine->lifespan_ns > 0)
    over = std::min(over, rt::deadline_after(c.said_at, rt::duration{mine->lifespan_ns}));
  if (over <= state_.cycle.now) return state_.counts.add(counter::expired); // it is over here
  published_by who{.peer = {c.id.index, c.id.generation}, .id_raw = asked.id_raw};
  if (state_.topics.at(index).driven) [[unlikely]] {
    if (body) return deliver_long(state_.topics.at(index), body, over, who);
    const auto passed = command_gate_.admit(c, asked, index);
    if (!passed) return;
    // As the lease, its time to live counts from when it was sent.
    if (over != rt::never && !ROWE_MUTANT(drive_ttl))
      over -= std::max(c.said_at - passed->sent, rt::duration{0});
    if (over <= state_.cycle.now) return state_.counts.add(counter::expired);
    over = std::min(over, passed->until);
    who.sent = passed->sent;
  }
  if (state_.options.relay && c.ours == side::server) {
    const bool latches = asked.latch || (mine != nullptr && mine->latched) || ROWE_MUTANT(latch_of_others);
    const auto keeper = latches ? latch_owner{latch_owner::kind::peer, c.id.index} : latch_owner{};
    if (body) return publish_long(index, state_.cycle.now, over, keeper, body, who);
    return publish(
        index, state_.cycle.now, over, keeper, [&](json::writer& into) { into.raw(asked.body_raw); }, who);
  }
  deliver_relayed(index, asked, body, over, who);
}

// In a client, or an endpoint that is no hub: to the handles of this process, and to who records.
void broker::deliver_relayed(topic_id index, const wire::request& asked, text_id body, rt::time_point over,
                             const published_by& who) noexcept {
  topic& on = state_.topics.at(index);
  topic_rates::note(on, state_.cycle.now);
  on.bytes = body ? state_.chunks.bytes(body) : asked.body_raw.size();
  const bool recorded = on.aside != 0 && (body ? recorded_.keep_long(index, body, state_.cycle.now)
                                               : recorded_.keep(index, asked.body_raw, state_.cycle.now));
  if (!on.inboxes.head) return recorded ? void() : state_.counts.add(counter::no_peer);
  if (!body)
    return on.driven ? deliver_command(on, asked.body_raw, state_.cycle.now, over, who)
                     : deliver(on, asked.body_raw, over, who);
  deliver_long(on, body, over, who);
}

void broker::deliver_latched(pair_index pair) noexcept {
  state_.latches.drop_expired(state_.topics.at(state_.pair_rows[pair].topic).latched, state_.cycle.now);
  state_.pair_rows[pair].latched_until = state_.latches.newest();
  go_on_with_latched(pair);
}

void broker::deliver_long_values() noexcept {
  std::size_t left = long_copy_bytes;
  while (const pair_index ended = long_deliveries_.advance(left)) go_on_with_latched(ended);
}

void broker::go_on_with_latched(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const latched_list& all = state_.topics.at(row.topic).latched;
  while (const latch_id i = state_.latches.next(all, row.latched_delivered, row.latched_until)) {
    row.latched_delivered = {i, state_.latches.at(i).number};
    const latched_value& kept = state_.latches.at(i).value;
    if (long_outbox_.is_long(kept)) {
      if (deliver_long_to(pair, kept.chunks, kept.expires, {})) return;
    } else if (const slot_id slot = long_outbox_.compose_latched(row.topic, kept)) {
      (void)deliver_to(pair, message_store_.slots().body(slot),
                       message_store_.slots().lifetime(slot).ttl_over(), {});
      message_store_.release(slot);
    }
  }
}

bool broker::deliver_to(pair_index pair, std::span<const char> body, rt::time_point over,
                        const published_by& who, std::int64_t turn) noexcept {
  // One that is sent now or never came in time, and has no time to live behind that.
  const bool always = over == state_.cycle.now || ROWE_MUTANT(ttl_at_handle);
  json::decoder::diagnosis why;
  const status done = local_delivery_.deliver(pair,
                                              {.stamped_ns = rt::nanoseconds_of(state_.cycle.now),
                                               .expires_ns = rt::nanoseconds_of(always ? rt::never : over),
                                               .peer = who.peer,
                                               .outcome_value = turn},
                                              {body.data(), body.size()}, why);
  if (!done) [[unlikely]]
    missed_.report(pair, who, done, why);
  return static_cast<bool>(done);
}

// A peer's command was admitted where it was read. Those of this process are here: they may have waited for
// this thread. What no handle with a lease can read does not count, so it gives nobody control. A handle
// without a lease on the same topic gets what counts, and all that this process publishes.
void broker::deliver_command(const topic& on, std::span<const char> body, rt::time_point published,
                             rt::time_point over, const published_by& who) noexcept {
  const bool own = who.peer.generation == 0;
  const topic_id topic = state_.pair_rows[on.inboxes.head].topic;
  const auto passed =
      own ? command_gate_.admit_own(topic, published) : std::optional{command_gate::passed{who.sent, over}};
  // One that is sent now or never has its lease behind that.
  const rt::time_point until = own && over == state_.cycle.now ? rt::never : over;
  bool counts = false;
  for (pair_index i = on.inboxes.head; i && passed; i = state_.pair_rows[i].next_inbox) {
    if (state_.pair_rows[i].driven)
      counts |= deliver_to(i, body, std::min(until, passed->until), who, state_.pairs[i].turn.number());
  }
  if (counts || (passed && ROWE_MUTANT(drive_unread))) command_gate_.count(topic, who.peer, passed->sent);
  if (!counts && !own) return;
  for (pair_index i = on.inboxes.head; i; i = state_.pair_rows[i].next_inbox) {
    if (!state_.pair_rows[i].driven) deliver_share(i, body, over, who);
  }
}

} // namespace rowe::service
