// SPDX-License-Identifier: Apache-2.0
#include "service/requests/call_router.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "service/base/service_limits.hpp"
#include "service/calls/checked_text.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {
namespace {

using form = wire::call_args::form;

} // namespace

// ---- calls of peers

rt::time_point call_router::time_limit(rt::time_point since, std::int64_t time_ns) const noexcept {
  const rt::duration asked = time_ns < 0 ? state_.options.call_timeout : rt::duration{time_ns};
  return std::min(rt::deadline_after(since, asked), rt::deadline_after(since, state_.options.inbound_ttl));
}

// Answers even beyond the rate of refusals: the caller waits for an answer.
void call_router::refuse(connection& c, const wire::request& asked, cause by, std::string_view code,
                         std::string_view why) noexcept {
  add(counter::calls_refused);
  refusals_.report(c, event::kind::refused_request, why, {});
  if (by == cause::peer) (void)refusals_.within_rate(c); // may close it
  if (!c.open()) return;
  refusals_.fail_call(c, asked.codec, wire::origin_of(asked), {.code = code, .text = why});
}

// Whether the peer may not call now, or not with this id; then it has got the reason.
inline bool call_router::refuses_more(connection& c, const wire::request& asked) noexcept {
  if (!state_.calls.admits({c.id.index})) {
    std::array<char, busy_text_bytes_max> why;
    const limits& bounds = state_.bounds();
    const int bytes =
        std::snprintf(why.data(), why.size(),
                      "too many calls are in flight (limits calls_per_connection_max %u, calls_max %u)",
                      bounds.calls_per_connection_max, bounds.calls_max);
    refuse(c, asked, cause::busy, "busy", {why.data(), static_cast<std::size_t>(bytes)});
    return true;
  }
  if (asked.id_raw.empty() || !state_.calls.find_asked(c.id, asked.id_raw)) return false;
  refuse(c, asked, cause::peer, "duplicate_id", "a call with this id is not answered yet");
  return true;
}

// Only peers provide actions.
void call_router::take_goal(connection& c, const wire::request& asked, const long_value& value) noexcept {
  if (refuses_more(c, asked)) return;
  const service_index found = service_directory_.find(asked.service, offer::action);
  const connection* const provider = found ? state_.peers.find(service_directory_.at(found).peer) : nullptr;
  if (provider == nullptr || !provider->open() || !state_.options.relay) {
    wire::text_of<detail::diagnostic_bytes_max> why;
    why.add("Action ").add_name(asked.service, name_bytes_shown).add(" does not exist");
    return refuse(c, asked, cause::peer, error{errc::no_service}.name(), why.text());
  }
  const rt::time_point until =
      asked.ttl_ns < 0 ? rt::never : rt::deadline_after(c.said_at, rt::duration{asked.ttl_ns});
  const call_index index =
      call_completion_.open(call_endpoint::of(c.id, asked.codec), asked.id_raw, asked.service, until);
  if (!index) return refuse(c, asked, cause::busy, "busy", "all calls_max calls are in flight");
  call& goal = state_.calls.at(index);
  goal.goal_status = 0;
  goal.goal_epoch = state_.peers.opened();
  goal.wants_feedback = asked.feedback;
  call_requests_.send(index, provider, state_.seams.protocols.of(service_directory_.at(found).speaks),
                      {.service = service_directory_.name(found),
                       .what = {.is = asked.form, .text = asked.body_raw},
                       .value = value,
                       .goal = true,
                       .type = service_directory_.type(found)});
}

void call_router::take_long(connection& c, const wire::request& asked, const long_value& value) noexcept {
  if (asked.what == wire::verb::send_goal) return take_goal(c, asked, value);
  (void)take_call(c, asked, value); // it is not parked
}

bool call_router::take_call(connection& c, const wire::request& asked, const long_value& value) noexcept {
  const auto refuse = [&](cause by, std::string_view code, std::string_view why) {
    this->refuse(c, asked, by, code, why);
    return true;
  };
  const stop_verb of_stop = stop_gate::find(asked.service, {});
  if (c.stop_only && !stop_gate::is_for_stop_peers(of_stop))
    return refuse(cause::peer, "refused", stop_only_diagnostic);
  if (refuses_more(c, asked)) return true;
  if (!value && goes_to_receiver(asked.service)) {
    switch (receiver_.admit({c.id.index})) {
    case admission::now: break;
    case admission::later: return false;
    case admission::never:
      add(counter::inbox_full);
      return refuse(cause::busy, "refused",
                    "calls come faster than the program takes them: the inbox is full");
    }
  }
  const call_index index = call_completion_.open(call_endpoint::of(c.id, asked.codec), asked.id_raw,
                                                 asked.service, time_limit(c.said_at, asked.ttl_ns));
  if (!index) return refuse(cause::busy, "busy", "all calls_max calls are in flight");
  route(index,
        {.service = asked.service,
         .what = {.is = asked.form, .text = asked.body_raw},
         .value = value,
         .of_stop = of_stop},
        {});
  return true;
}

// ---- calls of this process

// Validates the call. Returns the name of the service; if the call is an object, its text has the name.
result<std::string_view> call_router::service_of(const call_start& asked, std::span<char> buffer) noexcept {
  const wire::call_args& what = asked.what;
  if (what.is == form::object) {
    if (const status fine = check_object_text(state_.seams.validator, what.text); !fine) return fine.error();
    const auto named = json::find(what.text, "service");
    const auto name = named && asked.to.generation == 0 ? json::to_string(*named, buffer) : std::nullopt;
    return name.value_or(asked.service);
  }
  if (what.is == form::args) {
    if (const status fine = state_.seams.validator.validate(what.text); !fine) return fine.error();
    if (!json::is_object(what.text)) return error{errc::not_an_object};
  }
  return asked.service;
}

void call_router::start(const call_start& asked) noexcept {
  const auto fails = [&](const error& why) { local_delivery_.complete(asked.caller, asked.own, why); };
  if (state_.cycle.closing) return fails({errc::closed});
  std::array<char, 2 * detail::queue_pair::name_bytes_max> buffer; // of a service's name with escapes
  const result<std::string_view> service = service_of(asked, buffer);
  call_request request{.service = service ? *service : asked.service, .what = asked.what};
  const bool says_what = service || asked.what.is != form::object;
  if (asked.to.generation == 0 && says_what) request.of_stop = stop_gate::find(request.service, asked.what);
  // A stop needs neither a deadline nor a row of the call table: only its answer does.
  const auto stop_anyway = [&] {
    if (stop_service_.in_use() && request.of_stop == stop_verb::stop)
      stop_service_.carry_out(stop_verb::stop, {.who = asked.caller, .silent = true}, {});
  };
  if (asked.deadline < state_.cycle.now) {
    stop_anyway();
    add(counter::calls_timed_out);
    return fails({errc::timed_out, 0, (asked.deadline - asked.began).count()});
  }
  if (!service) {
    if (service.code() != errc::not_an_object || asked.what.is == form::object) add(counter::malformed);
    return fails(service.error());
  }
  const call_index index = call_completion_.open(asked.caller, {}, request.service, asked.deadline);
  if (!index) {
    stop_anyway();
    return fails({errc::too_many_calls, state_.calls.in_flight(), state_.bounds().calls_max});
  }
  state_.calls.at(index).own = asked.own;
  state_.calls.at(index).timeout = asked.deadline == rt::never ? rt::for_ever : asked.deadline - asked.began;
  route(index, request, asked.to);
}

// ---- routes

void call_router::route(call_index index, const call_request& asked, detail::peer_ref to) noexcept {
  const bool from_here = state_.calls.at(index).caller.who != call_endpoint::kind::peer;
  if (to.generation != 0) {
    const connection* const peer = state_.peers.find({to.index, to.generation});
    if (peer == nullptr || !peer->open()) return call_completion_.fail(index, {errc::peer_lost});
    return call_requests_.send(index, peer, state_.seams.protocols.messages, asked);
  }
  if (asked.of_stop != stop_verb::none && stop_service_.in_use())
    return call_requests_.hand_to_stop(index, asked);
  if (!asked.service.empty()) {
    const bool ask_server = from_here && state_.options.ours == side::client;
    const service_index found = service_directory_.find(asked.service);
    if (found) {
      const service_entry& provider = service_directory_.at(found);
      if (provider.pair && asked.value) return long_calls_.refuse(index, asked.value);
      if (provider.pair) return call_requests_.hand_to_pair(index, provider.pair, asked.what);
      const connection* const peer = state_.peers.find(provider.peer);
      if ((from_here || state_.options.relay) && peer != nullptr && peer->open())
        return call_requests_.send(index, peer, state_.seams.protocols.of(provider.speaks),
                                   {.service = service_directory_.name(found),
                                    .what = asked.what,
                                    .value = asked.value,
                                    .of_stop = asked.of_stop});
    }
    if (asked.of_stop != stop_verb::none && !ask_server)
      return call_completion_.fail(index, {errc::no_service});
    const std::string_view own = endpoint_services::find(asked.service);
    if (!found && !ask_server && !own.empty() && !asked.value)
      return endpoint_services_.answer(index, own, asked.what);
  }
  if (from_here) return ask_anyone(index, asked);
  const bool own = wire::is_own_name(asked.service);
  if (receiver_.is_there() && !own && !asked.value) return call_requests_.hand_to_receiver(index, asked);
  if (asked.value && (receiver_.is_there() || !endpoint_services::find(asked.service).empty()))
    return long_calls_.refuse(index, asked.value);
  call_completion_.fail(index, {errc::no_service});
}

// Whether route() gives a peer's call of this service, which is not the stop's, to the receiver.
bool call_router::goes_to_receiver(std::string_view service) const noexcept {
  if (!receiver_.is_there()) return false;
  if (service.empty()) return true;
  const service_index found = service_directory_.find(service);
  if (!found) return !wire::is_own_name(service) && endpoint_services::find(service).empty();
  const service_entry& provider = service_directory_.at(found);
  if (provider.pair) return false;
  const connection* const peer = state_.peers.find(provider.peer);
  return !(state_.options.relay && peer != nullptr && peer->open());
}

// A call of this process whose service is not in the directory. A client asks its server. A server asks the
// first peer that takes plain messages, if the call is one; if there is no such peer, the call waits for one.
void call_router::ask_anyone(call_index index, const call_request& asked) noexcept {
  const bool object = asked.what.is == form::object;
  if (state_.options.ours == side::client) {
    const wire::codec& in = object ? state_.seams.protocols.messages : state_.seams.protocols.calls_to_server;
    return call_requests_.send(index, state_.peers.server(), in, asked);
  }
  if (!object) return call_completion_.fail(index, {errc::no_service});
  const auto takes = [](const connection& c) { return c.open() && c.takes_messages; };
  const auto first = std::find_if(state_.peers.begin(), state_.peers.end(), takes);
  call_requests_.send(index, first != state_.peers.end() ? &*first : nullptr, state_.seams.protocols.messages,
                      asked);
}

} // namespace rowe::service
