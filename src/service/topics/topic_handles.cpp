// SPDX-License-Identifier: Apache-2.0
#include "service/topics/topic_handles.hpp"

#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/topics/own_types.hpp"
#include "wire/codec/codec.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
// A peer may have taken the last place for a topic since set-up looked. So set-up is answered from here.
status topic_handles::attach(pair_index pair) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  pair_row& row = state_.pair_rows[pair];
  const topic_id topic_index = hold_topic(queues.name());
  if (!topic_index) return error{errc::too_many_topics, state_.topics.count(), state_.bounds().topics_max};
  bool typed = !state_.topics.type(topic_index).empty();
  if (!state_.topics.set_type(topic_index, queues.type()) && !is_own_name(queues.name())) {
    if (state_.topics.at(topic_index).own_holders > 1 || ROWE_MUTANT(pinned_type)) {
      report_conflict(topic_index, queues);
      topic_places_.let_go_own(topic_index);
      return errc::type_conflict;
    }
    advertisements_.replace_type(topic_index, queues.type());
    typed = false;
  }
  if (!typed) subscriptions_.report_other_types(topic_index);
  topic& on = state_.topics.at(topic_index);
  const bool reads = detail::subscribes(queues.kind);
  if (!has_other(topic_index, reads))
    (reads ? on.asked_unslashed : on.offered_unslashed) = !has_slash(queues.name());
  row.topic = topic_index;
  const status driven = queues.lease != rt::duration{} ? command_gate_.attach(pair) : status{};
  if (!driven) {
    row.topic = {};
    topic_places_.let_go_own(topic_index);
    return driven;
  }
  row.attached = true;
  state_.topics.set_schema(topic_index, schema_of(topic_index));
  if (reads) {
    if (queues.kind != detail::pair_kind::listen) on.inboxes.push_front(state_.pair_rows, pair);
    topic_rates_.begin_for(topic_index);
    if (on.inboxes.head == pair && !row.driven)
      broker_.deliver_latched(pair); // what was published once is no command
  } else {
    begin_publishing(pair);
  }
  note_holders(pair);
  announce_to_servers(pair, true);
  audiences_.update(topic_index);
  return {};
}

// Holds the topic from now on. None: there is no place, even after peers lost theirs.
topic_id topic_handles::hold_topic(std::string_view name) noexcept {
  topic_id topic = state_.topics.find_or_add(name);
  if (!topic && advertisements_.take_back_topic()) topic = state_.topics.find_or_add(name);
  if (topic) state_.topics.hold_as_own(topic);
  return topic;
}

void topic_handles::begin_publishing(pair_index pair) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const std::size_t longest = queues.kind == detail::pair_kind::publish_text
                                  ? queues.service.out.memory.bytes_max
                                  : queues.encoder->bytes_max();
  state_.pair_rows[pair].long_texts =
      state_.chunks.text_bytes_max() != 0 && longest > state_.bounds().message_bytes_max;
  topic& on = state_.topics.at(state_.pair_rows[pair].topic);
  if (!queues.shared && on.own_alone++ == 0) advertisements_.withdraw_others(state_.pair_rows[pair].topic);
  on.keep = queues.keep;
  on.priority = queues.priority;
  // An early value of a predicted topic waits. So a topic is not predicted if such a value would expire
  // first.
  const bool outlives_rest =
      queues.ttl >= std::min(queues.period, publish_predictor::rest_max) || queues.ttl == rt::duration{0};
  if (state_.options.predicts && queues.period > rt::duration{0} && outlives_rest)
    publish_predictor_.begin(pair, queues.period, queues.priority);
  subscriptions_.merge_requests(state_.pair_rows[pair].topic);
}

void topic_handles::detach(pair_index pair) noexcept {
  pair_row& row = state_.pair_rows[pair];
  const topic_id topic = row.topic;
  command_gate_.detach(pair);
  if (state_.pairs[pair].kind == detail::pair_kind::listen) {
    // it has no inbox
  } else if (detail::subscribes(state_.pairs[pair].kind)) {
    state_.topics.at(topic).inboxes.erase(state_.pair_rows, pair);
  } else if (!state_.pairs[pair].shared) {
    --state_.topics.at(topic).own_alone;
  }
  note_holders(pair);
  announce_to_servers(pair, false);
  audiences_.leave(pair);
  publish_predictor_.end(pair);
  row = {.generation = row.generation};
  state_.topics.set_schema(topic, schema_of(topic));
  topic_places_.forget_latched(topic, {latch_owner::kind::handle, pair.value});
  audiences_.update(topic);
  topic_places_.let_go_own(topic);
}

void topic_handles::note_holders(pair_index pair) noexcept {
  topic& of = state_.topics.at(state_.pair_rows[pair].topic);
  topic_changes& changes = state_.topics.changes();
  detail::subscribes(state_.pairs[pair].kind) ? changes.note_subscribers(of) : changes.note_publishers(of);
}

// Set-up gets only an error code, which cannot name the types. An event does.
void topic_handles::report_conflict(topic_id topic, const detail::queue_pair& asked) noexcept {
  wire::text_of<event_text_bytes_max> what;
  what.add(detail::subscribes(asked.kind) ? "subscribe " : "advertise ")
      .add_name(state_.topics.name(topic), event_topic_bytes_shown);
  what.add(": the topic has the type ").add_name(state_.topics.type(topic), event_type_bytes_shown);
  what.add(", not ").add_name(asked.type(), event_type_bytes_shown);
  state_.events.report(event::kind::warning, {}, what.text(),
                       "use the same type, or leave the option `type` empty");
}

// Whether an attached handle reads the topic, or publishes on it.
bool topic_handles::has_other(topic_id topic, bool that_reads) const noexcept {
  for (const pair_index i : state_.pairs.ids()) {
    if (state_.pair_rows[i].attached && state_.pair_rows[i].topic == topic &&
        detail::subscribes(state_.pairs[i].kind) == that_reads)
      return true;
  }
  return false;
}

// What the endpoint says of its own topic; else what the publisher that came first says of its messages; else
// what a subscriber expects.
const schema_description* topic_handles::schema_of(topic_id topic) const noexcept {
  const schema_description* found = nullptr;
  if (state_.options.ours == side::server) {
    if (const own_topic_type* own = own_type_of_topic(state_.topics.name(topic))) return own->message;
  }
  std::uint64_t order = 0;
  bool published = false;
  for (const pair_index i : state_.pairs.ids()) {
    const pair_row& row = state_.pair_rows[i];
    if (!row.attached || row.topic != topic) continue;
    const bool publishes = detail::publishes(state_.pairs[i].kind);
    const schema_description* its = publishes ? state_.pairs[i].encoded : state_.pairs[i].decoded;
    if (its == nullptr) continue;
    if (found != nullptr && (published != publishes ? published : order < row.order)) continue;
    found = its;
    order = row.order;
    published = publishes;
  }
  return found;
}

// ---- budget

// Messages that are written together cost one system call. But no message may be lost because it was taken
// too early. So more are taken only if every subscriber reads and has room for them, and if all handles
// together leave half of the slots and of the queue entries. Values that need large slots are never taken
// beyond the usual budget: these slots are few.
std::size_t topic_handles::ample_budget(pair_index pair, std::size_t taken) const noexcept {
  const topic& on = state_.topics.at(state_.pair_rows[pair].topic);
  const slot_pool& slots = message_store_.slots();
  if (on.inboxes.head || on.bytes > slots.bytes_of(slot_class::small) / 2) return 0;
  const std::size_t halves = 2 * std::max<std::size_t>(audiences_.listened(), 1);
  std::size_t more = std::min<std::size_t>(values_per_cycle_ample, slots.count() / halves);
  more = std::min<std::size_t>(more, (state_.bounds().queued_max - outbox_.entries().in_use()) /
                                         (halves * std::max<std::size_t>(on.subscriptions.count, 1)));
  more -= std::min(more, taken);
  for (subscription_id i = on.subscriptions.head; i && more != 0;
       i = state_.subscriptions.at(i).next_on_topic) {
    const subscription& s = state_.subscriptions.at(i);
    if (outbox_.of(s.peer).backpressured()) return 0;
    more = std::min<std::size_t>(more, s.depth - std::min(s.depth, s.pending.count));
  }
  return more;
}

queue* topic_handles::queue_to_server(pair_index pair) noexcept {
  for (connection& c : state_.peers) {
    if (!c.open() || c.ours != side::client) continue;
    const subscription_id s = state_.subscriptions.find(state_.pair_rows[pair].topic, {c.id.index});
    if (s) return &state_.subscriptions.at(s).pending;
  }
  return nullptr;
}

// ---- client

void topic_handles::announce_to_servers(pair_index pair, bool begins) noexcept {
  for (connection& c : state_.peers) {
    if (c.open() && c.ours == side::client) announce(c, pair, begins);
  }
}

// What the other handles of a topic have already announced, or still use.
topic_handles::others topic_handles::others_of(pair_index pair) const noexcept {
  others found;
  for (const pair_index i : state_.pairs.ids()) {
    // A pair that is not attached must not be read: set-up may be building it.
    if (i == pair || !state_.pair_rows[i].attached ||
        state_.pair_rows[i].topic != state_.pair_rows[pair].topic)
      continue;
    if (detail::subscribes(state_.pairs[i].kind) != detail::subscribes(state_.pairs[pair].kind)) continue;
    found.any = true;
    found.any_before |= i.value < pair.value;
    found.throttle = std::min(found.throttle, state_.pairs[i].throttle);
  }
  return found;
}

// The first handle of a topic announces it, and the last one takes that back. One that wants more messages
// than the others has the subscription changed, when it comes and when it goes.
void topic_handles::announce(connection& c, pair_index pair, bool begins) noexcept {
  if (!c.protocol->can.topics) return;
  const detail::queue_pair& queues = state_.pairs[pair];
  const others besides = others_of(pair);
  const bool speaks = begins ? !besides.any_before : !besides.any;
  const bool changes = besides.any && queues.throttle < besides.throttle;
  if (!speaks && !changes) return;
  const rt::duration throttle = !besides.any ? queues.throttle
                                : begins     ? std::min(queues.throttle, besides.throttle)
                                             : besides.throttle;
  const topic_id topic_index = state_.pair_rows[pair].topic;
  const topic& on = state_.topics.at(topic_index);
  std::array<char, wire::announcement_bytes_max> buffer;
  json::writer text{buffer};
  const bool reads = detail::subscribes(queues.kind);
  const bool unslashed = reads ? on.asked_unslashed : on.offered_unslashed;
  const std::string_view name = state_.topics.name(topic_index).substr(unslashed ? 1 : 0);
  const wire::announcement what{.name = name,
                                .type = queues.type(),
                                .latch = queues.latched,
                                .begins = begins || besides.any,
                                .throttle_ms =
                                    std::chrono::duration_cast<std::chrono::milliseconds>(throttle).count()};
  const auto kind = reads ? c.protocol->topics.write_subscription(text, what)
                          : c.protocol->topics.write_advertisement(text, what);
  outbox_.reply_written({c.id.index}, text, kind);
  if (reads) return;
  begins ? subscriptions_.subscribe_server(c, topic_index, unslashed)
         : subscriptions_.unsubscribe_server(c, topic_index);
}

} // namespace rowe::service
