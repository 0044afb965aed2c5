// SPDX-License-Identifier: Apache-2.0
// Question: what do maps of 10 MB that come and go cost another peer's stream, and the stop?
//
// Measured, in turn in each round, with one robot each:
//   quiet     no maps
//   out       this process publishes a map of --megabytes to one peer, again and again: the next one when the
//             peer has the last byte of the one before
//   in        a peer sends such maps in, and the robot relays them to another one, likewise
// First `stream`: odometry, 100 times a second for --milliseconds, to another peer, from the beginning of
// publish() until the peer has it. Then the stop, for as long: a probe calls /rowe/stop every 2 ms on a
// connection of its own for the stop alone, open-loop, as in bench_stop_under_flood; the robot stands
// already.
// `stream_later_p99_us` is the median over the rounds of how much larger the p99 is than the quiet one of the
// same round, `stop_p99_of_quiet` that of the ratio of the p99s. `stream_lost` are values of the stream that
// its peer never got. `maps` is how many arrived whole. `woke_late` is by how much the probe woke after
// its time, and `served` the time from its waking until the answer was in its kernel: what the peers' core
// does to the probe is in neither end of it. `cycle_ran` is what the service thread itself ran in a cycle
// (cycle_cost.hpp), and `cycle_max` its longest cycle, whatever held it up.
//
// The robot is on core --here: the service thread, SCHED_FIFO --prio where that is granted, idle::poll, and
// the loop of the stream. All peers share core --there: who reads and sends maps, ordinary threads, and the
// stream's peer and the probe, SCHED_FIFO 10. So their threads share two cores with the robot.
//
// Excluded: networks, where a map of 10 MB occupies the line.
//
// What would make it lie: other load; a host that takes cores away (`cycle_max` is then some ms where
// `cycle_ran` is a tenth of one); SCHED_FIFO refused (the program says what was granted), since the
// stream's peer then waits for those who read maps; a sender that gives its kernel 10 MB at once, which keeps
// the probe from their core for 5 ms: it gives 32 KiB. With few messages the p99 says little: of 100 a
// second, that of 3 s is the third largest.
//
// Run: bench_maps [--rounds=5] [--milliseconds=3000] [--megabytes=10] [--prio=80] [--here=CPU] [--there=CPU]
//      [--benchmark_out=FILE]
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <rowe/rowe.hpp>
#include <rowe/rt/periodic.hpp>

#include "claims.hpp"
#include "cycle_cost.hpp"
#include "listener.hpp"
#include "probe_client.hpp"
#include "stamped.hpp"
#include "stop_probe.hpp"
#include "two_cores.hpp"

namespace rowe::bench {
namespace {

using namespace std::chrono_literals;

constexpr int stream_rate = 100;

int priority = 80;
int milliseconds = 3000;
int megabytes = 10;

std::size_t map_bytes() { return static_cast<std::size_t>(megabytes) * 1'000'000; }

// As a map is: an object with one long array of small numbers.
std::string map_text() {
  std::string text = R"({"data":[0)";
  while (text.size() + 8 < map_bytes()) text += ",100,-1";
  return text + "]}";
}

enum class traffic { none, out, in };

struct contender {
  const char* name;
  traffic maps;
  std::vector<double> stream_p50{}, stream_p99{}; // ns, of each round
  stop_figures stops{};
  std::vector<double> stop_p50{}, served_p99{}, woke_late_p99{};
  std::vector<double> maps_per_s{};
  std::vector<double> ran{}; // what the service thread itself ran in each cycle, of all rounds
  double lost = 0;           // values of the stream
  double maps_read = 0;      // whole
};

endpoint_options robot_options() {
  endpoint_options options;
  options.relay = true;
  options.service_cpu = here;
  options.service_priority = priority;
  options.stop.unguarded = true;
  options.limits.long_message_bytes_max = static_cast<std::uint32_t>(map_bytes()) + 4096;
  options.limits.handle_bytes += 8 * map_bytes(); // slots for texts as long as that
  return options;
}

// The peer that reads maps.
class map_reader {
 public:
  explicit map_reader(std::uint16_t port) : connection_{port} {
    (void)connection_.say(R"({"op":"subscribe","topic":"/map"})"); // ok() says it
    thread_ = on_the_other_core([this] {
      while (connection_.ok() && !stop_.load(std::memory_order_relaxed)) { // only when, not what
        (void)connection_.take([this](const wire::frame_step& step) {      // nothing came: once more
          if (step.event == wire::frame_event::piece || !step.in_pieces) return;
          read_.fetch_add(1, std::memory_order_relaxed); // likewise
        });
      }
    });
  }
  ~map_reader() {
    stop_.store(true, std::memory_order_relaxed); // see above
    connection_.end();
    thread_.join();
  }
  bool ok() const { return connection_.ok(); }
  std::uint64_t read() const { return read_.load(std::memory_order_relaxed); } // only how many

 private:
  listener connection_;
  std::atomic<std::uint64_t> read_{0};
  std::atomic<bool> stop_{false};
  rt::thread thread_;
};

// Maps, one after the other, until the end of this object.
class map_source {
 public:
  // Either the robot publishes them, or a peer sends them.
  map_source(endpoint& robot, traffic how, const std::string& map) {
    if (how == traffic::none) return;
    reader_.emplace(robot.port());
    if (how == traffic::in) {
      sender_.emplace(robot.port());
      const int buffer = 128 * 1024;
      (void)::setsockopt(sender_->socket(), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer); // see send_map()
      frame_ =
          raw_client::frame_of(wire::opcode::text, R"({"op":"publish","topic":"/map","msg":)" + map + "}");
    } else {
      auto made = robot.advertise<json_text>(
          "/map", {.depth = 2, .text_bytes_max = static_cast<std::uint32_t>(map_bytes()) + 1024});
      if (made) publisher_ = std::move(*made);
    }
    map_ = how == traffic::out ? &map : nullptr;
    thread_ = on_the_other_core([this] { run(); });
  }
  ~map_source() {
    stop_.store(true, std::memory_order_relaxed); // only when, not what
    if (thread_.joinable()) thread_.join();
  }
  bool ok() const { return !reader_ || (reader_->ok() && (map_ != nullptr || sender_->ok())); }
  std::uint64_t read() const { return reader_ ? reader_->read() : 0; }

 private:
  bool goes_on() const { return !stop_.load(std::memory_order_relaxed); } // only when, not what
  // In pieces, each a system call: a kernel that copies 10 MB in one keeps everybody else from this core.
  bool send_map() {
    bool good = true;
    for (std::string_view rest = frame_; good && !rest.empty();) {
      const std::string_view piece = rest.substr(0, 32 * 1024);
      good = sender_->send(piece);
      rest.remove_prefix(piece.size());
    }
    return good;
  }
  void run() {
    std::uint64_t said = 0;
    while (goes_on()) {
      if (map_ != nullptr) {
        if (publisher_.publish(*map_)) ++said;
      } else if (send_map()) {
        ++said;
      }
      // One that was lost is not waited for for ever.
      const auto until = monotonic_clock::now() + 2s;
      while (goes_on() && reader_->read() < said && monotonic_clock::now() < until)
        std::this_thread::sleep_for(1ms);
      said = std::min(said, reader_->read());
    }
  }

  std::optional<map_reader> reader_;
  std::optional<listener> sender_;
  std::string frame_;
  const std::string* map_ = nullptr;
  publisher<json_text> publisher_;
  std::atomic<bool> stop_{false};
  rt::thread thread_;
};

// The stream, for its time: how late each value was. `lost`: those that did not come.
std::vector<double> run_stream(endpoint& robot, double& lost) {
  std::vector<double> late;
  auto odometry = robot.advertise<stamped>("/odom", {.depth = 256});
  listener peer{robot.port()};
  if (!odometry || !peer.say(R"({"op":"subscribe","topic":"/odom"})")) return late;
  while (!odometry->wanted()) std::this_thread::sleep_for(1ms);
  const std::uint64_t count = static_cast<std::uint64_t>(milliseconds) * stream_rate / 1000;
  std::atomic<std::uint64_t> newest{0};
  rt::thread reader{rt::thread_options{.name = "stream", .cpu = there, .priority = probe_priority},
                    [&](const rt::grants&) {
                      while (peer.ok() && newest.load(std::memory_order_relaxed) < count) { // its own
                        (void)peer.take([&](const wire::frame_step& step) { // nothing came: once more
                          const auto came = arrival_of(text_of(step), monotonic_clock::now());
                          if (!came) return;
                          late.push_back(came->took_ns);
                          newest.store(came->sequence, std::memory_order_relaxed); // only how far
                        });
                      }
                    }};
  rt::thread{rt::thread_options{.name = "loop", .cpu = here, .priority = priority},
             [&](const rt::grants&) {
               rt::periodic beat{rt::duration{1s} / stream_rate};
               for (std::uint64_t sequence = 1; sequence <= count; ++sequence) {
                 const auto now = beat.wait();
                 (void)odometry->publish(odometry_at(sequence, monotonic_clock::now()), *now); // missed: lost
               }
             }}
      .join();
  const auto patient_until = monotonic_clock::now() + 10s;
  while (newest.load(std::memory_order_relaxed) < count && monotonic_clock::now() < patient_until)
    std::this_thread::sleep_for(1ms);
  peer.end();
  reader.join();
  lost += static_cast<double>(count) - static_cast<double>(late.size());
  return late;
}

bool measure(contender& of, const std::string& map) {
  auto opened = open_robot(robot_options());
  if (!opened) return false;
  endpoint robot = std::move(*opened);
  if (of.maps == traffic::none && of.stream_p50.empty()) say_grants("service thread", robot.service_grants());
  map_source maps{robot, of.maps, map};
  const auto begin = monotonic_clock::now();
  while (maps.ok() && of.maps != traffic::none && maps.read() == 0 && nanoseconds_since(begin) < 30e9)
    std::this_thread::sleep_for(1ms);
  if (!maps.ok()) return false;

  begin_cycles();
  const std::uint64_t before = maps.read();
  const auto counted = monotonic_clock::now();
  std::vector<double> late = run_stream(robot, of.lost);
  if (late.empty()) return false;
  of.stream_p50.push_back(quantile(late, 0.5));
  of.stream_p99.push_back(quantile(late, 0.99));

  probe_client probe{robot.port()};
  if (!probe.ok()) return false;
  const auto latch = make_stand(robot, probe);
  stop_figures now;
  call_stops(probe, std::chrono::milliseconds{milliseconds}, now);
  of.served_p99.push_back(quantile(now.served, 0.99));
  of.woke_late_p99.push_back(quantile(now.woke_late, 0.99));
  const std::vector<double> ran = cycles_taken();
  of.ran.insert(of.ran.end(), ran.begin(), ran.end());
  of.stop_p50.push_back(quantile(now.trips, 0.5));
  of.stops.p99s.push_back(now.p99s.front());
  of.stops.trips.insert(of.stops.trips.end(), now.trips.begin(), now.trips.end());
  of.stops.asked += now.asked;
  of.stops.answered += now.answered;
  of.stops.cycles.push_back(count_of(robot, "cycle_ns_max"));
  of.maps_read += static_cast<double>(maps.read());
  of.maps_per_s.push_back(static_cast<double>(maps.read() - before) * 1e9 / nanoseconds_since(counted));
  for (const count& one : robot.counts())
    if (one.group == "loss" && one.value != 0)
      std::printf("%s: %s %llu\n", of.name, std::string{one.name}.c_str(),
                  static_cast<unsigned long long>(one.value));
  return maps.ok();
}

template <class Of>
double median_of(const std::vector<double>& of, const std::vector<double>& to, Of how) {
  std::vector<double> each;
  for (std::size_t i = 0; i < of.size(); ++i) each.push_back(how(of[i], to[i]));
  return median(std::move(each));
}

void report(claims& into, std::array<contender, 3>& all) {
  const contender& quiet = all[0];
  constexpr double none = -std::numeric_limits<double>::infinity();
  for (contender& one : all) {
    const double later =
        median_of(one.stream_p99, quiet.stream_p99, [](double a, double b) { return a - b; });
    const double ratio =
        median_of(one.stops.p99s, quiet.stops.p99s, [](double a, double b) { return a / b; });
    const auto lost_calls = static_cast<double>(one.stops.asked - one.stops.answered);
    into.add_row("maps/" + std::string{one.name}, {{"stream_p50_us", median(one.stream_p50) / 1000},
                                                   {"stream_p99_us", median(one.stream_p99) / 1000},
                                                   {"stream_later_p99_us", later / 1000},
                                                   {"stream_lost", one.lost},
                                                   {"stop_p50_us", median(one.stop_p50) / 1000},
                                                   {"stop_p99_us", median(one.stops.p99s) / 1000},
                                                   {"served_p99_us", median(one.served_p99) / 1000},
                                                   {"woke_late_p99_us", median(one.woke_late_p99) / 1000},
                                                   {"stop_max_us", quantile(one.stops.trips, 1) / 1000},
                                                   {"stop_p99_of_quiet", ratio},
                                                   {"unanswered", lost_calls},
                                                   {"cycle_ran_p99.9_us", quantile(one.ran, 0.999) / 1000},
                                                   {"cycle_ran_max_us", quantile(one.ran, 1) / 1000},
                                                   {"cycle_max_us", quantile(one.stops.cycles, 1) / 1000},
                                                   {"maps", one.maps_read},
                                                   {"maps_per_s", median(one.maps_per_s)}});
    if (one.maps == traffic::none) continue;
    const std::string beside = std::string{"with maps "} + one.name + ": ";
    into.want(beside + "how much later the other peer's 100 Hz stream is, p99, us", later / 1000, none, 2000);
    into.want(beside + "values of that stream that were lost", one.lost, 0, 0);
    into.want(beside + "the stop's p99 in the quiet one", ratio, none, 1.5);
    into.want(beside + "stops that were not answered", lost_calls, 0, 0);
  }
}

} // namespace
} // namespace rowe::bench

int main(int count, char** arguments) {
  using namespace rowe::bench;
  if (!choose_cores("bench_maps", count, arguments)) return 1;
  claims said{count, arguments};
  const int rounds = number_option(count, arguments, "rounds", 5);
  milliseconds = number_option(count, arguments, "milliseconds", milliseconds);
  megabytes = number_option(count, arguments, "megabytes", megabytes);
  priority = number_option(count, arguments, "prio", priority);
  if (count != 1 || megabytes < 1 || megabytes > 60 || milliseconds < 1 || rounds < 1) {
    std::fprintf(stderr, "bench_maps: what is %s?\n", count > 1 ? arguments[1] : "that size or time");
    return 1;
  }
  std::printf("The robot is on core %d; all peers share core %d. So their threads share two cores with the "
              "robot, and what they do is in these figures, too.\n",
              here, there);
  const std::string map = map_text();
  std::array<contender, 3> all{contender{"quiet", traffic::none}, contender{"out", traffic::out},
                               contender{"in", traffic::in}};
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      contender& one = all[round % 2 == 0 ? i : all.size() - 1 - i];
      if (measure(one, map)) continue;
      std::fprintf(stderr, "%s: the robot did not open, or a peer did not connect\n", one.name);
      return 1;
    }
  }
  report(said, all);
  return said.say(rounds) ? 0 : 1;
}
