// SPDX-License-Identifier: Apache-2.0
#include "service/reports/statistics_report.hpp"

#include <algorithm>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/limit_table.hpp"
#include "service/base/service_limits.hpp"
#include "service/topics/listed_topics.hpp"
#include "json/text/digits.hpp"

namespace rowe::service {
namespace {

// The bytes of a report for topics that only peers hold, and those for connections.
std::size_t peers_topics_bytes_max(const limits& bounds) noexcept {
  return bounds.message_bytes_max / report_topics_one_in;
}
std::size_t connections_bytes_max(const limits& bounds) noexcept {
  return bounds.message_bytes_max / report_connections_one_in;
}

double microseconds(rt::duration d) noexcept { return std::chrono::duration<double, std::micro>(d).count(); }
double seconds(rt::duration d) noexcept { return std::chrono::duration<double>(d).count(); }

// Three decimal digits are enough for people, and short.
double rounded(double value) noexcept {
  return static_cast<double>(static_cast<std::int64_t>(value * 1000 + 0.5)) / 1000;
}

} // namespace

statistics_report::statistics_report(const statistics_report_needs& parts) noexcept
    : statistics_report_needs{parts},
      name_bytes_{std::min(state_.options.name.size(), name_.size())},
      opened_at_{state_.cycle.now} {
  state_.options.name.copy(name_.data(), name_bytes_);
}

void statistics_report::write_for_topic(json::writer& into) noexcept {
  into.begin_object();
  write_state(into, false, nullptr);
  into.end_object();
}

void statistics_report::write_for_service(json::writer& into, const reader* by) noexcept {
  if (by != nullptr && state_.rights.sees_everything(by->who)) by = nullptr;
  into.begin_object();
  write_state(into, true, by);
  write_connections(into, by);
  into.begin_object("counters");
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i) {
    into.member(counter_descriptions[i].name,
                read_count(state_.shared, state_.pairs, static_cast<counter>(i)));
  }
  into.end_object();
  into.begin_object("limits");
  for (const limit_row& row : limit_table) {
    into.member(rowe::name_of(row.which), row.of(state_.bounds()));
  }
  into.end_object();
  into.end_object();
}

void statistics_report::write_connections(json::writer& into, const reader* by) noexcept {
  into.begin_array("connections");
  std::uint32_t left_out = 0;
  const std::size_t begin = into.bytes();
  for (const connection& c : state_.peers) {
    if (!c.open() || (by != nullptr && by->peer != &c)) continue;
    if (into.bytes() - begin > connections_bytes_max(state_.bounds())) {
      ++left_out;
      continue;
    }
    const peer_queues& queues = outbox_.of({c.id.index});
    std::uint64_t queued = queues.replies.count + queues.long_replies.count;
    for (const queue& waiting : queues.direct) queued += waiting.count;
    for (subscription_id i = state_.subscriptions.first_of({c.id.index}); i;
         i = state_.subscriptions.at(i).next_on_peer) {
      queued += state_.subscriptions.at(i).pending.count;
    }
    into.begin_object();
    into.member("address", c.peer());
    if (!c.identity.empty()) into.member("identity", c.identity);
    if (state_.rights.apply_to(c)) {
      into.member("identity_role", state_.rights.policy().role_name(c.who.role));
    }
    into.member("role", c.ours == side::client ? "server" : "client"); // what the peer is
    into.member("dialect", c.messages_in == 0 ? std::string_view{"none"}
                                              : state_.seams.protocols.of(c.spoke_last).name());
    into.member("plain", c.takes_messages);
    into.member("since_s", rounded(seconds(state_.cycle.now - c.opened_at)));
    into.member("silent_s", rounded(seconds(state_.cycle.now - c.heard_at)));
    into.member("messages_in", c.messages_in);
    into.member("messages_out", c.messages_out);
    into.member("queued", queued);
    into.member("blocked", queues.backpressured());
    into.member("subscriptions", state_.subscriptions.count_of({c.id.index}));
    into.member("calls", state_.calls.open_calls_of({c.id.index}));
    into.end_object();
  }
  into.end_array();
  into.member("connections_left_out", left_out);
}

void statistics_report::write_state(json::writer& into, bool of_service, const reader* by) noexcept {
  into.member("name", name());
  into.key("epoch");
  std::array<char, json::hex_text_bytes> digits;
  json::write_hex(digits.data(), state_.epoch);
  into.string({digits.data(), digits.size()});
  into.member("uptime_s", rounded(seconds(state_.cycle.now - opened_at_)));
  into.member("peers", state_.peers.count());
  into.begin_object("real_time");
  into.member("fifo", static_cast<bool>(granted_.fifo));
  into.member("pinned", static_cast<bool>(granted_.pinned));
  into.member("locked", memory_locked_);
  into.end_object();
  write_topics(into, of_service, by);
  write_losses(into);
  into.member("cycle_us_max", rounded(static_cast<double>(state_.counts.read(counter::cycle_ns_max)) / 1000));
  write_loops(into);
}

void statistics_report::write_topics(json::writer& into, bool of_service, const reader* by) noexcept {
  const listed_topics listed{state_.topics, stop_rules_};
  const rt::time_point since = of_service ? topic_rates_.marks_began() : topic_rates_.period_began();
  const double over = seconds(std::max<rt::duration>(state_.cycle.now - since, std::chrono::milliseconds{1}));
  into.member("rates_over_s", rounded(over));
  into.begin_array("topics");
  std::uint32_t left_out = 0;
  const std::size_t begin = into.bytes();
  for (const topic_id i : state_.topics.topic_ids()) {
    if (!listed(i) || (by != nullptr && !state_.rights.sees(by->who, state_.topics.name(i)))) continue;
    if (state_.topics.of_peers(i) && into.bytes() - begin > peers_topics_bytes_max(state_.bounds())) {
      ++left_out;
      continue;
    }
    const topic& t = state_.topics.at(i);
    into.begin_object();
    into.member("topic", state_.topics.name(i));
    into.member("type", state_.topics.type(i));
    into.member("messages", t.messages);
    into.key("rate_hz");
    const std::uint64_t before = of_service && !ROWE_MUTANT(rates) ? t.messages_marked[1] : t.messages_before;
    into.number(rounded(static_cast<double>(t.messages - before) / over));
    into.member("bytes", t.bytes);
    into.key("gap_ms_max");
    const rt::duration marked = std::max(t.gap_marked[0], t.gap_marked[1]);
    into.number(rounded(seconds(of_service ? std::max(t.gap_max, marked) : t.gap_max) * 1000));
    into.member("subscribers", t.subscriptions.count);
    into.end_object();
  }
  into.end_array();
  into.member("topics_left_out", left_out);
}

void statistics_report::write_losses(json::writer& into) noexcept {
  into.begin_object("losses");
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i) {
    const counter_description& what = counter_descriptions[i];
    if (what.group != counter_group::loss && what.group != counter_group::chosen) continue;
    into.member(what.name, read_count(state_.shared, state_.pairs, static_cast<counter>(i)));
  }
  into.end_object();
}

void statistics_report::write_loops(json::writer& into) noexcept {
  into.begin_array("loops");
  for (pair_index i{0}; i.value < state_.shared.pairs_used(); ++i.value) {
    if (!state_.pair_rows[i].loop) continue;
    state_.cycle.work_bytes += percentiles_work;
    const detail::queue_pair& latch = state_.pairs[i];
    const rt::histogram& cycles = latch.timing->cycles();
    constexpr std::array percents{50.0, 99.0, 99.9};
    std::array<rt::duration, percents.size()> of;
    cycles.percentiles(percents, of);
    into.begin_object();
    into.member("name", latch.name());
    into.member("cycles", cycles.count());
    into.member("p50_us", rounded(microseconds(of[0])));
    into.member("p99_us", rounded(microseconds(of[1])));
    into.member("p999_us", rounded(microseconds(of[2])));
    into.member("max_us", rounded(microseconds(cycles.max())));
    into.member("bound_us", rounded(microseconds(latch.loop_timeout)));
    into.end_object();
  }
  into.end_array();
}

} // namespace rowe::service
