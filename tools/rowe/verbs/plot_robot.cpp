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
std::vector<std::string> topics_of(const plotted_data& data) {
  std::vector<std::string> all;
  for (const plotted_series& one : data.series)
    if (std::ranges::find(all, one.wish().topic) == all.end()) all.push_back(one.wish().topic);
  return all;
}

class robot_plotter {
 public:
  robot_plotter(endpoint& hub, remote& connection, plotted_data& into, const console& to)
      : hub_{hub}, connection_{connection}, into_{into}, to_{to} {}

  // Empty: all topics are there, as far as the robot says which there are, and are subscribed to.
  std::string subscribe() {
    const std::vector<std::string> wanted = topics_of(into_);
    if (wanted.size() > plotted_topics_max)
      return joined(wanted.size(), " topics are too many: at most ", plotted_topics_max);
    const std::vector<std::string> known = ask_topics();
    const auto is_known = [&](std::string_view name) {
      return std::ranges::any_of(known, [&](const std::string& one) { return is_same_name(one, name); });
    };
    for (const std::string& topic : wanted) {
      if (!known.empty() && !is_known(topic))
        return joined(connection_.url(), " has no topic ", quoted(topic), hint_of(topic, known));
      if (std::string wrong = subscribe(topic, into_.fields_of_topic(topic), wanted.size()); !wrong.empty())
        return wrong;
    }
    if (!is_known(stop_state_topic)) return {};
    return subscribe(std::string{stop_state_topic}, {}, wanted.size());
  }

  void ask_units() {
    watcher waits{connection_};
    service_asker asks{hub_, waits, robot_answer_time};
    robot_types types;
    if (!types.read_all(asks)) return;
    for (plotted_series& one : into_.series) {
      const typed_name* const described = types.find_topic(one.wish().topic);
      if (described != nullptr && described->message != nullptr)
        one.unit = unit_in(json_schema(*described->message), one.wish().path);
    }
  }

  // Until then, or a signal. `to_ns` makes a moment of this machine one since 1970.
  void listen(rt::time_point end, std::int64_t to_ns) {
    const rt::time_point begin = rt::monotonic_clock::now();
    rt::time_point next_status = begin + 1s;
    while (!interrupt::seen()) {
      take_all(to_ns);
      connection_.report();
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

  std::string subscribe(const std::string& topic, std::vector<std::size_t> fields, std::size_t among) {
    const auto depth = static_cast<std::uint32_t>(plotted_depth_all / (among + 1));
    auto one = hub_.subscribe<json_text>(topic, {.depth = depth, .text_bytes_max = plotted_bytes_max});
    if (!one) return joined("cannot subscribe to ", quoted(topic), ": ", one.error().message());
    sources_.push_back({std::move(*one), std::move(fields)});
    return {};
  }

  // None: the robot does not say.
  std::vector<std::string> ask_topics() {
    std::vector<std::string> names;
    auto opened = hub_.client<json_text, json_text>("/rosapi/topics",
                                                    {.depth = 1, .text_bytes_max = plotted_bytes_max});
    if (!opened) return names;
    watcher waits{connection_};
    const auto answer = waits.during([&] { return opened->call("{}", robot_answer_time); });
    if (!answer) return names;
    for (const json_value one : answer->json().find("topics").value_or(json_value{}).elements())
      names.push_back(plain_text_of(one));
    return names;
  }

  void take_all(std::int64_t to_ns) {
    for (source& one : sources_) {
      for (std::size_t left = plotted_depth_all; left != 0 && !interrupt::seen(); --left) {
        const auto message = one.from.try_take();
        if (!message) break;
        const std::int64_t time_ns = message->arrived().time_since_epoch().count() + to_ns;
        if (one.fields.empty())
          into_.take_stop_state(message->json(), time_ns);
        else
          into_.take(one.fields, message->json(), time_ns);
        if (!one.fields.empty()) ++messages_;
      }
    }
  }

  endpoint& hub_;
  remote& connection_;
  plotted_data& into_;
  const console& to_;
  std::vector<source> sources_;
  std::uint64_t messages_ = 0;
};

plot_outcome listen_to(endpoint hub, const std::string& url, const plot_options& o, const plot_request& what,
                       const console& to) {
  remote connection{hub, url, to};
  if (const auto end = connection.wait(o.timeout)) return {.end = *end};
  const rt::duration time = o.time.value_or(usual_listening_time);
  const rt::time_point asked = rt::monotonic_clock::now();
  const std::int64_t to_ns = wall_clock_ns() - asked.time_since_epoch().count();
  const std::int64_t begin_ns = asked.time_since_epoch().count() + to_ns;
  plotted_data data{what.wishes,
                    {.zero_ns = begin_ns,
                     .begin_ns = begin_ns,
                     .end_ns = begin_ns + time.count(),
                     .columns = what.columns}};
  robot_plotter plotting{hub, connection, data, to};
  plotting.ask_units();
  if (const std::string wrong = plotting.subscribe(); !wrong.empty()) {
    to.error(wrong);
    return {};
  }
  plotting.listen(rt::deadline_after(asked, time), to_ns);
  if (interrupt::seen()) {
    const std::int64_t end_ns = rt::monotonic_clock::now().time_since_epoch().count() + to_ns;
    data.end_at(std::min(end_ns, begin_ns + time.count()));
  }
  (void)hub.close(); // nothing is on its way that anybody waits for
  if (const std::uint64_t lost = lost_here(hub); lost != 0)
    to.note(counted(lost, "message"), " had no room here, and are missing");
  const bool is_empty =
      std::ranges::all_of(data.series, [](const plotted_series& one) { return one.messages() == 0; });
  if (is_empty && interrupt::seen()) return {.end = exit_code::interrupted};
  return {.data = std::move(data), .end = exit_code::done};
}

} // namespace

plot_outcome data_of_robot(const plot_options& o, const plot_request& what, const console& to) {
  const spelled_url url = read_url(o.at.url);
  if (url.url.empty()) return {.end = usage_error("plot", url.wrong)};
  auto bounds = limits_for("plot");
  if (!bounds) return {.end = exit_code::usage};
  constexpr std::size_t slot_bytes = plotted_bytes_max + std::size_t{1024};
  bounds->handle_bytes = std::max(bounds->handle_bytes, (plotted_depth_all + 64) * slot_bytes);
  endpoint_options options{.limits = *bounds};
  if (const auto end = use(o.at, options, to)) return {.end = *end};
  auto hub = endpoint::connect(url.url, options);
  if (!hub) return {.end = cannot_open(url.url, hub.error(), to)};
  return listen_to(std::move(hub).value(), url.url, o, what, to);
}

} // namespace rowe::tools
