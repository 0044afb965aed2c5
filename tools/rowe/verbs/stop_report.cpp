// SPDX-License-Identifier: Apache-2.0
#include "stop_report.hpp"

#include <array>
#include <ctime>

#include "../console.hpp"
#include "../text/json_values.hpp"
#include "stop_words.hpp"

namespace rowe::tools {
namespace {

constexpr std::array<std::string_view, 7> end_names{"",     "not_observed", "timed_out", "no_stop",
                                                    "lost", "unreachable",  "failed"};

// Now, in UTC: "2026-11-20T07:39:05.123Z".
std::string utc_now() {
  timespec now;
  ::clock_gettime(CLOCK_REALTIME, &now);
  std::tm parts;
  ::gmtime_r(&now.tv_sec, &parts);
  std::array<char, 40> buffer;
  const std::size_t whole = std::strftime(buffer.data(), buffer.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  const std::string thousandths = std::to_string(1000 + now.tv_nsec / 1'000'000);
  return joined(std::string_view{buffer.data(), whole}, ".", std::string_view{thousandths}.substr(1), "Z");
}

// As far as it is known where the time went.
std::string parts_of(const stop_outcome& is) {
  if (!is.service) return "(it had stopped before)";
  const std::string service = time_words(*is.service);
  if (is.send) {
    return joined("(send ", time_words(*is.send), ", service ", service, ", return ", time_words(*is.home),
                  ")");
  }
  return joined("(service ", service, ", there and back ", time_words(is.took - *is.service), ")");
}

std::string or_null(const std::string& text) { return text.empty() ? "null" : json_string_of(text); }
std::string or_null(std::optional<rt::duration> time) {
  return time ? std::to_string(time->count()) : "null";
}

} // namespace

stop_outcome stop_outcome::of_answer(std::string_view answer, rt::time_point asked, rt::time_point answered) {
  const auto accepted = integer_member(answer, "accepted_ns");
  const auto observed = integer_member(answer, "observed_ns");
  stop_outcome is;
  is.how = observed ? end::acknowledged : end::accepted;
  is.number = integer_member(answer, "number");
  is.took = answered - asked;
  if (!accepted || !observed || *observed < *accepted) return is;
  is.service = rt::duration{*observed - *accepted};
  const rt::duration send = rt::duration{*accepted} - asked.time_since_epoch();
  const rt::duration home = answered.time_since_epoch() - rt::duration{*observed};
  if (send < rt::duration{} || home < rt::duration{}) return is;
  is.send = send;
  is.home = home;
  return is;
}

std::string sentence_of(const stop_outcome& is, const stop_story& told) {
  const std::string& who = told.robot.empty() ? told.url : told.robot;
  const std::string_view no = "stop NOT acknowledged";
  switch (is.how) {
  case stop_outcome::end::acknowledged:
    return joined("stop acknowledged by ", who, " in ", time_words(is.took), " ", parts_of(is));
  case stop_outcome::end::accepted:
    return joined(no, " within ", time_words(is.took), ": ", who,
                  " accepted it, but not its loops: ", told.more.empty() ? "none is there" : told.more);
  case stop_outcome::end::timed_out:
    return joined(no, " within ", time_words(told.limit), ": ", told.url,
                  " is connected, but does not answer");
  case stop_outcome::end::unreachable:
    return joined(no, is.took < told.limit ? "" : joined(" within ", time_words(told.limit)), ": ", told.url,
                  " unreachable since ", time_words(is.took));
  case stop_outcome::end::no_stop: return joined(no, ": ", told.url, " has no stop configured");
  case stop_outcome::end::lost:
    return joined(no, ": the connection to ", told.url, " was lost before the answer came");
  case stop_outcome::end::failed: break;
  }
  return joined(no, ": ", told.more);
}

std::string json_of(const stop_outcome& is, const stop_story& told) {
  const bool good = is.how == stop_outcome::end::acknowledged;
  return joined(R"({"robot":)", or_null(told.robot), R"(,"acknowledged":)", good ? "true" : "false",
                R"(,"number":)", is.number ? std::to_string(*is.number) : "null", R"(,"round_trip_ns":)",
                is.answered() ? std::to_string(is.took.count()) : "null", R"(,"send_ns":)", or_null(is.send),
                R"(,"service_ns":)", or_null(is.service), R"(,"return_ns":)", or_null(is.home),
                R"(,"error":)", or_null(std::string{end_names[static_cast<std::size_t>(is.how)]}),
                R"(,"text":)", json_string_of(sentence_of(is, told)), "}\n");
}

void stop_tally::count(const stop_outcome& is, std::optional<rt::duration> limit) {
  ++asked_;
  ++ends_[static_cast<std::size_t>(is.how)];
  if (!is.answered()) return;
  if (worst_ == 0 || is.took > times_.max()) {
    worst_ = asked_;
    worst_at_ = utc_now();
  }
  times_.record(is.took);
  limit_ = limit;
  if (limit && is.took > *limit) ++over_;
}

exit_code stop_tally::verdict() const noexcept {
  using end = stop_outcome::end;
  if (of(end::unreachable) + of(end::lost) > 0) return exit_code::no_connection;
  if (of(end::accepted) + of(end::no_stop) + of(end::failed) > 0) return exit_code::failed;
  if (of(end::timed_out) > 0) return exit_code::timed_out;
  return over_ > 0 ? exit_code::exceeded : exit_code::done;
}

std::string stop_tally::line(std::string_view robot) const {
  using end = stop_outcome::end;
  std::string line =
      joined(counted(asked_, "stop"), ": ", of(end::acknowledged), " acknowledged by ", robot, ", ",
             of(end::accepted), " accepted only, ", of(end::timed_out), " not answered, ",
             of(end::no_stop) + of(end::lost) + of(end::unreachable) + of(end::failed), " failed");
  if (worst_ == 0) return line + '\n';
  return joined(line, "; min ", time_words(times_.min()), ", p50 ", time_words(times_.percentile(50)),
                ", p99 ", time_words(times_.percentile(99)), ", max ", time_words(times_.max()), " at ",
                worst_at_, "\n");
}

std::string stop_tally::json(std::string_view robot) const {
  using end = stop_outcome::end;
  return joined(R"({"robot":)", or_null(std::string{robot}), R"(,"stops":)", asked_, R"(,"acknowledged":)",
                of(end::acknowledged), R"(,"not_observed":)", of(end::accepted), R"(,"timed_out":)",
                of(end::timed_out), R"(,"failed":)",
                of(end::no_stop) + of(end::lost) + of(end::unreachable) + of(end::failed), R"(,"over_max":)",
                over_, R"(,"min_ns":)", times_.min().count(), R"(,"p50_ns":)", times_.percentile(50).count(),
                R"(,"p99_ns":)", times_.percentile(99).count(), R"(,"max_ns":)", times_.max().count(),
                R"(,"max_at_utc":)", or_null(worst_at_), "}\n");
}

std::string stop_tally::beyond() const {
  if (over_ == 0) return {};
  return joined(over_, " of ", asked_, " took longer than ", time_words(*limit_), "; the worst, the ", worst_,
                ". of them, ", time_words(times_.max()), " at ", worst_at_);
}

} // namespace rowe::tools
