// SPDX-License-Identifier: Apache-2.0
#include "service/listings.hpp"

#include <algorithm>
#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "wire/own_names.hpp"

#include "service/names.hpp"
#include "service/service_limits.hpp"
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
      unseen_{memory.carve<std::uint32_t>(words_for(told_.size()))},
      waits_{memory.carve<std::uint32_t>(words_for(told_.size()))} {
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

// ---- bits

bool listings::is_set(std::span<const std::uint32_t> bits, const std::uint32_t& number) const noexcept {
  const auto place = static_cast<std::size_t>(&number - told_.data());
  return (bits[place / 32] >> place % 32 & 1) != 0;
}
void listings::set(std::span<std::uint32_t> bits, const std::uint32_t& number, bool to) noexcept {
  const auto place = static_cast<std::size_t>(&number - told_.data());
  const std::uint32_t bit = std::uint32_t{1} << place % 32;
  bits[place / 32] = to ? bits[place / 32] | bit : bits[place / 32] & ~bit;
}
void listings::forget_unseen(std::uint32_t& number) noexcept {
  set(unseen_, number, false);
  number = no_number;
}

// ---- readers

// One message with a part of a list: some topics or services that are gone, or new.
struct listings::part {
  std::size_t count = 0;
  std::size_t bytes = 0;
  std::array<listed, listed_max> which{};
  std::array<std::uint32_t*, listed_max> told{}; // where the peer's row of each is
};

void listings::greet(connection& c) noexcept {
  readers_[{c.id.index}] = {.reads = true, .next = step::hello};
  ++readers_count_;
  all_told_ = false;
  // Before what it may ask in this cycle is answered, unless many peers come at once.
  if (turns_left_ != 0) (void)take_turn(c);
}

void listings::forget(peer_index peer) noexcept {
  if (!readers_[peer].reads) return;
  readers_[peer] = {};
  for (std::uint32_t& number : told(peer)) {
    set(waits_, number, false);
    forget_unseen(number);
  }
  if (--readers_count_ == 0) due_ = rt::never;
}

void listings::tell_again(peer_index peer) noexcept {
  reader& of = readers_[peer];
  if (!of.reads) return;
  for (std::uint32_t& number : told(peer))
    if (is_set(unseen_, number)) forget_unseen(number);
  if (of.next != step::hello) end_round(of);
  all_told_ = false;
}

bool listings::sees(const connection& c, const listed& one, bool topic) const noexcept {
  return topic ? state_.rights.sees(c, one.name) : state_.rights.calls(c, one.name);
}

bool listings::is_told(peer_index peer) const noexcept {
  const reader& of = readers_[peer];
  return !of.reads || !state_.peers[peer].open() ||
         (of.told_at == listed_at_ && of.next == step::none && !of.waits.index);
}

void listings::tell_readers() noexcept {
  due_ = rt::never;
  if (listed_at_ != changes()) {
    if (tells_.take(state_.cycle.now)) {
      listed_at_ = changes();
      all_told_ = false;
    } else {
      due_ = state_.cycle.now + listings_period;
    }
  }
  if (all_told_) return;
  all_told_ = true;
  for (std::uint32_t left = state_.peers.size(); left != 0; --left) {
    if (!is_told(turn_)) {
      all_told_ = false;
      if (turns_left_ == 0) {
        due_ = state_.cycle.now;
        break;
      }
      due_ = std::min(due_, take_turn(state_.peers[turn_]));
    }
    turn_ = {turn_.value + 1 == state_.peers.size() ? 0 : turn_.value + 1};
  }
  turns_left_ = listings_per_cycle;
}

// Tells the peer one message at most. Returns when to look at it again.
rt::time_point listings::take_turn(connection& c) noexcept {
  const peer_index peer{c.id.index};
  reader& to = readers_[peer];
  const peer_queues& its = outbox_.of(peer);
  const rt::time_point later = its.backpressured() ? state_.cycle.now + listings_retry_backpressured
                               : its.scheduled ? state_.cycle.now // it is written at the end of this cycle
                                               : state_.cycle.now + listings_retry;
  if (!settle(peer)) return later;
  if (its.backpressured() || its.replies.count >= listings_queued_max) return later;
  --turns_left_;
  while (!to.waits.index) { // twice at most: a round may end without a message
    if (to.next == step::none && to.told_at == listed_at_) return rt::never;
    if (to.next == step::none) begin_round(to);
    if (!tell(c)) return later;
  }
  return state_.cycle.now;
}

void listings::begin_round(reader& of) noexcept {
  of.next = step::topics_gone;
  of.from = 0;
  of.newest = state_.topics.newest_channel();
  of.newest_of_services = service_directory_.newest_number();
  of.told_at = listed_at_;
}

// It is to be told all that differs.
void listings::end_round(reader& of) noexcept {
  of.next = step::none;
  of.told_at = never_told;
}

// What became of its last message. False: it waits to be written.
bool listings::settle(peer_index peer) noexcept {
  reader& of = readers_[peer];
  if (!of.waits.index) return true;
  const outbox::fate now = outbox_.fate_of(peer, teller::listings, of.waits);
  if (now == outbox::fate::waits) return false;
  const bool lost = now == outbox::fate::lost && !ROWE_MUTANT(list_lost);
  of.waits = {};
  if (of.told == step::hello) {
    if (lost) of.next = step::hello;
    return true;
  }
  const bool added = of.told == step::topics_new || of.told == step::services_new;
  for (std::uint32_t& number : told(peer, of.told)) {
    if (!is_set(waits_, number)) continue;
    set(waits_, number, false);
    if (added == lost) number = no_number;
  }
  if (lost) end_round(of);
  return true;
}

// False: it is to be tried again.
bool listings::tell(connection& c) noexcept {
  reader& to = readers_[{c.id.index}];
  if (to.next == step::hello) return say_hello(c);
  part next;
  while (to.next != step::none) {
    const std::uint32_t from = to.from;
    gather(c, to, next);
    if (next.count != 0) {
      if (send(c, next)) return true;
      to.from = from;
      return false;
    }
    to.next = static_cast<step>(static_cast<unsigned>(to.next) + 1);
    to.from = 0;
  }
  return true;
}

bool listings::say_hello(connection& c) noexcept {
  const peer_index peer{c.id.index};
  const auto write = [&](json::writer& into) {
    return c.protocol->topics.write_hello(into, {.name = name_, .epoch = state_.epoch});
  };
  const slot_id slot = outbox_.reply(peer, write, rt::never, teller::listings);
  if (!slot) return false;
  reader& to = readers_[peer];
  end_round(to);
  to.told = step::hello;
  to.waits = outbox_.ref(slot);
  return true;
}

// What the peer was not told yet, from its row on, as much as one message takes. There are few large slots,
// so only what is alone in its message may need one.
void listings::gather(const connection& c, reader& to, part& into) noexcept {
  const peer_index peer{c.id.index};
  const bool topics = to.next == step::topics_gone || to.next == step::topics_new;
  const bool added = to.next == step::topics_new || to.next == step::services_new;
  const std::uint32_t newest = topics ? to.newest : to.newest_of_services;
  const std::size_t bytes_max = std::min(state_.bounds().small_slot_bytes, state_.bounds().message_bytes_max);
  const std::span<std::uint32_t> its = told(peer, to.next);
  for (; to.from < its.size(); ++to.from) {
    const listed now = topics ? topic_in({to.from}) : service_in(to.from);
    std::uint32_t& number = its[to.from];
    if (number == now.number) continue;
    if (is_set(unseen_, number)) forget_unseen(number); // the peer was not told that it came
    const bool is_new = now.number != no_number && number == no_number;
    if (is_new && now.number > newest) continue; // of the next round
    if (is_new && !sees(c, now, topics)) {
      number = now.number;
      set(unseen_, number, true);
      continue;
    }
    listed one = added ? now : listed{.number = number};
    if (one.number == no_number || (added && !is_new)) continue;
    const std::size_t bytes =
        added ? bytes_of(one, c.protocol->topics, state_.bounds().message_bytes_max) : listed_bytes;
    if (into.count == into.which.size() || (into.count != 0 && into.bytes + bytes > bytes_max)) return;
    into.bytes += bytes;
    into.told[into.count] = &number;
    into.which[into.count++] = one;
  }
}

// False: it is to be tried again.
bool listings::send(connection& c, const part& of) noexcept {
  const peer_index peer{c.id.index};
  reader& to = readers_[peer];
  const bool topics = to.next == step::topics_gone || to.next == step::topics_new;
  const bool added = to.next == step::topics_new || to.next == step::services_new;
  const auto which = std::span<const listed>{of.which}.first(of.count);
  const wire::codec& codec = c.protocol->topics;
  const auto write = [&](json::writer& into) {
    return topics ? codec.write_topics(into, which, added) : codec.write_services(into, which, added);
  };
  const slot_id slot = outbox_.reply(peer, write, rt::never, teller::listings);
  if (!slot) return false;
  for (std::size_t i = 0; i < of.count; ++i) {
    set(waits_, *of.told[i], true);
    if (added) *of.told[i] = of.which[i].number;
  }
  to.told = to.next;
  to.waits = outbox_.ref(slot);
  return true;
}

} // namespace rowe::service
