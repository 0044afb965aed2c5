// SPDX-License-Identifier: Apache-2.0
#include "service/parameters/parameter_requests.hpp"

#include <algorithm>
#include <array>

#include "service/base/names.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/codec/refusal.hpp"

namespace rowe::service {
namespace {

using diagnostic_buffer = std::array<char, wire::refusal::text_bytes_max>;
using name_buffer = std::array<char, parameters::name_bytes_max>;

// Calls `take(element)` with each.
template <class Take>
void for_each(std::string_view list, const Take& take) noexcept {
  json::array_walk elements{list};
  for (json::value one; elements.next(one);) take(one);
}

// The name in a list of names, or of objects; empty: it is longer than any name, or has no characters.
std::string_view name_in(const json::value& element, std::span<char> buffer) noexcept {
  const auto member = element.type == json::kind::object ? json::find(element.raw, "name") : element;
  const auto name = member ? json::to_string(*member, buffer) : std::nullopt;
  return name && name->size() <= parameters::name_bytes_max ? *name : std::string_view{};
}

} // namespace

parameter_requests::parameter_requests(rt::arena& memory, const parameter_requests_needs& parts) noexcept
    : parameter_requests_needs{parts},
      subscribers_{memory.carve<subscriber>(state_.bounds().connections_max)},
      named_{memory.carve<std::uint64_t>(std::size_t{state_.bounds().connections_max} *
                                         state_.bounds().parameters_max)} {}

// ---- values

void parameter_requests::write_value(json::writer& into, const wire::codec& codec,
                                     parameter_id which) const noexcept {
  name_buffer name;
  std::array<char, parameter_json_bytes_max> buffer;
  json::writer value{buffer};
  if (parameters_.in_use(which)) parameters_.write_value(which, value);
  codec.add_parameter(into, {.name = parameters_.name(which, name),
                             .json = value.text(),
                             .is_real = value.bytes() != 0 && parameters_.is_real(which)});
}

std::size_t parameter_requests::bytes_of(parameter_id which) const noexcept {
  name_buffer name;
  std::array<char, parameter_json_bytes_max> buffer;
  json::writer value{buffer};
  if (parameters_.in_use(which)) parameters_.write_value(which, value);
  return bytes_in_json(parameters_.name(which, name)) + value.bytes() + parameter_update_bytes;
}

// What there is not has no value; so its name is written as it was asked for. An empty list is all.
void parameter_requests::write_named(json::writer& into, const wire::codec& codec,
                                     std::string_view list) const noexcept {
  bool any = false;
  for_each(list, [&](const json::value& one) {
    any = true;
    name_buffer buffer;
    const std::string_view name = name_in(one, buffer);
    if (name.empty()) return;
    if (const parameter_id which = parameters_.find(name)) return write_value(into, codec, which);
    codec.add_parameter(into, {.name = name, .json = {}});
  });
  if (any) return;
  for (const parameter_id which : parameters_.ids()) {
    if (parameters_.in_use(which)) write_value(into, codec, which);
  }
}

void parameter_requests::answer(connection& c, const wire::request& asked) noexcept {
  state_.cycle.work_bytes += answer_work;
  const wire::codec& codec = state_.seams.protocols.of(asked.codec);
  const slot_id slot = outbox_.reply({c.id.index}, [&](json::writer& into) {
    codec.begin_parameters(into, asked.id_raw);
    write_named(into, codec, asked.body_raw);
    return codec.end_parameters(into);
  });
  if (slot) return;
  diagnostic_buffer text;
  wire::text_out why{text};
  why.add(asked.verb_text)
      .add(": there is no room for the values now, or they do not fit into a message of ");
  why.add(state_.bounds().message_bytes_max).add(" bytes: ask for fewer");
  refusals_.refuse(c, asked.id_raw, why.text());
}

// ---- requests

// True, and refused, if the list has more than so many elements.
bool parameter_requests::names_too_many(connection& c, const wire::request& asked,
                                        std::uint32_t most) noexcept {
  std::uint32_t count = 0;
  for_each(asked.body_raw, [&](const json::value&) { ++count; });
  state_.cycle.work_bytes += std::min(count, most) * parameter_work_bytes;
  if (count <= most) return false;
  diagnostic_buffer text;
  wire::text_out why{text};
  why.add(asked.verb_text).add(": ").add(count).add(" parameters in one message are too many; it takes ");
  refusals_.refuse(c, asked.id_raw, why.add(most).text());
  return true;
}

void parameter_requests::get(connection& c, const wire::request& asked) noexcept {
  parameters_.take();
  if (!names_too_many(c, asked, parameters_.count())) answer(c, asked);
}

// Who asks for an answer, by an id, and may get the values, gets those that hold now.
void parameter_requests::set(connection& c, const wire::request& asked) noexcept {
  parameters_.take();
  if (names_too_many(c, asked, std::max(state_.bounds().parameters_max, 1U))) return;
  bool any = false;
  for_each(asked.body_raw, [&](const json::value& one) {
    any = true;
    if (c.open()) set_one(c, asked, one);
  });
  if (any && !asked.id_raw.empty() && state_.rights.calls(c, wire::get_param_name)) answer(c, asked);
}

void parameter_requests::set_one(connection& c, const wire::request& asked, const json::value& one) noexcept {
  name_buffer buffer;
  const std::string_view name = name_in(one, buffer);
  diagnostic_buffer text;
  wire::text_out why{text};
  if (!access_control_.may_set(c, name, why)) return refusals_.deny(c, asked, why.text());
  why.add("parameter ").add_name(name, topic_bytes_shown).add(": ");
  const parameter_id which = parameters_.find(name);
  const auto value = json::find(one.raw, "value");
  if (!which) {
    why.add("there is no such parameter");
  } else if (!value) {
    why.add("the value is missing; nobody can delete it, because it belongs to the robot's program");
  } else if (parameters_.set(which, value->raw, why)) {
    return;
  }
  refusals_.refuse(c, asked.id_raw, why.text());
}

// ---- subscribers

bool parameter_requests::is_named(peer_index peer, std::string_view name) const noexcept {
  const auto its = names_of(peer).first(subscribers_[peer].named);
  return std::find(its.begin(), its.end(), hash_of(without_slash(name))) != its.end();
}

void parameter_requests::subscribe(connection& c, const wire::request& asked) noexcept {
  parameters_.take();
  if (names_too_many(c, asked, parameters_.count())) return;
  subscriber& of = subscribers_[{c.id.index}];
  if (!of.any()) {
    of = {};
    of.announced_at = parameters_.changes();
  }
  bool named = false;
  for_each(asked.body_raw, [&](const json::value& one) {
    named = true;
    name_buffer buffer;
    subscribe_to(c, asked, name_in(one, buffer));
  });
  if (!named) of.to_all = true;
  answer(c, asked);
}

void parameter_requests::subscribe_to(connection& c, const wire::request& asked,
                                      std::string_view name) noexcept {
  const peer_index peer{c.id.index};
  subscriber& of = subscribers_[peer];
  if (name.empty() || is_own_name(name) || is_named(peer, name)) return;
  const std::span<std::uint64_t> its = names_of(peer);
  if (of.named < its.size()) {
    its[of.named++] = hash_of(without_slash(name));
    return;
  }
  diagnostic_buffer text;
  wire::text_out why{text};
  why.add(asked.verb_text).add(": ").add_name(name, topic_bytes_shown).add(" is one too many: this peer");
  why.add(" may name ").add(of.named).add(" parameters (limit parameters_max), or all by an empty list");
  refusals_.refuse(c, asked.id_raw, why.text());
}

void parameter_requests::unsubscribe(connection& c, const wire::request& asked) noexcept {
  if (names_too_many(c, asked, parameters_.count())) return;
  const peer_index peer{c.id.index};
  subscriber& of = subscribers_[peer];
  bool named = false;
  for_each(asked.body_raw, [&](const json::value& one) {
    named = true;
    name_buffer buffer;
    const std::span<std::uint64_t> its = names_of(peer).first(of.named);
    const auto at = std::find(its.begin(), its.end(), hash_of(without_slash(name_in(one, buffer))));
    if (at == its.end()) return;
    *at = its.back();
    --of.named;
  });
  if (!named) return forget(peer);
  if (of.to_all)
    refusals_.refuse(
        c, asked.id_raw,
        "unsubscribeParameterUpdates: this peer subscribed to all parameters, so it can only end "
        "that for all, by an empty list");
}

bool parameter_requests::needs_update(peer_index peer, parameter_id which) const noexcept {
  const subscriber& of = subscribers_[peer];
  if (parameters_.changed_at(which) <= of.announced_at) return false;
  name_buffer buffer;
  const std::string_view name = parameters_.name(which, buffer);
  // Opened again it may have another place. That it is gone from here must not be the last that is announced.
  if (!parameters_.in_use(which) && parameters_.find(name)) return false;
  return of.to_all || is_named(peer, name);
}

// What became of its last message. What an evicted one said is announced again, as it is then. False: it
// waits.
bool parameter_requests::settle(peer_index peer) noexcept {
  subscriber& of = subscribers_[peer];
  const auto now = of.message.take_fate(outbox_.of(peer), announcer::parameters);
  if (now == announcement::fate::written) go_on(of);
  return now != announcement::fate::waits;
}

// What the last message said is known.
void parameter_requests::go_on(subscriber& of) noexcept {
  of.from = of.then;
  if (of.from == 0) of.announced_at = of.announcing;
}

// Writes one message. The rest, or all, comes later if there is too much of it, or the peer does not read.
void parameter_requests::announce(connection& c) noexcept {
  const peer_index peer{c.id.index};
  subscriber& of = subscribers_[peer];
  if (outbox_.of(peer).replies.count >= listings_queued_max) return;
  if (of.from == 0) of.announcing = parameters_.changes();
  const std::size_t bytes_max = state_.bounds().message_bytes_max - parameters_envelope_bytes;
  std::size_t bytes = 0;
  std::uint32_t to = of.from;
  for (; to < parameters_.count() && !parameters_.is_read_only({to}); ++to) {
    if (!needs_update(peer, {to})) continue;
    const std::size_t more = bytes_of({to});
    if (more > bytes_max) {
      state_.counts.add(counter::too_big);
      continue;
    }
    if (bytes + more > bytes_max) break;
    bytes += more;
  }
  const wire::codec& codec = c.protocol->topics;
  const auto write = [&](json::writer& into) {
    codec.begin_parameters(into, {});
    for (std::uint32_t i = of.from; i < to; ++i) {
      if (needs_update(peer, {i}) && bytes_of({i}) <= bytes_max) write_value(into, codec, {i});
    }
    return codec.end_parameters(into);
  };
  const bool ended = to == parameters_.count() || parameters_.is_read_only({to});
  of.then = ended ? 0 : to;
  if (bytes == 0) return go_on(of);
  if (outbox_.reply(peer, write, rt::never, announcer::parameters)) of.message.begin(outbox_.of(peer));
}

auto parameter_requests::announce_changes() noexcept -> round {
  const auto must_update = [this](peer_index peer) {
    const subscriber& of = subscribers_[peer];
    return state_.peers[peer].open() && of.any() && of.announced_at != parameters_.changes();
  };
  for (unsigned left = parameter_announcements_per_cycle; turn_.value < state_.peers.size(); ++turn_.value) {
    if (!settle(turn_) || !must_update(turn_)) continue;
    if (left == 0) return round::more_next;
    --left;
    announce(state_.peers[turn_]);
  }
  turn_ = {0};
  for (const peer_index peer : state_.peers.ids()) {
    if (must_update(peer)) return round::some_later;
  }
  return round::all_know;
}

} // namespace rowe::service
