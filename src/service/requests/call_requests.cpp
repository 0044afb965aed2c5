// SPDX-License-Identifier: Apache-2.0
#include "service/requests/call_requests.hpp"

#include <array>

#include "wire/codec/object_form.hpp"
#include "json/structs/decoder.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

using form = wire::call_args::form;

std::string_view text_at(slot_pool& slots, slot_id slot) noexcept {
  return {slots.text(slot).data(), slots.text(slot).size()};
}

} // namespace

call_requests::call_requests(const call_requests_needs& parts) noexcept
    : call_requests_needs{parts}, slots_{message_store_.slots()} {}

void call_requests::send(call_index index, const connection* to, const wire::codec& in,
                         const call_request& asked) noexcept {
  call& open = state_.calls.at(index);
  std::array<char, call_table::our_id_bytes_max> buffer;
  const std::string_view id = state_.calls.write_id(buffer, index, state_.peers.opened());
  const auto write = [&](json::writer& into) {
    if (!asked.goal) return in.write_call(into, asked.service, id, asked.what);
    return in.write_goal(into, {asked.service, asked.type, id, asked.what, open.wants_feedback});
  };
  if (asked.value) [[unlikely]]
    return long_calls_.send(index, *to, in.id(), asked.value, write);
  const bool stops = asked.of_stop == stop_verb::stop;
  const slot_id slot =
      outbox_.compose(message_lifetime{}, write, stops ? slot_use::stop : slot_use::ordinary);
  if (!slot) return call_completion_.fail_for_room(index);
  open.callee = to != nullptr ? call_endpoint::of(to->id, in.id())
                              : call_endpoint{.who = call_endpoint::kind::nobody, .speaks = in.id()};
  open.request = slots_.ref(slot);
  state_.counts.add(counter::calls_out);
  const status sent = direct_messages_.send_request(
      slot, to != nullptr ? peer_index{to->id.index} : peer_index{}, state_.calls.ref(index), stops);
  if (!sent) call_completion_.fail(index, sent.error());
}

inline detail::value_header call_requests::header_of(call_index index) const noexcept {
  const call& asked = state_.calls.at(index);
  const bool by_peer = asked.caller.who == call_endpoint::kind::peer;
  return {.stamped_ns = rt::nanoseconds_of(state_.cycle.now),
          .expires_ns = rt::nanoseconds_of(asked.deadline),
          .what = detail::entry::invocation,
          .peer =
              by_peer ? detail::peer_ref{asked.caller.index, asked.caller.generation} : detail::peer_ref{},
          .call = state_.calls.ref(index)};
}

void call_requests::hand_to_pair(call_index index, pair_index pair, const wire::call_args& what) noexcept {
  state_.calls.at(index).callee = call_endpoint::of(pair, state_.pair_rows[pair].generation);
  const detail::value_header header = header_of(index);
  status done;
  json::decoder::diagnosis fault;
  std::array<char, json::decoder::diagnosis::text_bytes_max> buffer;
  std::string_view fault_text; // a copy, if the text that `fault` points into does not live long enough
  const bool decodes = state_.pairs[pair].decoder != nullptr;
  if (!local_delivery_.may_deliver(pair, header.peer)) {
    done = errc::full;
  } else if (what.is == form::args || (decodes && what.is == form::object)) {
    done =
        local_delivery_.deliver(pair, header, what.text.empty() ? std::string_view{"{}"} : what.text, fault);
  } else {
    const slot_id slot =
        outbox_.compose(message_lifetime{}, [&](json::writer& into) { wire::write_args(into, what); });
    if (!slot) return call_completion_.fail_for_room(index);
    done = local_delivery_.deliver(pair, header, text_at(slots_, slot), fault);
    if (!done && decodes) fault_text = fault.text(buffer);
    message_store_.release(slot);
  }
  if (done) {
    awaited_ = pair;
    return;
  }
  switch (done.code()) {
  case errc::full:
    state_.counts.add(counter::inbox_full);
    return refuse(index, "the service is busy: all its places for requests are taken");
  case errc::too_big: state_.counts.add(counter::too_big); return refuse(index, done.error().message(buffer));
  default:
    state_.counts.add(counter::undecodable);
    return refuse(index, fault_text.empty() ? fault.text(buffer) : fault_text);
  }
}

void call_requests::hand_to_receiver(call_index index, const call_request& asked) noexcept {
  const wire::call_args& what = asked.what;
  const pair_index pair = receiver_.pair();
  state_.calls.at(index).callee = pair ? call_endpoint::of(pair, state_.pair_rows[pair].generation)
                                       : call_endpoint{.who = call_endpoint::kind::thread};
  const detail::value_header header = header_of(index);
  status done;
  if (what.is == form::object) {
    done = receiver_.deliver(header, what.text);
  } else {
    std::array<char, call_table::our_id_bytes_max> buffer;
    const std::string_view id = state_.calls.write_id(buffer, index, state_.peers.opened());
    const slot_id slot = outbox_.compose(message_lifetime{}, [&](json::writer& into) {
      wire::write_delivered_call(into, asked.service, what.text, id);
    });
    if (!slot) return call_completion_.fail_for_room(index);
    done = receiver_.deliver(header, text_at(slots_, slot));
    message_store_.release(slot);
  }
  if (done) {
    awaited_ = pair; // none: a thread takes the call, and has to wake up first
    return;
  }
  std::array<char, detail::diagnostic_bytes_max> why;
  refuse(index, done.code() == errc::full ? "calls come faster than the program takes them: the inbox is full"
                                          : done.error().message(why));
}

void call_requests::hand_to_stop(call_index index, const call_request& asked) noexcept {
  const wire::call_args& what = asked.what;
  state_.calls.at(index).callee = {.who = call_endpoint::kind::core};
  const stop_asker asker{.who = state_.calls.at(index).caller, .call = state_.calls.ref(index)};
  if (what.is != form::value) return stop_service_.carry_out(asked.of_stop, asker, what.text);
  const slot_id slot = outbox_.compose(
      message_lifetime{}, [&](json::writer& into) { wire::write_args(into, what); }, slot_use::stop);
  if (!slot) return stop_service_.carry_out(asked.of_stop, asker, {}); // still a stop, without its arguments
  stop_service_.carry_out(asked.of_stop, asker, text_at(slots_, slot));
  message_store_.release(slot);
}

} // namespace rowe::service
