// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_state_feed.hpp"

#include <algorithm>
#include <cstring>

#include "service/stop/stop_gate.hpp"
#include "service/topics/topic_rates.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {

stop_state_feed::stop_state_feed(rt::arena& memory, const stop_state_feed_needs& parts) noexcept
    : stop_state_feed_needs{parts},
      shown_at_{memory.carve<rt::time_point>(state_.bounds().connections_max)} {}

void stop_state_feed::show_if_due() noexcept {
  const topic& on = state_.topics.at(topic_);
  const bool changed = version_shown_ != stop_rules_.version();
  // New subscribers get it. So do new peers, which may take it without a subscription.
  const bool came = audience_seen_ != on.audience_changes || opened_seen_ != state_.peers.opened();
  if (!changed && !came && state_.cycle.now < due_) return;
  version_shown_ = stop_rules_.version();
  audience_seen_ = on.audience_changes;
  opened_seen_ = state_.peers.opened();
  message state;
  due_ = rt::never;
  show_subscribers(state, changed);
  if (state_.seams.protocols.any(&wire::capabilities::state_as_message)) show_takers_of_messages(changed);
  // In a client, handles that subscribe to the topic get the server's state, and never both in turn.
  const bool of_server =
      state_.options.ours == side::client && state_.seams.protocols.any(&wire::capabilities::topics);
  if ((on.inboxes.head || on.is_recorded()) && !of_server) show_handles(state, changed);
}

void stop_state_feed::show_subscribers(message& state, bool changed) noexcept {
  const rt::duration slow = stop_ticks_for_others * state_.options.stop.tick;
  const rt::duration early =
      state_.options.stop.tick / 2; // those that are due soon get it together with one that is due
  for (subscription_id i = state_.topics.at(topic_).subscriptions.head; i;
       i = state_.subscriptions.at(i).next_on_topic) {
    const subscription& to = state_.subscriptions.at(i);
    const connection& c = state_.peers[to.peer];
    // There is room for one state: a peer that subscribed by both names gets the one with the slash.
    if (to.unslashed && state_.subscriptions.find(topic_, to.peer, false)) continue;
    const bool guards = stop_rules_.guards_include(key_of(c.id));
    const rt::duration period = guards ? state_.options.stop.tick : slow;
    rt::time_point& shown_at = shown_at_[to.peer];
    if (changed || state_.cycle.now - shown_at >= (guards ? period : period - early)) {
      shown_at = state_.cycle.now;
      if (c.open()) {
        write(state);
        send(to, state);
      }
    }
    due_ = std::min(due_, shown_at + period);
  }
}

void stop_state_feed::write(message& state) noexcept {
  if (state.bytes != 0) return;
  topic& on = state_.topics.at(topic_);
  json::writer into{state.buffer};
  into.append(state_.topics.head(topic_));
  state.body_at = into.bytes();
  stop_rules_.write_state(into, state_.cycle.now);
  on.bytes = state.body_bytes = into.bytes() - state.body_at;
  into.append(state_.topics.tail());
  state.bytes = into.overflowed() ? 0 : into.bytes();
  topic_rates::note(on, state_.cycle.now);
}

void stop_state_feed::send(const subscription& to, const message& state) noexcept {
  if (to.whole && state.bytes != 0) {
    std::array<char, stop_buffer_bytes> whole;
    json::writer out{whole};
    const auto name = state_.topics.name(topic_).substr(to.unslashed ? 1 : 0);
    const wire::topic_message what{.topic = name,
                                   .wall_ns =
                                       rt::nanoseconds_of(state_.cycle.now) + state_.options.wall_offset_ns,
                                   .text = {state.body().data(), state.body().size()}};
    const auto kind = state_.seams.protocols.of(to.codec).write_message(out, what);
    if (!out.overflowed()) return sender_.add_stop_state(to.peer, {whole.data(), out.bytes()}, kind);
  }
  // One that would be too long is sent as it is: the state matters more than its form.
  if (!to.own_head || state.bytes == 0)
    return sender_.add_stop_state(to.peer, state.whole(), wire::message_kind::text);
  // The same message with another head, for peers that do not get the shared text.
  const std::int64_t now_ns = rt::nanoseconds_of(state_.cycle.now);
  const wire::message_head head =
      state_.seams.protocols.of(to.codec).head_of({.tag = to.tag,
                                                   .published_ns = now_ns,
                                                   .wall_ns = now_ns + state_.options.wall_offset_ns,
                                                   .unslashed = to.unslashed});
  const std::span<const char> rest = head.from == 0 ? state.body() : state.whole().subspan(head.from);
  std::array<char, stop_answer_bytes_max + sizeof(wire::message_head::bytes)> buffer;
  std::memcpy(buffer.data(), head.bytes.data(), head.size);
  std::copy(rest.begin(), rest.end(), buffer.begin() + head.size);
  sender_.add_stop_state(to.peer, std::span<const char>{buffer}.first(head.size + rest.size()), head.as);
}

// Peers whose protocol has no topics are sent the state as a message. Where it has no pings either, they
// learn from it that the robot is there.
void stop_state_feed::show_takers_of_messages(bool changed) noexcept {
  const rt::duration period = stop_ticks_for_others * state_.options.stop.tick;
  for (const connection& c : state_.peers) {
    if (!c.open() || !c.takes_messages || !c.protocol->can.state_as_message) continue;
    rt::time_point& shown_at = shown_at_[{c.id.index}];
    if (changed || state_.cycle.now - shown_at >= period) {
      shown_at = state_.cycle.now;
      std::array<char, stop_body_bytes_max> buffer;
      json::writer text{buffer};
      stop_rules_.write_state(text, state_.cycle.now);
      sender_.add_stop_state({c.id.index}, {buffer.data(), text.overflowed() ? 0 : text.bytes()});
    }
    due_ = std::min(due_, shown_at + period);
  }
}

void stop_state_feed::show_handles(message& state, bool changed) noexcept {
  const rt::duration tick = state_.options.stop.tick;
  const rt::duration period =
      stop_rules_.guards_include(key_of_this_process) ? tick : stop_ticks_for_others * tick;
  if (changed || state_.cycle.now - delivered_at_ >= period) {
    delivered_at_ = state_.cycle.now;
    write(state);
    broker_.deliver(state_.topics.at(topic_), state.body(), rt::never, {});
    (void)broker_.recorded().keep(topic_, state.body(), state_.cycle.now); // it may have no other audience
  }
  due_ = std::min(due_, delivered_at_ + period);
}

} // namespace rowe::service
