// SPDX-License-Identifier: Apache-2.0
#include "service/requests/request_router.hpp"

#include <cassert>
#include <string_view>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/service_limits.hpp"
#include "service/stop/stop_gate.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

// The text as its sender gave it to a rowe endpoint, which put the time to live in front. So a program may
// send on what it received. The valid text lies in the message, where a brace is written.
std::string_view without_ttl(std::string_view text, std::span<std::byte> message) noexcept {
  if (!text.starts_with(R"({"ttl_ms":)")) return text;
  const std::size_t at = text.find_first_of(",}"); // behind a number, so in no string
  assert(at != std::string_view::npos);
  text.remove_prefix(text[at] == '}' ? at - 1 : at);
  message[static_cast<std::size_t>(text.data() - reinterpret_cast<const char*>(message.data()))] =
      std::byte{'{'};
  return text;
}

} // namespace

request_router::due request_router::take(connection& c, read_request& one) noexcept {
  c.spoke_last = one.asked.codec;
  if (one.read == wire::decoded::malformed) state_.counts.add(counter::malformed);
  // A peer that uses the codec of plain messages also takes them.
  const bool speaks_messages =
      one.asked.codec == state_.seams.protocols.messages.id() && one.read != wire::decoded::malformed;
  if (speaks_messages && !c.stop_only && !std::exchange(c.takes_messages, true))
    direct_messages_.deliver_pending({c.id.index});
  const stop_verb of_stop = find_stop(c, one);
  if (of_stop != stop_verb::none) carry_out_stop(c, one, of_stop);
  if (one.read == wire::decoded::request) {
    if (of_stop == stop_verb::none) return carry_out(c, one);
  } else if (!drops(c, one.asked)) {
    refusals_.refuse(c, one.asked, one.why);
  }
  return due::next_fragment;
}

// What the request asks of the stop, if anything. Before that, names replace numbers; a request with an
// unknown number is refused.
inline stop_verb request_router::find_stop(const connection& c, read_request& one) noexcept {
  if (one.asked.by_number) {
    const unknown_number unknown = listings_.put_names(c, one.asked);
    if (!unknown.why.empty() && one.read == wire::decoded::request) {
      one.read = wire::decoded::refused;
      wire::text_out text{unknown_text_};
      one.why = {.code = "unknown_number", .text = text.add(unknown.why).add(unknown.number).text()};
    }
  }
  // A peer on stop_path is never called, so a message of it that looks like an answer is a plain message.
  const bool object = one.asked.form == wire::call_args::form::object;
  if (c.stop_only && one.asked.what == wire::verb::reply && object) one.asked.what = wire::verb::message;
  if (!stop_service_.in_use()) return stop_verb::none;
  const stop_verb found = stop_gate::find(one.read, one.asked, one.known);
  return c.stop_only && !stop_gate::is_for_stop_peers(found) ? stop_verb::none : found;
}

bool request_router::is_stop(const connection& c, read_request& one) noexcept {
  return find_stop(c, one) == stop_verb::stop;
}

// Comes before all else, whatever the peer's rate is. Only a call is answered.
inline void request_router::carry_out_stop(connection& c, const read_request& one,
                                           stop_verb of_stop) noexcept {
  const wire::verb what = one.read == wire::decoded::request ? one.asked.what : wire::verb::message;
  if (what != wire::verb::call)
    return stop_service_.carry_out_unanswered(c, what == wire::verb::publish ? one.asked.body_raw
                                                                             : one.known.text);
  if (!heard_before_) state_.counts.add(counter::calls_in);
  stop_service_.carry_out_call(c, one.asked, of_stop);
}

inline request_router::due request_router::carry_out(connection& c, const read_request& one) noexcept {
  using wire::verb;
  const wire::request& asked = one.asked;
  if (asked.what == verb::message) {
    take_message(c, one);
    return due::next_fragment;
  }
  // A server may ask nothing else. It is counted, and not answered: two ends might refuse refusals for ever.
  if (c.ours == side::client && is_for_servers(asked.what)) {
    state_.counts.add(counter::refused_requests);
    return due::next_fragment;
  }
  if (asked.what == verb::call && !heard_before_) state_.counts.add(counter::calls_in);
  if (drops(c, asked)) return due::next_fragment;
  if (c.stop_only && !stop_gate::is_for_stop_peers(asked)) {
    refusals_.refuse(c, asked, {.code = "refused", .text = stop_only_diagnostic});
    return due::next_fragment;
  }
  if (!access_control_.permits(c, asked)) return due::next_fragment;
  if (asked.fragment_size != 0) [[unlikely]]
    fragment_ingress_.ask({c.id.index}, asked.fragment_size);
  switch (asked.what) {
  case verb::publish:
    if (registrations_.registers(c, asked)) broker_.relay(c, asked);
    break;
  case verb::call:
    if (!call_router_.take_call(c, asked)) ingress_.park({c.id.index});
    break;
  case verb::send_goal:
    state_.counts.add(counter::calls_in);
    call_router_.take_goal(c, asked);
    break;
  case verb::cancel_goal: call_router_.cancel_goal(c, asked); break;
  case verb::goal_feedback: call_router_.take_feedback(c, asked); break;
  case verb::goal_result:
  case verb::reply: call_router_.take_reply(c, asked); break;
  case verb::fragment: return fragment_ingress_.take(c, asked, one.message);
  case verb::status: take_status(c, asked); break;
  case verb::set_level: refusals_.set_level({c.id.index}, asked.level); break;
  case verb::subscribe:
  case verb::unsubscribe:
  case verb::advertise:
  case verb::unadvertise:
  case verb::advertise_service:
  case verb::unadvertise_service:
  case verb::advertise_action:
  case verb::unadvertise_action:
  case verb::get_parameters:
  case verb::set_parameters:
  case verb::subscribe_parameters:
  case verb::unsubscribe_parameters:
  case verb::subscribe_graph:
  case verb::unsubscribe_graph: registrations_.carry_out(c, asked); break;
  case verb::message:
  case verb::unsupported:
  case verb::unknown: refusals_.refuse(c, asked.codec, asked.id_raw, one.why);
  }
  return due::next_fragment;
}

void request_router::take_status(connection& c, const wire::request& asked) noexcept {
  if (!refusals_.admits_event({c.id.index})) return state_.counts.add(counter::events_lost);
  std::array<char, event_text_bytes_max> scratch;
  const auto plain = json::to_string(json::root(asked.body_raw), scratch);
  state_.events.report(event::kind::status_from_peer, c.peer(), plain.value_or(asked.body_raw), {},
                       c.identity);
}

// A plain message: it goes to the receiver.
inline void request_router::take_message(connection& c, const read_request& one) noexcept {
  const wire::request& asked = one.asked;
  if (drops_excess()) return;
  if (c.stop_only)
    return refusals_.refuse(c, asked.codec, {}, {.code = "refused", .text = stop_only_diagnostic});
  if (!access_control_.permits(c, asked)) return;
  switch (receiver_.admit({c.id.index})) {
  case admission::now: break;
  case admission::later: return ingress_.park({c.id.index});
  case admission::never: return state_.counts.add(counter::inbox_full);
  }
  // Its status is not needed: a message that is too long is counted there.
  (void)receiver_.deliver(
      {.stamped_ns = rt::nanoseconds_of(c.said_at),
       .expires_ns = rt::nanoseconds_of(state_.options.inbound_expiry(c.said_at, asked.ttl_ns)),
       .what = detail::entry::message,
       .peer = {c.id.index, c.id.generation}},
      without_ttl(one.known.text, one.message));
}

// ---- long messages

// Only messages of topics, calls and answers may be long. A long stop is a stop, also if it found no room or
// may not be so long. A short message that is no JSON comes here, too.
void request_router::take_long(connection& c, read_request& one, const long_arrival& message) noexcept {
  using verdict = long_arrival::verdict;
  const bool fine = message.is == verdict::fine;
  const bool malformed = message.is == verdict::malformed;
  wire::request& asked = one.asked;
  c.spoke_last = asked.codec;
  if (one.read == wire::decoded::malformed || malformed) state_.counts.add(counter::malformed);
  stop_verb of_stop = ROWE_MUTANT(long_stop) ? stop_verb::none : find_stop(c, one);
  if (!fine && (of_stop != stop_verb::stop || (malformed && !message.binary) ||
                (ROWE_MUTANT(long_stop_room) && message.is == verdict::no_room)))
    of_stop = stop_verb::none;
  if (of_stop != stop_verb::none) return carry_out_stop(c, one, of_stop);
  if (message.is == verdict::no_room) state_.counts.add(counter::no_chunks);
  if (message.is == verdict::far_behind || message.is == verdict::other_long ||
      message.is == verdict::unsupported)
    state_.counts.add(counter::too_big);
  if (drops(c, asked) || (ROWE_MUTANT(long_told) && message.is == verdict::no_room)) return;
  if (one.read != wire::decoded::request && (fine || (message.binary && asked.what == wire::verb::unknown)))
    return refusals_.refuse(c, asked, one.why);
  if (fine && takes_long(c, asked, message)) return;
  if (fine) state_.counts.add(counter::too_big);
  refuse_long(c, asked, message);
}

// Carries out a request whose body is long, or has a long member. False: it may not be long.
bool request_router::takes_long(connection& c, wire::request& asked, const long_arrival& message) noexcept {
  using wire::verb;
  const char* const stand_in = reinterpret_cast<const char*>(message.envelope.data()) + message.stand_in_at;
  if (asked.what == verb::publish) {
    if (asked.body_raw.data() != stand_in) return false;
    if (access_control_.permits(c, asked) && registrations_.registers(c, asked))
      broker_.relay(c, asked, message.body.text);
    return true;
  }
  const auto has_it = [stand_in](std::string_view text) {
    return text.data() <= stand_in && stand_in < text.data() + text.size();
  };
  if (!has_it(asked.body_raw) || has_it(asked.id_raw)) return false;
  switch (asked.what) {
  case verb::call:
  case verb::send_goal:
    state_.counts.add(counter::calls_in);
    if (access_control_.permits(c, asked)) call_router_.take_long(c, asked, message.body);
    return true;
  case verb::reply:
  case verb::goal_result: {
    std::array<char, 96> reason;
    if (asked.failed) {
      wire::text_out words{reason};
      words.add("\"the reason has ").add(message.bytes);
      asked.body_raw = words.add(" bytes, and is not sent on\"").text();
    }
    call_router_.take_reply(c, asked, message.body);
    return true;
  }
  default: return false;
  }
}

// Who waits for the answer to a call gets the error at once.
void request_router::refuse_long(connection& c, wire::request& asked, const long_arrival& message) noexcept {
  using wire::verb;
  std::array<char, wire::refusal::text_bytes_max> buffer;
  const wire::diagnostic why = message.refusal(state_.bounds(), asked, buffer);
  const bool known = asked.by_number || asked.form == wire::call_args::form::object || !asked.id_raw.empty();
  const bool answerable = known || (message.is != long_arrival::verdict::malformed && !asked.service.empty());
  if ((asked.what == verb::call || asked.what == verb::send_goal) && answerable) {
    state_.counts.add(counter::calls_in);
    return refusals_.refuse_call(c, asked, why);
  }
  refusals_.refuse(c, asked, why);
  if (asked.what != verb::reply && asked.what != verb::goal_result) return;
  std::array<char, wire::error_bytes_max> quoted;
  json::writer words{quoted};
  words.string(why.text);
  asked.failed = true;
  asked.code = why.code;
  asked.body_raw = {quoted.data(), words.bytes()};
  call_router_.take_reply(c, asked);
}

} // namespace rowe::service
