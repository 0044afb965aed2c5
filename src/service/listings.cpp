// SPDX-License-Identifier: Apache-2.0
#include "service/listings.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "wire/own_names.hpp"

#include "service/service_limits.hpp"

namespace rowe::service {
namespace {

using wire::listed;
using wire::no_number;

// Their places are their numbers, from 1 on; the stop's come first.
constexpr std::size_t stop_services = 4;
constexpr std::array own_services{wire::stop_name,          wire::stop_reset_name, wire::stop_lease_name,
                                  wire::stop_state_name,    wire::stats_name,      wire::list_topics_name,
                                  wire::list_services_name, wire::topic_type_name, wire::publishers_name,
                                  wire::service_type_name};
static_assert(own_services.size() < service_directory::first_number);
// What one takes of it, each character of its name and type escaped.
constexpr std::size_t bytes_of(const listed& one) noexcept {
  return 128 + 6 * (one.name.size() + one.type.size());
}

} // namespace

listings::listings(rt::arena& memory, const needs& parts) noexcept
    : state_{parts.state},
      service_directory_{parts.directory},
      stop_rules_{parts.rules},
      advertisement_table_{parts.advertised},
      outbox_{parts.out},
      name_{parts.endpoint_name},
      stop_topic_{state_.topics.find(wire::stop_state_name)},
      message_bytes_max_{state_.bounds().message_bytes_max},
      listed_topics_{memory.carve<std::uint32_t>(state_.bounds().topics_max)},
      listed_services_{
          memory.carve<std::uint32_t>(service_directory::first_number + state_.bounds().services_max)},
      told_{memory.carve<bool>(state_.bounds().connections_max)} {
  std::fill(listed_topics_.begin(), listed_topics_.end(), wire::no_number);
  std::fill(listed_services_.begin(), listed_services_.end(), wire::no_number);
}

// ---- numbers

listed listings::topic_in(topic_id row) const noexcept {
  const topic& t = state_.topics.at(row);
  if (t.holders == 0 || (row == stop_topic_ && !stop_rules_.in_use())) return {};
  return {.number = t.channel, .name = state_.topics.name(row), .type = state_.topics.type(row)};
}

// First the endpoint's own, by their numbers, then the directory.
listed listings::service_in(std::uint32_t row) const noexcept {
  if (row < service_directory::first_number) {
    const std::string_view name = service_numbered(row);
    return name.empty() ? listed{} : listed{.number = row, .name = name};
  }
  const service_index index{row - service_directory::first_number};
  if (!service_directory_.in_use(index)) return {};
  return {.number = service_directory_.at(index).number,
          .name = service_directory_.name(index),
          .type = service_directory_.type(index)};
}

std::string_view listings::service_numbered(std::uint32_t number) const noexcept {
  if (number >= service_directory::first_number) {
    const service_index found = service_directory_.find_number(number);
    return !found ? std::string_view{} : service_directory_.name(found);
  }
  if (number == 0 || number > own_services.size() || (number <= stop_services && !stop_rules_.in_use()))
    return {};
  return own_services[number - 1];
}

topic_id listings::topic_subscribed(peer_index peer, std::uint32_t tag) const noexcept {
  for (subscription_id i = state_.topics.first_subscription(peer); i;
       i = state_.topics.subscription_at(i).next_on_peer) {
    if (state_.topics.subscription_at(i).tag == tag) return state_.topics.subscription_at(i).topic;
  }
  return {};
}

// What a request names by numbers. Empty, or why there is no such thing.
std::string_view listings::put_names(const connection& c, wire::request& asked) const noexcept {
  constexpr std::string_view unknown = "nothing here has this number";
  if (asked.service_number != no_number) {
    asked.service = service_numbered(asked.service_number);
    return asked.service.empty() ? unknown : std::string_view{};
  }
  topic_id topic{};
  if (asked.channel == no_number) {
    topic = topic_subscribed({c.id.index}, asked.tag);
  } else if (asked.channel_is_peers) {
    topic = advertisement_table_.find_tag({c.id.index}, asked.channel);
  } else {
    topic = state_.topics.find_channel(asked.channel);
  }
  if (!topic) return unknown;
  asked.topic = state_.topics.name(topic);
  if (asked.what != wire::verb::subscribe) return {};
  const topic_id other = topic_subscribed({c.id.index}, asked.tag);
  return !other || other == topic ? std::string_view{}
                                  : "subscribe: this peer gave the number to another topic";
}

// ---- who is told

// Without it the peer would know less, or more, than there is: it is closed.
template <class Write>
void listings::send(connection& c, Write&& write) noexcept {
  if (!c.open()) return;
  const slot_id slot = outbox_.reply({c.id.index}, write, rt::never, true);
  if (!slot) state_.peers.close_later(c, unread_sentence);
}

// `of(row, into)`: whether it is one of those that are told.
template <class Of>
void listings::tell(connection& c, bool topics, bool added, Of&& of) noexcept {
  std::array<listed, listed_max> some;
  std::size_t count = 0;
  std::size_t bytes = 0;
  const auto flush = [&] {
    if (count == 0 || !c.open()) return;
    const auto part = std::span<const listed>{some}.first(std::exchange(count, 0));
    bytes = 0;
    const wire::codec& codec = c.protocol->topics;
    send(c, [&](json::writer& into) {
      return topics ? codec.write_topics(into, part, added) : codec.write_services(into, part, added);
    });
  };
  const std::size_t rows = topics ? listed_topics_.size() : listed_services_.size();
  for (std::uint32_t row = 0; row < rows; ++row) {
    listed one;
    if (!of(row, one)) continue;
    if (count == some.size() || bytes + bytes_of(one) > message_bytes_max_) flush();
    bytes += bytes_of(one);
    some[count++] = one;
  }
  flush();
}

void listings::greet(connection& c) noexcept {
  list_changes();
  told_[{c.id.index}] = true;
  ++told_count_;
  send(c, [&](json::writer& into) { return c.protocol->topics.write_hello(into, name_); });
  for (const bool topics : {true, false}) {
    tell(c, topics, true, [&](std::uint32_t row, listed& into) {
      into = topics ? topic_in({row}) : service_in(row);
      return into.number != no_number;
    });
  }
}

void listings::tell_news() noexcept {
  const bool news = listed_at_ != changes();
  if (news && !tells_.take(state_.cycle.now)) {
    due_ = std::min(due_, state_.cycle.now + listings_period);
    return;
  }
  due_ = rt::never;
  if (news) list_changes();
}

void listings::list_changes() noexcept {
  if (std::exchange(listed_at_, changes()) == changes()) return;
  for (const bool topics : {true, false}) {
    const auto before = topics ? listed_topics_ : listed_services_;
    const auto now = [&](std::uint32_t row) { return topics ? topic_in({row}) : service_in(row); };
    for (connection& c : state_.peers) {
      if (!c.open() || !told_[{c.id.index}]) continue;
      tell(c, topics, false, [&](std::uint32_t row, listed& into) {
        into.number = before[row];
        return before[row] != no_number && before[row] != now(row).number;
      });
      tell(c, topics, true, [&](std::uint32_t row, listed& into) {
        into = now(row);
        return into.number != no_number && before[row] != into.number;
      });
    }
    for (std::uint32_t row = 0; row < before.size(); ++row) before[row] = now(row).number;
  }
}

} // namespace rowe::service
