// SPDX-License-Identifier: Apache-2.0
#include "service/calls/call_completion.hpp"

#include <array>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/calls/checked_text.hpp"
#include "wire/codec/object_form.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

// The text of a JSON string, for people. A text that does not fit, or is no string, is returned as it was
// sent.
std::string_view diagnostic_of(std::string_view raw, std::span<char> scratch) noexcept {
  if (raw.empty()) return {};
  const json::value v = json::root(raw);
  if (const auto text = json::to_string(v, scratch)) return *text;
  return raw.substr(0, scratch.size());
}

} // namespace

call_completion::call_completion(rt::arena& memory, const call_completion_needs& parts) noexcept
    : call_completion_needs{parts},
      slots_{message_store_.slots()},
      goals_{{.state_ = state_, .outbox_ = outbox_, .refusals_ = refusals_}},
      unarmed_{memory.carve<call_index>(state_.bounds().calls_max)} {}

call_index call_completion::open(const call_endpoint& caller, std::string_view id_raw,
                                 std::string_view service, rt::time_point until) noexcept {
  const call_index index = state_.calls.open(caller, id_raw, service);
  if (!index) return {};
  state_.calls.at(index).deadline = until;
  if (until == rt::never) return index;
  if (until <= state_.cycle.now || unarmed_count_ == unarmed_.size()) {
    state_.due.arm(index, until);
  } else {
    unarmed_[unarmed_count_++] = index;
  }
  return index;
}

void call_completion::arm_all_open() noexcept {
  for (const call_index index : unarmed_.first(std::exchange(unarmed_count_, 0))) {
    const call& one = state_.calls.at(index); // perhaps another call by now, which does no harm
    if (one.open && one.deadline != rt::never) state_.due.arm(index, one.deadline);
  }
}

result<call_index> call_completion::find_given(const call_endpoint& callee, detail::call_ref which) noexcept {
  call* const found = state_.calls.find(which);
  const bool given = found != nullptr && found->callee.who == callee.who &&
                     (callee.who != call_endpoint::kind::pair ||
                      (found->callee.index == callee.index && found->callee.generation == callee.generation));
  if (given) return call_index{which.index};
  add(counter::replies_unsent);
  return gone_as();
}

status call_completion::answer(const call_endpoint& callee, detail::call_ref which,
                               const local_reply& with) noexcept {
  const auto index = find_given(callee, which);
  if (!index) return index.error();
  if (with.expires < state_.cycle.now) {
    add(counter::expired);
    fail(*index, {errc::refused}, "the reply was not sent within its time to live");
    return errc::expired;
  }
  result<slot_id> slot = slot_id{};
  if (with.encoder != nullptr) {
    const auto encode = [&](json::writer& into) { with.encoder->encode(with.value, into); };
    slot = finish(*index, wire::body{encode}, with.expires);
  } else {
    if (const status fine = check_object_text(state_.seams.validator, with.text); !fine) {
      add(counter::malformed);
      fail(*index, {errc::refused}, "the provider's reply was not a JSON object");
      return fine;
    }
    slot = finish_with(*index, with.text, with.expires);
  }
  if (with.waits.who == call_endpoint::kind::nobody) {
    end_without_room(*index, slot);
    return slot ? status{} : slot.error();
  }
  if (!slot) return slot.error();
  const bool here = !*slot; // the caller is of this process, and has its answer
  here ? complete(with.waits, with.own, {}) : direct_messages_.track_reply(*slot, with.waits, with.own);
  return {};
}

status call_completion::refuse(const call_endpoint& callee, detail::call_ref which,
                               std::string_view why) noexcept {
  const auto index = find_given(callee, which);
  if (!index) return index.error();
  fail(*index, {errc::refused}, why);
  return {};
}

void call_completion::take_reply(connection& c, const wire::request& said) noexcept {
  const call_index call = goals_.find_answered(c, said.id_raw, said.what == wire::verb::goal_result);
  if (!call) return;
  if (said.what == wire::verb::goal_result) state_.calls.at(call).goal_status = said.goal_status;
  if (!said.failed) return complete(call, said.body_raw.empty() ? std::string_view{"{}"} : said.body_raw);
  std::array<char, wire::no_service_bytes_max> buffer;
  const std::string_view diagnostic = diagnostic_of(said.body_raw, buffer);
  const wire::codec& in = state_.seams.protocols.of(said.codec);
  const bool unknown = in.means_no_service(said, diagnostic, state_.calls.service(call));
  fail(call, {unknown ? errc::no_service : errc::refused}, diagnostic);
}

// Answers the call with a value; an answer to a peer may expire. Returns the slot of an answer to a peer, or
// none if the caller is of this process and has it. Errors: peer_lost, closed; full: the answer found no
// room, and the call has not ended.
result<slot_id> call_completion::finish(call_index index, const wire::body& value,
                                        rt::time_point expires) noexcept {
  const call ended = state_.calls.at(index);
  if (ended.caller.who != call_endpoint::kind::peer) {
    const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) { value.write(into); });
    if (!slot) return errc::full;
    const auto given = finish_with(index, {slots_.text(slot).data(), slots_.text(slot).size()});
    message_store_.release(slot);
    return given;
  }
  connection* const c = state_.peers.find(ended.caller.connection());
  if (c == nullptr || !c->open()) {
    add(counter::replies_unsent);
    close(index);
    return gone_as();
  }
  const wire::codec& codec = state_.seams.protocols.of(ended.caller.speaks);
  const wire::call_origin asked = state_.calls.origin(index);
  const slot_id slot = outbox_.reply(
      {c->id.index}, [&](json::writer& into) { return codec.write_reply(into, asked, value); }, expires);
  if (!slot) return errc::full;
  close(index);
  return slot;
}

result<slot_id> call_completion::finish_with(call_index index, std::string_view text,
                                             rt::time_point expires) noexcept {
  const call ended = state_.calls.at(index);
  if (ended.caller.who == call_endpoint::kind::peer) return finish(index, wire::body{text}, expires);
  // A caller that sent an object gets an object.
  const bool reads_objects = ended.caller.who == call_endpoint::kind::thread ||
                             state_.pairs[ended.caller.pair()].kind == detail::pair_kind::talk;
  if (reads_objects && !json::is_object(text)) {
    const slot_id slot =
        outbox_.compose(message_lifetime{}, [&](json::writer& into) { wire::write_result(into, text); });
    if (!slot) return errc::full;
    close(index);
    complete(ended.caller, ended.own, {}, {slots_.text(slot).data(), slots_.text(slot).size()});
    message_store_.release(slot);
    return slot_id{};
  }
  close(index);
  complete(ended.caller, ended.own, {}, text);
  return slot_id{};
}

// Ends a call whose reply found no room and is not tried again.
void call_completion::end_without_room(call_index index, const result<slot_id>& finished) noexcept {
  if (!finished && finished.code() == errc::full) fail_for_room(index);
}

void call_completion::fail_for_room(call_index index) noexcept {
  fail(index, error{errc::full, 0, slots_.count()}, "no room: the message is too large, or too many wait");
}

void call_completion::time_out(call_index index) noexcept {
  add(counter::calls_timed_out);
  goals_.abandon(index);
  fail(index, {errc::timed_out, 0, state_.calls.at(index).timeout.count()});
}

void call_completion::fail(call_index index, const error& why, std::string_view diagnostic) noexcept {
  const call ended = state_.calls.at(index);
  std::array<char, wire::no_service_bytes_max> buffer;
  if (why.code == errc::no_service && diagnostic.empty() && ended.service_bytes != 0) {
    diagnostic = wire::no_service_diagnostic(state_.calls.service(index), buffer);
  } else if (why.code == errc::timed_out) {
    diagnostic = "the service did not answer in time";
  } else if (diagnostic.empty()) {
    diagnostic = why.message(buffer);
  }
  if (ended.caller.who != call_endpoint::kind::peer) {
    close(index);
    return complete(ended.caller, ended.own, why, diagnostic);
  }
  add(counter::calls_refused);
  connection* const c = state_.peers.find(ended.caller.connection());
  if (c != nullptr && c->open()) {
    refusals_.fail_call(*c, ended.caller.speaks, state_.calls.origin(index),
                        {.code = why.name(), .text = diagnostic});
  }
  close(index);
}

void call_completion::deny(call_index index, std::string_view diagnostic) noexcept {
  const call& ended = state_.calls.at(index);
  connection* const c = state_.peers.find(ended.caller.connection());
  if (c != nullptr && c->open()) {
    wire::request asked;
    asked.what = wire::verb::call;
    asked.codec = ended.caller.speaks;
    asked.service = state_.calls.service(index);
    asked.id_raw = state_.calls.id_raw(index);
    refusals_.deny(*c, asked, diagnostic);
  }
  close(index);
}

void call_completion::close(call_index index) noexcept {
  direct_messages_.cancel(state_.calls.at(index).request);
  state_.due.disarm(index); // last: an outcome that was taken just now may have made it due
  state_.calls.close(index);
}

// ---- lost peers and handles

void call_completion::forget(connection_id peer) noexcept {
  for (const auto i : state_.calls.ids()) {
    const call& one = state_.calls.at(i);
    if (!one.open) continue;
    if (one.caller.is(peer)) {
      goals_.abandon(i);
      close(i);
    } else if (one.callee.is(peer) && !(ROWE_MUTANT(goal_lost) && state_.calls.is_goal(i))) {
      if (!state_.cycle.closing) add(counter::calls_lost);
      fail(i, {gone_as()});
    }
  }
}

void call_completion::forget_pair(pair_index pair) noexcept {
  for (const auto i : state_.calls.ids()) {
    const call& one = state_.calls.at(i);
    if (!one.open) continue;
    if (one.caller.who == call_endpoint::kind::pair && one.caller.pair() == pair) {
      close(i);
    } else if (one.callee.who == call_endpoint::kind::pair && one.callee.pair() == pair) {
      fail(i, {errc::no_service});
    }
  }
}

// ---- checks

// Each call in flight has a caller, and a callee that may still answer.
bool call_completion::check() const noexcept {
  const auto there = [this](const call_endpoint& p) {
    if (p.who == call_endpoint::kind::pair)
      return state_.pair_rows[p.pair()].attached && state_.pair_rows[p.pair()].generation == p.generation;
    return p.who != call_endpoint::kind::peer || state_.peers.find(p.connection()) != nullptr;
  };
  for (const auto i : state_.calls.ids()) {
    const call& one = state_.calls.at(i);
    if (one.open && !(there(one.caller) && there(one.callee))) return false;
  }
  return true;
}

} // namespace rowe::service
