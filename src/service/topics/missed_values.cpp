// SPDX-License-Identifier: Apache-2.0
#include "service/topics/missed_values.hpp"

#include <array>

#include "service/base/rate_limit.hpp"
#include "service/base/service_limits.hpp"
#include "wire/codec/refusal.hpp"
#include "wire/text/text_out.hpp"
#include "json/text/utf8.hpp"

namespace rowe::service {

void missed_values::report(pair_index pair, const published_by& who, const status& done,
                           const json::decoder::diagnosis& why) noexcept {
  if (done.code() == errc::full) return state_.counts.add(counter::inbox_full);
  if (done.code() == errc::too_big) return report_too_big(pair, done.error(), who);
  std::array<char, json::decoder::diagnosis::text_bytes_max> buffer;
  state_.counts.add(counter::undecodable);
  report_undecodable(pair, who, why.text(buffer));
}

void missed_values::report_too_big(pair_index pair, const error& why, const published_by& who) noexcept {
  state_.counts.add(counter::too_big);
  wire::text_of<json::decoder::diagnosis::text_bytes_max> text;
  text.add("the message has ").add(why.value).add(" bytes, its subscriber takes ").add(why.limit);
  if (state_.pairs[pair].decoder == nullptr) text.add(": raise the option `text_bytes_max`");
  report_undecodable(pair, who, text.text());
}

// A handle that subscribed cannot decode a message: two programs disagree about the type. A status reports it
// to the sender, an event to this process; each at most once a second for a topic, because usually every
// message fails.
void missed_values::report_undecodable(pair_index pair, const published_by& who,
                                       std::string_view why) noexcept {
  const topic_id topic = state_.pair_rows[pair].topic;
  rt::time_point& reported_at = state_.pair_rows[state_.topics.at(topic).inboxes.head]
                                    .undecodable_at; // one place for all handles on the topic
  connection* const c = state_.peers.find({who.peer.index, who.peer.generation});
  const bool first = may_report_again(reported_at, state_.cycle.now);
  const bool reports =
      c != nullptr && c->open() && c->ours == side::server && c->may_report(topic, state_.cycle.now);
  if (!first && !reports) return;
  wire::text_of<wire::refusal::text_bytes_max> text;
  text.add("publish ").add_name(state_.topics.name(topic), event_topic_bytes_shown);
  text.add(": ").add_shortened(why, diagnosis_bytes_shown);
  if (reports) refusals_.send_status(*c, who.id_raw, text.text());
  if (!first) return;
  const bool by_peer = c != nullptr && c->ours == side::server;
  state_.events.report(by_peer ? event::kind::refused_request : event::kind::warning,
                       c != nullptr ? c->peer() : std::string_view{},
                       json::utf8_prefix(text.text(), event_text_bytes_max),
                       "publish what the subscriber's type says, or set its option `fill_missing`",
                       c != nullptr ? c->identity.view() : std::string_view{});
}

// Reports to the publisher that a late subscriber will not get the value: to a peer, or to this process by an
// event.
void missed_values::report_not_latched(topic_id index, std::size_t bytes, const published_by& who) noexcept {
  state_.counts.add(counter::not_latched);
  connection* const c = state_.peers.find({who.peer.index, who.peer.generation});
  const bool reports = c != nullptr
                           ? c->open() && c->may_report(index, state_.cycle.now)
                           : may_report_again(state_.topics.at(index).loss_reported_at, state_.cycle.now);
  if (!reports) return;
  wire::text_of<wire::refusal::text_bytes_max> text;
  text.add("publish ").add_name(state_.topics.name(index), event_topic_bytes_shown);
  text.add(": its last value, of ").add(bytes);
  text.add(" bytes, is not retained for late subscribers: there is no room for it, or its publisher has its "
           "share of latched_bytes and of the room for long messages");
  if (c != nullptr) return refusals_.send_status(*c, who.id_raw, text.text(), wire::severity::warning);
  state_.events.report(event::kind::warning, {}, json::utf8_prefix(text.text(), event_text_bytes_max),
                       "raise the limit latched_bytes", {});
}

} // namespace rowe::service
