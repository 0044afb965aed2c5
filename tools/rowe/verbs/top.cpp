// SPDX-License-Identifier: Apache-2.0
// rowe top: a live view of a robot: its stop, what was lost, topics, peers and loops.
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "../arguments/command_line.hpp"
#include "../console.hpp"
#include "../interrupt.hpp"
#include "../live/robot_view.hpp"
#include "../live/screen.hpp"
#include "../network/asked_robot.hpp"
#include "../output.hpp"
#include "../status_line.hpp"
#include "../text/colour.hpp"
#include "../text/json_values.hpp"
#include "verbs.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

struct top_options {
  remote_place at;
  std::optional<rt::duration> every;
  std::optional<rt::duration> timeout;
  std::size_t order = 0;
  bool once = false;
};

command top_table(top_options& o) {
  return {
      .verb = "top",
      .examples = {{{"rowe top ws://127.0.0.1:8080", "until q or Ctrl-C"},
                    {"rowe top 127.0.0.1:8080 --once", "print it once, for scripts"}}},
      .description =
          "Shows a robot, each second anew: whether it is stopped and why, what was lost, its topics with\n"
          "their rates, who is connected, and how long the cycles of its loops take. Keys: q ends it, s "
          "sorts\n"
          "the topics otherwise, p pauses, arrows scroll. Rates are of topics that have had a subscriber;\n"
          "those of the others are not known.\n",
      .operands = {url_operand(o.at.url)},
      .options =
          with_remote(o.at, {{"--every", "", "TIME", "how often it asks (default 1s)", time_span{&o.every}},
                             {"--sort", "", "rate|bytes|gap|name", "how topics are sorted (default rate)",
                              choice{&o.order, topic_orders}},
                             {"--once", "", "", "print it once", &o.once},
                             {"--timeout", "", "TIME", "for the connection and for each answer (default 2s)",
                              time_span{&o.timeout}}})};
}

class top_of_robot {
 public:
  top_of_robot(asked_robot& robot, const top_options& chosen)
      : robot_{robot}, order_{static_cast<topic_order>(chosen.order)}, period_{chosen.every.value_or(1s)} {}

  // False: the robot does not answer; see service_asker::why().
  bool ask() {
    const auto stats = robot_.ask("/rowe/stats");
    if (!stats) return false;
    answered_ = rt::monotonic_clock::now();
    const auto stop = robot_.ask("/rowe/stop/state"); // a role may not be let call it
    view_.take(read_json(*stats), stop ? read_json(*stop) : json_value{});
    return true;
  }

  exit_code print() const {
    std::string text;
    for (const view_line& one : view_.lines(order_, columns_of_stdout())) {
      switch (one.look) {
      case line_look::heading: text += colour::heading(one.text); break;
      case line_look::good: text += colour::good(one.text); break;
      case line_look::bad: text += colour::bad(one.text); break;
      case line_look::plain: text += one.text; break;
      }
      text += '\n';
    }
    emit(text);
    return exit_code::done;
  }

  exit_code show() {
    screen on;
    if (!on)
      return usage_error("top", "no terminal is known that is called as $TERM says; --once needs none");
    auto next = rt::monotonic_clock::now() + period_;
    for (;;) {
      draw(on);
      const screen::key pressed = on.read(next);
      if (interrupt::seen() || pressed == screen::key::quit) return exit_code::done;
      act_on(pressed, on);
      const auto now = rt::monotonic_clock::now();
      if (now < next) continue;
      next = now + period_;
      robot_.connection().report();
      if (paused_) continue;
      fault_ = ask() ? std::string{} : robot_.services().why();
    }
  }

 private:
  void act_on(screen::key pressed, const screen& on) {
    const std::size_t page = std::max<std::size_t>(on.rows(), 3) - 2;
    switch (pressed) {
    case screen::key::sort:
      order_ = static_cast<topic_order>((static_cast<std::size_t>(order_) + 1) % topic_orders.size());
      break;
    case screen::key::pause: paused_ = !paused_; break;
    case screen::key::up: first_ -= std::min<std::size_t>(first_, 1); break;
    case screen::key::down: ++first_; break;
    case screen::key::page_up: first_ -= std::min(first_, page); break;
    case screen::key::page_down: first_ += page; break;
    default: break;
    }
  }

  void draw(screen& on) {
    const std::vector<view_line> lines = view_.lines(order_, on.columns());
    const std::size_t room = std::max<std::size_t>(on.rows(), 2) - 1;
    first_ = std::min(first_, lines.size() > room ? lines.size() - room : 0);
    const std::string_view by = topic_orders[static_cast<std::size_t>(order_)];
    std::string bottom =
        joined(" q quit  s sort: ", by, "  p ", paused_ ? "go on" : "pause", "  arrows scroll");
    if (!fault_.empty())
      bottom = joined(" STALE for ", seconds_text(rt::monotonic_clock::now() - answered_), ": ", fault_);
    on.show(lines, first_, bottom);
  }

  asked_robot& robot_;
  robot_view view_;
  topic_order order_;
  const rt::duration period_;
  std::size_t first_ = 0;
  bool paused_ = false;
  rt::time_point answered_{};
  std::string fault_;
};

} // namespace

exit_code top(argument_list arguments) {
  top_options chosen;
  if (const auto end = read(top_table(chosen), arguments)) return *end;
  const console to{"top"};
  if (!chosen.once && !screen::is_possible())
    return usage_error("top", "stdin and stdout must be a terminal; --once prints it once anywhere");
  asked_robot robot{"top", chosen.timeout.value_or(2s), to};
  if (const auto end = robot.connect(chosen.at)) return *end;
  top_of_robot shows{robot, chosen};
  if (!shows.ask()) return robot.give_up_statistics();
  return chosen.once ? shows.print() : shows.show();
}

} // namespace rowe::tools
