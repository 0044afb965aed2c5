// SPDX-License-Identifier: Apache-2.0
// rowe bench peer: the other end. Echoes what it is asked, and reports when values arrived; from the thread
// that a robot's program would have for it. With --idle spin and CPUs of its own that is one thread that
// never sleeps; else one for each of the two, which sleep until something is there.
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include <rowe/endpoint.hpp>

#include "../rowe/interrupt.hpp"
#include "../rowe/network/host_addresses.hpp"
#include "../rowe/network/remote.hpp"
#include "../rowe/output.hpp"
#include "../rowe/text/json_values.hpp"
#include "modes.hpp"
#include "probe.hpp"
#include "session.hpp"

namespace rowe::tools::bench {
namespace {

using namespace std::chrono_literals;

constexpr rt::duration look_up_period = 100ms; // how late a signal, or the end of stdin, is seen

struct peer_settings : settings {
  std::int64_t port = 0;
  std::string listen;
  bool insecure = false;
  bool until_eof = false;
  bool stop = false;
};

command peer_table(peer_settings& s) {
  return {
      .verb = "bench peer",
      .examples = {{{"rowe bench peer --listen 0.0.0.0:8080 --insecure --cpu 3 --prio 80", "on the board"},
                    {"rowe bench rpc ws://BOARD:8080", "on the other machine"}}},
      .description = "The other end of `rowe bench rpc`, send and stop. Runs until Ctrl-C.\n",
      .operands = {},
      .options = {{"--port", "", "N", "0 takes any free one (default)", integer{&s.port, 0, 65535}},
                  {"--listen", "", "ADDR:PORT", "where to listen, instead of loopback", &s.listen},
                  {"--insecure", "", "", "permit an address that others reach", &s.insecure},
                  {"--cpu", "", "N[,M]", "the CPU of its thread, and of its service thread", &s.cpu},
                  {"--prio", "", "N", "their SCHED_FIFO priority, N and N-1; 0: ordinary (default)",
                   integer{&s.priority, 0, 99}},
                  {"--idle", "", "poll|spin|wake|phase", "how the service thread waits (default poll)",
                   choice{&s.idle, idle_names}},
                  {"--size", "", "BYTES", "the largest message (default: any that can be measured)",
                   integer{&s.size, size_min, size_max}},
                  {"--stop", "", "", "with a loop of 1 kHz that can be stopped: `rowe bench stop`", &s.stop},
                  {"--until-eof", "", "", "end when standard input does", &s.until_eof}}};
}

// What a peer answers with.
class answering {
 public:
  using echo_handle = responder<json_text, json_text>;

  static result<answering> open(endpoint& on, std::int64_t size) {
    const auto text_max = static_cast<std::uint32_t>(size);
    auto echo =
        on.serve<json_text, json_text>(echo_service, {.depth = in_flight_max, .text_bytes_max = text_max});
    if (!echo) return echo.error();
    auto in = on.subscribe<json_text>(out_topic, {.depth = in_flight_max, .text_bytes_max = text_max});
    if (!in) return in.error();
    auto back = on.advertise<arrived>(back_topic, {.depth = reports_in_flight_max});
    if (!back) return back.error();
    return answering{std::move(*echo), std::move(*in), std::move(*back)};
  }

  // Each until `stop`, or until the endpoint is closed.
  void spin(const std::atomic<bool>& stop) noexcept {
    // relaxed: nothing but the flag itself is handed over
    while (!stop.load(std::memory_order_relaxed)) {
      if (auto request = echo_.try_next()) echo(*request);
      if (auto value = in_.try_take()) answer(value->json());
    }
  }
  void echo_all() noexcept {
    for (;;) {
      auto request = echo_.next(-1ns);
      if (!request) return;
      echo(*request);
    }
  }
  void answer_all() noexcept {
    for (;;) {
      auto value = in_.take(-1ns);
      if (!value) return;
      answer(value->json());
    }
  }

 private:
  answering(echo_handle echo, subscriber<json_text> in, publisher<arrived> back)
      : echo_{std::move(echo)}, in_{std::move(in)}, back_{std::move(back)} {}

  void echo(request<json_text>& asked) noexcept { (void)echo_.reply(asked, asked.value()); } // it may be gone
  void answer(json_value probe) noexcept {
    const rt::time_point now = rt::monotonic_clock::now();
    const auto number = probe_text::number_of(probe);
    if (number) (void)back_.publish({*number, rt::nanoseconds_of(now)}, now); // one lost is seen there
  }

  echo_handle echo_;
  subscriber<json_text> in_;
  publisher<arrived> back_;
};

// A robot's loop, which brakes when it is stopped, and what lets it run again. There is no guard: what is
// measured is the stop that somebody asks for.
class stoppable {
 public:
  static result<stoppable> open(endpoint& on) {
    auto latch = on.stop_latch({.name = "bench"});
    if (!latch) return latch.error();
    auto reset = on.serve<json_text, json_text>(reset_service);
    if (!reset) return reset.error();
    return stoppable{std::move(*latch), std::move(*reset)};
  }
  void run(const std::atomic<bool>& stop) noexcept {
    rt::periodic loop{1ms};
    // relaxed: nothing but the flag itself is handed over
    while (!stop.load(std::memory_order_relaxed)) {
      const auto now = loop.wait();
      if (now && latch_.engaged(*now)) latch_.acknowledge(*now);
    }
  }
  void reset_all(endpoint& on) noexcept {
    for (;;) {
      auto request = reset_.next(-1ns);
      if (!request) return;
      const auto done = on.reset_emergency_stop({}, timeout_default);
      (void)(done ? reset_.reply(*request, "{}") : reset_.refuse(*request, done.error().message()));
    }
  }

 private:
  stoppable(stop_latch latch, responder<json_text, json_text> reset)
      : latch_{std::move(latch)}, reset_{std::move(reset)} {}

  stop_latch latch_;
  responder<json_text, json_text> reset_;
};

bool input_ended() noexcept {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  char c = 0;
  return ::poll(&input, 1, 0) > 0 && ::read(STDIN_FILENO, &c, 1) <= 0;
}

// Says who we are, until it is time to end.
void introduce_until_end(responder<json_text, json_text>& info, const peer_settings& s) {
  const machine here = this_machine({s.here.user.value_or(0)});
  const std::string answer = joined(R"({"boot_id":)", json_string_of(here.boot_id), R"(,"line":)",
                                    json_string_of(joined(here.line(), "; ", s.here.text())), "}");
  while (!interrupt::seen() && !(s.until_eof && input_ended())) {
    if (auto asked = info.next(look_up_period)) (void)info.reply(*asked, answer);
  }
}

} // namespace

exit_code peer(argument_list arguments) {
  peer_settings s;
  s.size = size_max;
  console to{"bench peer"};
  if (const auto end = read_mode(peer_table(s), arguments, s, to)) return *end;
  if (s.cpu.empty()) s.here = s.peer; // away from where the measuring end runs by default
  endpoint_options options = s.options_of(s.here);
  options.insecure = s.insecure;
  options.stop.unguarded = s.stop;
  auto port = static_cast<std::uint16_t>(s.port);
  if (!s.listen.empty()) {
    const std::string wrong = split_listen(s.listen, options.address, port);
    if (!wrong.empty()) return usage_error("bench peer", wrong);
  }
  auto hub = endpoint::listen(port, options);
  if (!hub) {
    to.error("cannot listen on ", options.address, ": ", hub.error().message());
    return exit_code_of(hub.error());
  }
  auto answers = answering::open(*hub, s.size);
  auto info = hub->serve<json_text, json_text>(info_service);
  if (!answers || !info) {
    to.error("cannot answer: ", (answers ? info.error() : answers.error()).message());
    return exit_code::failed;
  }
  std::optional<stoppable> robot;
  if (s.stop) {
    auto opened = stoppable::open(*hub);
    if (!opened) {
      to.error("cannot be stopped: ", opened.error().message());
      return exit_code::failed;
    }
    robot = std::move(*opened);
  }
  (void)rt::lock_process_memory(); // where it is refused, the measuring end sees it
  std::atomic<bool> stop{false};
  std::vector<rt::thread> threads;
  if (s.spins(s.here)) {
    threads.emplace_back(s.here.user_thread("answer"), [&] { answers->spin(stop); });
  } else {
    threads.emplace_back(s.here.user_thread("echo"), [&] { answers->echo_all(); });
    threads.emplace_back(s.here.user_thread("answer"), [&] { answers->answer_all(); });
  }
  if (robot) {
    threads.emplace_back(s.here.user_thread("loop"), [&] { robot->run(stop); });
    threads.emplace_back(s.here.user_thread("reset"), [&] { robot->reset_all(*hub); });
  }
  for (const rt::thread& one : threads) {
    std::array<char, 256> buffer;
    if (!one.grants().complete()) to.error("not granted: ", one.grants().text(buffer));
  }
  emit(joined("rowe bench peer at ws://", host_for_here(options.address), ":", hub->port(), " (process ",
              ::getpid(), ")\n"));
  introduce_until_end(*info, s);
  // relaxed: nothing but the flag itself is handed over
  stop.store(true, std::memory_order_relaxed);
  (void)hub->close(); // whoever waits in a handle is told
  threads.clear();
  return exit_code::done;
}

} // namespace rowe::tools::bench
