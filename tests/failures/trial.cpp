// SPDX-License-Identifier: Apache-2.0
#include "failures/trial.hpp"

#include <dirent.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <typeinfo>

namespace failures {
namespace {

constexpr std::uint64_t runs_usually = 8;
constexpr unsigned seconds_max = 30; // a run takes some hundredths
constexpr std::uint64_t never = UINT64_MAX;

// What the child leaves for its parent, in memory that both see.
struct report {
  std::uint64_t calls;
  failure failed; // points to literals, which are at the same addresses in both
  char wrong[256];
};
report* written = nullptr;

// How often which library did.
std::map<std::string, int> ended_by;

void copy(char* to, std::size_t capacity, std::string_view text) noexcept {
  const std::size_t bytes = std::min(text.size(), capacity - 1);
  std::memcpy(to, text.data(), bytes);
  to[bytes] = '\0';
}

std::size_t open_descriptors() noexcept {
  DIR* const folder = ::opendir("/proc/self/fd");
  std::size_t count = 0;
  while (::readdir(folder) != nullptr) ++count;
  ::closedir(folder);
  return count;
}

[[noreturn]] void child(kind which, std::uint64_t n, const scenario& run) noexcept {
  keep_failure_in(written->failed);
  ::alarm(seconds_max); // whose signal ends a hang
  const std::size_t before = open_descriptors();
  trial tried{which, n};
  try {
    run(tried);
  } catch (const std::exception& thrown) {
    disarm();
    tried.expect(false, std::string{"an exception came out: "} + typeid(thrown).name());
  }
  tried.end();
  const std::size_t after = open_descriptors();
  tried.expect(after == before || tried.unrecoverable(),
               "descriptors before and after: " + std::to_string(before) + ", " + std::to_string(after));
  ::_exit(0);
}

// False when the call was not reached.
bool run_with(kind which, std::uint64_t n, const scenario& run) {
  written = std::construct_at(written);
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid == 0) child(which, n, run);
  int ending = 0;
  if (pid < 0 || ::waitpid(pid, &ending, 0) != pid) {
    ADD_FAILURE() << "no child";
    return false;
  }
  const auto where = [&] {
    const char* const failed = written->failed.call;
    return "when call " + std::to_string(n) + " fails (" + (failed ? failed : "none") +
           (written->failed.within ? std::string{" in "} + written->failed.within.load() : "") + "): ";
  };
  if (WIFSIGNALED(ending) && WTERMSIG(ending) != SIGALRM && written->failed.within)
    ++ended_by[written->failed.within.load()];
  else if (WIFSIGNALED(ending) && WTERMSIG(ending) == SIGALRM)
    ADD_FAILURE() << where() << "a hang; " << written->wrong;
  else if (WIFSIGNALED(ending))
    ADD_FAILURE() << where() << ::strsignal(WTERMSIG(ending)) << "; " << written->wrong;
  else if (WEXITSTATUS(ending) != 0)
    ADD_FAILURE() << where() << "exit code " << WEXITSTATUS(ending);
  else if (written->wrong[0])
    ADD_FAILURE() << where() << written->wrong;
  return written->failed.call != nullptr;
}

std::string_view wanted() {
  const char* const given = std::getenv("ROWE_FAILURES");
  return given != nullptr ? given : "";
}

} // namespace

void trial::end() noexcept {
  calls_ = std::max(calls_, disarm());
  written->calls = calls_;
}

bool trial::failed() const noexcept { return written->failed.call != nullptr; }
bool trial::unrecoverable() const noexcept { return written->failed.within != nullptr; }

bool trial::expect(bool right, std::string_view what) noexcept {
  if (!right && !written->wrong[0]) copy(written->wrong, sizeof written->wrong, what);
  return right;
}

std::uint64_t fail_each(kind which, const scenario& run) {
  void* const shared =
      ::mmap(nullptr, sizeof(report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    ADD_FAILURE() << "no memory to share with children";
    return 0;
  }
  written = static_cast<report*>(shared);
  std::uint64_t calls = 0;
  if (const auto only = std::strtoull(wanted().data(), nullptr, 10); only != 0) {
    run_with(which, only, run);
  } else {
    run_with(which, never, run);
    calls = written->calls;
    // How many calls a run makes varies a little: in the end a run does not reach the call meant for it.
    const bool all = wanted() == "all";
    const std::uint64_t step = all ? 1 : std::max<std::uint64_t>(1, calls / runs_usually);
    const std::uint64_t most = all ? never : calls;
    for (std::uint64_t n = 1; n <= most && run_with(which, n, run); n += step) {
    }
  }
  for (const auto& [library, times] : ended_by)
    std::cout << "ended or made useless by " << library << " itself: " << times << " times\n";
  ended_by.clear();
  ::munmap(shared, sizeof(report));
  return calls;
}

} // namespace failures
