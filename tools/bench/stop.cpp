// SPDX-License-Identifier: Apache-2.0
// rowe bench stop: the transition itself, from running to the loop's brake, over and over: asks for a stop at
// its time, waits for the answer, lets the robot run again. The robot is one that was started for this: a
// real one must never be reset by a measurement.
#include <charconv>
#include <optional>
#include <string>

#include "../rowe/network/remote.hpp"
#include "modes.hpp"
#include "probe.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

using client = caller<json_text, json_text>;

// Not a multiple of the robot's period, so that the stops come at all times of its cycle.
constexpr double stop_rate_default = 19.87;
constexpr std::string_view request = R"({"source":"rowe bench stop"})";

// A time of the robot's clock in its answer, a string of digits; nothing where there is none.
std::optional<rt::time_point> time_in(json_value json, std::string_view name) noexcept {
  const auto found = json.get<std::string_view>(name);
  std::int64_t ns = 0;
  if (!found || std::from_chars(found->data(), found->data() + found->size(), ns).ec != std::errc{})
    return std::nullopt;
  return rt::time_point{rt::duration{ns}};
}

class stops {
 public:
  distribution round_trip, to_acceptance, to_brake;

  stops(client ask, client reset, rt::duration timeout, bool same_clock)
      : ask_{std::move(ask)}, reset_{std::move(reset)}, timeout_{timeout}, same_clock_{same_clock} {}

  // The parts are of the run only.
  void begin() noexcept {
    for (distribution* const one : {&round_trip, &to_acceptance, &to_brake}) one->clear();
  }
  bool send(std::uint64_t number, rt::time_point now) {
    const auto answer = ask_.call(request, timeout_);
    const rt::time_point back = rt::monotonic_clock::now();
    last_ = arrival{number, back, ending::well};
    if (!answer) {
      last_->how = answer.error().code == errc::timed_out ? ending::timed_out : ending::failed;
      failure_ = joined("the stop: ", answer.error().message());
    } else {
      note(answer->json(), now, back);
    }
    let_run();
    return true;
  }
  template <class Sink>
  void take(Sink&& sink) {
    if (last_) sink(*last_);
    last_.reset();
  }
  void wait(rt::time_point until) { rt::kernel_clock::sleep_until(until); }
  bool over() const noexcept { return over_; }
  const std::string& failure() const noexcept { return failure_; }

  // False: the robot cannot run, and failure() says why.
  bool let_run() {
    const auto done = reset_.call("{}", timeout_);
    if (done) return true;
    over_ = true;
    failure_ =
        joined("the robot cannot be reset: ",
               done.error().code == errc::refused ? printable(reset_.refusal()) : done.error().message(),
               " (was it started with `rowe bench peer --stop`?)");
    return false;
  }

 private:
  void note(json_value answer, rt::time_point asked, rt::time_point back) noexcept {
    const auto accepted = time_in(answer, "accepted_ns");
    const auto observed = time_in(answer, "observed_ns");
    round_trip.record(back - asked);
    if (accepted && same_clock_) to_acceptance.record(*accepted - asked);
    if (!accepted || !observed) {
      last_->how = ending::timed_out;
      return;
    }
    to_brake.record(*observed - *accepted);
    if (same_clock_) last_->at = *observed;
  }

  client ask_, reset_;
  rt::duration timeout_;
  bool same_clock_;
  std::optional<arrival> last_;
  std::string failure_;
  bool over_ = false;
};

command stop_table(settings& s) {
  command table{
      .verb = "bench stop",
      .examples = {{{"rowe bench stop -D 60s --max 5ms", "exit code 5 when a brake comes later"},
                    {"rowe bench stop --prio 80 --svg stop.svg", "a drawing of the distribution"}}},
      .description =
          "Stops a robot with a loop of 1 kHz, again and again. A sample is the time from when the stop was\n"
          "due to when the loop said that it had commanded its brake. Without URL the robot is started; at\n"
          "the URL there is a `rowe bench peer --stop`; from another machine, whose clock is not ours, a\n"
          "sample is the whole round trip. This complements a wired stop; it never replaces one.\n",
      .operands = {url_operand(s.url)},
      .options = run_options(s)};
  table.operands[0].optional = true;
  for (auto more : {message_options(s), bound_options(s), output_options(s), plot_options(s)})
    for (option& one : more)
      if (one.name != "--size") table.options.push_back(one);
  for (option& one : table.options)
    if (one.name == "--rate")
      one.meaning = "stops a second (default 19.87Hz: at all times of the loop's cycle)";
  return table;
}

} // namespace

exit_code stop(argument_list arguments) {
  settings s;
  s.rate = stop_rate_default;
  console to{"bench stop"};
  if (const auto end = read_mode(stop_table(s), arguments, s, to)) return *end;
  link over = connect(s, to, {"--stop"}, true);
  if (over.failed) return *over.failed;
  auto ask = over.hub->client<json_text, json_text>("/rowe/stop", {.depth = 1});
  auto reset = over.hub->client<json_text, json_text>(reset_service, {.depth = 1});
  if (!ask || !reset) {
    to.error("cannot ask: ", (ask ? reset.error() : ask.error()).message());
    return exit_code::failed;
  }
  stops target{std::move(*ask), std::move(*reset), s.timeout.value_or(timeout_default), over.same_clock};
  if (!target.let_run()) {
    to.error(target.failure());
    return exit_code::failed;
  }
  recording samples{s.listed_above()};
  to.note("measuring for ", seconds_text(s.run_time_or_default()), " (Ctrl-C ends it and prints)");
  measured m = measure_messages(s, target, samples);
  if (m.problem.empty()) m.problem = target.failure();
  const std::string_view what = over.same_clock
                                    ? "from when a stop was due to when the robot's loop commanded its brake"
                                    : "from when a stop was due to the answer that the brake was commanded";
  report r = report_of(s, std::string{what}, over, m, samples);
  std::erase_if(r.settings, [](const setting& one) { return one.name == "size"; });
  r.settings.push_back({"robot's period", "1.00 ms"});
  r.parts = {{"asked to answered", "round_trip", &target.round_trip},
             {"accepted to the brake", "to_brake", &target.to_brake}};
  if (over.same_clock)
    r.parts.insert(r.parts.begin() + 1, {"asked to accepted", "to_acceptance", &target.to_acceptance});
  return deliver(r, s, to);
}

} // namespace rowe::tools::bench
