// SPDX-License-Identifier: Apache-2.0
#include "service/control/command_gate.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "wire/text/text_out.hpp"

namespace rowe::service {
namespace {

constexpr counter counter_of(driver_rules::verdict why) noexcept {
  switch (why) {
  case driver_rules::verdict::refused: return counter::commands_refused;
  case driver_rules::verdict::unproven: return counter::commands_unproven;
  default: return counter::commands_stale;
  }
}

} // namespace

command_gate::command_gate(rt::arena& memory, const command_gate_needs& parts) noexcept
    : command_gate_needs{parts},
      stop_number_{stop_rules_.number()},
      rows_{memory.carve<row>(state_.bounds().connections_max)} {}

// ---- handles

status command_gate::attach(pair_index pair) noexcept {
  topic& on = state_.topics.at(state_.pair_rows[pair].topic);
  if (!on.driven) {
    const auto free = std::find_if(places_.begin(), places_.end(), [](const place& p) { return !p.topic; });
    if (free == places_.end()) return error{errc::too_many_leases, driven_topics_max, driven_topics_max};
    on.driven = {static_cast<std::uint32_t>(free - places_.begin())};
    free->topic = state_.pair_rows[pair].topic;
    free->rules.begin(state_.pairs[pair].lease, state_.cycle.now);
    ++count_;
  }
  state_.pair_rows[pair].driven = true;
  ++places_[on.driven.value].handles;
  settle_lease(on.driven);
  state_.pairs[pair].turn.set(static_cast<std::int64_t>(rules_of(on.driven).turn())); // it has no inbox yet
  return {};
}

void command_gate::detach(pair_index pair) noexcept {
  pair_row& its = state_.pair_rows[pair];
  if (!its.driven) return;
  topic& on = state_.topics.at(its.topic);
  its.driven = false;
  place& at = places_[on.driven.value];
  if (--at.handles != 0) return settle_lease(on.driven);
  at.rules.begin({}, state_.cycle.now);
  at.topic = {};
  on.driven = {};
  --count_;
}

// The shortest lease of the topic's handles holds for all.
void command_gate::settle_lease(driven_index of) noexcept {
  rt::duration shortest = rt::for_ever;
  const topic& on = state_.topics.at(places_[of.value].topic);
  for (const pair_index i : state_.pairs.ids()) {
    if (state_.pair_rows[i].driven && state_.topics.at(state_.pair_rows[i].topic).driven == on.driven)
      shortest = std::min(shortest, state_.pairs[i].lease);
  }
  rules_of(of).set_lease(shortest);
  publish_turn(of);
}

// Shows the loops which turn lasts.
void command_gate::publish_turn(driven_index of) noexcept {
  const place& at = places_[of.value];
  for (pair_index i = state_.topics.at(at.topic).inboxes.head; i; i = state_.pair_rows[i].next_inbox) {
    if (state_.pair_rows[i].driven) state_.pairs[i].turn.set(static_cast<std::int64_t>(at.rules.turn()));
  }
}

void command_gate::leave(const connection& c) noexcept {
  if (!any() || ROWE_MUTANT(drive_gone)) return;
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    if (!places_[i].topic) continue;
    places_[i].rules.release(key_of(c.id), state_.cycle.now);
    publish_turn({i});
  }
}

// ---- commands

rt::time_point command_gate::sent_at(const connection& from, const wire::request& command,
                                     rt::duration lease) noexcept {
  if (command.tick != wire::no_tick) return stop_rules_.issued(command.tick, state_.cycle.now);
  const peer_index peer{from.id.index};
  rt::time_point& commanded_at = rows_[peer].commanded_at;
  if (commanded_at == rt::time_point{}) commanded_at = state_.cycle.now;
  const rt::time_point answered_at = sender_.urgent().answered_at(peer);
  const bool known =
      answered_at > commanded_at || (answered_at != rt::time_point{} && ROWE_MUTANT(drive_unproven));
  if (!known || state_.cycle.now - answered_at >= lease / 4) {
    sender_.urgent().request_ping(peer);
    sender_.urgent().check_responsive(peer);
  }
  return known ? answered_at : rt::never;
}

std::optional<command_gate::passed> command_gate::admit(connection& from, const wire::request& command,
                                                        topic_id topic) noexcept {
  const driven_index of = state_.topics.at(topic).driven;
  driver_rules& rules = rules_of(of);
  note_stop();
  const rt::time_point sent = sent_at(from, command, rules.lease());
  if (stop_rules_.in_use() && !stop_rules_.running() && !ROWE_MUTANT(drive_stopped)) {
    state_.counts.add(counter::commands_stopped);
    return std::nullopt;
  }
  const driver_rules::judged made = rules.judge(key_of(from.id), sent, state_.cycle.now);
  publish_turn(of);
  if (made.is == driver_rules::verdict::accepted) return passed{sent, made.until};
  refuse(from, command, of, made.is, sent);
  return std::nullopt;
}

std::optional<command_gate::passed> command_gate::admit_own(topic_id topic,
                                                            rt::time_point published) noexcept {
  const driven_index of = state_.topics.at(topic).driven;
  note_stop();
  if (stop_rules_.in_use() && !stop_rules_.running()) {
    state_.counts.add(counter::commands_stopped);
    return std::nullopt;
  }
  const driver_rules::judged made = rules_of(of).judge(key_of_this_process, published, state_.cycle.now);
  publish_turn(of);
  if (made.is == driver_rules::verdict::accepted) return passed{published, made.until};
  state_.counts.add(counter_of(made.is));
  return std::nullopt;
}

void command_gate::count(topic_id topic, detail::peer_ref by, rt::time_point sent) noexcept {
  wire::text_of<peer_name_bytes_max> name;
  const connection* const c = state_.peers.find({by.index, by.generation});
  c != nullptr ? state_.rights.write_name(name, c->name(), {}) : name.add("this process");
  rules_of(state_.topics.at(topic).driven)
      .count({.peer = c != nullptr ? key_of(c->id) : key_of_this_process, .name = name.text()}, sent,
             state_.cycle.now);
}

// Without ticks the first commands of a connection are always unproven, so that is no news for a while.
void command_gate::refuse(connection& from, const wire::request& command, driven_index of,
                          driver_rules::verdict why, rt::time_point sent) noexcept {
  state_.counts.add(counter_of(why));
  const bool begins = why == driver_rules::verdict::unproven && command.tick == wire::no_tick &&
                      state_.cycle.now - rows_[{from.id.index}].commanded_at < unproven_unsaid_for;
  const place& at = places_[of.value];
  if (begins || from.ours == side::client || !from.may_report(at.topic, state_.cycle.now)) return;
  wire::text_of<wire::refusal::text_bytes_max> text;
  text.add("publish ").add_name(state_.topics.name(at.topic), event_topic_bytes_shown).add(": dropped, ");
  switch (why) {
  case driver_rules::verdict::refused:
    text.add_name(at.rules.driver(), driver_rules::name_bytes_max);
    text.add(" drives; the service /rowe/control takes control");
    break;
  case driver_rules::verdict::unproven:
    text.add(command.tick == wire::no_tick
                 ? "it has no tick, and no ping was answered since the first command"
                 : "the robot has not issued its tick");
    break;
  default:
    text.add("it was sent ").add(whole_ms(state_.cycle.now - sent)).add(" ms ago, and the lease is ");
    text.add(whole_ms(at.rules.lease())).add(" ms; or before the newest stop");
    break;
  }
  refusals_.send_status(from, command.id_raw, text.text(), wire::severity::warning);
}

// ---- state

driven_index command_gate::find(std::string_view topic) const noexcept {
  if (const topic_id found = topic.empty() ? topic_id{} : state_.topics.find(topic))
    return state_.topics.at(found).driven;
  if (!topic.empty() || count_ != 1) return {};
  const auto only =
      std::find_if(places_.begin(), places_.end(), [](const place& p) { return bool{p.topic}; });
  return {static_cast<std::uint32_t>(only - places_.begin())};
}

std::uint64_t command_gate::version() const noexcept {
  std::uint64_t sum = 0;
  for (const place& p : places_) sum += p.rules.version();
  return sum;
}

void command_gate::update() noexcept {
  note_stop();
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    if (!places_[i].topic || places_[i].rules.next_update() > state_.cycle.now) continue;
    places_[i].rules.update(state_.cycle.now);
    publish_turn({i});
  }
}

rt::time_point command_gate::next_update() const noexcept {
  rt::time_point next = rt::never;
  if (any())
    for (const place& p : places_) next = std::min(next, p.topic ? p.rules.next_update() : rt::never);
  return next;
}

void command_gate::void_commands() noexcept {
  stop_number_ = stop_rules_.number();
  stop_in_use_ = stop_rules_.in_use();
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    if (!places_[i].topic) continue;
    places_[i].rules.void_commands(state_.cycle.now);
    publish_turn({i});
  }
}

bool command_gate::check() const noexcept {
  std::uint32_t used = 0;
  for (std::uint32_t i = 0; i < places_.size(); ++i) {
    const place& p = places_[i];
    if (!p.topic) continue;
    ++used;
    std::uint32_t handles = 0;
    const topic& on = state_.topics.at(p.topic);
    if (on.driven != driven_index{i}) return false;
    for (pair_index at = on.inboxes.head; at; at = state_.pair_rows[at].next_inbox) {
      if (!state_.pair_rows[at].driven) continue;
      ++handles;
      if (state_.pairs[at].turn.number() != static_cast<std::int64_t>(p.rules.turn())) return false;
    }
    if (handles != p.handles) return false;
  }
  return used == count_;
}

} // namespace rowe::service
