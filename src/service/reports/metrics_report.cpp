// SPDX-License-Identifier: Apache-2.0
// One function writes the report, for two kinds of output: into the buffer, and, with the largest figures
// there can be, into a count of bytes when this is compiled.
#include "service/reports/metrics_report.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "service/base/counters.hpp"
#include "wire/text/text_out.hpp"

namespace rowe::service {
namespace {

struct figures {
  std::array<std::uint64_t, counter_descriptions.size()> counts{};
  std::string_view name; // the endpoint's
  std::uint64_t uptime_ns = 0;
  std::uint64_t peers = 0;
  std::uint64_t topics = 0;
  bool stop_in_use = false;
  bool stopped = false;
};

enum class unit : std::uint8_t { one, nanoseconds };

// How a counter is called where the conventions of Prometheus want another name than rowe_NAME_total: units
// stand behind the name and are base units, what may fall is a gauge, and counters that are parts of one sum
// are one metric with a label.
struct metric {
  std::string_view name;
  std::string_view ending; // behind the name
  bool gauge = false;
  unit in = unit::one;
  std::string_view reason = {}; // the label; those of one metric stand together
  bool optional = false;        // 0 says that there is none
};

// Of tls_failed_REASON.
constexpr metric failed_handshakes(std::string_view counter_name) noexcept {
  return {.name = "tls_handshakes_failed",
          .ending = "_total",
          .reason = counter_name.substr(std::string_view{"tls_failed_"}.size())};
}

constexpr metric metric_of(counter which) noexcept {
  const std::string_view name = counter_descriptions[static_cast<std::size_t>(which)].name;
  if (name.starts_with("tls_failed_")) return failed_handshakes(name);
  switch (which) {
  case counter::bytes_in: return {"received", "_bytes_total"};
  case counter::bytes_out: return {"sent", "_bytes_total"};
  case counter::cycle_ns_max: return {"cycle", "_max_seconds", true, unit::nanoseconds};
  case counter::queued_max: return {"queued", "_max", true};
  case counter::phase_watched_ns: return {"phase_watched", "_seconds_total", false, unit::nanoseconds};
  case counter::handshake_bytes_used: return {"handshake", "_used_bytes", true};
  case counter::handshake_bytes_peak: return {"handshake", "_peak_bytes", true};
  case counter::tls_certificate_end:
    return {
        .name = "tls_certificate", .ending = "_expiry_timestamp_seconds", .gauge = true, .optional = true};
  default: return {name, "_total"};
  }
}

// Only counts what is added.
class counting_out {
 public:
  constexpr counting_out& add(std::string_view text) noexcept {
    bytes_ += text.size();
    return *this;
  }
  constexpr std::size_t bytes() const noexcept { return bytes_; }

 private:
  std::size_t bytes_ = 0;
};

template <class Out>
constexpr void add_number(Out& to, std::uint64_t value, std::size_t digits_min = 1) noexcept {
  std::array<char, 20> digits{};
  std::size_t begin = digits.size();
  for (; value != 0 || digits.size() - begin < digits_min; value /= 10)
    digits[--begin] = static_cast<char>('0' + value % 10);
  to.add({digits.data() + begin, digits.size() - begin});
}

template <class Out>
constexpr void add_value(Out& to, std::uint64_t value, unit in) noexcept {
  constexpr std::uint64_t second = 1'000'000'000;
  if (in == unit::one) return add_number(to, value);
  add_number(to, value / second);
  to.add(".");
  add_number(to, value % second, 9);
}

template <class Out>
constexpr void add_metric(Out& to, const metric& what, std::string_view group,
                          std::string_view meaning, // empty: it is another value of the metric before
                          std::uint64_t value) noexcept {
  const auto add_name = [&] { to.add("rowe_").add(what.name).add(what.ending); };
  if (!meaning.empty()) {
    to.add("# HELP ");
    add_name();
    to.add(" ").add(group).add(meaning).add("\n# TYPE ");
    add_name();
    to.add(what.gauge ? " gauge\n" : " counter\n");
  }
  add_name();
  if (!what.reason.empty()) to.add("{reason=\"").add(what.reason).add("\"}");
  to.add(" ");
  add_value(to, value, what.in);
  to.add("\n");
}

// The value of a label, between its quotes.
template <class Out>
constexpr void add_label(Out& to, std::string_view value) noexcept {
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i] == '\n') {
      to.add("\\n");
      continue;
    }
    if (value[i] == '\\' || value[i] == '"') to.add("\\");
    to.add(value.substr(i, 1));
  }
}

template <class Out>
constexpr void write_figures(Out& to, const figures& now) noexcept {
  to.add("# HELP rowe_info which endpoint this is\n# TYPE rowe_info gauge\nrowe_info{name=\"");
  add_label(to, now.name);
  to.add("\"} 1\n");
  const auto add_gauge = [&](std::string_view name, std::string_view meaning, std::uint64_t value,
                             unit in = unit::one) {
    add_metric(to, {.name = name, .ending = {}, .gauge = true, .in = in}, {}, meaning, value);
  };
  add_gauge("uptime_seconds", "since the endpoint was opened", now.uptime_ns, unit::nanoseconds);
  add_gauge("peers", "connections now", now.peers);
  add_gauge("topics", "topics now", now.topics);
  add_gauge("stop_in_use", "1: a loop of this process obeys the stop", now.stop_in_use);
  add_gauge("stopped", "1: loops may not move", now.stopped);
  constexpr std::array<std::string_view, 5> groups{"loss: ", "chosen: ", "flow: ", "refusal: ", "own: "};
  std::string_view last;
  for (std::size_t i = 0; i < now.counts.size(); ++i) {
    const counter_description& what = counter_descriptions[i];
    const metric as = metric_of(static_cast<counter>(i));
    if (as.optional && now.counts[i] == 0) continue;
    const std::string_view meaning = as.name == last     ? std::string_view{}
                                     : as.reason.empty() ? what.meaning
                                                         : "TLS handshakes that failed";
    add_metric(to, as, groups[static_cast<std::size_t>(what.group)], meaning, now.counts[i]);
    if (!as.reason.empty()) last = as.name;
  }
}

constexpr std::size_t most_bytes() noexcept {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  std::array<char, statistics_report::name_bytes_max> name{};
  name.fill('"'); // each is written as two
  figures largest{.name = {name.data(), name.size()},
                  .uptime_ns = most,
                  .peers = most,
                  .topics = most,
                  .stop_in_use = true,
                  .stopped = true};
  largest.counts.fill(most);
  counting_out out;
  write_figures(out, largest);
  return out.bytes();
}
static_assert(most_bytes() <= metrics_report::bytes_max, "raise metrics_report::bytes_max");
static_assert(std::ranges::none_of(counter_descriptions,
                                   [](const counter_description& what) {
                                     return what.meaning.find_first_of("\\\n") != std::string_view::npos;
                                   }),
              "the text of HELP would need escapes");

} // namespace

std::string_view metrics_report::write(std::span<char, bytes_max> buffer) const noexcept {
  figures now{.name = statistics_report_.name(),
              .uptime_ns = static_cast<std::uint64_t>((state_.cycle.now - opened_at_).count()),
              .peers = state_.peers.count(),
              .topics = state_.topics.count(),
              .stop_in_use = stop_rules_.in_use(),
              .stopped = stop_rules_.in_use() && !stop_rules_.running()};
  for (std::size_t i = 0; i < now.counts.size(); ++i)
    now.counts[i] = read_count(state_.shared, state_.pairs, static_cast<counter>(i));
  wire::text_out out{buffer};
  write_figures(out, now);
  return out.text();
}

} // namespace rowe::service
