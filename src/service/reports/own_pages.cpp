// SPDX-License-Identifier: Apache-2.0
#include "service/reports/own_pages.hpp"

#include <chrono>

#include "wire/codec/own_names.hpp"
#include "wire/text/text_out.hpp"
#include "json/writing/writer.hpp"

namespace rowe::service {
namespace {

std::int64_t milliseconds(rt::duration d) noexcept {
  return std::chrono::duration_cast<std::chrono::milliseconds>(d).count();
}

} // namespace

admit_answer own_pages::may_read(const credentials& shown) noexcept {
  if (shown.typed_in) return access_control_.may_log_in(shown);
  if (shown.path.starts_with(wire::topics_prefix)) {
    const std::string_view topic = topic_pages_.topic_in(shown.path);
    return topic.empty() ? admit_answer{}
                         : access_control_.may_subscribe(shown, topic); // empty: a 404 for all
  }
  if (shown.path != wire::metrics_path && shown.path != wire::stats_path) return {};
  return access_control_.may_call(shown, wire::stats_name); // both have the same counters
}

http_answer own_pages::answer(const http_request& request) noexcept {
  if (request.awaited != nullptr) return topic_pages_.answer(*request.awaited, request.last, buffer_);
  if (request.path == wire::health_path) return health();
  if (request.path == wire::stats_path) return statistics(request.who);
  if (request.path.starts_with(wire::topics_prefix)) return topic_pages_.answer(request, buffer_);
  if (request.path.starts_with(wire::api_prefix))
    return fresh_answer(404,
                        "there is nothing at this path\nask for /api/v1/stats, or /api/v1/topics/NAME\n");
  if (request.path != wire::metrics_path)
    return state_.seams.pages != nullptr ? state_.seams.pages->answer(request) : http_answer{};
  http_answer answer = fresh_answer(200, metrics_report_.write(buffer_.first<metrics_report::bytes_max>()));
  answer.content_type = metrics_report::content_type;
  return answer;
}

http_answer own_pages::statistics(const access::subject& who) noexcept {
  const statistics_report::reader by{.who = who};
  json::writer into{buffer_};
  statistics_report_.write_for_service(into, &by);
  into.append("\n");
  state_.cycle.work_bytes += answer_work;
  if (into.overflowed())
    return fresh_answer(503, "the report is longer than a message may be\nraise message_bytes_max\n");
  http_answer answer = fresh_answer(200, {buffer_.data(), into.bytes()});
  answer.content_type = "application/json";
  return answer;
}

// That it is answered shows that cycles advance now.
http_answer own_pages::health() noexcept {
  constexpr std::uint16_t unavailable = 503;
  if (state_.cycle.closing) return fresh_answer(unavailable, "the endpoint is closing\n");
  if (gap_ == rt::duration{} || state_.cycle.now - gap_ended_ > unhealthy_after_gap)
    return fresh_answer(200, "ok");
  wire::text_out words{buffer_};
  words.add("for ").add(milliseconds(gap_)).add(" ms the service thread began no cycle; it should after ");
  words.add(milliseconds(cycle_gap_max)).add(" ms at most. That ended ");
  words.add(milliseconds(state_.cycle.now - gap_ended_)).add(" ms ago\n");
  return fresh_answer(unavailable, words.text());
}

} // namespace rowe::service
