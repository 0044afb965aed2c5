// SPDX-License-Identifier: Apache-2.0
// rowe bench send: publishes at its times; the peer says of each value when its own thread had it. On one
// machine both ends read the same clock, and the difference is the way there. Between machines it is not:
// there the report of the arrival is timed here, and half of the round trip is what is shown, under that
// name.
#include <algorithm>
#include <optional>
#include <string>

#include "../rowe/network/remote.hpp"
#include "modes.hpp"
#include "probe.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

class values {
 public:
  values(publisher<json_text> out, subscriber<arrived> back, const settings& s, bool same_clock)
      : out_{std::move(out)},
        back_{std::move(back)},
        text_{static_cast<std::size_t>(s.size)},
        spins_{s.spins(s.here)},
        same_clock_{same_clock} {}

  // Waits until somebody takes what is published.
  bool heard(rt::duration timeout) const {
    const auto end = rt::monotonic_clock::now() + timeout;
    while (!out_.wanted() && rt::monotonic_clock::now() < end)
      interrupt::sleep_until(rt::monotonic_clock::now() + 1ms);
    return out_.wanted();
  }

  bool send(std::uint64_t number, rt::time_point now) {
    const status published = out_.publish(text_.numbered(number), now);
    if (published) return true;
    if (published.error().code == errc::full) return false;
    failure_ = published.error();
    return true; // never to come back
  }
  template <class Sink>
  void take(Sink&& sink) {
    if (taken_) sink(arrival_of(*taken_));
    taken_.reset();
    while (auto value = back_.try_take()) sink(arrival_of(value->value()));
  }
  void wait(rt::time_point until) {
    if (spins_) return;
    auto value = back_.take(std::max<rt::duration>(until - rt::monotonic_clock::now(), 0ns));
    if (value) taken_ = value->value();
  }
  bool over() const noexcept { return failure_.has_value(); }
  std::string failure() const { return failure_ ? failure_->message() : std::string{}; }

 private:
  // Where the clocks differ, what counts is when the report of the arrival came back.
  arrival arrival_of(const arrived& one) const noexcept {
    const rt::time_point there{rt::duration{one.at_ns}};
    return {one.n, same_clock_ ? there : rt::monotonic_clock::now(), ending::well};
  }

  publisher<json_text> out_;
  subscriber<arrived> back_;
  probe_text text_;
  bool spins_;
  bool same_clock_;
  std::optional<arrived> taken_; // while waiting
  std::optional<error> failure_;
};

command send_table(settings& s) {
  command table{
      .verb = "bench send",
      .examples = {{{"rowe bench send -D 60s --cpu 3 --peer-cpu 2 --prio 80", "to a peer started for it"},
                    {"rowe bench send --compare before.json", "a table of before and after"}}},
      .description = "Publishes at a fixed rate. A sample is the time from when a value was due to when the "
                     "peer's thread\n"
                     "had it. With the URL of a `rowe bench peer` on another machine, whose clock is not "
                     "ours, half of the\n"
                     "round trip is measured instead, and the report says so.\n",
      .operands = {url_operand(s.url)},
      .options = run_options(s)};
  table.operands[0].optional = true;
  for (auto more : {message_options(s), bound_options(s), output_options(s), plot_options(s)})
    table.options.insert(table.options.end(), more.begin(), more.end());
  return table;
}

} // namespace

exit_code send(argument_list arguments) {
  settings s;
  console to{"bench send"};
  if (const auto end = read_mode(send_table(s), arguments, s, to)) return *end;
  link over = connect(s, to, {}, true);
  if (over.failed) return *over.failed;
  const rt::duration period = period_of(s.rate_or_default());
  const bool declarable = period >= 100us && period <= 1h;
  auto out =
      over.hub->advertise<json_text>(out_topic, {.depth = in_flight_max,
                                                 .period = declarable ? period : 0us,
                                                 .text_bytes_max = static_cast<std::uint32_t>(s.size)});
  auto back = over.hub->subscribe<arrived>(back_topic, {.depth = reports_in_flight_max});
  if (!out || !back) {
    to.error("cannot publish: ", (out ? back.error() : out.error()).message());
    return exit_code::failed;
  }
  if (!over.same_clock)
    to.note(
        "the peer's clock is not comparable with ours: measuring the round trip / 2, of value and report");
  values target{std::move(*out), std::move(*back), s, over.same_clock};
  if (!target.heard(std::max<rt::duration>(s.timeout.value_or(timeout_default), 1s))) {
    to.error("nobody takes what is published");
    return exit_code::failed;
  }
  recording samples{s.listed_above(), over.same_clock ? 1 : 2};
  to.note("measuring for ", seconds_text(s.run_time_or_default()), " (Ctrl-C ends it and prints)");
  measured m = measure_messages(s, target, samples);
  if (m.problem.empty()) m.problem = target.failure();
  const std::string_view what =
      over.same_clock ? "from when a value was due to its arrival in the peer's thread"
                      : "round trip / 2, from when a value was due to the report of its arrival here";
  return deliver(report_of(s, std::string{what}, over, m, samples), s, to);
}

} // namespace rowe::tools::bench
