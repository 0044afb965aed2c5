// SPDX-License-Identifier: Apache-2.0
#include "service/graph/listings.hpp"

#include <algorithm>
#include <array>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/listed_numbers.hpp"
#include "service/base/names.hpp"

namespace rowe::service {
namespace {

using wire::listed;
using wire::no_number;
using mark = announced_numbers::mark;

// Nothing was announced to the peer yet.
constexpr std::uint64_t never_announced = UINT64_MAX;
// Of one that was added. A schema that is too long for any message is left out.
std::size_t bytes_of(listed& one, const wire::codec& codec, std::size_t bytes_max) noexcept {
  const std::size_t bytes = listed_bytes + bytes_in_json(one.name) + bytes_in_json(one.type);
  const std::size_t with_schemas = bytes + codec.schema_bytes(one);
  if (with_schemas <= bytes_max) return with_schemas;
  one.schema = one.request = nullptr;
  return bytes + codec.schema_bytes(one);
}

} // namespace

listings::listings(rt::arena& memory, const listings_needs& parts) noexcept
    : listings_needs{parts},
      numbered_{state_, service_directory_, stop_rules_},
      readers_{memory.carve<reader>(state_.bounds().connections_max)},
      announced_{memory, state_.bounds()} {}

// ---- numbers

unknown_number listings::put_names(const connection& c, wire::request& asked) const noexcept {
  const auto unknown = [](std::uint32_t number) -> unknown_number {
    return {"no topic or service has the number ", number};
  };
  if (asked.service_number != no_number) {
    asked.service = numbered_.service(asked.service_number);
    const bool may = state_.rights.calls(c, asked.service); // else it does not even get the name
    return may && !asked.service.empty() ? unknown_number{} : unknown(asked.service_number);
  }
  topic_id topic{};
  if (asked.channel == no_number) {
    topic = numbered_.topic_subscribed({c.id.index}, asked.tag);
  } else if (asked.channel_is_peers) {
    topic = advertisement_table_.find_tag({c.id.index}, asked.channel);
  } else {
    topic = state_.topics.find_channel(asked.channel);
    if (topic && !state_.rights.sees(c, state_.topics.name(topic))) topic = {};
  }
  if (!topic) return unknown(asked.channel == no_number ? asked.tag : asked.channel);
  asked.topic = state_.topics.name(topic);
  if (asked.what != wire::verb::subscribe) return {};
  const topic_id other = numbered_.topic_subscribed({c.id.index}, asked.tag);
  if (!other || other == topic) return {};
  return {"subscribe: this peer has another topic with the number ", asked.tag};
}

// ---- readers

// One message with a part of a list: some topics or services that are gone, or new.
struct listings::part {
  std::size_t count = 0;
  std::size_t bytes = 0;
  std::array<listed, listed_max> which{};
  std::array<std::uint32_t*, listed_max> rows{}; // the peer's, of each
};

void listings::greet(connection& c) noexcept {
  readers_[{c.id.index}] = {.reads = true, .next = step::hello};
  ++readers_count_;
  all_up_to_date_ = false;
  // Before what it may ask in this cycle is answered, unless many peers come at once.
  if (turns_left_ != 0) (void)take_turn(c);
}

void listings::forget(peer_index peer) noexcept {
  if (!readers_[peer].reads) return;
  readers_[peer] = {};
  for (std::uint32_t& number : announced_.of(peer)) {
    announced_.set(mark::waits, number, false);
    announced_.forget(number);
  }
  if (--readers_count_ == 0) due_ = rt::never;
}

void listings::announce_again(peer_index peer) noexcept {
  reader& of = readers_[peer];
  if (!of.reads) return;
  for (std::uint32_t& number : announced_.of(peer))
    if (announced_.is(mark::unseen, number)) announced_.forget(number);
  if (of.next != step::hello) end_round(of);
  all_up_to_date_ = false;
}

bool listings::is_up_to_date(peer_index peer) const noexcept {
  const reader& of = readers_[peer];
  return !of.reads || !state_.peers[peer].open() ||
         (of.announced_at == listed_at_ && of.next == step::none && !of.message.is_begun());
}

void listings::announce_to_readers() noexcept {
  due_ = rt::never;
  if (listed_at_ != numbered_.changes()) {
    if (rate_.take(state_.cycle.now)) {
      listed_at_ = numbered_.changes();
      all_up_to_date_ = false;
    } else {
      due_ = state_.cycle.now + listings_period;
    }
  }
  if (all_up_to_date_) return;
  all_up_to_date_ = true;
  for (std::uint32_t left = state_.peers.size(); left != 0; --left) {
    if (!is_up_to_date(turn_)) {
      all_up_to_date_ = false;
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

// Announces to the peer by one message at most. Returns when to look at it again.
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
  while (!to.message.is_begun()) { // twice at most: a round may end without a message
    if (to.next == step::none && to.announced_at == listed_at_) return rt::never;
    if (to.next == step::none) begin_round(to);
    if (!announce(c)) return later;
  }
  return state_.cycle.now;
}

void listings::begin_round(reader& of) noexcept {
  of.next = step::topics_gone;
  of.from = 0;
  of.newest = numbered_.newest_topic();
  of.newest_of_services = numbered_.newest_service();
  of.announced_at = listed_at_;
}

// All that differs is to be announced to it.
void listings::end_round(reader& of) noexcept {
  of.next = step::none;
  of.announced_at = never_announced;
}

// What became of its last message. False: it waits to be written.
bool listings::settle(peer_index peer) noexcept {
  reader& of = readers_[peer];
  const auto now = of.message.take_fate(outbox_.of(peer), announcer::listings);
  if (now == announcement::fate::none) return true;
  if (now == announcement::fate::waits) return false;
  const bool lost = now == announcement::fate::lost && !ROWE_MUTANT(list_lost);
  if (of.announced == step::hello) {
    if (lost) of.next = step::hello;
    return true;
  }
  const bool added = is_of_new(of.announced);
  for (std::uint32_t& number : announced_.of(peer, is_of_topics(of.announced))) {
    if (!announced_.is(mark::waits, number)) continue;
    announced_.set(mark::waits, number, false);
    if (added == lost) number = no_number;
  }
  if (lost) end_round(of);
  return true;
}

// False: it is to be tried again.
bool listings::announce(connection& c) noexcept {
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
    return c.protocol->topics.write_hello(into, {.name = endpoint_name_, .epoch = state_.epoch});
  };
  if (!outbox_.reply(peer, write, rt::never, announcer::listings)) return false;
  reader& to = readers_[peer];
  end_round(to);
  to.announced = step::hello;
  to.message.begin(outbox_.of(peer));
  return true;
}

// What was not announced to the peer yet, from its row on, as much as one message takes. There are few large
// slots, so only what is alone in its message may need one.
void listings::gather(const connection& c, reader& to, part& into) noexcept {
  const peer_index peer{c.id.index};
  const bool topics = is_of_topics(to.next);
  const bool added = is_of_new(to.next);
  const std::uint32_t newest = topics ? to.newest : to.newest_of_services;
  const std::size_t bytes_max = std::min(state_.bounds().small_slot_bytes, state_.bounds().message_bytes_max);
  const std::span<std::uint32_t> its = announced_.of(peer, topics);
  for (; to.from < its.size(); ++to.from) {
    const listed now = topics ? numbered_.topic_in({to.from}) : numbered_.service_in(to.from);
    std::uint32_t& number = its[to.from];
    if (number == now.number) continue;
    if (announced_.is(mark::unseen, number)) announced_.forget(number); // it was not announced
    const bool is_new = now.number != no_number && number == no_number;
    const bool counts = topics || now.number >= first_service_number; // the endpoint's own do not
    if (is_new && counts && listed_numbers::is_newer(now.number, newest)) continue; // of the next round
    if (is_new && !(topics ? state_.rights.sees(c, now.name) : state_.rights.calls(c, now.name))) {
      number = now.number;
      announced_.set(mark::unseen, number, true);
      continue;
    }
    listed one = added ? now : listed{.number = number};
    if (one.number == no_number || (added && !is_new)) continue;
    const std::size_t bytes =
        added ? bytes_of(one, c.protocol->topics, state_.bounds().message_bytes_max) : listed_bytes;
    if (into.count == into.which.size() || (into.count != 0 && into.bytes + bytes > bytes_max)) return;
    into.bytes += bytes;
    into.rows[into.count] = &number;
    into.which[into.count++] = one;
  }
}

// False: it is to be tried again.
bool listings::send(connection& c, const part& of) noexcept {
  const peer_index peer{c.id.index};
  reader& to = readers_[peer];
  const bool topics = is_of_topics(to.next);
  const bool added = is_of_new(to.next);
  const auto which = std::span<const listed>{of.which}.first(of.count);
  const wire::codec& codec = c.protocol->topics;
  const auto write = [&](json::writer& into) {
    return topics ? codec.write_topics(into, which, added) : codec.write_services(into, which, added);
  };
  if (!outbox_.reply(peer, write, rt::never, announcer::listings)) return false;
  for (std::size_t i = 0; i < of.count; ++i) {
    announced_.set(mark::waits, *of.rows[i], true);
    if (added) *of.rows[i] = of.which[i].number;
  }
  to.announced = to.next;
  to.message.begin(outbox_.of(peer));
  return true;
}

} // namespace rowe::service
