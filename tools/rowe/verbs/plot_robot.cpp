// SPDX-License-Identifier: Apache-2.0
// rowe plot of a running robot: subscribes to the topics, and takes what comes until the time is over or a
// signal came. One thread looks at all of them each millisecond; their queues hold what comes in between.
#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>

#include <rowe/endpoint.hpp>
#include <rowe/recording.hpp>
#include <rowe/types.hpp>

#include "../arguments/limit_options.hpp"
#include "../interrupt.hpp"
#include "../network/asked_robot.hpp"
#include "../network/robot_names.hpp"
#include "../network/robot_types.hpp"
#include "../recordings/own_topics.hpp"
#include "../status_line.hpp"
#include "../text/json_values.hpp"
#include "../text/times.hpp"
#include "plotting.hpp"

namespace rowe::tools {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration usual_listening_time = 10s;
constexpr rt::duration robot_answer_time = 2s;
constexpr rt::duration robot_look_period = 1ms;
constexpr rt::duration robot_status_period = 200ms;
constexpr std::uint32_t plotted_bytes_max = limits{}.message_bytes_max;
constexpr std::size_t plotted_depth_all = 512; // messages in the queues of all topics: 30 MiB
constexpr std::size_t plotted_topics_max = 32;

// Each once, in their order.
std::vector<std::string> topics_of(const std::vector<field_wish>& wishes) {
  std::vector<std::string> all;
  for (const field_wish& one : wishes)
    if (std::ranges::find(all, one.topic) == all.end()) all.push_back(one.topic);
  return all;
}

class robot_plotter {
 public:
  robot_plotter(asked_robot& robot, const std::vector<field_wish>& wishes, const console& to)
      : robot_{robot}, topics_{topics_of(wishes)}, to_{to} {}

  // What the robot has, and of which types. Nothing: go on; it need not say so. Otherwise the verb ends with
  // this, and the reason was printed.
  std::optional<exit_code> ask() {
    if (topics_.size() > plotted_topics_max) {
      to_.error(topics_.size(), " topics are too many: at most ", plotted_topics_max);
      return exit_code::failed;
    }
    std::vector<std::string> known;
    if (const auto all = names_of(robot_.services(), name_kind::topic))
      for (const robot_name& one : *all) known.push_back(one.name);
    const auto is_known = [&](std::string_view name) {
      return std::ranges::any_of(known, [&](const std::string& one) { return is_same_name(one, name); });
    };
    for (const std::string& topic : topics_) {
      if (known.empty() || is_known(topic)) continue;
      to_.error(robot_.url(), " has no topic ", quoted(topic), hint_of(topic, known));
      return exit_code::failed;
    }
    says_stops_ = is_known(stop_state_topic);
    (void)types_.read_all(robot_.services()); // else there are no units
    return interrupt::seen() ? std::optional{exit_code::interrupted} : std::nullopt;
  }

  // Empty: all topics are subscribed to.
  std::string subscribe(plotted_data& into) {
    into_ = &into;
    for (plotted_series& one : into.series) {
      const typed_name* const described = types_.find_topic(one.wish().topic);
      if (described != nullptr && described->message != nullptr)
        one.unit = unit_in(json_schema(*described->message), one.wish().path);
    }
    for (const std::string& topic : topics_) {
      if (std::string wrong = subscribe(topic, into.fields_of_topic(topic)); !wrong.empty()) return wrong;
    }
    return says_stops_ ? subscribe(std::string{stop_state_topic}, {}) : std::string{};
  }

  // Until then, or a signal. `to_ns` makes a moment of this machine one since 1970.
  void listen(rt::time_point end, std::int64_t to_ns) {
    const rt::time_point begin = rt::monotonic_clock::now();
    rt::time_point next_status = begin + 1s;
    while (!interrupt::seen()) {
      take_all(to_ns);
      robot_.connection().report();
      const rt::time_point now = rt::monotonic_clock::now();
      if (now >= end) break;
      if (now >= next_status && !to_.quiet() && status_line::is_possible()) {
        next_status = now + robot_status_period;
        status_line::show(joined(seconds_text(now - begin), " of ", seconds_text(end - begin), ", ",
                                 counted(messages_, "message")));
      }
      interrupt::sleep_until(std::min(end, now + robot_look_period));
    }
    status_line::clear();
  }

 private:
  struct source {
    subscriber<json_text> from;
    std::vector<std::size_t> fields; // none: it says when the robot is stopped
  };

  std::string subscribe(const std::string& topic, std::vector<std::size_t> fields) {
    const auto depth = static_cast<std::uint32_t>(plotted_depth_all / (topics_.size() + 1));
    auto one =
        robot_.hub().subscribe<json_text>(topic, {.depth = depth, .text_bytes_max = plotted_bytes_max});
    if (!one) return joined("cannot subscribe to ", quoted(topic), ": ", one.error().message());
    sources_.push_back({std::move(*one), std::move(fields)});
    return {};
  }

  void take_all(std::int64_t to_ns) {
    for (source& one : sources_) {
      for (std::size_t left = plotted_depth_all; left != 0 && !interrupt::seen(); --left) {
        const auto message = one.from.try_take();
        if (!message) break;
        const std::int64_t time_ns = message->arrived().time_since_epoch().count() + to_ns;
        if (one.fields.empty())
          into_->take_stop_state(message->json(), time_ns);
        else
          into_->take(one.fields, message->json(), time_ns);
        if (!one.fields.empty()) ++messages_;
      }
    }
  }

  asked_robot& robot_;
  const std::vector<std::string> topics_;
  robot_types types_;
  bool says_stops_ = false;
  plotted_data* into_ = nullptr;
  const console& to_;
  std::vector<source> sources_;
  std::uint64_t messages_ = 0;
};

plot_outcome listen_to(asked_robot& robot, const plot_options& o, const plot_request& what,
                       const console& to) {
  robot_plotter plotting{robot, what.wishes, to};
  if (const auto end = plotting.ask()) return {.end = *end};
  const rt::duration time = o.time.value_or(usual_listening_time);
  const rt::time_point begin = rt::monotonic_clock::now();
  const std::int64_t to_ns = wall_clock_ns() - begin.time_since_epoch().count();
  const std::int64_t begin_ns = begin.time_since_epoch().count() + to_ns;
  plotted_data data{what.wishes,
                    {.zero_ns = begin_ns,
                     .begin_ns = begin_ns,
                     .end_ns = begin_ns + time.count(),
                     .columns = what.columns}};
  if (const std::string wrong = plotting.subscribe(data); !wrong.empty()) {
    to.error(wrong);
    return {};
  }
  plotting.listen(rt::deadline_after(begin, time), to_ns);
  if (interrupt::seen()) {
    const std::int64_t end_ns = rt::monotonic_clock::now().time_since_epoch().count() + to_ns;
    data.end_at(std::min(end_ns, begin_ns + time.count()));
  }
  (void)robot.hub().close(); // nothing is on its way that anybody waits for
  if (const std::uint64_t lost = lost_here(robot.hub()); lost != 0)
    to.note(counted(lost, "message"), " had no room here, and are missing");
  const bool is_empty =
      std::ranges::all_of(data.series, [](const plotted_series& one) { return one.messages() == 0; });
  if (is_empty && interrupt::seen()) return {.end = exit_code::interrupted};
  return {.data = std::move(data), .end = exit_code::done};
}

} // namespace

plot_outcome data_of_robot(const plot_options& o, const plot_request& what, const console& to) {
  constexpr std::size_t slot_bytes = plotted_bytes_max + std::size_t{1024};
  const auto bounds = limits_for("plot", (plotted_depth_all + 64) * slot_bytes);
  if (!bounds) return {.end = exit_code::usage};
  asked_robot robot{"plot", robot_answer_time, to};
  if (const auto end = robot.connect(o.at, o.timeout, bounds)) return {.end = *end};
  return listen_to(robot, o, what, to);
}

} // namespace rowe::tools
