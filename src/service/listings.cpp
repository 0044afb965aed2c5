// SPDX-License-Identifier: Apache-2.0
#include "service/listings.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "wire/own_names.hpp"

#include "service/names.hpp"
#include "service/service_limits.hpp"
#include "service/shares.hpp"
#include "service/stop_gate.hpp"

namespace rowe::service {
namespace {

using wire::listed;
using wire::no_number;

// Their positions are their numbers, from 1 on.
constexpr std::array own_services{wire::stop_name,          wire::stop_reset_name, wire::stop_lease_name,
                                  wire::stop_state_name,    wire::stats_name,      wire::list_topics_name,
                                  wire::list_services_name, wire::topic_type_name, wire::publishers_name,
                                  wire::service_type_name};
static_assert(own_services.size() < first_service_number);
static_assert(own_services[wire::stop_service_number - 1] == wire::stop_name);
// The peer was told nothing yet.
constexpr std::uint64_t never_told = UINT64_MAX;
// Of one that was added. A schema that is too long for any message is not told.
std::size_t bytes_of(listed& one, const wire::codec& codec, std::size_t bytes_max) noexcept {
  const std::size_t bytes = listed_bytes + bytes_in_json(one.name) + bytes_in_json(one.type);
  const std::size_t with_schemas = bytes + codec.schema_bytes(one);
  if (with_schemas <= bytes_max) return with_schemas;
  one.schema = one.request = nullptr;
  return bytes + codec.schema_bytes(one);
}

} // namespace

listings::listings(rt::arena& memory, const needs& parts) noexcept
    : state_{parts.state},
      service_directory_{parts.service_directory},
      stop_rules_{parts.stop_rules},
      advertisement_table_{parts.advertisement_table},
      outbox_{parts.outbox},
      name_{parts.endpoint_name},
      stop_topic_{state_.topics.find(wire::stop_state_name)},
      readers_{memory.carve<reader>(state_.bounds().connections_max)},
      told_{memory.carve<std::uint32_t>(std::size_t{state_.bounds().connections_max} *
                                        rows_of_peer(state_.bounds()))},
      unseen_{memory.carve<std::uint32_t>(words_for(told_.size()))} {
  std::fill(told_.begin(), told_.end(), no_number);
}

// ---- numbers

listed listings::topic_in(topic_id row) const noexcept {
  const topic& t = state_.topics.at(row);
  if (t.holders == 0 || (row == stop_topic_ && !stop_rules_.in_use())) return {};
  return {.number = t.channel,
          .name = state_.topics.name(row),
          .type = state_.topics.type(row),
          .schema = t.schema};
}

// The endpoint's own services come first, by their numbers, then those in the directory.
listed listings::service_in(std::uint32_t row) const noexcept {
  if (row < first_service_number) {
    const std::string_view name = service_numbered(row);
    return name.empty() ? listed{} : listed{.number = row, .name = name};
  }
  const service_index index{row - first_service_number};
  if (!service_directory_.is_service(index)) return {};
  const service_entry& entry = service_directory_.at(index);
  const detail::queue_pair* by = entry.pair ? &state_.pairs[entry.pair] : nullptr;
  return {.number = entry.number,
          .name = service_directory_.name(index),
          .type = service_directory_.type(index),
          .schema = by != nullptr ? by->encoded : nullptr,
          .request = by != nullptr ? by->decoded : nullptr};
}

std::string_view listings::service_numbered(std::uint32_t number) const noexcept {
  if (number >= first_service_number) {
    const service_index found = service_directory_.find_number(number);
    return !found ? std::string_view{} : service_directory_.name(found);
  }
  if (number == 0 || number > own_services.size()) return {};
  const std::string_view own = own_services[number - 1];
  const bool of_stop = stop_gate::service_named(own) != stop_verb::none;
  return of_stop && !stop_rules_.in_use() ? std::string_view{} : own;
}

topic_id listings::topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept {
  for (subscription_id i = state_.subscriptions.first_of(peer); i;
       i = state_.subscriptions.at(i).next_on_peer) {
    if (state_.subscriptions.at(i).tag == tag) return state_.subscriptions.at(i).topic;
  }
  return {};
}

unknown_number listings::put_names(const connection& c, wire::request& asked) const noexcept {
  const auto unknown = [](std::uint32_t number) -> unknown_number {
    return {"nothing here has the number ", number};
  };
  if (asked.service_number != no_number) {
    asked.service = service_numbered(asked.service_number);
    const bool may = state_.rights.calls(c, asked.service); // else it is not told even the name
    return may && !asked.service.empty() ? unknown_number{} : unknown(asked.service_number);
  }
  topic_id topic{};
  if (asked.channel == no_number) {
    topic = topic_subscribed({c.id.index}, asked.tag);
  } else if (asked.channel_is_peers) {
    topic = advertisement_table_.find_tag({c.id.index}, asked.channel);
  } else {
    topic = state_.topics.find_channel(asked.channel);
    if (topic && !state_.rights.sees(c, state_.topics.name(topic))) topic = {};
  }
  if (!topic) return unknown(asked.channel == no_number ? asked.tag : asked.channel);
  asked.topic = state_.topics.name(topic);
  if (asked.what != wire::verb::subscribe) return {};
  const topic_id other = topic_subscribed({c.id.index}, asked.tag);
  if (!other || other == topic) return {};
  return {"subscribe: this peer gave to another topic the number ", asked.tag};
}

// ---- what a peer may not see

bool listings::is_unseen(const std::uint32_t& number) const noexcept {
  const auto place = static_cast<std::size_t>(&number - told_.data());
  return (unseen_[place / 32] >> place % 32 & 1) != 0;
}
void listings::set_unseen(const std::uint32_t& number, bool to) noexcept {
  const auto place = static_cast<std::size_t>(&number - told_.data());
  const std::uint32_t bit = std::uint32_t{1} << place % 32;
  unseen_[place / 32] = to ? unseen_[place / 32] | bit : unseen_[place / 32] & ~bit;
}
void listings::forget_unseen(std::uint32_t& number) noexcept {
  set_unseen(number, false);
  number = no_number;
}

// ---- readers

// One message with a part of a list: some topics or services that are gone, or new.
struct listings::part {
  const bool topics;
  const bool added;
  std::size_t count = 0;
  std::size_t bytes = 0;
  std::array<listed, listed_max> which{};
  std::array<std::uint32_t*, listed_max> told{}; // where the peer's row of each is
};

// How long a message with a part of a list may become. There are few large slots, so a part must fit into a
// small one as long as the peer's share of those suffices.
std::size_t listings::part_bytes_max(peer_index peer) const noexcept {
  const limits& bounds = state_.bounds();
  const std::uint32_t held = outbox_.entries().held_by(peer, queued_as::evictable, slot_class::small);
  const bool within_share = held < equal_share(bounds.small_slots, state_.peers.count());
  return within_share ? bounds.small_slot_bytes : bounds.message_bytes_max;
}

bool listings::takes_more(peer_index peer) const noexcept {
  return outbox_.of(peer).replies.count < listings_queued_max;
}

// False: it is to be sent later.
bool listings::send(connection& c, part& of) noexcept {
  if (of.count == 0) return true;
  const peer_index peer{c.id.index};
  if (!c.open() || !takes_more(peer)) return false;
  const auto which = std::span<const listed>{of.which}.first(of.count);
  const wire::codec& codec = c.protocol->topics;
  const auto write = [&](json::writer& into) {
    return of.topics ? codec.write_topics(into, which, of.added)
                     : codec.write_services(into, which, of.added);
  };
  if (!outbox_.reply(peer, write, rt::never, true)) return false;
  for (std::size_t i = 0; i < of.count; ++i) *of.told[i] = of.added ? of.which[i].number : no_number;
  of.count = of.bytes = 0;
  return true;
}

// Tells the peer what is gone, or what is new, and was not told yet. False: the rest is told later.
bool listings::tell(connection& c, bool topics, bool added) noexcept {
  const peer_index peer{c.id.index};
  const std::size_t topics_max = state_.bounds().topics_max;
  const std::span<std::uint32_t> its = topics ? told(peer).first(topics_max) : told(peer).subspan(topics_max);
  part next{.topics = topics, .added = added};
  for (std::uint32_t row = 0; row < its.size(); ++row) {
    const listed now = topics ? topic_in({row}) : service_in(row);
    if (its[row] == now.number) continue;
    if (is_unseen(its[row])) forget_unseen(its[row]); // the peer was not told that it came
    if (now.number != no_number && its[row] == no_number && !sees(c, now, topics)) {
      its[row] = now.number;
      set_unseen(its[row], true);
      continue;
    }
    listed one = added ? now : listed{.number = its[row]};
    if (one.number == no_number) continue;
    const std::size_t bytes =
        added ? bytes_of(one, c.protocol->topics, state_.bounds().message_bytes_max) : listed_bytes;
    if (next.count == next.which.size() || next.bytes + bytes > part_bytes_max(peer)) {
      if (!send(c, next)) return false;
    }
    next.bytes += bytes;
    next.told[next.count] = &its[row];
    next.which[next.count++] = one;
  }
  return send(c, next);
}

void listings::tell(connection& c) noexcept {
  const peer_index peer{c.id.index};
  if (takes_more(peer) && tell(c, true, false) && tell(c, true, true) && tell(c, false, false) &&
      tell(c, false, true)) {
    readers_[peer].told_at = listed_at_;
  } else if (!outbox_.of(peer).backpressured()) { // else a cycle comes when its socket has room again
    due_ = std::min(due_, state_.cycle.now + listings_retry);
  }
}

void listings::greet(connection& c) noexcept {
  const peer_index peer{c.id.index};
  readers_[peer] = {.reads = true, .told_at = never_told};
  ++readers_count_;
  const auto write = [&](json::writer& into) {
    return c.protocol->topics.write_hello(into, {.name = name_, .epoch = state_.epoch});
  };
  if (!outbox_.reply(peer, write, rt::never, true)) state_.peers.close_later(c, unread_diagnostic);
  tell(c);
}

void listings::forget(peer_index peer) noexcept {
  if (!std::exchange(readers_[peer].reads, false)) return;
  const std::span<std::uint32_t> its = told(peer);
  for (std::uint32_t& number : its) {
    if (is_unseen(number)) set_unseen(number, false);
    number = no_number;
  }
  if (--readers_count_ == 0) due_ = rt::never;
}

void listings::tell_again(peer_index peer) noexcept {
  if (!readers_[peer].reads) return;
  for (std::uint32_t& number : told(peer))
    if (is_unseen(number)) forget_unseen(number);
  readers_[peer].told_at = never_told;
}

bool listings::sees(const connection& c, const listed& one, bool topic) const noexcept {
  return topic ? state_.rights.sees(c, one.name) : state_.rights.calls(c, one.name);
}

void listings::tell_readers() noexcept {
  due_ = rt::never;
  if (listed_at_ != changes()) {
    if (tells_.take(state_.cycle.now)) {
      listed_at_ = changes();
    } else {
      due_ = state_.cycle.now + listings_period;
    }
  }
  for (connection& c : state_.peers) {
    const reader& one = readers_[{c.id.index}];
    if (c.open() && one.reads && one.told_at != listed_at_) tell(c);
  }
}

} // namespace rowe::service
