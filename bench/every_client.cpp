// SPDX-License-Identifier: Apache-2.0
// Question: what do three pages, three clients with roslib and three with Foxglove cost a loop of 1 kHz, and
// what do they miss?
//
// Measured: a loop publishes odometry, a struct with 13 doubles, --rate times a second, on a latched topic,
// which is handed over whether anybody listens or not. In each round once with no client (`none`), once with
// one that subscribes as roslib does (`one`), once with nine (`nine`), and once with none while another robot
// of this process, with a loop and a service thread on core --there, has the nine (`elsewhere`): what the
// machine does to a loop while as much goes on. The nine do on the wire what these programs do:
//   page      /odom with throttle_rate 33 and queue_length 1, /rowe/stats likewise, and the state of the stop
//             on this connection and on a second one, for the stop alone
//   roslib    /odom with each value; one of the three by CBOR
//   foxglove  subprotocol, list of channels, subscription; each value in a binary frame
// `publish` is each call of publish() in the loop, the clock's own cost subtracted; `publish_of_none` and
// `publish_of_elsewhere` are the medians over the rounds of the ratios of their medians. `arrival` is from
// the beginning of publish() until the client has the message, of all clients together. `lost` is what
// publish() took and a client of roslib's or Foxglove's never got, the worst client of all rounds;
// `lost_by_name` is what the endpoint counted as lost, whoever lost it. What pages do not get since they
// asked for less is not lost. `refused` is what publish() did not take.
//
// The loop is alone on core --here, SCHED_FIFO --prio where that is granted. The service thread is on core
// --there with --prio - 1, idle::poll, and so is the one thread of all clients, an ordinary one: they share
// two cores with the robot, so that an arrival has the work for the clients before it in it.
//
// Excluded: networks; what browsers and programs do with the messages (tests/web has these programs
// themselves, and counts).
//
// What would make it lie: other load; the clients' thread, which competes with the service thread for a core;
// SCHED_FIFO refused, which the program says.
//
// Run: bench_every_client [--rounds=11] [--milliseconds=1000] [--rate=1000] [--prio=80] [--here=CPU]
//      [--there=CPU] [--benchmark_out=FILE]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/epoll.h>

#include <rowe/rowe.hpp>
#include <rowe/rt/periodic.hpp>

#include "claims.hpp"
#include "listener.hpp"
#include "stamped.hpp"
#include "two_cores.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

int priority = 80;
int milliseconds = 1000;
int rate = 1000;

enum class program { page, page_stop, roslib, roslib_cbor, foxglove };
constexpr std::array nine = {program::page,     program::page_stop, program::page,        program::page_stop,
                             program::page,     program::page_stop, program::roslib,      program::roslib,
                             program::foxglove, program::foxglove,  program::roslib_cbor, program::foxglove};

bool takes_all(program one) { return one != program::page && one != program::page_stop; }

// ---- one client

class client {
 public:
  client(std::uint16_t port, program is)
      : is_{is},
        connection_{port, is == program::page_stop ? "/rowe/stop" : "/",
                    is == program::foxglove ? "foxglove.websocket.v1" : ""} {
    if (is == program::page) {
      subscribe("stats", "/rowe/stats", R"(,"throttle_rate":100,"queue_length":1)");
      subscribe("pose", "/odom", R"(,"throttle_rate":33,"queue_length":1)");
    }
    if (is == program::page || is == program::page_stop) subscribe("stop", "/rowe/stop/state", "");
    if (is == program::roslib || is == program::roslib_cbor) {
      std::string more = R"(,"type":"nav_msgs/Odometry","throttle_rate":0,"queue_length":0,"compression":")";
      more += is == program::roslib ? "none" : "cbor";
      subscribe("subscribe:/odom:1", "/odom", more + '"');
    }
  }

  bool ok() const { return connection_.ok(); }
  int socket() const { return connection_.socket(); }
  bool takes_all() const { return bench::takes_all(is_); }
  std::uint64_t newest() const { return newest_; }
  // Of those from `first` on, each one once.
  std::uint64_t heard_since(std::uint64_t first) const {
    return static_cast<std::uint64_t>(std::count_if(
        heard_.begin(), heard_.end(), [&](const arrival& one) { return one.sequence >= first; }));
  }
  void add_times(std::uint64_t since, std::vector<double>& into) const {
    for (const arrival& one : heard_)
      if (one.sequence >= since) into.push_back(one.took_ns);
  }

  void take() {
    while (connection_.take([&](const wire::frame_step& step) { hear(text_of(step)); }, MSG_DONTWAIT))
      continue;
  }

 private:
  void subscribe(std::string_view id, std::string_view topic, std::string_view more) {
    (void)connection_.say(R"({"op":"subscribe","id":")" + std::string{id} + R"(","topic":")" + // ok() says it
                          std::string{topic} + '"' + std::string{more} + "}");
  }
  void hear(std::string_view message) {
    if (const auto came = arrival_of(message, monotonic_clock::now())) {
      if (came->sequence <= newest_) return; // the latched one, once more
      newest_ = came->sequence;
      heard_.push_back(*came);
    } else if (is_ == program::foxglove && message.find("\"advertise\"") != std::string_view::npos) {
      choose(message);
    }
  }
  // Of a list of channels, the one of the odometry: its number stands before its topic.
  void choose(std::string_view list) {
    const std::size_t topic = list.find(R"("topic":"/odom")");
    if (topic == std::string_view::npos) return;
    const auto number = number_behind(list.substr(list.rfind("\"id\":", topic)), "id");
    (void)connection_.say(R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":)" + // ok() says it
                          std::to_string(number.value_or(0)) + "}]}");
  }

  program is_;
  listener connection_;
  std::uint64_t newest_ = 0;
  std::vector<arrival> heard_;
};

// All clients, on one thread of the core `there`.
class crowd {
 public:
  crowd(std::uint16_t port, std::size_t count) {
    // One that is alone is a client of roslib's.
    for (std::size_t i = 0; i < count; ++i)
      all_.push_back(std::make_unique<client>(port, count == 1 ? program::roslib : nine[i]));
    thread_ = on_the_other_core([this] { run(); });
  }
  ~crowd() { end(); }

  // The newest value that all have, pages aside; 0: not all have one.
  std::uint64_t all_have() const { return all_have_.load(std::memory_order_relaxed); } // only how far
  bool pages_have() const { return pages_have_.load(std::memory_order_relaxed); }      // likewise
  // They may be looked into afterwards.
  void end() {
    stop_.store(true, std::memory_order_relaxed); // only when, not what: the join is between
    thread_.join();
  }
  const std::vector<std::unique_ptr<client>>& clients() const { return all_; }
  bool ok() const {
    return std::all_of(all_.begin(), all_.end(), [](const auto& one) { return one->ok(); });
  }

 private:
  void run() {
    const net::descriptor events{::epoll_create1(EPOLL_CLOEXEC)};
    for (const auto& one : all_) {
      epoll_event readable{.events = EPOLLIN, .data = {.ptr = one.get()}};
      (void)::epoll_ctl(events.get(), EPOLL_CTL_ADD, one->socket(), &readable); // who is not heard is missed
    }
    while (!stop_.load(std::memory_order_relaxed)) { // pairs with nothing: see end()
      std::array<epoll_event, 16> ready;
      const int count = ::epoll_wait(events.get(), ready.data(), ready.size(), 20);
      for (int i = 0; i < count; ++i)
        static_cast<client*>(ready[static_cast<std::size_t>(i)].data.ptr)->take();
      if (!ok()) return; // its sockets would be ready for ever
      note();
    }
  }
  void note() {
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    bool pages = true;
    for (const auto& one : all_) {
      if (one->takes_all()) least = std::min(least, one->newest());
    }
    for (std::size_t i = 0; i < all_.size() && all_.size() > 1; ++i)
      if (nine[i] == program::page) pages = pages && all_[i]->newest() != 0;
    all_have_.store(least, std::memory_order_relaxed); // see all_have()
    pages_have_.store(pages, std::memory_order_relaxed);
  }

  std::vector<std::unique_ptr<client>> all_;
  std::atomic<std::uint64_t> all_have_{0};
  std::atomic<bool> pages_have_{false};
  std::atomic<bool> stop_{false};
  rt::thread thread_;
};

// ---- the robot

struct contender {
  const char* name;
  std::size_t connections;                          // three pages have six of them
  bool elsewhere = false;                           // they are another robot's
  std::vector<double> publish_p50{}, publish_p99{}; // ns, of each round
  std::vector<double> arrival_p50{}, arrival_p99{}, arrival_max{};
  double lost = 0; // of the worst client
  double lost_by_name = 0, refused = 0, published = 0;
};

double losses_of(const endpoint& robot) {
  double all = 0;
  for (const count& one : robot.counts())
    if (one.group == "loss") all += static_cast<double>(one.value);
  return all;
}
void say_losses(const endpoint& robot, const char* during) {
  for (const count& one : robot.counts())
    if (one.group == "loss" && one.value != 0)
      std::printf("%s: %s %llu\n", during, std::string{one.name}.c_str(), // since it was opened
                  static_cast<unsigned long long>(one.value));
}

struct robot {
  endpoint open;
  stop_latch latch;
  publisher<stamped> odometry;

  status publish(std::uint64_t sequence, rt::time_point now) {
    if (latch.engaged(now)) latch.acknowledge(now);
    return odometry.publish(odometry_at(sequence, monotonic_clock::now()), now);
  }
};

std::optional<robot> open_robot() {
  endpoint_options options;
  options.service_cpu = there;
  options.service_priority = priority > 1 ? priority - 1 : 0;
  options.stop.unguarded = true;
  auto opened = endpoint::listen(0, options);
  if (!opened) {
    options.service_priority = 0;
    opened = endpoint::listen(0, options);
  }
  if (!opened) return std::nullopt;
  auto latch = opened->stop_latch({.loop_timeout = 10s});
  auto odometry = opened->advertise<stamped>("/odom", {.latched = true, .type = "nav_msgs/Odometry"});
  if (!latch || !odometry) return std::nullopt;
  return robot{std::move(*opened), std::move(*latch), std::move(*odometry)};
}

// A loop that is not measured, on the other core.
class loop_beside {
 public:
  explicit loop_beside(robot& of)
      : thread_{rt::thread_options{.name = "beside", .cpu = there, .priority = priority},
                [this, &of](const rt::grants&) {
                  rt::periodic beat{rt::duration{1s} / rate};
                  for (std::uint64_t sequence = 1; !stop_.load(std::memory_order_relaxed); ++sequence)
                    (void)of.publish(sequence, *beat.wait()); // nobody counts
                }} {}
  ~loop_beside() {
    stop_.store(true, std::memory_order_relaxed); // only when, not what
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  rt::thread thread_;
};

// What a loop found.
struct cycles {
  std::vector<double> took;          // by publish(), ns
  std::uint64_t first = 0, last = 0; // that count
  std::uint64_t taken = 0;           // by publish()
  double lost_before = 0;
};

// Publishes until all have heard something, and from then on for the time of a round.
cycles run_loop(robot& of, const crowd& clients, bool says_grants) {
  const auto count = static_cast<std::uint64_t>(milliseconds) * static_cast<std::uint64_t>(rate) / 1000;
  const double clock = clock_cost();
  cycles seen;
  seen.took.reserve(count);
  rt::thread loop{
      rt::thread_options{.name = "loop", .cpu = here, .priority = priority}, [&](const rt::grants&) {
        const rt::time_point give_up = monotonic_clock::now() + 30s;
        rt::periodic beat{rt::duration{1s} / rate};
        for (std::uint64_t sequence = 1; seen.took.size() < count; ++sequence) {
          const rt::time_point now = *beat.wait();
          if (of.latch.engaged(now)) of.latch.acknowledge(now);
          const stamped value = odometry_at(sequence, monotonic_clock::now());
          const auto begin = monotonic_clock::now();
          const status done = of.odometry.publish(value, now);
          const double spent = nanoseconds_since(begin);
          if (seen.first != 0) {
            seen.took.push_back(spent - clock);
            if (done) ++seen.taken;
            if (done) seen.last = sequence;
          } else if ((clients.all_have() != 0 && clients.pages_have() && sequence > 50) || now > give_up) {
            seen.first = sequence + 1;
            seen.lost_before = losses_of(of.open);
          }
        }
      }};
  if (says_grants) say_grants("loop", loop.grants());
  loop.join();
  return seen;
}

bool measure(contender& of) {
  auto measured = open_robot();
  std::optional<robot> other;
  if (of.elsewhere) other = open_robot();
  if (!measured || (of.elsewhere && !other)) return false;
  crowd clients{(other ? other : measured)->open.port(), of.connections};
  if (!clients.ok()) return false;
  std::optional<loop_beside> beside;
  if (other) beside.emplace(*other);
  const bool is_first = of.connections == 0 && of.publish_p50.empty();
  if (is_first) say_grants("service thread", measured->open.service_grants());
  cycles seen = run_loop(*measured, clients, is_first);

  const auto until = monotonic_clock::now() + 10s;
  while (!other && clients.all_have() < seen.last && monotonic_clock::now() < until)
    std::this_thread::sleep_for(1ms);
  clients.end();
  if (!clients.ok()) {
    std::fprintf(stderr, "%s: a connection ended\n", of.name);
    return false;
  }
  of.publish_p50.push_back(std::max(quantile(seen.took, 0.5), 1.0));
  of.publish_p99.push_back(std::max(quantile(seen.took, 0.99), 1.0));
  of.published += static_cast<double>(seen.taken);
  of.refused += static_cast<double>(seen.took.size() - seen.taken);
  const double lost = losses_of(measured->open) - seen.lost_before;
  if (lost != 0) say_losses(measured->open, of.name);
  of.lost_by_name += lost;
  if (other) return true;
  std::vector<double> arrivals;
  for (const auto& one : clients.clients()) {
    one->add_times(seen.first, arrivals);
    if (!one->takes_all()) continue;
    const auto heard = static_cast<double>(one->heard_since(seen.first));
    of.lost = std::max(of.lost, static_cast<double>(seen.taken) - heard);
  }
  of.arrival_p50.push_back(quantile(arrivals, 0.5));
  of.arrival_p99.push_back(quantile(arrivals, 0.99));
  of.arrival_max.push_back(quantile(arrivals, 1));
  return true;
}

double median_ratio(const std::vector<double>& of, const std::vector<double>& to) {
  std::vector<double> each;
  for (std::size_t i = 0; i < of.size(); ++i) each.push_back(of[i] / to[i]);
  return median(std::move(each));
}

void report(claims& into, const std::array<contender, 4>& all) {
  const contender &none = all[0], &last = all[2], &elsewhere = all[3];
  for (const contender& one : all) {
    claims::counters of{{"publish_p50_ns", median(one.publish_p50)},
                        {"publish_p99_ns", median(one.publish_p99)},
                        {"publish_of_none", median_ratio(one.publish_p50, none.publish_p50)},
                        {"publish_p99_of_none", median_ratio(one.publish_p99, none.publish_p99)},
                        {"publish_of_elsewhere", median_ratio(one.publish_p50, elsewhere.publish_p50)},
                        {"published", one.published},
                        {"refused", one.refused},
                        {"lost_by_name", one.lost_by_name}};
    if (one.connections != 0 && !one.elsewhere) {
      of.insert(of.end(), {{"lost", one.lost},
                           {"arrival_p50_us", median(one.arrival_p50) / 1000},
                           {"arrival_p99_us", median(one.arrival_p99) / 1000},
                           {"arrival_max_us",
                            *std::max_element(one.arrival_max.begin(), one.arrival_max.end()) / 1000}});
    }
    into.add_row("every_client/" + std::string{one.name}, std::move(of));
  }
  constexpr double least = -std::numeric_limits<double>::infinity();
  into.want("cost of publish() in the loop with nine clients, p50, in that with none",
            median_ratio(last.publish_p50, none.publish_p50), 0.9, 1.1);
  into.want("the same in that with none, while another robot of this process has the nine",
            median_ratio(last.publish_p50, elsewhere.publish_p50), 0.9, 1.1);
  into.want("messages that a healthy client lost, the worst of nine", last.lost, 0, 0);
  into.want("messages that the endpoint counted as lost", last.lost_by_name, 0, 0);
  into.want("arrival, p99, us", median(last.arrival_p99) / 1000, least, 2000);
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  if (!choose_cores("bench_every_client", count, arguments)) return 1;
  claims said{count, arguments};
  const int rounds = number_option(count, arguments, "rounds", 11);
  milliseconds = number_option(count, arguments, "milliseconds", milliseconds);
  rate = number_option(count, arguments, "rate", rate);
  priority = number_option(count, arguments, "prio", priority);
  if (count != 1 || rate < 1 || milliseconds < 1 || rounds < 1) {
    std::fprintf(stderr, "bench_every_client: what is %s?\n", count > 1 ? arguments[1] : "that rate or time");
    return 1;
  }
  std::printf(
      "The loop is on core %d; the service thread and all clients share core %d. So what clients do is "
      "in these figures, too.\n",
      here, there);
  std::array<contender, 4> all{contender{"none", 0}, contender{"one", 1}, contender{"nine", nine.size()},
                               contender{"elsewhere", nine.size(), true}};
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      contender& one = all[round % 2 == 0 ? i : all.size() - 1 - i];
      if (measure(one)) continue;
      std::fprintf(stderr, "%s: the robot did not open, or a client did not connect\n", one.name);
      return 1;
    }
  }
  report(said, all);
  return said.say(rounds) ? 0 : 1;
}
