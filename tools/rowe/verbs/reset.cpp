// SPDX-License-Identifier: Apache-2.0
// rowe reset: lets a stopped robot go again. A reset names the number of the stop, as its user was shown it,
// so that a stop that came meanwhile holds; without a number it only shows what is.
#include <optional>
#include <string>

#include <rowe/endpoint.hpp>

#include "../arguments/command_line.hpp"
#include "../arguments/limit_options.hpp"
#include "../arguments/values.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../network/remote.hpp"
#include "../output.hpp"
#include "stop_words.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration timeout_default = 2s;

struct reset_settings {
  remote_place at;
  std::string number;
  std::optional<rt::duration> timeout;
  bool quiet = false;
};

command table_of(reset_settings& o) {
  return {
      .verb = "reset",
      .examples = {{{"rowe reset ws://127.0.0.1:8080",
                     "why the robot is stopped, and the number of its stop"},
                    {"rowe reset 127.0.0.1:8080 1742", "ends this stop: the robot may move"}}},
      .description =
          "Ends the stop of that number, if nobody has stopped the robot since, its loops run and its\n"
          "guards are fresh; otherwise says why not (1). Look at the robot first. Without a number it says\n"
          "who stopped it (1, or 0 if it is running). See `rowe stop`.\n",
      .operands = {url_operand(o.at.url),
                   {.name = "NUMBER",
                    .meaning = "of the stop, as `rowe reset URL` prints it",
                    .into = &o.number,
                    .optional = true}},
      .options = with_remote(
          o.at, {
                    {"--timeout", "", "TIME", "for the connection and for each answer (default 2s)",
                     time_span{&o.timeout}},
                    {"--quiet", "-q", "", "no hints on stderr", &o.quiet},
                })};
}

// Why it was refused; `state` is what it was before.
std::string refusal_words(std::string_view why, std::string_view state, const std::string& asked) {
  if (why == "number") return joined("number ", asked, " is over: the robot is ", state_words(state));
  if (why == "role")
    return "your role has no right to reset (where a robot has no roles, only its own machine may reset it)";
  if (why == "tick") return "it took too long, or somebody stopped the robot again meanwhile; try again";
  if (why == "loops") {
    const std::string late = late_loops(state);
    return joined("a loop has not acknowledged the stop, or does not run", late.empty() ? "" : ": ", late);
  }
  if (why == "guards") {
    const std::string silent = silent_guards(state);
    return silent.empty()
               ? "nobody guards the robot, which must not move unguarded: open its page, and guard it"
               : joined("a guard is silent: ", silent);
  }
  return joined("refused: ", printable(why));
}

exit_code reset_from(endpoint hub, const reset_settings& o, const std::string& url, const console& to) {
  using service = caller<json_text, json_text>;
  const auto open = [&](std::string_view name) {
    return hub.client<json_text, json_text>(name, {.depth = 1, .text_bytes_max = limits{}.message_bytes_max});
  };
  auto stating = open("/rowe/stop/state");
  auto resetting = open("/rowe/stop/reset");
  if (!stating || !resetting) {
    to.error("cannot ask ", url, ": ", (stating ? resetting : stating).error().message());
    return exit_code::failed;
  }
  const rt::duration timeout = o.timeout.value_or(timeout_default);
  remote connection{hub, url, to};
  if (const auto end = connection.wait(timeout)) return *end;

  watcher waits{connection};
  std::optional<exit_code> failed;
  const auto ask = [&](service& whom, const std::string& what) -> std::string {
    const auto answer = waits.during([&] { return whom.call(what, timeout); });
    if (answer) return std::string{answer->value()};
    const bool none = answer.code() == errc::no_service || answer.code() == errc::refused;
    failed = answer.code() == errc::timed_out ? exit_code::timed_out : exit_code::failed;
    if (interrupt::seen()) failed = exit_code::interrupted;
    to.error(none ? joined(url, " has no stop configured") : answer.error().message());
    return {};
  };
  const std::string state = ask(*stating, "{}");
  if (failed) return *failed;
  if (o.number.empty()) {
    emit(joined(state_words(state), "\n"));
    if (text_member(state, "state") == "running") return exit_code::done;
    to.note("to reset it: rowe reset ", url, " ", printable(text_member(state, "number")), typed_again(o.at));
    return exit_code::failed;
  }
  const std::string answer = ask(*resetting, joined(R"({"number":)", o.number, R"(,"tick":)",
                                                    integer_member(state, "tick").value_or(-1), "}"));
  if (failed) return *failed;
  if (const std::string why = text_member(answer, "refused"); !why.empty()) {
    to.error("NOT reset: ", refusal_words(why, state, o.number));
    if (why == "guards" && !silent_guards(state).empty()) {
      to.note("to remove a guard: rowe call ", url, R"( /rowe/stop/guard '{"guard":"NAME","resign":true}')",
              typed_again(o.at));
    }
    return exit_code::failed;
  }
  emit("reset: the robot may move\n");
  return exit_code::done;
}

} // namespace

exit_code reset(argument_list arguments) {
  reset_settings chosen;
  if (const auto end = read(table_of(chosen), arguments)) return *end;
  console to{"reset"};
  to.be_quiet(chosen.quiet);
  if (!chosen.number.empty() && integer_of(chosen.number).value_or(-1) < 0)
    return usage_error("reset", joined("NUMBER is a whole number, not ", quoted(chosen.number)));
  const auto bounds = limits_for("reset");
  if (!bounds) return exit_code::usage;
  exit_code otherwise = exit_code::failed;
  auto opened = open_endpoint("reset", chosen.at, {.limits = *bounds}, to, otherwise);
  if (!opened) return otherwise;
  return reset_from(std::move(opened->hub), chosen, opened->url, to);
}

} // namespace rowe::tools
