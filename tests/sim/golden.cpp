// SPDX-License-Identifier: Apache-2.0
// sim_golden FILE | --record | --steps KIND SEED: runs the simulated worlds whose traces FILE names, and
// fails where a trace differs from the recorded one. A trace is a hash of each byte that the core
// wrote, of each connection that it closed, and of all counters at the end that are not 0, with their names:
// a counter that is new, and counts nothing, changes none. So a change of the core's inner
// structure that is to change nothing outside shows that it did not. A change that is meant records the
// traces anew, and its commit says why. `--steps` prints one world's trace and counters behind each step:
// where two builds part is found by comparing what they print.
//
// Recorded on x86-64. The credit of peers is computed in floating point, and may differ elsewhere.
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string>

#include "messaging_world.hpp"
#include "swarm_world.hpp"
#include "world.hpp"

namespace {

constexpr std::uint64_t seeds = 100; // of each kind
constexpr std::uint64_t steps = 1500;

template <class Harness>
std::uint64_t trace_of(Harness& on, std::uint64_t more) {
  std::uint64_t hash = on.net.trace() ^ more;
  for (std::size_t i = 0; i < rowe::service::counter_descriptions.size(); ++i) {
    const std::uint64_t count = on.count(static_cast<rowe::service::counter>(i));
    if (count == 0) continue;
    hash = (hash ^ rowe::service::hash_of(rowe::service::counter_descriptions[i].name)) * 1099511628211U;
    hash = (hash ^ count) * 1099511628211U;
  }
  return hash;
}

// Peers that subscribe, and publishers.
std::uint64_t publishing(std::uint64_t seed) {
  sim::world w{seed, {}};
  for (std::uint64_t i = 0; i < steps; ++i) w.step();
  return trace_of(w.on(), w.trace());
}

// Messages and calls; by the seed a server, a hub or a client.
std::uint64_t talking(std::uint64_t seed) {
  sim::messaging_world w{seed};
  for (std::uint64_t i = 0; i < steps; ++i) w.step();
  w.finish();
  return trace_of(w.on(), w.trace());
}

// Everything, from anybody.
template <swarm::tongues speak>
std::uint64_t swarming(std::uint64_t seed) {
  swarm::coverage seen;
  swarm::world w{seed, seen, {}, false, speak};
  for (std::uint64_t i = 0; i < steps && !w.broken(); ++i) w.step(i);
  if (!w.broken()) w.finish(steps);
  return trace_of(w.on(), w.trace_hash());
}

template <class Harness>
void print_step(std::uint64_t step, const Harness& on, std::uint64_t told) {
  std::printf("%" PRIu64 " written %016" PRIx64 " told %016" PRIx64 "\n", step, on.net.trace(), told);
  for (std::size_t i = 0; i < rowe::service::counter_descriptions.size(); ++i) {
    if (const auto count = on.count(static_cast<rowe::service::counter>(i)); count != 0)
      std::printf("  %s %" PRIu64 "\n", rowe::service::counter_descriptions[i].name.data(), count);
  }
}

int print_steps(const std::string& kind, std::uint64_t seed) {
  if (kind == "talking") {
    sim::messaging_world w{seed};
    for (std::uint64_t i = 0; i < steps; ++i) {
      w.step();
      print_step(i, w.on(), w.trace());
    }
  } else if (kind == "swarming" || kind == "foxglove") {
    swarm::coverage seen;
    const auto speak = kind == "foxglove" ? swarm::tongues::foxglove : swarm::tongues::numbers;
    swarm::world w{seed, seen, {}, false, speak};
    for (std::uint64_t i = 0; i < steps && !w.broken(); ++i) {
      w.step(i);
      print_step(i, w.on(), w.trace_hash());
    }
  } else {
    sim::world w{seed, {}};
    for (std::uint64_t i = 0; i < steps; ++i) {
      w.step();
      print_step(i, w.on(), w.trace());
    }
  }
  return 0;
}

struct kind {
  const char* name;
  std::uint64_t (*run)(std::uint64_t seed);
};
constexpr kind kinds[] = {{"publishing", publishing},
                          {"talking", talking},
                          {"swarming", swarming<swarm::tongues::numbers>},
                          {"foxglove", swarming<swarm::tongues::foxglove>}};

int record() {
  for (const kind& one : kinds) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed)
      std::printf("%s %" PRIu64 " %016" PRIx64 "\n", one.name, seed, one.run(seed));
  }
  return 0;
}

int compare(const char* path) {
  std::ifstream file{path};
  std::string name, recorded;
  std::uint64_t seed = 0;
  std::uint64_t equal = 0, different = 0;
  while (file >> name >> seed >> recorded) {
    for (const kind& one : kinds) {
      if (name != one.name) continue;
      char trace[17];
      std::snprintf(trace, sizeof trace, "%016" PRIx64, one.run(seed));
      if (recorded == trace) {
        ++equal;
      } else if (++different <= 10) {
        std::printf("%s %" PRIu64 ": %s, recorded was %s\n", one.name, seed, trace, recorded.c_str());
      }
    }
  }
  std::printf("%" PRIu64 " traces are equal, %" PRIu64 " are not\n", equal, different);
  return different == 0 && equal == seeds * std::size(kinds) ? 0 : 1;
}

} // namespace

int main(int count, char** arguments) {
  if (count == 4 && std::strcmp(arguments[1], "--steps") == 0)
    return print_steps(arguments[2], std::strtoull(arguments[3], nullptr, 10));
  if (count != 2) {
    std::fputs("usage: sim_golden FILE | --record | --steps KIND SEED\n", stderr);
    return 2;
  }
  return std::strcmp(arguments[1], "--record") == 0 ? record() : compare(arguments[1]);
}
