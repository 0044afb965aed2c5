// SPDX-License-Identifier: Apache-2.0
// A robot for foreign peers to talk to, by the public interface alone and in the loop that every robot has:
//
//   peers_robot listen PROFILE          at a port of its own choice
//   peers_robot connect PROFILE URL     as a client
//
// until SIGTERM. It prints a line with its port when it is ready. It provides add-two-numbers ({"a","b"}
// gives {"result"}) and /mine (std_srvs/SetBool), and sends every plain message that comes to every peer that
// takes some.
#include <rowe/rowe.hpp>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

struct two_numbers {
  std::int64_t a, b;
};
template <>
inline constexpr auto rowe::schema<two_numbers> = rowe::fields<&two_numbers::a, &two_numbers::b>{};

struct sum {
  std::int64_t result;
};
template <>
inline constexpr auto rowe::schema<sum> = rowe::fields<&sum::result>{};

struct wanted {
  bool data;
};
template <>
inline constexpr auto rowe::schema<wanted> = rowe::fields<&wanted::data>{};

struct done {
  bool success;
  rowe::fixed_string<16> message;
};
template <>
inline constexpr auto rowe::schema<done> = rowe::fields<&done::success, &done::message>{};

namespace {

using namespace std::chrono_literals;

constexpr done on{true, "on"}, off{true, "off"};

rowe::rt::periodic loop{1ms};

extern "C" void end(int) { loop.stop(); }

rowe::peer_profile profile_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, rowe::peer_profile>, 3> profiles{
      {{"standard", rowe::peer_profile::standard},
       {"hop", rowe::peer_profile::hop},
       {"hop_2014", rowe::peer_profile::hop_2014}}};
  for (const auto& [one, profile] : profiles)
    if (one == name) return profile;
  std::fprintf(stderr, "there is no profile %.*s\n", static_cast<int>(name.size()), name.data());
  std::exit(2);
}

void run(rowe::endpoint& robot) {
  auto adds = robot.serve<two_numbers, sum>("add-two-numbers").value();
  auto mine = robot.serve<wanted, done>("/mine", {.type = "std_srvs/SetBool"}).value();
  auto mail = robot.open_lane({.depth = 16, .inbox_depth = 16, .calls = 4}).value();
  std::printf("ready at port %u\n", static_cast<unsigned>(robot.port())); // 0 as a client
  std::fflush(stdout);
  while (const auto now = loop.wait()) {
    while (auto asked = adds.try_next(*now))
      (void)adds.reply(*asked, {asked->body.a + asked->body.b}, *now); // who left needs no answer
    while (auto asked = mine.try_next(*now)) (void)mine.reply(*asked, asked->body.data ? on : off, *now);
    while (auto came = mail.try_receive(*now)) {
      if (came->wants_reply())
        (void)mail.try_refuse(*came, "not one of mine", *now);
      else if (!mail.try_send(came->text(), 1s, *now))
        std::fprintf(stderr, "a message was not sent\n");
    }
  }
}

} // namespace

int main(int argc, char** argv) {
  const std::string_view role = argc > 2 ? argv[1] : "";
  if (!(role == "listen" && argc == 3) && !(role == "connect" && argc == 4)) {
    std::fprintf(stderr, "usage: peers_robot listen PROFILE | connect PROFILE URL\n");
    return 2;
  }
  std::signal(SIGTERM, end);
  const rowe::endpoint_options options{.profile = profile_of(argv[2])};
  auto robot =
      role == "listen" ? rowe::endpoint::listen(0, options) : rowe::endpoint::connect(argv[3], options);
  if (!robot) {
    std::fprintf(stderr, "no endpoint: error %d\n", static_cast<int>(robot.code()));
    return 1;
  }
  run(*robot);
  return robot->close(1s) ? 0 : 1;
}
