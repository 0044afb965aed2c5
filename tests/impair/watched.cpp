// SPDX-License-Identifier: Apache-2.0
// impair_watched PING_MS SILENCE_MS: an endpoint that listens on every address and prints what happens to it,
// until its input ends. It prints a line for each event: what, which peer, and why. To each line of input it
// prints the counters, on one line.
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include <rowe/rowe.hpp>

namespace {

const char* name_of(rowe::event::kind what) {
  using kind = rowe::event::kind;
  return what == kind::peer_joined ? "joined" : what == kind::peer_left ? "left" : "other";
}

void tell(const rowe::event& happened) {
  const std::string_view peer = happened.peer, what = happened.what;
  std::printf("%s %.*s: %.*s\n", name_of(happened.what_kind), static_cast<int>(peer.size()), peer.data(),
              static_cast<int>(what.size()), what.data());
}

void tell_counts(const rowe::endpoint& of) {
  std::printf("counts");
  for (const rowe::count& one : of.counts()) {
    std::printf(" %.*s=%llu", static_cast<int>(one.name.size()), one.name.data(),
                static_cast<unsigned long long>(one.value));
  }
  std::printf("\n");
}

} // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  rowe::endpoint_options options;
  options.address = "0.0.0.0";
  options.insecure = true;
  options.allow_hosts = {"10.98.76.1"};
  options.ping_period = std::chrono::milliseconds{std::atoi(arguments[1])};
  options.silence_max = std::chrono::milliseconds{std::atoi(arguments[2])};
  auto opened = rowe::endpoint::listen(0, options);
  if (!opened) {
    std::printf("error %s\n", std::string{opened.error().name()}.c_str());
    return 1;
  }
  std::printf("port %d\n", opened->port());
  std::fflush(stdout);
  for (;;) {
    pollfd typed{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    const bool ready = ::poll(&typed, 1, 1) > 0; // a millisecond: events are not waited for
    while (const auto happened = opened->try_event()) tell(*happened);
    char line[256];
    if (ready && ::read(STDIN_FILENO, line, sizeof line) <= 0) return 0;
    if (ready) tell_counts(*opened);
    std::fflush(stdout);
  }
}
