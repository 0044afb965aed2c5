// SPDX-License-Identifier: Apache-2.0
// The topic /rowe/stats: what the endpoint knows of itself, for the page and for tools, at most ten times a
// second and only while somebody listens. docs/concepts.md describes its members.
#include <algorithm>
#include <array>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/core.hpp"
#include "service/limit_table.hpp"
#include "service/publishing.hpp"

namespace rowe::service {
namespace {

// Of a report, for topics that only peers hold, and for connections: so the rest of it always finds room.
std::size_t peers_topics_bytes_max(const limits& bounds) noexcept { return bounds.message_bytes_max / 8; }
std::size_t connections_bytes_max(const limits& bounds) noexcept { return bounds.message_bytes_max / 2; }

double seconds(rt::duration d) noexcept { return std::chrono::duration<double>(d).count(); }

// Three digits are plenty for people, and short.
double rounded(double value) noexcept {
  return static_cast<double>(static_cast<std::int64_t>(value * 1000 + 0.5)) / 1000;
}

} // namespace

void core::describe_thread(const rt::grants& granted, bool memory_locked) noexcept {
  granted_ = granted;
  memory_locked_ = memory_locked;
}

// Somebody listens: the first report covers the time from here on.
void core::begin_statistics() noexcept {
  if (timers_.armed(timer::statistics)) return;
  end_statistics_period();
  timers_.arm(timer::statistics, now_ + options_.stats_period);
}

void core::end_statistics_period() noexcept {
  statistics_at_ = now_;
  for (std::uint32_t i = 0; i < router_.topic_places(); ++i) {
    topic& t = router_.at(i);
    t.messages_before = t.messages;
    t.gap_marked[0] = std::max(t.gap_marked[0], t.gap_max);
    t.gap_max = rt::duration{0};
  }
}

// The service is asked at any time, whether or not somebody listens to the topic. Its rates are of two
// periods, the newest of which has not ended, so of one second at least; of two and one cycle at most.
void core::mark_rates() noexcept {
  rates_marked_ = {now_, rates_marked_[0]};
  const bool reported =
      statistics_topic_ != no_index && (router_.at(statistics_topic_).first_subscription != no_index ||
                                        router_.at(statistics_topic_).first_inbox != no_index);
  for (std::uint32_t i = 0; i < router_.topic_places(); ++i) {
    topic& t = router_.at(i);
    if (t.holders == 0) continue; // it begins anew
    t.messages_marked = {t.messages, t.messages_marked[0]};
    t.gap_marked = {rt::duration{0}, std::max(t.gap_marked[0], t.gap_max)};
    if (!reported) t.gap_max = rt::duration{0}; // otherwise end_statistics_period() does
  }
}

void core::publish_statistics() noexcept {
  const topic& on = router_.at(statistics_topic_);
  // Armed again by the next one who listens.
  if (on.first_subscription == no_index && on.first_inbox == no_index) return;
  timers_.arm(timer::statistics, now_ + options_.stats_period);
  if (now_ <= statistics_at_) return;
  publish(statistics_topic_, now_, rt::never, {}, [&](json::writer& into) { write_statistics(into); });
  end_statistics_period();
}

void core::write_statistics(json::writer& into) noexcept {
  into.begin_object();
  write_state(into, false);
  into.end_object();
}

// The service /rowe/stats: the topic's members, and all that is too much for ten times a second.
void core::write_report(json::writer& into) noexcept {
  into.begin_object();
  write_state(into, true);
  write_connections(into);
  into.key("counters");
  into.begin_object();
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i) {
    into.key(counter_descriptions[i].name);
    into.number(read_count(shown_, lanes_, static_cast<counter>(i)));
  }
  into.end_object();
  into.key("limits");
  into.begin_object();
  for (const limit_row& row : limit_table) {
    into.key(rowe::name_of(row.which));
    into.number(row.of(bounds_));
  }
  into.end_object();
  into.end_object();
}

void core::write_connections(json::writer& into) noexcept {
  into.key("connections");
  into.begin_array();
  std::uint32_t left_out = 0;
  const std::size_t begin = into.bytes();
  for (connection& c : peers_) {
    if (!c.open()) continue;
    if (into.bytes() - begin > connections_bytes_max(bounds_)) {
      ++left_out;
      continue;
    }
    const peer_queues& queues = queues_of(c);
    std::uint64_t queued = queues.replies.count;
    for (const queue& waiting : queues.direct) queued += waiting.count;
    for (std::uint32_t i = c.first_subscription; i != no_index;
         i = router_.subscription_at(i).next_on_connection) {
      queued += router_.subscription_at(i).waiting.count;
    }
    into.begin_object();
    into.key("address");
    into.string(c.peer());
    into.key("role");
    into.string(c.ours == side::client ? "server" : "client"); // what the peer is
    into.key("dialect");
    into.string(c.messages_in == 0 ? std::string_view{"none"} : protocols_.of(c.spoke_last).name());
    into.key("bare");
    into.boolean(c.takes_messages);
    into.key("since_s");
    into.number(rounded(seconds(now_ - c.opened_at)));
    into.key("silent_s");
    into.number(rounded(seconds(now_ - c.heard_at)));
    into.key("messages_in");
    into.number(c.messages_in);
    into.key("messages_out");
    into.number(c.messages_out);
    into.key("queued");
    into.number(queued);
    into.key("blocked");
    into.boolean(queues.backpressured());
    into.key("subscriptions");
    into.number(c.subscriptions);
    into.key("calls");
    into.number(c.calls_asked);
    into.end_object();
  }
  into.end_array();
  into.key("connections_left_out");
  into.number(left_out);
}

// What both have.
void core::write_state(json::writer& into, bool of_service) noexcept {
  into.key("name");
  into.string({name_.data(), name_bytes_});
  into.key("uptime_s");
  into.number(rounded(seconds(now_ - opened_at_)));
  into.key("peers");
  into.number(peers_.count());
  into.key("real_time");
  into.begin_object();
  into.key("fifo");
  into.boolean(static_cast<bool>(granted_.fifo));
  into.key("pinned");
  into.boolean(static_cast<bool>(granted_.pinned));
  into.key("locked");
  into.boolean(memory_locked_);
  into.end_object();
  write_topics(into, of_service);
  write_losses(into);
  into.key("cycle_us_max");
  into.number(rounded(static_cast<double>(shown_.counts.read(counter::cycle_ns_max)) / 1000));
}

void core::write_topics(json::writer& into, bool of_service) noexcept {
  const rt::time_point since = of_service ? rates_marked_[1] : statistics_at_;
  const double over = seconds(std::max<rt::duration>(now_ - since, std::chrono::milliseconds{1}));
  into.key("rates_over_s");
  into.number(rounded(over));
  into.key("topics");
  into.begin_array();
  std::uint32_t left_out = 0;
  const std::size_t begin = into.bytes();
  for (std::uint32_t i = 0; i < router_.topic_places(); ++i) {
    if (!is_listed(i)) continue;
    if (router_.of_peers(i) && into.bytes() - begin > peers_topics_bytes_max(bounds_)) {
      ++left_out;
      continue;
    }
    const topic& t = router_.at(i);
    into.begin_object();
    into.key("topic");
    into.string(router_.name(i));
    into.key("type");
    into.string(router_.type(i));
    into.key("messages");
    into.number(t.messages);
    into.key("rate_hz");
    const std::uint64_t before = of_service && !ROWE_MUTANT(rates) ? t.messages_marked[1] : t.messages_before;
    into.number(rounded(static_cast<double>(t.messages - before) / over));
    into.key("bytes");
    into.number(t.bytes);
    into.key("gap_ms_max");
    const rt::duration marked = std::max(t.gap_marked[0], t.gap_marked[1]);
    into.number(rounded(seconds(of_service ? std::max(t.gap_max, marked) : t.gap_max) * 1000));
    into.key("subscribers");
    into.number(t.subscriptions);
    into.end_object();
  }
  into.end_array();
  into.key("topics_left_out");
  into.number(left_out);
}

void core::write_losses(json::writer& into) noexcept {
  into.key("losses");
  into.begin_object();
  for (std::size_t i = 0; i < counter_descriptions.size(); ++i) {
    const counter_description& what = counter_descriptions[i];
    if (what.group != counter_group::loss && what.group != counter_group::chosen) continue;
    into.key(what.name);
    into.number(read_count(shown_, lanes_, static_cast<counter>(i)));
  }
  into.end_object();
}

} // namespace rowe::service
