// SPDX-License-Identifier: Apache-2.0
// Endpoints for C: options converted, objects as text submitted and received.
#include "capi/endpoint.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <rowe/settings.hpp>

#include "capi/error.hpp"
#include "capi/object.hpp"
#include "wire/codec/object_form.hpp"

namespace rowe::capi {

struct origin {
  connection from;
  std::optional<received> call; // of an invocation, until it is answered: its answer goes by this
};

void origin_delete::operator()(origin* gone) const noexcept { delete gone; }

namespace {

result<endpoint_options> options_of(const rowe_options* given) {
  const result<rowe_options> all = whole(given);
  if (!all) return all.error();
  endpoint_options options;
  if (all->name != nullptr) options.name = all->name;
  switch (all->profile) {
  case rowe_profile_standard: options.profile = websocket_profile::standard; break;
  case rowe_profile_hop: options.profile = websocket_profile::hop; break;
  case rowe_profile_hop_2014: options.profile = websocket_profile::hop_2014; break;
  default: return error{errc::bad_argument, all->profile, rowe_profile_hop_2014, argument::profile};
  }
  switch (all->idle) {
  case rowe_idle_poll: options.idle_policy = idle::poll; break;
  case rowe_idle_spin: options.idle_policy = idle::spin; break;
  case rowe_idle_wake: options.idle_policy = idle::wake; break;
  case rowe_idle_phase: options.idle_policy = idle::phase; break;
  default: return error{errc::bad_argument, all->idle, rowe_idle_phase, argument::idle_policy};
  }
  if (all->address != nullptr) options.address = all->address;
  options.insecure = all->insecure;
  options.page = !all->no_page;
  options.plain_unasked = !all->only_when_spoken_to;
  options.answers_any = true; // what arrives waits for rowe_receive()
  options.relay = all->relay;
  if (all->pin_service) options.service_cpu = all->service_cpu;
  options.service_priority = all->service_priority;
  if (all->inbound_ttl_ms != 0) options.inbound_ttl = duration_of(all->inbound_ttl_ms);
  const auto set = [](duration& into, long given_ms) {
    if (given_ms != 0) into = time_of_option<std::chrono::milliseconds>(given_ms);
  };
  options.stop.unguarded = all->stop_unguarded;
  set(options.stop.guard_timeout, all->stop_guard_timeout_ms);
  set(options.stop.tick, all->stop_tick_ms);
  set(options.stop.service_timeout, all->stop_service_timeout_ms);
  set(options.stop.observe_timeout, all->stop_observe_timeout_ms);
  limits& bounds = options.limits;
  bounds.connections_max = or_default(all->connections_max, bounds.connections_max);
  bounds.message_bytes_max = or_default(all->message_bytes_max, bounds.message_bytes_max);
  bounds.door_slots = or_default(all->door_slots, bounds.door_slots);
  bounds.door_slot_bytes = or_default(all->door_slot_bytes, bounds.door_slot_bytes);
  bounds.handle_bytes = or_default(all->handle_bytes, bounds.handle_bytes);
  bounds.long_message_bytes_max = or_default(all->long_message_bytes_max, bounds.long_message_bytes_max);
  bounds.long_slots = or_default(all->long_slots, bounds.long_slots);
  return options;
}

// ws://HOST:PORT/PATH. An IPv6 address gets its brackets; what would end the host early is refused here.
result<std::string> url_of(std::string_view host, int port, const char* path) {
  if (port < 1 || port > 65535) return error{errc::bad_argument, port, 65535, argument::port};
  const bool bracketed = host.starts_with('[') && host.ends_with(']');
  const auto colons = std::ranges::count(host, ':');
  const bool several = colons > 1 && !bracketed;
  constexpr std::int64_t host_at = 5; // ws://
  if (const auto at = host.find_first_of("/?#@ "); at != std::string_view::npos || colons == 1) {
    const auto wrong_at = static_cast<std::int64_t>(std::min(at, host.find(':')));
    return error{errc::bad_url, host_at + wrong_at};
  }
  if (path != nullptr && path[0] != '/')
    return error{errc::bad_url, host_at + static_cast<std::int64_t>(host.size())};
  std::string url = several ? "ws://[" : "ws://";
  url.append(host).append(several ? "]:" : ":").append(std::to_string(port));
  return url.append(path != nullptr ? path : "/");
}

// Puts an endpoint where C can point at it.
rowe_endpoint* shown(result<endpoint>&& opened) {
  if (!opened) return no(opened.error());
  auto inside = std::make_unique<endpoint>(std::move(*opened));
  return new rowe_endpoint{std::make_unique<struct_descriptions>(), std::move(inside)};
}

// What has arrived as an object. A call holds its slot of the shared inbox, a message releases it here.
rowe_object* object_of(received&& arrived) {
  auto object = std::make_unique<rowe_object>(tree_of(arrived.value()));
  object->from.reset(new origin{arrived.from(), std::nullopt});
  if (arrived.wants_reply()) object->from->call.emplace(std::move(arrived));
  return object.release();
}

connection connection_of(rowe_peer peer) noexcept { return {peer.index, peer.generation}; }

// What the service thread would refuse as well, but could report only to those who wait.
status check_message(const rowe_object& object, std::string_view text) noexcept {
  if (object.type != json::kind::object) return errc::not_an_object;
  const auto at = wire::find_reserved(text);
  return at ? status{error{errc::reserved_member, static_cast<std::int64_t>(*at)}} : status{};
}

// Hands the object's text to `send(endpoint&, text)`.
template <class Send>
int send_text(const rowe_endpoint* endpoint, const rowe_object* object, Send&& send) noexcept {
  if (endpoint == nullptr || object == nullptr) return fail(errc::misuse);
  return code_with_memory([&] {
    const std::string text = text_of(*object);
    if (const status fine = check_message(*object, text); !fine) return done(fine);
    return done(send(*endpoint->inside, std::string_view{text}));
  });
}

// Ends an invocation by `answer(endpoint&, received&)`. One that has its answer, or can have none any more,
// gives its slot back.
template <class Answer>
int answer_call(const rowe_endpoint* endpoint, const rowe_object* invocation, Answer&& answer) noexcept {
  if (endpoint == nullptr || invocation == nullptr) return fail(errc::misuse);
  if (!invocation->from || !invocation->from->call) return fail(errc::misuse);
  return code_with_memory([&] {
    const status answered = answer(*endpoint->inside, *invocation->from->call);
    const bool still_open = !answered && (answered.code() == errc::misuse || answered.code() == errc::full ||
                                          answered.code() == errc::too_big);
    if (!still_open) invocation->from->call.reset();
    return done(answered);
  });
}

// A piece of an event as a C string.
template <std::size_t Bytes>
void copy_text(std::string_view from, char (&to)[Bytes]) noexcept {
  to[from.copy(to, Bytes - 1)] = '\0';
}

static_assert(static_cast<int>(event::kind::peer_joined) == rowe_event_peer_joined &&
              static_cast<int>(event::kind::peer_left) == rowe_event_peer_left &&
              static_cast<int>(event::kind::refused_handshake) == rowe_event_refused_handshake &&
              static_cast<int>(event::kind::cannot_connect) == rowe_event_cannot_connect &&
              static_cast<int>(event::kind::refused_request) == rowe_event_refused_request &&
              static_cast<int>(event::kind::status_from_peer) == rowe_event_status_from_peer &&
              static_cast<int>(event::kind::limit) == rowe_event_limit &&
              static_cast<int>(event::kind::warning) == rowe_event_warning &&
              static_cast<int>(event::kind::denied) == rowe_event_denied &&
              static_cast<int>(event::kind::stop) == rowe_event_stop);

} // namespace
} // namespace rowe::capi

using namespace rowe::capi;
using rowe::errc;
using rowe::error;

// ---- endpoints

struct rowe_endpoint* rowe_open_local_endpoint(int port) {
  return rowe_open_local_endpoint_with(port, nullptr);
}

struct rowe_endpoint* rowe_open_local_endpoint_with(int port, const struct rowe_options* options) {
  return pointer_with_memory([&]() -> rowe_endpoint* {
    if (port < 0 || port > 65535) return no({errc::bad_argument, port, 65535, rowe::argument::port});
    const auto converted = options_of(options);
    if (!converted) return no(converted.error());
    return shown(rowe::endpoint::listen(static_cast<std::uint16_t>(port), *converted));
  });
}

struct rowe_endpoint* rowe_open_configured_endpoint(const char* path) {
  return pointer_with_memory([&]() -> rowe_endpoint* {
    if (path == nullptr) return no(errc::misuse);
    const auto as_of_zeroes = options_of(nullptr);
    if (!as_of_zeroes) return no(as_of_zeroes.error());
    rowe::settings chosen{{.endpoint = *as_of_zeroes, .serve = {}}};
    std::string why;
    rowe::status right = chosen.read_file(path, &why);
    if (right) right = chosen.check(&why);
    if (!right) return no(right.error(), std::string_view{why}.substr(0, why.find('\n')));
    return shown(rowe::endpoint::listen(chosen.values().endpoint));
  });
}

struct rowe_endpoint* rowe_open_remote_endpoint(const char* host, int port) {
  return rowe_open_remote_endpoint_with(host, port, nullptr);
}

struct rowe_endpoint* rowe_open_remote_endpoint_with(const char* host, int port,
                                                     const struct rowe_options* options) {
  if (host == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_endpoint* {
    const auto converted = options_of(options);
    if (!converted) return no(converted.error());
    const auto url = url_of(host, port, whole(options)->path);
    if (!url) return no(url.error());
    return shown(rowe::endpoint::connect(*url, *converted));
  });
}

int rowe_endpoint_port(const struct rowe_endpoint* endpoint) {
  return endpoint == nullptr ? 0 : endpoint->inside->port();
}

unsigned rowe_peers(const struct rowe_endpoint* endpoint) {
  return endpoint == nullptr ? 0 : endpoint->inside->peers();
}

int rowe_wait_peer(const struct rowe_endpoint* endpoint, long timeout_ms) {
  if (endpoint == nullptr) return fail(errc::misuse);
  return done(endpoint->inside->wait_peer(duration_of(timeout_ms)));
}

int rowe_close(const struct rowe_endpoint* endpoint, long drain_ms) {
  if (endpoint == nullptr) return fail(errc::misuse);
  return done(endpoint->inside->close(duration_of(drain_ms)));
}

void rowe_endpoint_free(struct rowe_endpoint* endpoint) { delete endpoint; }

// ---- messages

int rowe_send(const struct rowe_endpoint* endpoint, const struct rowe_object* object, long ttl_ms) {
  return rowe_send_to(endpoint, {0, 0}, object, ttl_ms);
}

int rowe_async_send(const struct rowe_endpoint* endpoint, const struct rowe_object* object, long ttl_ms) {
  return rowe_async_send_to(endpoint, {0, 0}, object, ttl_ms);
}

int rowe_send_to(const struct rowe_endpoint* endpoint, struct rowe_peer peer,
                 const struct rowe_object* object, long ttl_ms) {
  return send_text(endpoint, object, [&](rowe::endpoint& by, std::string_view text) {
    return by.send(text, duration_of(ttl_ms), connection_of(peer));
  });
}

int rowe_async_send_to(const struct rowe_endpoint* endpoint, struct rowe_peer peer,
                       const struct rowe_object* object, long ttl_ms) {
  return send_text(endpoint, object, [&](rowe::endpoint& by, std::string_view text) {
    return by.try_send(text, duration_of(ttl_ms), connection_of(peer));
  });
}

struct rowe_object* rowe_receive(const struct rowe_endpoint* endpoint, long timeout_ms) {
  if (endpoint == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_object* {
    auto arrived = endpoint->inside->receive(duration_of(timeout_ms));
    if (!arrived) return no(arrived.error());
    return object_of(std::move(*arrived));
  });
}

int rowe_wait_room(const struct rowe_endpoint* endpoint, struct rowe_peer peer, long timeout_ms) {
  if (endpoint == nullptr) return fail(errc::misuse);
  return done(endpoint->inside->wait_room(duration_of(timeout_ms), connection_of(peer)));
}

struct rowe_peer rowe_object_sender(const struct rowe_object* received) {
  if (received == nullptr || !received->from) return {0, 0};
  return {received->from->from.index, received->from->from.generation};
}

// ---- calls

struct rowe_object* rowe_invoke(const struct rowe_endpoint* endpoint, struct rowe_object* object,
                                long timeout_ms) {
  if (endpoint == nullptr || object == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_object* {
    std::string why;
    auto reply = endpoint->inside->invoke(std::string_view{text_of(*object)}, duration_of(timeout_ms),
                                          rowe::everyone, &why);
    if (reply) return object_of(std::move(*reply));
    fail(reply.error(), why);
    return nullptr;
  });
}

int rowe_reply(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
               const struct rowe_object* object, long ttl_ms) {
  if (object == nullptr) return fail(errc::misuse);
  return answer_call(endpoint, invocation, [&](rowe::endpoint& by, const rowe::received& call) {
    return by.reply(call, std::string_view{text_of(*object)}, duration_of(ttl_ms));
  });
}

int rowe_async_reply(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
                     const struct rowe_object* object) {
  if (object == nullptr) return fail(errc::misuse);
  return answer_call(endpoint, invocation, [&](rowe::endpoint& by, const rowe::received& call) {
    return by.try_reply(call, std::string_view{text_of(*object)});
  });
}

int rowe_refuse(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
                const char* diagnostic) {
  if (diagnostic == nullptr) return fail(errc::misuse);
  return answer_call(endpoint, invocation, [&](rowe::endpoint& by, const rowe::received& call) {
    return by.refuse(call, diagnostic);
  });
}

// ---- events

int rowe_try_event(const struct rowe_endpoint* endpoint, struct rowe_event* into) {
  if (endpoint == nullptr || into == nullptr) return fail(errc::misuse);
  const auto what = endpoint->inside->try_event();
  if (!what) return fail(errc::empty);
  into->kind = static_cast<rowe_event_kind>(what->what_kind);
  copy_text(what->peer, into->peer);
  copy_text(what->what, into->what);
  copy_text(what->remedy, into->remedy);
  copy_text(what->identity, into->identity);
  into->lasting = what->lasting;
  return rowe_ok;
}

struct rowe_object* rowe_stats(const struct rowe_endpoint* endpoint) {
  if (endpoint == nullptr) return no(errc::misuse);
  return pointer_with_memory([&]() -> rowe_object* {
    auto all = std::make_unique<rowe_object>(rowe_object::kind::object);
    for (const rowe::count& one : endpoint->inside->counts()) {
      rowe_object value{rowe_object::kind::number};
      value.text = std::to_string(one.value);
      if (const rowe::status added = all->add(one.name, std::move(value)); !added) return no(added.error());
    }
    return all.release();
  });
}
