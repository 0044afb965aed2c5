// SPDX-License-Identifier: Apache-2.0
#include "child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <utility>
#include <vector>

#include "interrupt.hpp"

namespace rowe::tools {
namespace {

constexpr std::size_t bytes_max = 4 << 20;

} // namespace

child::child(std::span<const char* const> words) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    error_ = errno;
    return;
  }
  output_ = ends[0];
  ::posix_spawn_file_actions_t actions;
  ::posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  // This program ignores these, and what it ignores its children would.
  ::sigset_t as_usual;
  ::sigemptyset(&as_usual);
  for (const int signal : {SIGPIPE, SIGXFSZ}) ::sigaddset(&as_usual, signal);
  ::posix_spawnattr_setsigdefault(&attributes, &as_usual);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  std::vector<std::string> texts{words.begin(), words.end()};
  std::vector<char*> arguments;
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);
  error_ = ::posix_spawnp(&process_, arguments[0], &actions, &attributes, arguments.data(), environ);
  if (error_ != 0) process_ = -1;
  ::posix_spawn_file_actions_destroy(&actions);
  ::posix_spawnattr_destroy(&attributes);
  ::close(ends[1]);
}

child::~child() {
  if (process_ > 0) ::kill(process_, SIGTERM);
  (void)end();
}

int child::end() {
  if (output_ >= 0) ::close(std::exchange(output_, -1)); // it does not wait for us to read
  if (process_ <= 0) return -1;
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

child::outcome child::next(std::string& line, rt::time_point deadline) {
  while (true) {
    if (const std::size_t end = read_.find('\n'); end != read_.npos) {
      line.assign(read_, 0, end);
      read_.erase(0, end + 1);
      return outcome::line;
    }
    if (interrupt::seen()) return outcome::interrupted;
    const rt::duration left = deadline - rt::monotonic_clock::now();
    if (left <= rt::duration{0}) return outcome::too_late;
    const auto wait = std::min(left, interrupt::slice);
    ::pollfd asked{.fd = output_, .events = POLLIN, .revents = 0};
    const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(wait).count();
    if (::poll(&asked, 1, static_cast<int>(milliseconds)) <= 0) continue;
    std::array<char, 4096> piece;
    const ::ssize_t count = ::read(output_, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return outcome::end;
    bytes_ += static_cast<std::size_t>(count);
    if (bytes_ > bytes_max) return outcome::too_much;
    read_.append(piece.data(), static_cast<std::size_t>(count));
  }
}

} // namespace rowe::tools
