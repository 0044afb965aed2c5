// SPDX-License-Identifier: Apache-2.0
#include "service/incoming/refusals.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "json/writing/writer.hpp"

#include "service/base/service_limits.hpp"

namespace rowe::service {
namespace {

// The close reason of a peer that sends too much.
close_reason flood_reason(std::string_view what, std::uint32_t per_second, std::string_view remedy,
                          std::string_view option) noexcept {
  wire::text_of<wire::close_reason_bytes_max> why;
  why.add("more than ").add(per_second).add(" ").add(what).add(" a second for ");
  why.add(flood_time_max / std::chrono::seconds{1}).add(" s: ").add(remedy);
  close_reason reason;
  reason = why.add(" (limit ").add(option).add(")").text();
  return reason;
}

} // namespace

refusals::refusals(rt::arena& memory, const refusals_needs& parts) noexcept
    : refusals_needs{parts},
      rows_{memory.carve<row>(state_.bounds().connections_max)},
      too_many_messages_{flood_reason("messages", state_.bounds().messages_per_second_max, "send fewer",
                                      "messages_per_second_max")},
      too_many_refusals_{flood_reason("refused requests", state_.bounds().refusals_per_second_max,
                                      "act on the refusals", "refusals_per_second_max")} {}

void refusals::open(peer_index peer) noexcept {
  rows_[peer] = {.refused = rate_limit{state_.bounds().refusals_per_second_max},
                 .reports = rate_limit{std::chrono::seconds{1}, refusal_events_burst}};
}

void refusals::refuse(connection& c, wire::codec_id in, std::string_view id_raw,
                      const wire::diagnostic& why) noexcept {
  if (admits(c, event::kind::refused_request, why.text, {})) answer(c, in, id_raw, why);
}

void refusals::refuse(connection& c, const wire::request& asked, const wire::diagnostic& why) noexcept {
  if (is_answerable(asked)) return refuse_call(c, asked, why);
  // The id of an answer is ours. Where it is all that an error has, it would mean a call of the peer's own.
  const bool ours = asked.what == wire::verb::reply && asked.form == wire::call_args::form::object;
  refuse(c, asked.codec, ours ? std::string_view{} : asked.id_raw, why);
}

void refusals::fail_excess(connection& c, const wire::request& asked) noexcept {
  if (!is_answerable(asked)) return;
  add(counter::calls_refused);
  wire::text_of<detail::diagnostic_bytes_max> why;
  why.add("dropped: more than ").add(state_.bounds().messages_per_second_max);
  why.add(" messages a second (limit messages_per_second_max)");
  fail_call(c, asked.codec, wire::origin_of(asked), {.code = "busy", .text = why.text()});
}

void refusals::refuse(connection& c, std::string_view id_raw, std::string_view why) noexcept {
  refuse(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why});
}

void refusals::refuse_own_topic(connection& c, std::string_view id_raw, std::string_view verb,
                                std::string_view topic) noexcept {
  wire::text_of<detail::diagnostic_bytes_max> why;
  why.add(verb).add(": ").add_name(topic, name_bytes_shown);
  refuse(c, id_raw, why.add(" is published by the program here, which does not share it").text());
}

void refusals::refuse_limit(connection& c, std::string_view id_raw, std::string_view what,
                            std::uint64_t limit, std::string_view option) noexcept {
  wire::text_of<event_text_bytes_max> why;
  why.add("all ").add(limit).add(" ").add(what).add(" are taken");
  refuse_for(c, id_raw, why, option);
}

void refusals::refuse_share(connection& c, const wire::request& asked, const taken_share& of) noexcept {
  wire::text_of<share_text_bytes_max> why;
  why.add_name(asked.verb_text, verb_bytes_shown).add(" ");
  why.add_name(asked.topic.empty() ? asked.service : asked.topic, topic_bytes_shown);
  why.add(": one peer may hold no more ").add(of.what).add(" than it leaves free: it holds ").add(of.held);
  why.add(", ").add(of.left).add(" of ").add(of.for_peers).add(" are left");
  const std::uint32_t kept = std::min(of.kept, of.left);
  if (kept != 0) why.add(", ").add(kept).add(" of them reserved for peers that hold fewer");
  refuse_for(c, asked.id_raw, why, of.option);
}

void refusals::refuse_for(connection& c, std::string_view id_raw, wire::text_out& why,
                          std::string_view option) noexcept {
  wire::text_of<remedy_bytes_max> remedy;
  remedy.add("raise `limits::").add(option).add("`");
  if (!admits(c, event::kind::limit, why.text(), remedy.text())) return;
  why.add(" (limit ").add(option).add(")");
  answer(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why.text()});
}

void refusals::deny(connection& c, const wire::request& asked, std::string_view why) noexcept {
  add(counter::denied);
  const wire::diagnostic denied{.code = "denied", .text = why};
  if (asked.what != wire::verb::call && asked.what != wire::verb::send_goal) {
    if (admits(c, event::kind::denied, why, {})) answer(c, asked.codec, asked.id_raw, denied);
    return;
  }
  report(c, event::kind::denied, why, {});
  answer_call(c, asked, denied);
}

void refusals::refuse_unknown(connection& c, const wire::request& asked) noexcept {
  std::array<char, wire::no_service_bytes_max> buffer;
  answer_call(
      c, asked,
      {.code = error{errc::no_service}.name(), .text = wire::no_service_diagnostic(asked.service, buffer)});
}

void refusals::warn(connection& c, std::string_view id_raw, std::string_view why,
                    wire::severity how) noexcept {
  if (admits(c, event::kind::refused_request, why, {})) send_status(c, id_raw, why, how);
}

void refusals::send_status(connection& c, std::string_view id_raw, std::string_view why,
                           wire::severity how) noexcept {
  say(c, c.protocol->topics.id(), id_raw, {.code = "refused", .text = why}, how);
}

// The rate may close the connection. Else the call is answered even beyond it, because its caller waits.
void refusals::answer_call(connection& c, const wire::request& asked, const wire::diagnostic& why) noexcept {
  add(counter::calls_refused);
  (void)within_rate(c);
  if (c.open()) fail_call(c, asked.codec, wire::origin_of(asked), why);
}

void refusals::fail_call(connection& c, wire::codec_id in, const wire::call_origin& call,
                         const wire::diagnostic& why) noexcept {
  const wire::codec& codec = state_.seams.protocols.of(in);
  if (codec.fails_as_refusal()) add(counter::refused_requests);
  // Its slot is not needed: nobody tracks the answer, and one that is lost is counted.
  (void)outbox_.reply({c.id.index}, [&](json::writer& into) { return codec.write_failure(into, call, why); });
}

void refusals::answer(connection& c, wire::codec_id in, std::string_view id_raw,
                      const wire::diagnostic& why) noexcept {
  add(counter::refused_requests);
  say(c, in, id_raw, why);
}

void refusals::say(connection& c, wire::codec_id in, std::string_view id_raw, const wire::diagnostic& why,
                   wire::severity how) noexcept {
  std::array<char, wire::error_bytes_max> buffer;
  json::writer text{buffer};
  const auto kind = state_.seams.protocols.of(in).write_error(
      text,
      {.to_server = c.ours == side::client, .level = rows_[{c.id.index}].level, .how = how, .id_raw = id_raw},
      why);
  outbox_.reply_written({c.id.index}, text, kind);
}

// ---- rates

bool refusals::admits(connection& c, event::kind kind, std::string_view why,
                      std::string_view remedy) noexcept {
  report(c, kind, why, remedy);
  if (within_rate(c)) return true;
  add(counter::refusals_unsaid);
  return false;
}

bool refusals::within_rate(connection& c) noexcept {
  rate_limit& refused = rows_[{c.id.index}].refused;
  if (c.ours == side::client || refused.take(state_.cycle.now)) return true;
  close_if_flooding(c, refused, too_many_refusals_);
  return false;
}

void refusals::report(connection& c, event::kind kind, std::string_view why,
                      std::string_view remedy) noexcept {
  if (admits_event({c.id.index})) {
    state_.events.report(kind, c.peer(), why, remedy, c.identity);
  } else {
    ++rows_[{c.id.index}].unreported;
  }
}

void refusals::report_missed(connection& c) noexcept {
  row& of = rows_[{c.id.index}];
  if (of.unreported == 0 || !admits_event({c.id.index})) return;
  std::array<char, missed_text_bytes_max> text;
  const int bytes = std::snprintf(text.data(), text.size(), "%u more requests were refused",
                                  std::exchange(of.unreported, 0));
  state_.events.report(event::kind::refused_request, c.peer(), {text.data(), static_cast<std::size_t>(bytes)},
                       {}, c.identity);
}

void refusals::note_excess(connection& c) noexcept { close_if_flooding(c, c.messages, too_many_messages_); }

void refusals::close_if_flooding(connection& c, const rate_limit& rate, std::string_view why) noexcept {
  if (!c.open() || rate.over_for(state_.cycle.now) < flood_time_max) return;
  add(counter::flooding_peers);
  state_.peers.close_later(c, why);
}

} // namespace rowe::service
