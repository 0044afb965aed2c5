// SPDX-License-Identifier: Apache-2.0
// soak [--seconds=60] [--healthy=36] [--fast=4] [--hostile=6] [--visits=20]
//
// A robot under TLS and the fleet of its clients (fleet.hpp), for so long. It fails if a healthy client loses
// a value or its connection, if a stop is not answered, if a visitor is turned away, if a hostile client did
// not get to its misdeed, and if the process has more descriptors or memory afterwards. No time is judged, so
// a busy machine makes it slow, and nothing else.
//
// Memory and descriptors are compared between two times at which only the healthy clients are there: after a
// warm-up in which everybody was there, and at the end. Of memory, both the heap that is in use and what is
// resident: a leak of 20 bytes for each handshake shows in the first within a minute.
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>

#include <dirent.h>
#include <malloc.h>
#include <unistd.h>

#include "loaded_robot.hpp"

namespace rowe::load {
namespace {

using namespace std::chrono_literals;

constexpr std::array<std::string_view, misdeeds> names{
    "reads_nothing", "half_handshake", "takes_new_keys", "wrong_record", "cut", "wrong_token"};
constexpr std::int64_t heap_growth_max = 128 << 10; // what malloc keeps for a thread counts as in use
constexpr std::int64_t resident_growth_max = 4 << 20;

struct options {
  int seconds = 60;
  plan of{};
};

// Takes `--name=value` with a value of at least `least`; false: it is another one, or wrong.
bool take(std::string_view word, std::string_view name, int least, auto& into) {
  if (!word.starts_with(name)) return false;
  const int value = std::atoi(word.substr(name.size()).data());
  into = static_cast<std::remove_reference_t<decltype(into)>>(value);
  return value >= least;
}

bool read(int count, char** words, options& into) {
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    const bool known =
        take(word, "--seconds=", 1, into.seconds) || take(word, "--healthy=", 1, into.of.healthy) ||
        take(word, "--fast=", 1, into.of.fast) || take(word, "--hostile=", 0, into.of.hostile) ||
        take(word, "--visits=", 1, into.of.visits_per_s);
    if (!known) {
      std::fprintf(stderr,
                   "soak: it is --seconds, --healthy, --fast, --hostile or --visits, with a number\n");
      return false;
    }
  }
  return true;
}

struct usage {
  std::int64_t descriptors = 0, heap = 0, resident = 0;

  static usage now() {
    usage seen;
    DIR* const folder = ::opendir("/proc/self/fd");
    while (::readdir(folder) != nullptr) ++seen.descriptors;
    ::closedir(folder);
    const struct mallinfo2 heap = ::mallinfo2();
    seen.heap = static_cast<std::int64_t>(heap.uordblks + heap.hblkhd);
    std::ifstream pages{"/proc/self/statm"};
    std::int64_t all = 0, resident = 0;
    pages >> all >> resident;
    seen.resident = resident * ::sysconf(_SC_PAGESIZE);
    return seen;
  }
};

class judge {
 public:
  void expect(bool fine, const std::string& otherwise) {
    if (fine) return;
    std::printf("WRONG: %s\n", otherwise.c_str());
    good_ = false;
  }
  bool good() const { return good_; }

 private:
  bool good_ = true;
};

struct soak {
  const options& chosen;
  board& shown;
  endpoint& robot;
  load::loop& loop;
  judge& verdict;

  std::uint64_t misdeeds_of_each_at_least() const {
    std::uint64_t least = UINT64_MAX;
    for (std::size_t i = 0; i < std::min<std::size_t>(misdeeds, chosen.of.hostile); ++i)
      least = std::min(least, shown.done[i].get());
    return least;
  }
  void tell(const char* when) const {
    const usage now = usage::now();
    std::printf("%s: %" PRIu64 " values, %" PRIu64 " visits, %" PRIu64 " handshakes, heap %" PRId64
                " KiB, resident %" PRId64 " KiB, %" PRId64 " descriptors;",
                when, shown.heard.get(), shown.visits.get(), count_of(robot, "tls_handshakes"),
                now.heap >> 10, now.resident >> 10, now.descriptors);
    for (std::size_t i = 0; i < misdeeds; ++i)
      std::printf(" %s %" PRIu64, names[i].data(), shown.done[i].get());
    std::printf("\n");
    std::fflush(stdout);
  }
  // Only the healthy clients are left, and whoever calls the stop.
  usage calm() {
    shown.disturbed.set(false);
    const bool quiet =
        eventually([&] { return shown.strangers.get() == 0 && robot.peers() == chosen.of.healthy + 1; }, 60s);
    verdict.expect(quiet, std::to_string(shown.strangers.get()) + " strangers did not leave");
    usage least = usage::now(); // sessions are destroyed a moment later
    (void)eventually(
        [&] {
          const usage now = usage::now();
          const bool less = now.descriptors < least.descriptors || now.heap < least.heap;
          if (less) least = now;
          return !less;
        },
        10s);
    rest(1000);
    return usage::now();
  }
  void disturb(int seconds, std::uint64_t misdeeds_wanted) {
    shown.disturbed.set(true);
    for (int second = 0; second < seconds; ++second) {
      rest(1000);
      if ((second + 1) % 10 == 0) tell((std::to_string(second + 1) + " s").c_str());
    }
    const bool enough = eventually([&] { return misdeeds_of_each_at_least() >= misdeeds_wanted; }, 60s);
    verdict.expect(enough, "a hostile client did not get to its misdeed");
  }

  void run() {
    disturb(std::clamp(chosen.seconds / 6, 2, 30), 2);
    const usage before = calm();
    const std::uint64_t misdeeds_before = misdeeds_of_each_at_least();
    tell("warm");
    disturb(chosen.seconds, misdeeds_before == UINT64_MAX ? 0 : misdeeds_before + 1);
    const usage after = calm();
    tell("at the end");
    verdict.expect(after.descriptors == before.descriptors,
                   std::to_string(after.descriptors - before.descriptors) + " descriptors more");
    verdict.expect(after.heap <= before.heap + heap_growth_max,
                   std::to_string(after.heap - before.heap) + " bytes of heap more");
    verdict.expect(after.resident <= before.resident + resident_growth_max,
                   std::to_string(after.resident - before.resident) + " bytes resident more");
  }

  // What was published has come to everyone.
  void look_for_losses() {
    loop.be_silent();
    const bool all_there = eventually(
        [&] {
          return shown.all_have.get() == loop.published_for_all() &&
                 shown.fast_have.get() == loop.published_of_loop();
        },
        60s);
    verdict.expect(all_there, "of " + std::to_string(loop.published_for_all()) + " and " +
                                  std::to_string(loop.published_of_loop()) + " values somebody has only " +
                                  std::to_string(shown.all_have.get()) + ", or " +
                                  std::to_string(shown.fast_have.get()));
    verdict.expect(shown.lost.get() == 0, std::to_string(shown.lost.get()) + " values were lost");
    verdict.expect(shown.wrong.get() == 0,
                   std::to_string(shown.wrong.get()) + " values were not the next ones");
    verdict.expect(shown.broken.get() == 0,
                   std::to_string(shown.broken.get()) + " healthy connections ended");
    verdict.expect(shown.visits_failed.get() == 0,
                   std::to_string(shown.visits_failed.get()) + " visitors were turned away");
    verdict.expect(shown.visits.get() != 0, "nobody visited");
  }

  // What was done to the robot it has counted.
  void compare_counts() {
    const auto done = [&](misdeed what) { return shown.done[static_cast<std::size_t>(what)].get(); };
    const auto expect_count = [&](std::string_view name, std::uint64_t wanted) {
      verdict.expect(eventually([&] { return count_of(robot, name) == wanted; }, 10s),
                     std::string{name} + " is " + std::to_string(count_of(robot, name)) + ", not " +
                         std::to_string(wanted));
    };
    expect_count("tls_key_floods", done(misdeed::takes_new_keys));
    expect_count("tls_alerts", done(misdeed::wrong_record));
    expect_count("tls_failed_timeout", done(misdeed::half_handshake));
    expect_count("tls_failed_evicted", 0);
    verdict.expect(count_of(robot, "tls_cuts") >= done(misdeed::cut), "cuts are not counted");
    const std::uint64_t secure = chosen.of.healthy + 1 + shown.visits.get() + done(misdeed::cut) +
                                 done(misdeed::takes_new_keys) + done(misdeed::wrong_record) +
                                 done(misdeed::wrong_token) + done(misdeed::reads_nothing);
    expect_count("tls_handshakes", secure);
  }
};

int run(const options& chosen) {
  board* const shown = make_board();
  if (shown == nullptr) return 1;
  fleet clients{chosen.of, *shown}; // before there is a thread
  raise_descriptor_limit();
  const server_files files;
  auto opened = endpoint::listen(0, options_for(chosen.of, files));
  if (!opened) {
    std::printf("the robot did not open: %s\n", opened.error().message().c_str());
    return 1;
  }
  endpoint robot = std::move(*opened);
  loop moving{robot, chosen.of};
  shown->port.set(robot.port());

  judge verdict;
  verdict.expect(eventually([&] { return shown->open.get() == chosen.of.healthy; }, 120s),
                 std::to_string(shown->open.get()) + " clients are open");
  number<bool> over;
  std::uint64_t asked = 0, answered = 0;
  std::thread stops{[&] {
    stop_caller caller{robot.port()};
    while (caller.ok() && !over.get()) {
      ++asked;
      caller.send({});
      answered += caller.hear() ? 1U : 0U;
      rest(20);
    }
  }};
  if (verdict.good()) {
    soak all{chosen, *shown, robot, moving, verdict};
    all.run();
    all.look_for_losses();
    all.compare_counts();
  }
  over.set(true);
  stops.join();
  verdict.expect(asked != 0 && asked == answered, std::to_string(asked - answered) + " of " +
                                                      std::to_string(asked) + " stops were not answered");
  std::printf("%" PRIu64 " stops, all answered: %s; %" PRIu64 " values refused by a full queue\n", asked,
              asked == answered ? "yes" : "no", moving.refused());
  return verdict.good() ? 0 : 1;
}

} // namespace
} // namespace rowe::load

int main(int count, char** words) {
  rowe::load::options chosen;
  if (!rowe::load::read(count, words, chosen)) return 2;
  return rowe::load::run(chosen);
}
