// SPDX-License-Identifier: Apache-2.0
// Question: what does each kind of request that a peer may send cost the service thread, and what do many
// peers that send nothing else do to the stop?
//
// Measured, for each kind, with a robot of its own: --peers connections send it without pause, as often as
// their kernel takes it, for --milliseconds; all answers are read. Meanwhile a probe calls /rowe/stop every
// 2 ms, open-loop, on a connection of its own for the stop alone; the robot stands already. `per_s` is how
// many messages were read, and `each_us` what the service thread itself ran for one of them, all told
// (cycle_cost.hpp). `cycle_ran_p99_us` and `cycle_ran_max_us` are of single cycles. `stop_p99_us` is from
// the probe's time until it has its answer, `served_p99_us` without the waking of the probe at both ends. The
// rates that limits set are off, so that each message is carried out.
//
// The robot is on core --here: the service thread, SCHED_FIFO --prio where that is granted, idle::poll. The
// peers, ordinary threads, and the probe, SCHED_FIFO 10, share core --there.
//
// A new operation of a codec gets its line here.
//
// Excluded: encryption, and networks.
//
// What would make it lie: other load; a host that takes cores away, which `cycle_ran` does not see; peers
// that cannot send as fast as the robot reads: then `per_s` is theirs, and `each_us` has what a cycle costs
// alone.
//
// Run: bench_requests [--milliseconds=1000] [--peers=36] [--prio=80] [--here=CPU] [--there=CPU]
//      [--rounds=1] [--only=NAME] [--benchmark_out=FILE]
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/socket.h>

#include <rowe/rowe.hpp>

#include "claims.hpp"
#include "cycle_cost.hpp"
#include "listener.hpp"
#include "probe_client.hpp"
#include "stop_probe.hpp"
#include "two_cores.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

int priority = 80;
int milliseconds = 1000;
int peers = 36;

std::string repeated(std::string_view one, std::size_t count) {
  std::string all{one};
  for (std::size_t i = 1; i < count; ++i) all.append(",").append(one);
  return all;
}
std::string numbers(std::size_t count) {
  std::string all = "1";
  for (std::size_t i = 1; i < count; ++i) all += "," + std::to_string(i % 100);
  return all;
}

struct kind {
  std::string name;
  std::string_view subprotocol;
  std::string message;
  wire::opcode what = wire::opcode::text;
};

std::vector<kind> kinds() {
  constexpr std::string_view rosbridge = "", foxglove = "foxglove.websocket.v1";
  const auto call = [](std::string_view service, std::string_view args = "{}") {
    return R"({"op":"call_service","id":"1","service":")" + std::string{service} + R"(","args":)" +
           std::string{args} + "}";
  };
  std::string members = "{";
  for (int i = 0; i < 4300; ++i) members += "\"m" + std::to_string(i) + "\":0,";
  return {
      {"ping", rosbridge, "", wire::opcode::ping},
      {"publish", rosbridge, R"({"op":"publish","topic":"/said","msg":{"x":1}})"},
      {"publish_57kB_of_numbers", rosbridge,
       R"({"op":"publish","topic":"/said","msg":{"x":[)" + numbers(19'000) + "]}}"},
      {"members_before_the_op", rosbridge, members + R"("op":"publish","topic":"/said","msg":{}})"},
      {"no_json", rosbridge, "[" + repeated("1", 28'000)},
      {"call_nobody", rosbridge, call("/nobody")},
      {"rosapi_topics", rosbridge, call("/rosapi/topics")},
      {"rosapi_services", rosbridge, call("/rosapi/services")},
      {"rosapi_node_details", rosbridge, call("/rosapi/node_details", R"({"node":"robot"})")},
      {"rowe_stats", rosbridge, call("/rowe/stats")},
      {"set_param", rosbridge, call("/rosapi/set_param", R"({"name":"/gain","value":"0.5"})")},
      {"subscribe", rosbridge, R"({"op":"subscribe","topic":"/said"})"},
      {"subscribe_parameters_14000", foxglove,
       R"({"op":"subscribeParameterUpdates","parameterNames":[)" + repeated("\"\"", 14'000) + "]}"},
      {"get_parameters_10000", foxglove,
       R"({"op":"getParameters","id":"1","parameterNames":[)" + repeated("\"/a\"", 10'000) + "]}"},
      {"get_parameters", foxglove, R"({"op":"getParameters","id":"1","parameterNames":[]})"},
      {"subscribe_channels_2300", foxglove,
       R"({"op":"subscribe","subscriptions":[)" + repeated(R"({"id":1,"channelId":9})", 2300) + "]}"},
      {"unsubscribe_28000", foxglove,
       R"({"op":"unsubscribe","subscriptionIds":[)" + repeated("1", 28'000) + "]}"},
      {"unadvertise_28000", foxglove, R"({"op":"unadvertise","channelIds":[)" + repeated("1", 28'000) + "]}"},
      {"advertise_500", foxglove,
       R"({"op":"advertise","channels":[)" +
           repeated(R"({"id":1,"topic":"/t","encoding":"json","schemaName":"a/B"})", 500) + "]}"},
  };
}

endpoint_options robot_options() {
  endpoint_options options;
  options.relay = true;
  options.service_cpu = here;
  options.service_priority = priority;
  options.stop.unguarded = true;
  options.limits.connections_max = static_cast<std::uint32_t>(peers) + 8;
  options.limits.messages_per_second_max = 0;
  options.limits.refusals_per_second_max = 0;
  return options;
}

// All of them in one thread, until the end of this object.
class loaders {
 public:
  loaders(std::uint16_t port, const kind& of) {
    const std::string frame = raw_client::frame_of(of.what, of.message);
    while (said_.size() < 64 * 1024) said_ += frame;
    for (int i = 0; i < peers; ++i) {
      all_.push_back({std::make_unique<listener>(port, "/", of.subprotocol)});
      ok_ = ok_ && all_.back().connection->ok();
    }
    if (ok_) thread_ = on_the_other_core([this] { run(); });
  }
  ~loaders() {
    stop_.store(true, std::memory_order_relaxed); // only when, not what
    if (thread_.joinable()) thread_.join();
  }
  bool ok() const { return ok_; }

 private:
  struct one {
    std::unique_ptr<listener> connection;
    std::size_t sent = 0; // of said_
  };
  void run() {
    while (!stop_.load(std::memory_order_relaxed)) { // only when, not what
      for (one& each : all_) {
        const ssize_t sent = ::send(each.connection->socket(), said_.data() + each.sent,
                                    said_.size() - each.sent, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (sent > 0) each.sent = (each.sent + static_cast<std::size_t>(sent)) % said_.size();
        while (each.connection->take([](const wire::frame_step&) {}, MSG_DONTWAIT)) {
        }
      }
    }
  }

  std::string said_; // whole frames
  std::vector<one> all_;
  bool ok_ = true;
  std::atomic<bool> stop_{false};
  rt::thread thread_;
};

// Of one kind in one round.
struct result {
  std::string name;
  double per_s, each, ran_p99, ran_max, stop_p50, stop_p99, served_p99, stop_max, unanswered;
};

bool measure(const kind& of, std::vector<result>& all) {
  auto opened = open_robot(robot_options());
  if (!opened) return false;
  endpoint robot = std::move(*opened);
  const auto said = robot.subscribe<json_text>("/said", {.keep = keep::newest});
  const auto gain = robot.parameter("/gain", 0.5);
  probe_client probe{robot.port()};
  if (!said || !gain || !probe.ok()) return false;
  const auto latch = make_stand(robot, probe);
  const loaders load{robot.port(), of};
  if (!load.ok()) return false;
  begin_cycles();
  const double before = count_of(robot, "messages_in");
  const auto began = monotonic_clock::now();
  stop_figures stops;
  call_stops(probe, std::chrono::milliseconds{milliseconds}, stops);
  const double took = nanoseconds_since(began);
  std::vector<double> ran = cycles_taken();
  const double messages = of.what == wire::opcode::ping ? 0 : count_of(robot, "messages_in") - before;
  const double each = messages == 0 ? 0 : std::accumulate(ran.begin(), ran.end(), 0.0) / messages;
  all.push_back({of.name, messages * 1e9 / took, each / 1000, quantile(ran, 0.99) / 1000,
                 quantile(ran, 1) / 1000, quantile(stops.trips, 0.5) / 1000,
                 quantile(stops.trips, 0.99) / 1000, quantile(stops.served, 0.99) / 1000,
                 quantile(stops.trips, 1) / 1000, static_cast<double>(stops.asked - stops.answered)});
  return true;
}

// The medians over the rounds, and the largest of what is a maximum.
void report(claims& into, const std::vector<result>& all) {
  const auto largest = [](std::vector<double> of) { return quantile(of, 1); };
  double worst_cycle = 0, worst_stop = 0, unanswered = 0;
  for (const kind& one : kinds()) {
    if (std::none_of(all.begin(), all.end(), [&](const result& each) { return each.name == one.name; }))
      continue;
    const auto values_of = [&](double result::*what) {
      std::vector<double> values;
      for (const result& each : all)
        if (each.name == one.name) values.push_back(each.*what);
      return values;
    };
    into.add_row("requests/" + one.name, {{"per_s", median(values_of(&result::per_s))},
                                          {"each_us", median(values_of(&result::each))},
                                          {"cycle_ran_p99_us", median(values_of(&result::ran_p99))},
                                          {"cycle_ran_max_us", largest(values_of(&result::ran_max))},
                                          {"stop_p50_us", median(values_of(&result::stop_p50))},
                                          {"stop_p99_us", median(values_of(&result::stop_p99))},
                                          {"served_p99_us", median(values_of(&result::served_p99))},
                                          {"stop_max_us", largest(values_of(&result::stop_max))},
                                          {"unanswered", largest(values_of(&result::unanswered))}});
    worst_cycle = std::max(worst_cycle, median(values_of(&result::ran_p99)));
    worst_stop = std::max(worst_stop, median(values_of(&result::stop_p99)));
    unanswered += largest(values_of(&result::unanswered));
  }
  constexpr double none = -std::numeric_limits<double>::infinity();
  into.want("the worst kind: the service thread in a cycle, p99, us", worst_cycle, none, 500);
  into.want("the worst kind: the stop, p99, us", worst_stop, none, 2000);
  into.want("stops that were not answered", unanswered, 0, 0);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  if (!choose_cores("bench_requests", count, arguments)) return 1;
  claims into{count, arguments};
  std::string_view only;
  for (int i = 1; i < count; ++i) {
    if (!std::string_view{arguments[i]}.starts_with("--only=")) continue;
    only = std::string_view{arguments[i]}.substr(7);
    std::copy(arguments + i + 1, arguments + count, arguments + i);
    --count;
    break;
  }
  const int rounds = number_option(count, arguments, "rounds", 1);
  milliseconds = number_option(count, arguments, "milliseconds", milliseconds);
  peers = number_option(count, arguments, "peers", peers);
  priority = number_option(count, arguments, "prio", priority);
  if (count != 1 || milliseconds < 1 || peers < 1 || peers > 1000 || rounds < 1) {
    std::fprintf(stderr, "bench_requests: what is %s?\n", count > 1 ? arguments[1] : "that number or time");
    return 1;
  }
  std::printf("The robot is on core %d; %d peers and the probe share core %d.\n", here, peers, there);
  std::vector<result> all;
  for (int round = 0; round < rounds; ++round) {
    for (const kind& each : kinds()) {
      if ((!only.empty() && each.name != only) || measure(each, all)) continue;
      std::fprintf(stderr, "bench_requests: %s: the robot, or its peers, cannot be had\n", each.name.c_str());
      return 1;
    }
  }
  report(into, all);
  return into.say(rounds) ? 0 : 1;
}
