// SPDX-License-Identifier: Apache-2.0
// Services and calls. A call comes from a handle or a thread of this process or from a peer, in any dialect;
// it goes to a responder, to whoever receives generically, to a peer, or is answered by the endpoint itself;
// and its end finds the way back. All of that is one table (calls.hpp) and two turns: route() chooses who
// answers, finish() and finish_badly() tell the one who asked. Only this thread decides which of reply,
// refusal, time-out and loss comes first.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "service/shares.hpp"
#include "wire/object_form.hpp"
#include "json/decoder.hpp"
#include "json/encoder.hpp"

namespace rowe::service {
namespace {

using detail::entry;
using form = wire::call_args::form;

} // namespace

// ---- asked by peers

rt::time_point core::time_limit(std::int64_t time_ns) const noexcept {
  const rt::duration asked = time_ns < 0 ? options_.call_timeout : rt::duration{time_ns};
  return std::min(rt::deadline_after(now_, asked), rt::deadline_after(now_, options_.inbound_ttl));
}

void core::take_call(connection& c, const wire::request& asked) noexcept {
  if (!heard_before_) add(counter::calls_in);
  const auto of_stop = stop_service_named(asked.service);
  const bool allowed = !c.stop_only || is_for_stop(of_stop);
  if (allowed && stop_.in_use() && of_stop != stop_service::none) return take_stop_call(c, asked, of_stop);
  if (drops_excess()) return;
  // Within the rate of refusals or not: whoever calls waits for an answer. What is busy may be so because of
  // others, and is no reason to cut who asks again.
  enum class cause { peer, busy };
  const auto refuse = [&](cause by, std::string_view code, std::string_view why) {
    add(counter::calls_refused);
    report_refusal(c, event::kind::refused_request, why, {});
    if (by == cause::peer) (void)within_refusals(c); // may close it
    if (!c.open()) return;
    answer_failure(c, asked.codec, {.service = asked.service, .id_raw = asked.id_raw},
                   {.code = code, .text = why});
  };
  if (!allowed) return refuse(cause::peer, "refused", stop_only_sentence);
  if (c.calls_asked >= bounds_.calls_per_connection_max ||
      !call_claims_.may_take(c.calls_asked, left_of(calls_of_peers(bounds_), peer_calls_))) {
    std::array<char, 160> why;
    const int bytes =
        std::snprintf(why.data(), why.size(),
                      "too many calls are in flight (limits calls_per_connection_max %u, calls_max %u)",
                      bounds_.calls_per_connection_max, bounds_.calls_max);
    return refuse(cause::busy, "busy", {why.data(), static_cast<std::size_t>(bytes)});
  }
  if (!asked.id_raw.empty() && calls_.find_asked(c.id, asked.id_raw) != no_index)
    return refuse(cause::peer, "duplicate_id", "a call with this id is not answered yet");
  if (goes_to_receiver(asked.service)) {
    switch (receiver_.admit({c.id.index})) {
    case admission::now: break;
    case admission::later: return ingress_.park({c.id.index});
    case admission::never:
      add(counter::inbox_full);
      return refuse(cause::busy, "refused", "nobody takes calls fast enough: the inbox is full");
    }
  }
  const std::uint32_t index = calls_.open(party::of(c.id, asked.codec), asked.id_raw, asked.service);
  if (index == no_index) return refuse(cause::busy, "busy", "all calls_max calls are in flight");
  call_claims_.take(c.calls_asked);
  ++peer_calls_;
  limit_call(index, time_limit(asked.ttl_ns));
  route(index, asked.service, {.is = asked.form, .text = asked.body_raw}, {});
}

void core::limit_call(std::uint32_t index, rt::time_point until) noexcept {
  calls_.at(index).deadline = until;
  if (until == rt::never) return;
  if (until <= now_ || unarmed_count_ == unarmed_calls_.size()) return timers_.arm(call_index{index}, until);
  unarmed_calls_[unarmed_count_++] = index;
}

// ---- asked by this process

void core::start_call(const party& asker, detail::call_ref own, std::string_view service,
                      const wire::call_args& what, detail::peer_ref to, rt::time_point began,
                      rt::time_point deadline) noexcept {
  const auto fails = [&](const error& why) { tell(asker, own, why); };
  if (closing_) return fails({errc::closed});
  // A stop needs neither time nor a place: only its answer does.
  const auto stop_anyway = [&] {
    const bool named = stop_service_named(service) == stop_service::stop;
    const bool object = what.is == form::object && check_text(what.text);
    if (stop_.in_use() && (named || (object && to.generation == 0 && asks_to_stop(what.text))))
      carry_out_stop(stop_service::stop, {.who = asker, .silent = true}, {});
  };
  if (deadline < now_) {
    stop_anyway();
    add(counter::calls_timed_out);
    return fails({errc::timed_out, 0, (deadline - began).count()});
  }
  std::array<char, 2 * detail::lane::name_bytes_max> room; // of the service's name where it has escapes
  if (what.is == form::object) {
    if (const status fine = check_text(what.text); !fine) {
      add(counter::malformed);
      return fails(fine.error());
    }
    const auto named = json::find(what.text, "service");
    if (named && to.generation == 0) {
      if (const auto name = json::to_string(*named, room)) service = *name;
    }
  } else if (what.is == form::args) {
    if (const status fine = validator_.validate(what.text); !fine) {
      add(counter::malformed);
      return fails(fine.error());
    }
    if (!json::is_object(what.text)) return fails({errc::not_an_object});
  }
  const std::uint32_t index = calls_.open(asker, {}, service);
  if (index == no_index) {
    stop_anyway();
    return fails({errc::too_many_calls, calls_.in_flight(), bounds_.calls_max});
  }
  calls_.at(index).own = own;
  calls_.at(index).timeout = deadline == rt::never ? rt::for_ever : deadline - began;
  limit_call(index, deadline);
  route(index, service, what, to);
}

// ---- who answers

void core::route(std::uint32_t index, std::string_view service, const wire::call_args& what,
                 detail::peer_ref to) noexcept {
  const party asker = calls_.at(index).asked_by;
  const bool from_here = asker.who != party::kind::peer;
  if (to.generation != 0) {
    connection* const peer = find({to.index, to.generation});
    if (peer == nullptr || !peer->open()) return finish_badly(index, {errc::peer_lost});
    return ask_peer(index, peer, protocols_.messages, service, what);
  }
  if (!service.empty()) {
    const bool ask_server = from_here && ours_ == side::client;
    const std::uint32_t found = services_.find(service);
    if (found != no_index) {
      const service_entry& provider = services_.at(found);
      if (provider.lane != no_index) return hand_to_lane(index, provider.lane, what);
      connection* const peer = find(provider.peer);
      if ((from_here || options_.relay) && peer != nullptr && peer->open())
        return ask_peer(index, peer, protocols_.of(provider.speaks), services_.name(found), what);
    }
    const auto of_stop = stop_service_named(service);
    if (of_stop != stop_service::none && stop_.in_use()) return answer_stop_call(index, of_stop, what);
    if (of_stop != stop_service::none && !ask_server) return finish_badly(index, {errc::no_service});
    const std::string_view own = own_service(service);
    if (found == no_index && !ask_server && !own.empty()) return answer_own(index, own, what);
  }
  if (from_here) return ask_anyone(index, service, what);
  if (receiver_.is_there()) return hand_to_receiver(index, service, what);
  finish_badly(index, {errc::no_service});
}

// Whether route() gives a peer's call of this service, which is not the stop's, to whoever receives.
bool core::goes_to_receiver(std::string_view service) noexcept {
  if (!receiver_.is_there()) return false;
  if (service.empty()) return true;
  const std::uint32_t found = services_.find(service);
  if (found == no_index)
    return stop_service_named(service) == stop_service::none && own_service(service).empty();
  const service_entry& provider = services_.at(found);
  if (provider.lane != no_index) return false;
  const connection* const peer = find(provider.peer);
  return !(options_.relay && peer != nullptr && peer->open());
}

connection* core::server_connection() noexcept {
  for (connection& c : peers_) {
    if (c.open() && c.ours == side::client) return &c;
  }
  return nullptr;
}

// A call of this process that no service in the directory takes: a client asks its server; a server asks the
// first peer that takes messages, if the call is one. Where there is none, it waits for one.
void core::ask_anyone(std::uint32_t index, std::string_view service, const wire::call_args& what) noexcept {
  const bool object = what.is == form::object;
  if (ours_ == side::client) {
    const wire::codec& in = object ? protocols_.messages : protocols_.calls_to_server;
    return ask_peer(index, server_connection(), in, service, what);
  }
  if (!object) return finish_badly(index, {errc::no_service});
  connection* first = nullptr;
  for (connection& c : peers_) {
    if (c.open() && c.takes_messages && first == nullptr) first = &c;
  }
  ask_peer(index, first, protocols_.messages, service, what);
}

// Sends the request; with no peer it waits for the first who comes.
void core::ask_peer(std::uint32_t index, connection* c, const wire::codec& in, std::string_view service,
                    const wire::call_args& what) noexcept {
  call& asked = calls_.at(index);
  std::array<char, call_table::our_id_bytes_max> room;
  const std::string_view id = calls_.write_id(room, index, peers_.opened());
  const auto write = [&](json::writer& into) { in.write_call(into, service, id, what); };
  const bool stops = stop_service_named(service) == stop_service::stop;
  const std::uint32_t slot = compose(rt::never, write, stops ? slot_use::stop : slot_use::ordinary);
  if (slot == no_index) return finish_badly(index, {errc::full});
  asked.provider =
      c != nullptr ? party::of(c->id, in.id()) : party{.who = party::kind::nobody, .speaks = in.id()};
  asked.request = slots_.ref(slot);
  add(counter::calls_out);
  const status sent = messages_.send_request(slot, c != nullptr ? peer_index{c->id.index} : peer_index{},
                                             calls_.ref(index), stops);
  if (!sent) finish_badly(index, sent.error());
}

// To a responder of this process.
void core::hand_to_lane(std::uint32_t index, std::uint32_t lane, const wire::call_args& what) noexcept {
  call& asked = calls_.at(index);
  asked.provider = {.who = party::kind::lane, .index = lane, .generation = views_[lane].generation};
  const bool by_peer = asked.asked_by.who == party::kind::peer;
  const detail::value_header header{
      .stamped_ns = rt::nanoseconds_of(now_),
      .expires_ns = rt::nanoseconds_of(asked.deadline),
      .what = entry::invocation,
      .peer =
          by_peer ? detail::peer_ref{asked.asked_by.index, asked.asked_by.generation} : detail::peer_ref{},
      .call = calls_.ref(index)};
  status done;
  json::decoder::diagnosis fault;
  std::array<char, json::decoder::diagnosis::text_bytes_max> room;
  std::string_view fault_text; // where the text that it points into is gone
  const bool decodes = lanes_[lane].decoder != nullptr;
  if (what.is == form::args || (decodes && what.is == form::object)) {
    done = delivery_.deliver(lane, header, what.text.empty() ? std::string_view{"{}"} : what.text, fault);
  } else {
    const std::uint32_t slot = compose(rt::never, [&](json::writer& into) { wire::write_args(into, what); });
    if (slot == no_index) return finish_badly(index, {errc::full});
    done = delivery_.deliver(lane, header, {slots_.text(slot).data(), slots_.text(slot).size()}, fault);
    if (!done && lanes_[lane].decoder != nullptr) fault_text = fault.text(room);
    release(slot);
  }
  if (done) {
    asked_lane_ = lane;
    return;
  }
  switch (done.code()) {
  case errc::full:
    add(counter::inbox_full);
    return finish_badly(index, {errc::refused}, "the service is busy: all its places for requests are taken");
  case errc::too_big:
    add(counter::too_big);
    return finish_badly(index, {errc::refused}, done.error().message(room));
  default:
    add(counter::undecodable);
    return finish_badly(index, {errc::refused}, fault_text.empty() ? fault.text(room) : fault_text);
  }
}

// To whoever receives what no other handle takes, as one object whatever it came in.
void core::hand_to_receiver(std::uint32_t index, std::string_view service,
                            const wire::call_args& what) noexcept {
  call& asked = calls_.at(index);
  const std::uint32_t lane = receiver_.pair();
  asked.provider = lane != no_index
                       ? party{.who = party::kind::lane, .index = lane, .generation = views_[lane].generation}
                       : party{.who = party::kind::door};
  const detail::value_header header{.stamped_ns = rt::nanoseconds_of(now_),
                                    .expires_ns = rt::nanoseconds_of(asked.deadline),
                                    .what = entry::invocation,
                                    .peer = {asked.asked_by.index, asked.asked_by.generation},
                                    .call = calls_.ref(index)};
  status done;
  if (what.is == form::object) {
    done = receiver_.deliver(header, what.text);
  } else {
    std::array<char, call_table::our_id_bytes_max> room;
    const std::string_view id = calls_.write_id(room, index, peers_.opened());
    const std::uint32_t slot = compose(
        rt::never, [&](json::writer& into) { wire::write_delivered_call(into, service, what.text, id); });
    if (slot == no_index) return finish_badly(index, {errc::full});
    done = receiver_.deliver(header, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
  }
  std::array<char, 192> why;
  if (done) {
    asked_lane_ = lane; // none: a thread of the front door sleeps
  } else {
    finish_badly(index, {errc::refused},
                 done.code() == errc::full ? "nobody takes calls fast enough: the inbox is full"
                                           : done.error().message(why));
  }
}

} // namespace rowe::service
