// SPDX-License-Identifier: Apache-2.0
// Services and calls. A call comes from a handle or a thread of this process or from a peer, in either
// dialect; it goes to a responder, to whoever receives generically, to a peer, or is answered by the endpoint
// itself; and its end finds the way back. All of that is one table (calls.hpp) and two turns: route() chooses
// who answers, finish() and finish_badly() tell the one who asked. Only this thread decides which of reply,
// refusal, time-out and loss comes first.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstdio>
#include <cstring>

#include "service/core.hpp"
#include "service/publishing.hpp"
#include "json/decoder.hpp"
#include "json/encoder.hpp"
#include "json/splice.hpp"

namespace rowe::service {
namespace {

using detail::entry;
namespace bare = wire::bare;
namespace rosbridge = wire::rosbridge;

constexpr std::size_t sentence_bytes_max = 256;

// A string's text for people; what does not fit or is no string is shown as it stands there.
std::string_view sentence_of(std::string_view raw, std::span<char> scratch) noexcept {
  if (raw.empty()) return {};
  const json::value v = json::root(raw);
  if (const auto text = json::to_string(v, scratch)) return *text;
  return raw.substr(0, sentence_bytes_max);
}

std::string_view print(std::span<char> into, const char* format, std::string_view value) noexcept {
  const int bytes = std::snprintf(into.data(), into.size(), format,
                                  static_cast<int>(std::min<std::size_t>(value.size(), 128)), value.data());
  return {into.data(), std::min(static_cast<std::size_t>(bytes), into.size() - 1)};
}

constexpr std::string_view stats_service = "/rowe/stats";

bool same_service(std::string_view asked, std::string_view name) noexcept {
  return asked == name || asked == name.substr(1);
}

} // namespace

// ---- asked by peers

rt::time_point core::time_limit(std::int64_t time_ns) const noexcept {
  return std::min(rt::deadline_after(now_, rt::duration{time_ns}), // negative: never
                  rt::deadline_after(now_, options_.inbound_ttl));
}

void core::take_call(connection& c, dialect in, std::string_view id_raw, std::string_view service,
                     const asking& what, std::int64_t time_ns) noexcept {
  add(counter::calls_in);
  const auto refuse = [&](std::string_view code, std::string_view why) {
    add(counter::calls_refused);
    report(event::kind::refused_request, c.peer(), why);
    if (in == dialect::bare) return answer_bare_error(c, id_raw, code, why);
    (void)answer(c, [&](json::writer& into) { // what is lost is counted there
      rosbridge::write_service_response_head(into, service, id_raw, false);
      into.string(why);
      rosbridge::write_service_response_tail(into);
    });
  };
  // A quarter of the table is this process's own.
  if (c.calls_asked >= bounds_.calls_per_connection_max ||
      peer_calls_ >= bounds_.calls_max - bounds_.calls_max / 4) {
    std::array<char, 160> why;
    const int bytes =
        std::snprintf(why.data(), why.size(),
                      "too many calls are in flight (limits calls_per_connection_max %u, calls_max %u)",
                      bounds_.calls_per_connection_max, bounds_.calls_max);
    return refuse("busy", {why.data(), static_cast<std::size_t>(bytes)});
  }
  if (!id_raw.empty() && find_asked(c, id_raw) != no_index)
    return refuse("duplicate_id", "a call with this id is not answered yet");
  const std::uint32_t index = calls_.open(party::of(c.id, in), id_raw, service);
  if (index == no_index) return refuse("busy", "all calls_max calls are in flight");
  ++c.calls_asked;
  ++peer_calls_;
  limit_call(index, time_limit(time_ns));
  route(index, service, what);
}

void core::limit_call(std::uint32_t index, rt::time_point until) noexcept {
  calls_.at(index).deadline = until;
  if (until != rt::never) arm(timer::call, index, until);
}

// The call with this id that the peer waits for.
std::uint32_t core::find_asked(connection& c, std::string_view id_raw) noexcept {
  if (c.calls_asked == 0) return no_index;
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    if (calls_.at(i).open && calls_.at(i).asked_by.is(c.id) && calls_.id_raw(i) == id_raw) return i;
  }
  return no_index;
}

// ---- asked by this process

void core::start_call(const party& asker, detail::call_ref own, std::string_view service, const asking& what,
                      rt::time_point deadline) noexcept {
  const auto fails = [&](const error& why) { tell(asker, own, why); };
  if (closing_) return fails({errc::closed});
  if (deadline < now_) {
    add(counter::calls_timed_out);
    return fails({errc::timed_out});
  }
  if (what.is == asking::form::object) {
    if (const status fine = check_text(what.text); !fine) {
      add(counter::malformed);
      return fails(fine.error());
    }
    const auto named = json::find(what.text, "service");
    if (named && what.to.generation == 0) {
      if (const auto name = json::to_string(*named, scratch_)) service = *name;
    }
  } else if (what.is == asking::form::args) {
    if (const status fine = validator_.validate(what.text); !fine) {
      add(counter::malformed);
      return fails(fine.error());
    }
    if (json::root(what.text).type != json::kind::object) return fails({errc::not_an_object});
  }
  const std::uint32_t index = calls_.open(asker, {}, service);
  if (index == no_index) {
    return fails({errc::too_many_calls, calls_.in_flight(), bounds_.calls_max});
  }
  calls_.at(index).own = own;
  limit_call(index, deadline);
  route(index, service, what);
}

// ---- who answers

void core::route(std::uint32_t index, std::string_view service, const asking& what) noexcept {
  const party asker = calls_.at(index).asked_by;
  const bool from_here = asker.who != party::kind::peer;
  if (what.to.generation != 0) {
    connection* const to = find({what.to.index, what.to.generation});
    if (to == nullptr || !to->open()) return finish_badly(index, {errc::peer_lost});
    return ask_peer(index, to, dialect::bare, service, what);
  }
  if (!service.empty()) {
    const std::uint32_t found = services_.find(service);
    if (found != no_index) {
      const service_entry& provider = services_.at(found);
      if (provider.lane != no_index) return hand_to_lane(index, provider.lane, what);
      connection* const peer = find(provider.peer);
      if ((from_here || options_.relay) && peer != nullptr && peer->open())
        return ask_peer(index, peer, dialect::rosbridge, services_.name(found), what);
    }
    const bool ask_server = from_here && ours_ == side::client;
    if (found == no_index && !ask_server) {
      for (const std::string_view own :
           {stats_service, std::string_view{"/rosapi/topics"}, std::string_view{"/rosapi/services"},
            std::string_view{"/rosapi/topic_type"}, std::string_view{"/rosapi/service_type"}}) {
        if (same_service(service, own)) return answer_own(index, own, what);
      }
    }
  }
  if (from_here) return ask_anyone(index, service, what);
  if (received()) return hand_to_receiver(index, service, what);
  finish_badly(index, {errc::no_service});
}

connection* core::server_connection() noexcept {
  for (connection& c : connections_) {
    if (c.open() && c.ours == side::client) return &c;
  }
  return nullptr;
}

// A call of this process that no service in the directory takes: a client asks its server; a server asks the
// first peer that speaks the bare dialect, if the call is of it. Where there is none, it waits for one.
void core::ask_anyone(std::uint32_t index, std::string_view service, const asking& what) noexcept {
  const bool object = what.is == asking::form::object;
  if (ours_ == side::client) {
    const bool in_bare = object || options_.profile != peer_profile::standard;
    return ask_peer(index, server_connection(), in_bare ? dialect::bare : dialect::rosbridge, service, what);
  }
  if (!object) return finish_badly(index, {errc::no_service});
  connection* first = nullptr;
  for (connection& c : connections_) {
    if (c.open() && c.bare && first == nullptr) first = &c;
  }
  ask_peer(index, first, dialect::bare, service, what);
}

// Sends the request; with no peer it waits for the first who comes.
void core::ask_peer(std::uint32_t index, connection* c, dialect in, std::string_view service,
                    const asking& what) noexcept {
  call& asked = calls_.at(index);
  std::array<char, call_table::our_id_bytes_max> room;
  const std::string_view id = calls_.write_id(room, index, epoch_);
  const auto write = [&](json::writer& into) {
    if (in == dialect::bare) {
      if (what.is == asking::form::object) return bare::write_invocation(into, what.text, id);
      return bare::write_call(into, service, id, [&](json::writer& body) { write_args(body, what); });
    }
    rosbridge::write_call_service_head(into, service, id);
    write_args(into, what);
    rosbridge::write_call_service_tail(into);
  };
  const std::uint32_t slot = compose(rt::never, write);
  if (slot == no_index) return finish_badly(index, {errc::full});
  asked.provider = c != nullptr ? party::of(c->id, in) : party{.who = party::kind::nobody, .speaks = in};
  asked.request = slots_.ref(slot);
  add(counter::calls_out);
  begin_letter(slot, {.everyone = c == nullptr, .request_of = calls_.ref(index)});
  if (c != nullptr && !queue_letter(*c, slot)) return finish_badly(index, {errc::full});
  send_letter(slot);
}

// The arguments alone, as one JSON value.
void core::write_args(json::writer& into, const asking& what) const noexcept {
  switch (what.is) {
  case asking::form::value: return what.encoder->encode(what.value, into);
  case asking::form::args: return into.raw(what.text.empty() ? std::string_view{"{}"} : what.text);
  case asking::form::object: break;
  }
  // A bare message: what is not the dialect's own.
  into.begin_object();
  json::object_walk members{json::root(what.text).raw};
  for (json::member m; members.next(m);) {
    constexpr std::string_view own[] = {"service", "message_id", "in_reply_to", "ttl_ms"};
    if (std::any_of(std::begin(own), std::end(own), [&](std::string_view n) { return json::name_is(m, n); }))
      continue;
    into.raw({m.name_raw.data() - 1, m.name_raw.size() + 2}); // with its quotes
    into.append(":");
    into.append(m.what.raw);
  }
  into.end_object();
}

// To a responder of this process.
void core::hand_to_lane(std::uint32_t index, std::uint32_t lane, const asking& what) noexcept {
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
  const bool decodes = lanes_[lane].decoder != nullptr;
  if (what.is == asking::form::args || (decodes && what.is == asking::form::object)) {
    done = fill_inbox(lane, header, what.text.empty() ? std::string_view{"{}"} : what.text);
  } else {
    const std::uint32_t slot = compose(rt::never, [&](json::writer& into) { write_args(into, what); });
    if (slot == no_index) return finish_badly(index, {errc::full});
    done = fill_inbox(lane, header, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
  }
  if (done) return;
  std::array<char, 192> why;
  switch (done.code()) {
  case errc::full:
    add(counter::inbox_full);
    return finish_badly(index, {errc::refused}, "the service is busy: all its places for requests are taken");
  case errc::too_big: add(counter::too_big); break;
  default: add(counter::undecodable); break;
  }
  finish_badly(index, {errc::refused}, done.error().text(why));
}

// To whoever receives what no other handle takes, as a message of the bare dialect whatever it came in.
void core::hand_to_receiver(std::uint32_t index, std::string_view service, const asking& what) noexcept {
  call& asked = calls_.at(index);
  const std::uint32_t lane = receiver();
  asked.provider = lane != no_index
                       ? party{.who = party::kind::lane, .index = lane, .generation = views_[lane].generation}
                       : party{.who = party::kind::door};
  const detail::value_header header{.stamped_ns = rt::nanoseconds_of(now_),
                                    .expires_ns = rt::nanoseconds_of(asked.deadline),
                                    .what = entry::invocation,
                                    .peer = {asked.asked_by.index, asked.asked_by.generation},
                                    .call = calls_.ref(index)};
  status done;
  if (what.is == asking::form::object) {
    done = deliver_message(header, what.text);
  } else {
    std::array<char, call_table::our_id_bytes_max> room;
    const std::string_view id = calls_.write_id(room, index, epoch_);
    const std::uint32_t slot = compose(
        rt::never, [&](json::writer& into) { bare::write_delivered_call(into, service, what.text, id); });
    if (slot == no_index) return finish_badly(index, {errc::full});
    done = deliver_message(header, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
  }
  std::array<char, 192> why;
  if (!done)
    finish_badly(index, {errc::refused},
                 done.code() == errc::full ? "nobody takes calls fast enough: the inbox is full"
                                           : done.error().text(why));
}

// ---- answered by this process

// The call that a handle or a thread answers, provided that it was given to it and has not ended.
result<std::uint32_t> core::find_answered(const party& provider, detail::call_ref which) noexcept {
  call* const found = calls_.find(which);
  const bool own = found != nullptr && found->provider.who == provider.who &&
                   (provider.who != party::kind::lane || (found->provider.index == provider.index &&
                                                          found->provider.generation == provider.generation));
  if (own) return which.index;
  add(counter::replies_unsent);
  return gone_as();
}

// With `waits`, that is told once the answer is written. An error where there is nobody to answer, where it
// is no JSON, where its time is over already, or where it finds no room; then it is not told by this, and
// when there was no room it may try again.
status core::answer_call(const party& provider, detail::call_ref which, const reply& with) noexcept {
  const auto index = find_answered(provider, which);
  if (!index) return index.error();
  if (with.expires < now_) {
    add(counter::expired);
    finish_badly(*index, {errc::refused}, "the reply was not sent within its time to live");
    return errc::expired;
  }
  result<std::uint32_t> slot = no_index;
  if (with.encoder != nullptr) {
    slot = finish(
        *index, [&](json::writer& into) { with.encoder->encode(with.value, into); }, with.expires);
  } else {
    if (const status fine = check_text(with.text); !fine) {
      add(counter::malformed);
      finish_badly(*index, {errc::refused}, "the provider's reply was no proper JSON object");
      return fine;
    }
    slot = finish_with(*index, with.text, with.expires);
  }
  const bool waits = with.waits.who != party::kind::nobody;
  if (!waits) end_without_room(*index, slot);
  if (!slot) return slot.error();
  if (!waits) return {};
  if (*slot == no_index) {
    tell(with.waits, with.own, {}); // to one of this process: it has it
    return {};
  }
  letters_.at(*slot) = {.now = letter::state::queued, .sender = with.waits, .own = with.own};
  slots_.keep(*slot);
  return {};
}

status core::refuse_call(const party& provider, detail::call_ref which, std::string_view why) noexcept {
  const auto index = find_answered(provider, which);
  if (!index) return index.error();
  finish_badly(*index, {errc::refused}, why);
  return {};
}

// ---- answered by peers

void core::take_reply(connection& c, const bare::envelope& said, std::string_view text) noexcept {
  const auto meant = calls_.read_id(said.in_reply_to_raw);
  if (!meant) return add(counter::replies_foreign);
  call* const found = calls_.find(*meant);
  if (found == nullptr) return add(counter::replies_late);
  if (!found->provider.is(c.id)) return add(counter::replies_foreign);
  if (!said.failed) return end_without_room(meant->index, finish_with(meant->index, text));
  std::array<char, sentence_bytes_max> room;
  const errc code = said.error_code == "no_service" ? errc::no_service : errc::refused;
  finish_badly(meant->index, {code}, sentence_of(said.error_text_raw, room));
}

void core::take_service_response(connection& c, const rosbridge::request& said) noexcept {
  const auto meant = calls_.read_id(said.id_raw);
  if (!meant) return add(counter::replies_foreign);
  call* const found = calls_.find(*meant);
  if (found == nullptr) return add(counter::replies_late);
  if (!found->provider.is(c.id)) return add(counter::replies_foreign);
  if (said.result) {
    const std::string_view values = said.values_raw.empty() ? std::string_view{"{}"} : said.values_raw;
    return end_without_room(meant->index, finish_with(meant->index, values));
  }
  std::array<char, sentence_bytes_max> room;
  finish_badly(meant->index, {errc::refused}, sentence_of(said.values_raw, room));
}

// ---- ends

// The call is answered with the value that `write_body(json::writer&)` writes; towards a peer the answer may
// have a time of its own. Returns the slot of an answer on its way to a peer, or no_index where one of this
// process has it. Errors: peer_lost, closed; full: it found no room, and the call has not ended.
template <class WriteBody>
result<std::uint32_t> core::finish(std::uint32_t index, WriteBody&& write_body,
                                   rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who != party::kind::peer) {
    const std::uint32_t slot = compose(rt::never, write_body);
    if (slot == no_index) return errc::full;
    const auto given = finish_with(index, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
    return given;
  }
  connection* const c = find(ended.asked_by.connection());
  const std::string_view id_raw = calls_.id_raw(index);
  if (c == nullptr || !c->open()) {
    add(counter::replies_unsent);
    close_call(index);
    return gone_as();
  }
  const auto write = [&](json::writer& into) {
    if (ended.asked_by.speaks == dialect::bare) return bare::write_reply(into, id_raw, write_body);
    rosbridge::write_service_response_head(into, calls_.service(index), id_raw, true);
    write_body(into);
    rosbridge::write_service_response_tail(into);
  };
  const std::uint32_t slot = answer(*c, write, expires);
  if (slot == no_index) return errc::full;
  close_call(index);
  return slot;
}

result<std::uint32_t> core::finish_with(std::uint32_t index, std::string_view text,
                                        rt::time_point expires) noexcept {
  const call ended = calls_.at(index);
  if (ended.asked_by.who == party::kind::peer) {
    // In rosbridge's values these are members like others; in a bare reply they would stand beside ours.
    const bool wraps = ended.asked_by.speaks == dialect::bare && bare::find_reserved(text);
    const auto write = [&](json::writer& into) {
      if (!wraps) return into.raw(text);
      into.begin_object();
      into.key("result");
      into.raw(text);
      into.end_object();
    };
    return finish(index, write, expires);
  }
  // Whoever asked in bare JSON gets an object.
  const bool reads_objects =
      ended.asked_by.who == party::kind::door || lanes_[ended.asked_by.index].kind == detail::lane_kind::talk;
  if (reads_objects && json::root(text).type != json::kind::object) {
    const std::uint32_t slot = compose(rt::never, [&](json::writer& into) {
      into.begin_object();
      into.key("result");
      into.raw(text);
      into.end_object();
    });
    if (slot == no_index) return errc::full;
    close_call(index);
    tell(ended.asked_by, ended.own, {}, {slots_.text(slot).data(), slots_.text(slot).size()});
    release(slot);
    return no_index;
  }
  close_call(index);
  tell(ended.asked_by, ended.own, {}, text);
  return no_index;
}

// A call whose reply found no room ends without it, where nobody is to try again.
void core::end_without_room(std::uint32_t index, const result<std::uint32_t>& finished) noexcept {
  if (finished || finished.code() != errc::full) return;
  finish_badly(index, {errc::full}, "the reply finds no room: it is too large, or too many wait");
}

// The call ends without a reply. The one who asked is told why: code and sentence.
void core::finish_badly(std::uint32_t index, const error& why, std::string_view sentence) noexcept {
  const call ended = calls_.at(index);
  std::array<char, 256> room;
  if (why.code == errc::no_service && sentence.empty() && ended.service_bytes != 0) {
    sentence = print(room, "Service %.*s does not exist", calls_.service(index));
  } else if (why.code == errc::timed_out) {
    sentence = "the service did not answer in time";
  } else if (sentence.empty()) {
    sentence = why.text(room);
  }
  if (ended.asked_by.who != party::kind::peer) {
    close_call(index);
    return tell(ended.asked_by, ended.own, why, sentence);
  }
  add(counter::calls_refused);
  connection* const c = find(ended.asked_by.connection());
  if (c != nullptr && c->open()) {
    const std::string_view id_raw = calls_.id_raw(index);
    if (ended.asked_by.speaks == dialect::bare) {
      answer_bare_error(*c, id_raw, why.name(), sentence);
    } else {
      (void)answer(*c, [&](json::writer& into) { // what is lost is counted there
        rosbridge::write_service_response_head(into, calls_.service(index), id_raw, false);
        into.string(sentence);
        rosbridge::write_service_response_tail(into);
      });
    }
  }
  close_call(index);
}

void core::close_call(std::uint32_t index) noexcept {
  const call& ended = calls_.at(index);
  if (ended.asked_by.who == party::kind::peer) {
    --peer_calls_;
    if (connection* const c = find(ended.asked_by.connection())) --c->calls_asked;
  }
  disarm(timer::call, index);
  cancel_letter(ended.request);
  calls_.close(index);
}

// A connection is gone: what it asked needs no answer, and what it was to answer has none.
void core::end_calls_of(connection& c) noexcept {
  for (std::uint32_t i = 0; i < services_.places(); ++i) {
    if (services_.in_use(i) && services_.at(i).lane == no_index && services_.at(i).peer == c.id)
      services_.remove(i);
  }
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    const call& one = calls_.at(i);
    if (!one.open) continue;
    if (one.asked_by.is(c.id)) {
      close_call(i);
    } else if (one.provider.is(c.id)) {
      if (!closing_) add(counter::calls_lost);
      finish_badly(i, {gone_as()});
    }
  }
}

void core::end_calls_of_lane(std::uint32_t lane) noexcept {
  for (std::uint32_t i = 0; i < calls_.places(); ++i) {
    const call& one = calls_.at(i);
    if (!one.open) continue;
    if (one.asked_by.who == party::kind::lane && one.asked_by.index == lane) {
      close_call(i);
    } else if (one.provider.who == party::kind::lane && one.provider.index == lane) {
      finish_badly(i, {errc::no_service});
    }
  }
}

// ---- the directory

void core::advertise_service(connection& c, const rosbridge::request& asked) noexcept {
  if (asked.service.starts_with("/rowe/") || asked.service.starts_with("rowe/"))
    return refuse(c, asked.id_raw, "advertise_service: services below /rowe/ are the endpoint's own");
  std::uint32_t mine = 0;
  for (std::uint32_t i = 0; i < services_.places(); ++i)
    mine += services_.in_use(i) && services_.at(i).lane == no_index && services_.at(i).peer == c.id;
  if (mine >= bounds_.advertisements_per_connection_max) {
    return refuse_limit(c, asked.id_raw, "services of one peer", bounds_.advertisements_per_connection_max,
                        "advertisements_per_connection_max");
  }
  const auto [index, why] = services_.add(asked.service, asked.type, no_index, c.id);
  if (why == services::refusal::no_room)
    return refuse_limit(c, asked.id_raw, "services", bounds_.services_max, "services_max");
  if (why == services::refusal::taken) {
    const service_entry& there = services_.at(services_.find(asked.service));
    // Clients that reconnect say it again.
    if (there.lane == no_index && there.peer == c.id) return;
    std::array<char, 192> text;
    refuse(c, asked.id_raw, print(text, "advertise_service: %.*s is provided already", asked.service));
  }
}

void core::unadvertise_service(connection& c, const rosbridge::request& asked) noexcept {
  const std::uint32_t index = services_.find(asked.service);
  if (index == no_index || services_.at(index).lane != no_index || services_.at(index).peer != c.id)
    return refuse(c, asked.id_raw, "unadvertise_service: this peer does not provide the service");
  services_.remove(index);
}

// ---- what the endpoint itself answers

void core::answer_own(std::uint32_t index, std::string_view service, const asking& what) noexcept {
  calls_.at(index).provider = {.who = party::kind::core};
  const auto named = [&](std::string_view member) -> std::string_view {
    const auto found = what.text.empty() ? std::nullopt : json::find(json::root(what.text).raw, member);
    const auto text = found ? json::to_string(*found, scratch_) : std::nullopt;
    return text.value_or(std::string_view{});
  };
  const auto list = [&](json::writer& into, std::string_view key, bool topics, bool types) {
    into.key(key);
    into.begin_array();
    const std::uint32_t places = topics ? router_.topic_places() : services_.places();
    for (std::uint32_t i = 0; i < places; ++i) {
      if (topics ? router_.at(i).holders == 0 : !services_.in_use(i)) continue;
      into.string(topics ? (types ? router_.type(i) : router_.name(i))
                         : (types ? services_.type(i) : services_.name(i)));
    }
    into.end_array();
  };
  const auto finished = finish(index, [&](json::writer& into) {
    if (service == stats_service) return write_report(into);
    into.begin_object();
    if (service == "/rosapi/topics") {
      list(into, "topics", true, false);
      list(into, "types", true, true);
    } else if (service == "/rosapi/services") {
      list(into, "services", false, false);
    } else if (service == "/rosapi/topic_type") {
      const std::uint32_t topic = router_.find(named("topic"));
      into.key("type");
      into.string(topic == no_index ? std::string_view{} : router_.type(topic));
    } else {
      const std::uint32_t found = services_.find(named("service"));
      into.key("type");
      into.string(found == no_index ? std::string_view{} : services_.type(found));
    }
    into.end_object();
  });
  end_without_room(index, finished);
}

// ---- handles that talk, respond and call

void core::attach_talker(std::uint32_t index) noexcept {
  detail::lane& lane = lanes_[index];
  lane_view& view = views_[index];
  const auto answer_with = [&](detail::lane_state state) {
    lane.state.store(state, std::memory_order_release); // release: pairs with the acquire in open_lane()
    lane.news.notify();
  };
  if (detail::responds(lane.kind)) {
    const auto [at, why] = services_.add(lane.name(), lane.type(), index, {});
    if (why != services::refusal::none) {
      lane.answer = why == services::refusal::taken
                        ? error{errc::service_taken}
                        : error{errc::too_many_services, services_.count(), bounds_.services_max};
      return answer_with(detail::lane_state::refused);
    }
    view.service = at;
  }
  view.attached = true;
  ++talking_lanes_;
  lane.heard_by.store(detail::audience::somebody,
                      std::memory_order_relaxed); // relaxed: `active` publishes it
  if (connection* const c = server_connection()) announce_service(*c, index, true);
  if (receiver() == index && !door_.manned()) take_over_inbox(index);
  answer_with(detail::lane_state::active);
}

// What came before anybody received is for the first who does.
void core::take_over_inbox(std::uint32_t index) noexcept {
  const party us{.who = party::kind::lane, .index = index, .generation = views_[index].generation};
  while (const auto slot = door_.take_back(now_)) {
    const door_header& came = door_.inbound_header(*slot);
    call* const asked = calls_.find(came.call);
    const bool is_call = came.what == door_request::invocation;
    if (asked != nullptr) asked->provider = us;
    if (!is_call || asked != nullptr) {
      const status done = deliver_message({.stamped_ns = rt::nanoseconds_of(came.stamped),
                                           .expires_ns = rt::nanoseconds_of(came.expires),
                                           .what = is_call ? entry::invocation : entry::message,
                                           .peer = came.peer,
                                           .call = came.call},
                                          door_.inbound_text(*slot));
      if (!done && is_call) finish_badly(came.call.index, {errc::refused}, "the inbox is full");
    }
    door_.give_back_inbound(*slot);
  }
}

void core::detach_talker(std::uint32_t index) noexcept {
  lane_view& view = views_[index];
  end_calls_of_lane(index);
  if (view.service != no_index) services_.remove(view.service);
  if (connection* const c = server_connection()) announce_service(*c, index, false);
  --talking_lanes_;
}

// As a client: a server learns which services this process provides.
void core::announce_service(connection& c, std::uint32_t index, bool begins) noexcept {
  const detail::lane& lane = lanes_[index];
  if (!detail::responds(lane.kind) || options_.profile != peer_profile::standard) return;
  std::array<char, 8192> text; // request_bytes_max() is 4782 with the longest names
  send_direct(c, begins ? rosbridge::encode_advertise_service(text, lane.name(), lane.type())
                        : rosbridge::encode_unadvertise_service(text, lane.name()));
}

} // namespace rowe::service
