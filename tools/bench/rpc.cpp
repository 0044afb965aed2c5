// SPDX-License-Identifier: Apache-2.0
// rowe bench rpc: calls a service at its times and measures from those to the reply in this thread. With
// --idle spin and CPUs of its own the thread never sleeps and has many calls in flight; otherwise it calls as
// an ordinary program does, one call at a time, and a call that was due meanwhile is late.
#include <optional>
#include <string>
#include <vector>

#include "../rowe/network/remote.hpp"
#include "../rowe/text/json_values.hpp"
#include "modes.hpp"
#include "probe.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using client = caller<json_text, json_text>;

class calls {
 public:
  calls(const endpoint& on, client from, const settings& s, std::optional<std::string> fixed)
      : on_{on},
        from_{std::move(from)},
        text_{static_cast<std::size_t>(s.size)},
        fixed_{std::move(fixed)},
        timeout_{s.timeout.value_or(timeout_default)},
        spins_{s.spins(s.here)},
        numbers_(in_flight_max) {}

  bool send(std::uint64_t number, rt::time_point now) {
    if (on_.peers() == 0) { // a call would wait for one
      end_of_call_ = arrival{number, now, ending_of(status{errc::no_peer})};
      return true;
    }
    const std::string_view asked = fixed_ ? std::string_view{*fixed_} : text_.numbered(number);
    if (!spins_) {
      const auto reply = from_.call(asked, timeout_);
      end_of_call_ = arrival{number, rt::monotonic_clock::now(), ending_of(reply)};
      return true;
    }
    const auto started = from_.start(asked, timeout_, now);
    if (!started && (started.error().code == errc::full || started.error().code == errc::too_many_calls))
      return false;
    if (!started) {
      end_of_call_ = arrival{number, now, ending_of(started)};
    } else {
      numbers_[started->index % in_flight_max] = number;
    }
    return true;
  }
  template <class Sink>
  void take(Sink&& sink) {
    if (end_of_call_) sink(*end_of_call_);
    end_of_call_.reset();
    if (!spins_) return;
    while (const auto done = from_.try_finish())
      sink(arrival{numbers_[done->id.index % in_flight_max], rt::monotonic_clock::now(),
                   ending_of(done->reply)});
  }
  void wait(rt::time_point until) {
    if (!spins_) rt::kernel_clock::sleep_until(until);
  }
  bool over() const noexcept { return over_; }

  // Why the last call failed that did; empty where none did. After the run.
  std::string failure() const {
    if (!failure_) return {};
    if (failure_->code == errc::refused) return joined("the service refused: ", printable(from_.refusal()));
    return failure_->message();
  }

 private:
  template <class Result>
  ending ending_of(const Result& got) noexcept {
    if (got) return ending::well;
    if (got.error().code == errc::timed_out) return ending::timed_out;
    failure_ = got.error();
    over_ = over_ || failure_->code == errc::closed || failure_->code == errc::peer_lost ||
            failure_->code == errc::no_peer || failure_->code == errc::no_service;
    return ending::failed;
  }

  const endpoint& on_;
  client from_;
  probe_text text_;
  std::optional<std::string> fixed_;
  rt::duration timeout_;
  bool spins_;
  std::vector<std::uint64_t> numbers_; // of the call in each place
  std::optional<arrival> end_of_call_; // of one that ended as it was sent
  std::optional<error> failure_;
  bool over_ = false;
};

struct rpc_settings : settings {
  std::string service;
  std::string request;
};

command rpc_table(rpc_settings& s) {
  command table{
      .verb = "bench rpc",
      .examples = {{{"rowe bench rpc -D 60s --cpu 3 --peer-cpu 2 --prio 80", "a robot is started for it"},
                    {"rowe bench rpc ws://10.0.0.7:8080 --max 2ms", "exit code 5 when a call takes longer"}}},
      .description =
          "Calls a service at a fixed rate. A sample is the time from when the call was due to when its "
          "reply\n"
          "was in the calling thread. Without URL a peer is started, which echoes what it is asked; at the\n"
          "URL there is a `rowe bench peer`, or a robot with a service of its own (--service).\n",
      .operands = {url_operand(s.url)},
      .options = run_options(s)};
  table.operands[0].optional = true;
  for (auto more : {message_options(s), bound_options(s), output_options(s), plot_options(s)})
    table.options.insert(table.options.end(), more.begin(), more.end());
  table.options.push_back(
      {"--service", "", "NAME", "call this service (default: the peer's echo)", &s.service});
  table.options.push_back({"--request", "", "JSON", "the request (default {})", &s.request});
  return table;
}

} // namespace

exit_code rpc(argument_list arguments) {
  rpc_settings s;
  console to{"bench rpc"};
  if (const auto end = read_mode(rpc_table(s), arguments, s, to)) return *end;
  const bool echo = s.service.empty();
  if (echo && !s.request.empty()) return usage_error("bench rpc", "--request is for a --service");
  if (!echo && s.url.empty()) return usage_error("bench rpc", "--service needs a URL: the robot that has it");
  if (const auto fault = object_fault(s.request); !s.request.empty() && !fault.empty())
    return usage_error("bench rpc", joined(quoted(s.request), " ", fault));

  if (!echo) s.size = size_max; // whatever it answers
  link over = connect(s, to, {}, echo);
  if (over.failed) return *over.failed;
  const std::string service = echo ? std::string{echo_service} : s.service;
  auto from = over.hub->client<json_text, json_text>(
      service, {.depth = in_flight_max, .text_bytes_max = static_cast<std::uint32_t>(s.size)});
  if (!from) {
    to.error("cannot call ", quoted(service), ": ", from.error().message());
    return tools::exit_code_of(from.error());
  }
  const std::string request = s.request.empty() ? "{}" : s.request;
  calls target{*over.hub, std::move(*from), s, echo ? std::nullopt : std::optional{request}};
  recording samples{s.listed_above()};
  to.note("measuring for ", seconds_text(s.run_time_or_default()), " (Ctrl-C ends it and prints)");
  measured m = measure_messages(s, target, samples);
  if (m.problem.empty()) m.problem = target.failure();
  report r =
      report_of(s, joined("round trip of a call of ", service, ", from when it was due"), over, m, samples);
  for (setting& one : r.settings)
    if (!echo && one.name == "size") one.value = joined(request.size(), " bytes");
  return deliver(r, s, to);
}

} // namespace rowe::tools::bench
