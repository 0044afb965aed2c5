// SPDX-License-Identifier: Apache-2.0
#include "service/stop/stop_service.hpp"

#include <algorithm>
#include <charconv>

#include <rowe/detail/mutation_points.hpp>

#include "json/reading/reader.hpp"

namespace rowe::service {
namespace {

// Nanoseconds as a string of digits: browsers round integers beyond 2^53.
void write_time(json::writer& into, std::string_view key, rt::time_point t) noexcept {
  into.key(key);
  if (t == rt::never) return into.null();
  std::array<char, 24> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), rt::nanoseconds_of(t)).ptr;
  into.string({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

std::int64_t integer_of(std::string_view args, std::string_view member) noexcept {
  const auto found = json::find(args, member);
  return found ? json::to_integer(*found).value_or(-1) : -1;
}

} // namespace

stop_service::stop_service(rt::arena& memory, const stop_service_needs& parts) noexcept
    : stop_service_needs{parts},
      switch_{state_, command_gate_, stop_rules_},
      threads_{{.state_ = state_, .stop_switch_ = switch_}},
      rows_{memory.carve<row>(state_.bounds().connections_max)},
      waiters_{memory.carve<waiter>(waiters_of(state_.bounds()))} {}

// ---- attach and detach

status stop_service::attach(pair_index pair) noexcept {
  const detail::queue_pair& queues = state_.pairs[pair];
  const std::uint32_t loop =
      stop_rules_.add_loop(queues.name(), queues.loop_timeout, queues.latch, state_.cycle.now);
  if (loop == stop_rules::no_loop)
    return error{errc::too_many_latches, stop_rules::loops_max, stop_rules::loops_max};
  state_.pair_rows[pair].loop = {loop};
  switch_.write_permit();
  return {};
}

void stop_service::detach(pair_index pair) noexcept {
  stop_rules_.remove_loop(state_.pair_rows[pair].loop.value, state_.cycle.now);
  switch_.write_permit();
}

void stop_service::leave(const connection& c) noexcept {
  command_gate_.leave(c);
  if (!in_use()) return;
  stop_rules_.peer_gone(key_of(c.id), state_.cycle.now);
  switch_.write_permit();
}

void stop_service::stop_all() noexcept {
  if (!in_use()) return;
  stop_rules_.request("the endpoint is closing", 0, state_.cycle.now);
  switch_.write_permit();
}

// ---- requests

void stop_service::carry_out(stop_verb which, const stop_asker& asker, std::string_view args) noexcept {
  connection* const c = peer_of(asker.who);
  const std::uint64_t key = c != nullptr ? key_of(c->id) : key_of_this_process;
  const bool from_here = asker.who.who != call_endpoint::kind::peer;
  auto needed = access::right::reset;
  const auto may = [&](access::right what) {
    needed = what;
    return from_here || (c != nullptr && access_control_.may(*c, what));
  };
  std::array<char, stop_member_bytes_max> buffer; // of one at a time
  const auto text_of = [&](std::string_view member) -> std::string_view {
    const auto found = json::find(args, member);
    const auto text = found ? json::to_string(*found, buffer) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  if (!args.empty()) args = json::root(args).raw;
  // Before this raises the number, waiters get what the loops have done. Otherwise nobody would get an answer
  // if a peer stops more often than a loop looks.
  switch_.update();
  answer_acknowledged();
  auto refused = stop_rules::refusal::none;
  const stop_switch::asker by = c != nullptr ? stop_switch::asker{c} : stop_switch::asker{};
  switch (which) {
  case stop_verb::stop: {
    if (c != nullptr && stop_rules_.running()) rows_[{c->id.index}].stopped_at = state_.cycle.now;
    switch_.request(by, text_of("source"), key);
    break;
  }
  case stop_verb::reset:
    refused = stop_rules_.reset(integer_of(args, "number"), integer_of(args, "tick"),
                                may(access::right::reset), state_.cycle.now);
    break;
  case stop_verb::guard: {
    const auto resign = json::find(args, "resign");
    const bool resigns = resign && json::to_boolean(*resign).value_or(false);
    // To take away the guard of somebody else weakens the next reset, so it needs that right.
    const bool takes = resigns && !ROWE_MUTANT(role_resign);
    const bool allowed = may(takes ? access::right::reset : access::right::guard);
    refused = stop_rules_.heartbeat(text_of("guard"), integer_of(args, "tick"), resigns, key, allowed,
                                    state_.cycle.now);
    break;
  }
  case stop_verb::state:
  case stop_verb::none: break;
  }
  switch_.show(which == stop_verb::stop ? text_of("reason") : "", by); // before anything else
  if (refused != stop_rules::refusal::none) switch_.count_refusal();
  if (refused == stop_rules::refusal::role && c != nullptr) access_control_.report_denial(*c, needed);
  if (asker.silent) return;
  if (which == stop_verb::stop) return await_loops(asker);
  answer(which, asker, {.accepted = state_.cycle.now, .refused = refused, .needed = needed});
}

// ---- answers

// The answer to a stop waits until the loops have acknowledged, for observe_timeout at most. It does not wait
// if all places for waiters are taken.
void stop_service::await_loops(const stop_asker& asker) noexcept {
  const connection* const c = peer_of(asker.who);
  row* const of_peer = c != nullptr ? &rows_[{c->id.index}] : nullptr;
  const bool has_enough = of_peer != nullptr && of_peer->awaited == stops_awaited_per_peer;
  if (stop_rules_.observed() != rt::never || waiting_ == waiters_.size() || has_enough)
    return answer(stop_verb::stop, asker, {.accepted = state_.cycle.now});
  waiter& last = waiters_[(first_waiter_ + waiting_++) % waiters_.size()];
  last = {.who = asker.who,
          .call = asker.call,
          .accepted = state_.cycle.now,
          .until = state_.cycle.now + state_.options.stop.observe_timeout};
  const std::string_view id = ROWE_MUTANT(stop_id) ? std::string_view{"0"} : asker.id_raw;
  last.id_bytes = static_cast<std::uint16_t>(id.copy(last.id.data(), last.id.size()));
  if (of_peer != nullptr) ++of_peer->awaited;
  waits_since_ = state_.cycle.now;
}

void stop_service::answer_acknowledged() noexcept {
  threads_.answer_acknowledged();
  const bool observed = stop_rules_.observed() != rt::never || stop_rules_.running();
  while (waiting_ != 0 && (observed || state_.cycle.now >= waiters_[first_waiter_].until)) {
    const waiter first = waiters_[first_waiter_];
    first_waiter_ = static_cast<std::uint32_t>((first_waiter_ + 1) % waiters_.size());
    --waiting_;
    if (const connection* const c = peer_of(first.who)) --rows_[{c->id.index}].awaited;
    answer(stop_verb::stop,
           {.who = first.who, .id_raw = {first.id.data(), first.id_bytes}, .call = first.call},
           {.accepted = first.accepted});
  }
}

void stop_service::write_answer(json::writer& into, stop_verb which, const decision& made) noexcept {
  if (which == stop_verb::state) return stop_rules_.write_state(into, state_.cycle.now);
  into.begin_object();
  into.member("state", stop_rules_.running() ? "running" : "stopped");
  into.member("number", stop_rules_.number());
  switch (which) {
  case stop_verb::stop:
    into.member_or_null("cause", stop_rules_.cause_name());
    into.member_or_null("source", stop_rules_.source());
    write_time(into, "accepted_ns", made.accepted);
    write_time(into, "observed_ns", stop_rules_.observed());
    break;
  case stop_verb::guard:
    into.member(
        "timeout_ms",
        std::chrono::duration_cast<std::chrono::milliseconds>(state_.options.stop.guard_timeout).count());
    into.member("tick", stop_rules_.tick(state_.cycle.now));
    [[fallthrough]];
  default:
    into.member_or_null("refused", stop_rules::name_of(made.refused));
    if (made.refused == stop_rules::refusal::role) into.member_or_null("right", access::name_of(made.needed));
    break;
  }
  into.end_object();
}

void stop_service::answer(stop_verb which, const stop_asker& asker, const decision& made) noexcept {
  std::array<char, stop_answer_bytes_max> buffer;
  json::writer text{buffer};
  const auto body = [&](json::writer& into) { write_answer(into, which, made); };
  if (asker.who.who != call_endpoint::kind::peer) {
    body(text);
    if (state_.calls.find(asker.call) == nullptr) return; // the call ended before
    return call_completion_.complete({asker.call.index}, {buffer.data(), text.bytes()});
  }
  const connection* const c = state_.peers.find(asker.who.connection());
  if (c == nullptr || !c->open()) return;
  const auto kind = state_.seams.protocols.of(asker.who.speaks)
                        .write_reply(text, {.service = stop_gate::name_of(which), .id_raw = asker.id_raw},
                                     wire::body{body});
  sender_.add_stop_reply({c->id.index}, {buffer.data(), text.overflowed() ? 0 : text.bytes()}, kind);
}

// ---- time

void stop_service::look() noexcept {
  if (threads_.read_requests()) {
    switch_.update();
    answer_acknowledged(); // as in carry_out()
    threads_.carry_out_stop();
  }
  if (threads_.wants_reset()) {
    switch_.update();
    answer_acknowledged(); // likewise
    threads_.carry_out_reset();
  }
  switch_.update();
  switch_.show(); // a guard or a loop may have left, too
  answer_acknowledged();
}

rt::time_point stop_service::next_update() const noexcept {
  if (!in_use()) return rt::never;
  const rt::time_point next = stop_rules_.next_update(state_.cycle.now);
  if (waiting_ == 0 && !threads_.waits()) return next;
  const rt::duration waited = state_.cycle.now - std::max(waits_since_, threads_.waits_since());
  return std::min(next, state_.cycle.now +
                            std::clamp(waited / 8, acknowledgment_rest_min, acknowledgment_rest_max));
}

bool stop_service::check() const noexcept {
  std::uint32_t of_peers = 0;
  for (std::uint32_t i = 0; i < waiting_; ++i)
    of_peers += peer_of(waiters_[(first_waiter_ + i) % waiters_.size()].who) != nullptr;
  std::uint32_t awaited = 0;
  for (const peer_index peer : state_.peers.ids())
    if (state_.peers[peer].state != connection::phase::free) awaited += rows_[peer].awaited;
  return waiting_ <= waiters_.size() && of_peers == awaited;
}

} // namespace rowe::service
