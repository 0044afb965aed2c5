// SPDX-License-Identifier: Apache-2.0
#include "output.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <system_error>

#include "console.hpp"
#include "interrupt.hpp"
#include "status_line.hpp"

namespace rowe::tools {
namespace {

std::uint64_t stdout_bytes = 0;     // of stdout, written
int stdout_failure = 0;             // of stdout: the first one
std::atomic<int> stderr_failure{0}; // the newest one

void note_failure(int why) {
  stdout_failure = why;
  if (!output_failed()) return;
  write_to_stderr(joined("rowe: cannot write to standard output: ", std::generic_category().message(why),
                         " (", counted(stdout_bytes, "byte"), " written)\n"));
}

// A standard stream that is closed would be the next socket's, and texts for people would go to a peer. In
// its place comes one that can only be used the wrong way round, so that using it is an error still.
void fill_closed_streams() noexcept {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
    (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY); // the lowest free one: this
  }
}

// What an earlier write has put off (a quota, a file system over the network) is said at the end.
void close_stdout() {
  if (::close(STDOUT_FILENO) != 0 && stdout_bytes != 0 && stdout_failure == 0) note_failure(errno);
}

std::mutex held_mutex; // what follows
bool is_held = false;
std::string held_text;

} // namespace

std::size_t write_all(int to, std::string_view text) noexcept {
  constexpr auto slice = std::chrono::duration_cast<std::chrono::milliseconds>(interrupt::slice);
  std::size_t done = 0;
  while (done < text.size()) {
    const ::ssize_t count = ::write(to, text.data() + done, text.size() - done);
    if (count >= 0) {
      done += static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      ::pollfd room{.fd = to, .events = POLLOUT, .revents = 0};
      (void)::poll(&room, 1, static_cast<int>(slice.count()));
      if (interrupt::seen()) {
        errno = EINTR;
        break;
      }
    } else if (errno != EINTR || interrupt::seen()) {
      break;
    }
  }
  return done;
}

int write_file(const std::string& path, std::string_view text) noexcept {
  constexpr ::mode_t everybody = 0666; // less what umask says
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, everybody);
  if (file < 0) return errno;
  const int reason = write_all(file, text) == text.size() ? 0 : errno;
  return ::close(file) == 0 || reason != 0 ? reason : errno;
}

bool emit(std::string_view text) {
  if (stdout_failure != 0) return false;
  const std::size_t count = write_all(STDOUT_FILENO, text);
  stdout_bytes += count;
  if (count == text.size()) return true;
  if (errno != EINTR) note_failure(errno);
  return false;
}

bool output_failed() noexcept { return stdout_failure != 0 && stdout_failure != EPIPE; }

void hold_stderr(bool held) {
  std::string text;
  {
    const std::lock_guard lock{held_mutex};
    is_held = held;
    if (!held) text.swap(held_text);
  }
  if (!text.empty()) write_to_stderr(text);
}

void write_to_stderr(std::string_view text) noexcept {
  {
    const std::lock_guard lock{held_mutex};
    constexpr std::size_t held_bytes_max = 1 << 20;
    if (is_held && held_text.size() + text.size() <= held_bytes_max) held_text += text;
    if (is_held) return;
  }
  const std::string_view before = status_line::taken_away();
  if (write_all(STDERR_FILENO, before) < before.size() || write_all(STDERR_FILENO, text) < text.size())
    stderr_failure.store(errno, std::memory_order_seq_cst);
}

int run_program(int count, char** words, exit_code (*program)(argument_list)) {
  fill_closed_streams();
  interrupt::watch();
  const auto arguments = argument_list{words, static_cast<std::size_t>(count)};
  exit_code end = program(arguments.subspan(count > 0 ? 1 : 0));
  close_stdout();
  // Whoever closes stderr wants to hear nothing; a full disk, though, has taken what was to be heard.
  const int why = stderr_failure.load(std::memory_order_seq_cst);
  const bool unheard = why != 0 && why != EPIPE && why != EBADF && why != EINTR;
  if ((output_failed() || unheard) && end == exit_code::done) end = exit_code::failed;
  return static_cast<int>(end);
}

} // namespace rowe::tools
