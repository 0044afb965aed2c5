// SPDX-License-Identifier: Apache-2.0
#include "child.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>

#include "../rowe/console.hpp"

namespace rowe::tools::bench {
namespace {

// A pipe of which one end is for the child.
struct pipe_ends {
  int read = -1;
  int write = -1;
  pipe_ends() {
    std::array<int, 2> both{};
    if (::pipe2(both.data(), O_CLOEXEC) != 0) return;
    read = both[0];
    write = both[1];
  }
  pipe_ends(const pipe_ends&) = delete;
  pipe_ends& operator=(const pipe_ends&) = delete;
  ~pipe_ends() {
    if (read >= 0) ::close(read);
    if (write >= 0) ::close(write);
  }
};

int spawn(pid_t& id, const std::vector<std::string>& arguments, int input, int output) {
  std::vector<std::string> words{"rowe", "bench", "peer"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawnattr_t how;
  ::posix_spawnattr_init(&how);
  ::posix_spawnattr_setflags(&how,
                             POSIX_SPAWN_SETPGROUP); // a group of its own: the terminal's Ctrl-C is ours
  ::posix_spawnattr_setpgroup(&how, 0);
  const int failure = ::posix_spawn(&id, "/proc/self/exe", &files, &how, pointers.data(), environ);
  ::posix_spawnattr_destroy(&how);
  ::posix_spawn_file_actions_destroy(&files);
  return failure;
}

// The first line; what has come of it where the child ends before it is whole.
std::string line_from(int descriptor) {
  std::string line;
  char c = 0;
  for (;;) {
    const ssize_t got = ::read(descriptor, &c, 1);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0 || c == '\n') return line;
    line += c;
  }
}

} // namespace

child::child(const std::vector<std::string>& arguments) {
  pipe_ends input;
  pipe_ends output;
  if (input.read < 0 || output.read < 0) {
    wrong_ = joined("cannot make a pipe (errno ", errno, ")");
    return;
  }
  if (const int failure = spawn(id_, arguments, input.read, output.write); failure != 0) {
    id_ = -1;
    wrong_ = joined("the peer cannot be started (errno ", failure, ")");
    return;
  }
  ::close(output.write);
  output.write = -1;
  keeps_alive_ = input.write;
  input.write = -1;
  const std::string line = line_from(output.read);
  if (const auto at = line.find("ws://"); at != line.npos) {
    url_ = line.substr(at, line.find(' ', at) - at);
  } else {
    wrong_ = "the peer ended before it was ready";
  }
}

child::~child() {
  if (id_ < 0) return;
  if (keeps_alive_ >= 0) ::close(keeps_alive_);
  ::kill(id_, SIGCONT); // it may have been stopped meanwhile
  ::kill(id_, SIGTERM);
  while (::waitpid(id_, nullptr, 0) < 0 && errno == EINTR) continue;
}

} // namespace rowe::tools::bench
