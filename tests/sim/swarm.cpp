// SPDX-License-Identifier: Apache-2.0
// The swarm world as a program, and the worlds of links (flow.hpp) behind it. It runs seeds in child
// processes, so that a seed that crashes or hangs is a finding like others. It shrinks the first seeds that
// fail to the steps that matter, and prints those. It says which cells of the coverage table were never seen.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/detail/mutation_points.hpp>

#include "flow_worlds.hpp"
#include "mutants.hpp"

namespace {

constexpr std::uint64_t steps_default = 1500;
constexpr std::size_t jobs_max = 64;
constexpr std::uint64_t seeds_at_a_time = 25; // of one process
// A seed takes a fraction of a second, and ten times as long under a sanitizer.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr unsigned hang_seconds = 300;
#else
constexpr unsigned hang_seconds = 20;
#endif

constexpr std::string_view help =
    R"(sim_swarm [OPTION...]: simulated worlds of arbitrary peers around the core.

  --seeds N..M         run these seeds (default 1..1200, or as many as ROWE_SIM_SEEDS says)
  --steps N            steps of each (default 1500); those of the worlds of links come behind
  -j N                 so many processes at a time (default 1, or as ROWE_SIM_JOBS says)
  --without NAME       switch an invariant off; may be repeated; --invariants lists them
  --trace SEED         run one seed, print what everybody says and the error
  --shrink N           print the N first failures of each invariant, shrunk (default 1)
  --coverage           print the coverage table
  --no-coverage        do not fail for cells of it that were never seen
  --invariants         list the invariants
  --mutant NAME        take one fix out again (in sim_swarm_mutants only)
  --mutants FILE       each of them until it is found, first in the seed that FILE names; and none of them in
                       the seeds that found them, where nothing may be
  --record FILE        the same, all of them from the first seed on, and write FILE
)";

struct arguments {
  std::uint64_t first = 1, last = 1200, steps = steps_default, jobs = 1;
  std::set<std::string> without;
  std::optional<std::uint64_t> trace;
  std::uint64_t shrink = 1;
  bool prints_coverage = false;
  bool demands_coverage = true;
  std::string known_mutants; // a file
  bool records = false;
};

// What a child leaves behind, in memory that it shares with its parent.
struct result_of_seed {
  std::uint64_t seed = 0;
  std::uint64_t step = 0;
  bool done = false;
  bool broken = false;
  char invariant[32] = {};
  char what[1200] = {};
};
struct shared {
  result_of_seed result;
  std::uint64_t steps;
  std::uint64_t served;
  std::uint32_t counts[1]; // of the coverage table
};

template <class T>
T* share(std::size_t bytes) {
  void* const at = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) {
    std::perror("mmap");
    std::exit(2);
  }
  return static_cast<T*>(at);
}

void put(char* to, std::size_t size, const std::string& text) {
  const std::size_t bytes = std::min(size - 1, text.size());
  std::memcpy(to, text.data(), bytes);
  to[bytes] = '\0';
}

// Steps of a world, numbered from `from` on, without those in `left_out`.
template <class World>
void run_world(World& w, std::uint64_t from, std::uint64_t steps, const std::vector<bool>& left_out,
               shared& out) {
  std::uint64_t i = from;
  for (; i < from + steps && !w.broken(); ++i) {
    out.result.step = i;
    if (i < left_out.size() && left_out[i]) continue;
    w.step(i);
    ++out.steps;
  }
  out.result.step = i;
  if (!w.broken()) w.finish(from + steps);
  out.result.broken = w.broken();
  put(out.result.invariant, sizeof out.result.invariant, w.result().invariant());
  put(out.result.what, sizeof out.result.what, w.result().what());
}

// In a child: up to so many steps. Those of the world of links come behind the swarm's.
void run_seed(std::uint64_t seed, std::uint64_t steps, const std::vector<bool>& left_out,
              const arguments& asked, swarm::coverage& seen, shared& out, bool traces) {
  out.result.seed = seed;
  out.result.done = false;
  alarm(hang_seconds); // which ends the child
  {
    swarm::world w{seed, seen, asked.without, traces};
    w.on().net.leave_trace_out();
    run_world(w, 0, std::min(steps, asked.steps), left_out, out);
    out.served += w.honest_peer().served;
  }
  const auto links = steps > asked.steps && !out.result.broken
                         ? flow::make_world(seed, seen, asked.without, traces)
                         : nullptr;
  if (links) run_world(*links, asked.steps, std::min(steps - asked.steps, flow::world::steps), left_out, out);
  alarm(0);
  out.result.done = true;
}

struct failure {
  std::uint64_t seed = 0;
  std::uint64_t step = 0;
  std::string invariant;
  std::string what;
};

failure failure_of(const shared& out, int status) {
  if (out.result.done) return {out.result.seed, out.result.step, out.result.invariant, out.result.what};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return {out.result.seed, out.result.step, "hang",
            "the core did not come back for " + std::to_string(hang_seconds) + " s"};
  return {out.result.seed, out.result.step, "crash",
          WIFSIGNALED(status) ? strsignal(WTERMSIG(status))
                              : "it ended with " + std::to_string(WEXITSTATUS(status))};
}

std::optional<failure> run_alone(std::uint64_t seed, std::uint64_t steps, const std::vector<bool>& left_out,
                                 const arguments& asked, shared& out, bool traces) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    swarm::coverage seen;
    run_seed(seed, steps, left_out, asked, seen, out, traces);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (out.result.done && !out.result.broken) return std::nullopt;
  return failure_of(out, status);
}

// Leaves out as many steps as possible so that it still fails by the same invariant (delta debugging: Zeller,
// Hildebrandt, 2002). Of a seed that hangs only the steps after the hang are left out.
void shrink(const failure& found, const arguments& asked, shared& out) {
  std::vector<bool> left_out(found.step + 1, false);
  const std::uint64_t steps = found.step + 1;
  std::uint64_t tries = found.invariant == "hang" ? 0 : 1500;
  for (std::uint64_t chunk = std::max<std::uint64_t>(steps / 2, 1); tries > 0;) {
    bool any = false;
    for (std::uint64_t at = 0; at < steps && tries > 0; at += chunk) {
      std::vector<bool> fewer = left_out;
      bool changes = false;
      for (std::uint64_t i = at; i < std::min(at + chunk, steps); ++i) {
        changes = changes || !fewer[i];
        fewer[i] = true;
      }
      if (!changes) continue;
      --tries;
      const auto again = run_alone(found.seed, steps, fewer, asked, out, false);
      if (!again || again->invariant != found.invariant) continue;
      left_out = fewer;
      any = true;
    }
    if (chunk == 1 && !any) break;
    chunk = std::max<std::uint64_t>(chunk / 2, 1);
  }
  const auto left = std::count(left_out.begin(), left_out.end(), false);
  std::printf("---- seed %llu, %s, shrunk from %llu steps to %ld:\n",
              static_cast<unsigned long long>(found.seed), found.invariant.c_str(),
              static_cast<unsigned long long>(steps), static_cast<long>(left));
  const auto again = run_alone(found.seed, steps, left_out, asked, out, true);
  if (again) std::printf("==> %s: %s\n", again->invariant.c_str(), again->what.c_str());
}

std::uint64_t number_of(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (wrong != std::errc{} || end != text.data() + text.size()) {
    std::fprintf(stderr, "sim_swarm: %.*s is no number\n", static_cast<int>(text.size()), text.data());
    std::exit(2);
  }
  return number;
}

std::string invariant_of(std::string_view name) {
  const auto is_it = [name](const swarm::invariant& one) { return one.name == name; };
  if (std::ranges::none_of(swarm::invariants(), is_it) && std::ranges::none_of(flow::invariants(), is_it)) {
    std::fprintf(stderr, "sim_swarm: there is no invariant %.*s\n", static_cast<int>(name.size()),
                 name.data());
    std::exit(2);
  }
  return std::string{name};
}

// "" for none.
void choose_mutant(std::string_view name) {
  const auto named = [name](const swarm::mutant& one) { return one.name == name; };
  if (!name.empty() && std::none_of(std::begin(swarm::mutants), std::end(swarm::mutants), named)) {
    std::fprintf(stderr, "sim_swarm: there is no mutant %.*s\n", static_cast<int>(name.size()), name.data());
    std::exit(2);
  }
#ifdef ROWE_MUTANTS
  rowe::detail::mutant_that_runs = name.empty() ? 0 : rowe::detail::mutant_key(name);
#else
  std::fprintf(stderr, "sim_swarm: there are mutants in sim_swarm_mutants only\n");
  std::exit(2);
#endif
}

arguments read(int count, char** words) {
  arguments asked;
  // As the other simulations.
  if (const char* const seeds = std::getenv("ROWE_SIM_SEEDS")) asked.last = number_of(seeds);
  if (const char* const jobs = std::getenv("ROWE_SIM_JOBS")) asked.jobs = number_of(jobs);
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    const auto next = [&]() -> std::string_view {
      if (i + 1 < count) return words[++i];
      std::fprintf(stderr, "sim_swarm: %s wants a value\n", words[i]);
      std::exit(2);
    };
    if (word == "--seeds") {
      const std::string_view range = next();
      const auto dots = range.find("..");
      asked.first = number_of(range.substr(0, dots));
      asked.last = dots == std::string_view::npos ? asked.first : number_of(range.substr(dots + 2));
    } else if (word == "--steps") {
      asked.steps = number_of(next());
    } else if (word == "-j") {
      asked.jobs = number_of(next());
    } else if (word == "--without") {
      asked.without.insert(invariant_of(next()));
    } else if (word == "--trace") {
      asked.trace = number_of(next());
    } else if (word == "--shrink") {
      asked.shrink = number_of(next());
    } else if (word == "--coverage") {
      asked.prints_coverage = true;
    } else if (word == "--no-coverage") {
      asked.demands_coverage = false;
    } else if (word == "--mutant") {
      choose_mutant(next());
    } else if (word == "--mutants" || word == "--record") {
      asked.known_mutants = next();
      asked.records = word == "--record";
    } else if (word == "--invariants") {
      for (const auto& all : {swarm::invariants(), flow::invariants()}) {
        for (const auto& one : all)
          std::printf("%-18s %s\n", std::string{one.name}.c_str(), std::string{one.says}.c_str());
      }
      std::exit(0);
    } else {
      std::fputs(std::string{help}.c_str(), word == "--help" ? stdout : stderr);
      std::exit(word == "--help" ? 0 : 2);
    }
  }
  if (asked.jobs < 1 || asked.jobs > jobs_max) {
    std::fprintf(stderr, "sim_swarm: -j wants 1 to %zu processes, not %llu\n", jobs_max,
                 static_cast<unsigned long long>(asked.jobs));
    std::exit(2);
  }
  return asked;
}

using failures_by_invariant = std::map<std::string, std::vector<failure>>;

// A process that runs some of the seeds, and its own share of memory.
struct worker {
  shared& out;
  std::uint64_t next = 1; // of its seeds
  std::uint64_t last = 0;
  pid_t child = 0;
};

// Runs seeds of a worker until one fails.
void start(worker& one, const arguments& asked) {
  std::fflush(stdout);
  one.out.result = {.seed = one.next};
  one.child = fork();
  if (one.child != 0) return;
  for (std::uint64_t seed = one.next; seed <= one.last; ++seed) {
    swarm::coverage seen;
    run_seed(seed, asked.steps + flow::world::steps, {}, asked, seen, one.out, false);
    for (std::size_t i = 0; i < swarm::coverage::cells(); ++i) one.out.counts[i] += seen.counts()[i];
    if (one.out.result.broken) break;
  }
  _exit(0);
}

void stop_all(std::vector<worker>& workers) {
  for (worker& one : workers) {
    if (one.child == 0) continue;
    kill(one.child, SIGKILL);
    waitpid(one.child, nullptr, 0);
    one.child = 0;
  }
}

// All seeds, or until one fails. Each worker has one of `outs`.
failures_by_invariant run_all(const arguments& asked, std::span<shared* const> outs, bool first_only) {
  failures_by_invariant failures;
  std::uint64_t next = asked.first;
  std::vector<worker> workers;
  for (shared* const out : outs) workers.push_back({.out = *out});
  const auto go_on = [&](worker& one) {
    one.child = 0;
    if (one.next > one.last && next <= asked.last) {
      one.next = next;
      one.last = std::min(next + seeds_at_a_time - 1, asked.last);
      next = one.last + 1;
    }
    if (one.next <= one.last) start(one, asked);
  };
  for (worker& one : workers) go_on(one);
  for (;;) {
    int status = 0;
    const pid_t ended = wait(&status);
    if (ended < 0) break; // all have
    const auto at = std::ranges::find(workers, ended, &worker::child);
    if (at == workers.end()) continue;
    const shared& out = at->out;
    at->next = out.result.seed + 1;
    if (!out.result.done || out.result.broken) {
      const failure one = failure_of(out, status);
      auto& same = failures[one.invariant];
      same.push_back(one);
      if (same.size() <= asked.shrink || first_only)
        std::printf("seed %llu, step %llu: %s: %s\n", static_cast<unsigned long long>(one.seed),
                    static_cast<unsigned long long>(one.step), one.invariant.c_str(), one.what.c_str());
      if (first_only) {
        at->child = 0;
        stop_all(workers);
        break;
      }
    }
    go_on(*at);
  }
  for (auto& [invariant, all] : failures) std::ranges::sort(all, {}, &failure::seed);
  return failures;
}

using seeds_by_mutant = std::map<std::string, std::uint64_t, std::less<>>;

// A line each: the name of a mutant, and the first seed that found it.
seeds_by_mutant read_known(const std::string& path) {
  seeds_by_mutant known;
  std::ifstream from{path};
  for (auto [name, seed] = std::pair{std::string{}, std::uint64_t{0}}; from >> name >> seed;)
    known[name] = seed;
  if (from.eof() && !known.empty()) return known;
  std::fprintf(stderr, "sim_swarm: %s has no lines of a mutant and its seed\n", path.c_str());
  std::exit(2);
}

// The seed that finds the mutant: the one that is known, or else the first of all.
std::optional<std::uint64_t> find(const swarm::mutant& one, std::optional<std::uint64_t> known,
                                  const arguments& asked, std::span<shared* const> outs) {
  choose_mutant(one.name);
  std::printf("%s (without: %s)\n  ", std::string{one.name}.c_str(), std::string{one.takes_out}.c_str());
  const auto found_in = [&](std::uint64_t first, std::uint64_t last) -> std::optional<std::uint64_t> {
    arguments some = asked;
    some.first = first;
    some.last = last;
    const auto found = run_all(some, outs, true);
    return found.empty() ? std::nullopt : std::optional{found.begin()->second.front().seed};
  };
  if (known) {
    if (const auto seed = found_in(*known, *known)) return seed;
    std::printf("no longer in seed %llu; ", static_cast<unsigned long long>(*known));
  }
  const auto seed = found_in(asked.first, asked.last);
  if (!seed)
    std::printf("NOT FOUND in %llu seeds\n", static_cast<unsigned long long>(asked.last - asked.first + 1));
  return seed;
}

// Each mutant must be found, and without one there is nothing to find in the seeds that found them.
int run_mutants(const arguments& asked, std::span<shared* const> outs) {
  const seeds_by_mutant known = asked.records ? seeds_by_mutant{} : read_known(asked.known_mutants);
  seeds_by_mutant found;
  bool fine = true;
  for (const swarm::mutant& one : swarm::mutants) {
    const auto where = known.find(one.name);
    const auto seed =
        find(one, where == known.end() ? std::nullopt : std::optional{where->second}, asked, outs);
    if (seed) found[std::string{one.name}] = *seed;
    fine = fine && seed;
  }
  choose_mutant("");
  std::set<std::uint64_t> seeds;
  for (const auto& [name, seed] : found) seeds.insert(seed);
  std::printf("none, in %zu seeds\n", seeds.size());
  for (const std::uint64_t seed : seeds) {
    arguments alone = asked;
    alone.first = alone.last = seed;
    fine = run_all(alone, outs, true).empty() && fine;
  }
  if (asked.records) {
    std::ofstream to{asked.known_mutants};
    for (const auto& [name, seed] : found) to << name << ' ' << seed << '\n';
    fine = to.flush() && fine;
  }
  return fine ? 0 : 1;
}

} // namespace

int main(int count, char** words) {
  const arguments asked = read(count, words);
  std::vector<shared*> outs;
  for (std::uint64_t i = 0; i < asked.jobs; ++i)
    outs.push_back(share<shared>(sizeof(shared) + swarm::coverage::cells() * sizeof(std::uint32_t)));
  shared& out = *outs.front();
  if (asked.trace) {
    const auto found = run_alone(*asked.trace, asked.steps + flow::world::steps, {}, asked, out, true);
    if (found)
      std::printf("==> step %llu, %s: %s\n", static_cast<unsigned long long>(found->step),
                  found->invariant.c_str(), found->what.c_str());
    return found ? 1 : 0;
  }
  if (!asked.known_mutants.empty()) return run_mutants(asked, outs);
  const auto begin = std::chrono::steady_clock::now();
  const auto failures = run_all(asked, outs, false);
  for (const shared* const one : std::span{outs}.subspan(1)) {
    out.steps += one->steps;
    out.served += one->served;
    for (std::size_t i = 0; i < swarm::coverage::cells(); ++i) out.counts[i] += one->counts[i];
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::size_t failed = 0;
  for (const auto& [invariant, all] : failures) failed += all.size();
  const std::uint64_t steps = out.steps;
  std::printf(
      "%llu seeds, %llu steps, %.0f steps/s, %llu calls of the honest peer served, %zu seeds failed\n",
      static_cast<unsigned long long>(asked.last - asked.first + 1), static_cast<unsigned long long>(steps),
      static_cast<double>(steps) / seconds, static_cast<unsigned long long>(out.served), failed);
  for (const auto& [invariant, all] : failures) {
    std::printf("  %-18s %5zu seeds:", invariant.c_str(), all.size());
    for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), 12); ++i)
      std::printf(" %llu", static_cast<unsigned long long>(all[i].seed));
    std::printf("\n");
  }
  swarm::coverage seen;
  for (std::size_t i = 0; i < swarm::coverage::cells(); ++i) seen.counts()[i] = out.counts[i];
  const auto holes = seen.holes();
  if (asked.prints_coverage) std::printf("%s\n", seen.table().c_str());
  std::printf("%zu cells of the coverage table can happen and were not seen\n", holes.size());
  if (asked.demands_coverage) {
    for (std::size_t i = 0; i < std::min<std::size_t>(holes.size(), asked.prints_coverage ? SIZE_MAX : 20);
         ++i)
      std::printf("  %s\n", holes[i].c_str());
  }
  for (const auto& [invariant, all] : failures) {
    for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), asked.shrink); ++i)
      shrink(all[i], asked, out);
  }
  return failed != 0 || (asked.demands_coverage && !holes.empty()) ? 1 : 0;
}
