// SPDX-License-Identifier: Apache-2.0
#include "keys.hpp"

#include <poll.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string_view>

#include "interrupt.hpp"

namespace rowe::tools {
namespace {

// What handlers of signals use: written before they are installed.
termios terminal_before{};
termios terminal_for_keys{};
std::atomic<bool> keys_are_on{false};

bool in_foreground() noexcept { return ::tcgetpgrp(STDIN_FILENO) == ::getpgrp(); }

// In the background the terminal is somebody else's.
void restore() noexcept {
  if (keys_are_on.load(std::memory_order_seq_cst) && in_foreground())
    (void)::tcsetattr(STDIN_FILENO, TCSANOW, &terminal_before);
}

// Ctrl-Z, and Ctrl-\: as without us, but for the terminal.
void end_or_stop(int which) noexcept {
  const int before = errno;
  restore();
  struct sigaction usual {};
  usual.sa_handler = SIG_DFL;
  struct sigaction ours {};
  ::sigaction(which, &usual, &ours);
  sigset_t only;
  ::sigemptyset(&only);
  ::sigaddset(&only, which);
  (void)::raise(which);
  ::pthread_sigmask(SIG_UNBLOCK, &only, nullptr); // here it stops, or ends
  ::sigaction(which, &ours, nullptr);
  errno = before;
}

void go_on(int) noexcept {
  const int before = errno;
  if (keys_are_on.load(std::memory_order_seq_cst) && in_foreground())
    (void)::tcsetattr(STDIN_FILENO, TCSANOW, &terminal_for_keys);
  errno = before;
}

void handle(int which, void (*handler)(int)) {
  struct sigaction before {};
  ::sigaction(which, nullptr, &before);
  if (before.sa_handler == SIG_IGN) return;
  struct sigaction handling {};
  handling.sa_handler = handler;
  ::sigaction(which, &handling, nullptr);
}

} // namespace

keys::keys(bool wanted) {
  if (!wanted || ::isatty(STDIN_FILENO) == 0 || !in_foreground()) return;
  if (::tcgetattr(STDIN_FILENO, &terminal_before) != 0) return;
  terminal_for_keys = terminal_before;
  terminal_for_keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO); // Ctrl-C stays what it is
  terminal_for_keys.c_cc[VMIN] = 0;
  terminal_for_keys.c_cc[VTIME] = 0;
  keys_are_on.store(true, std::memory_order_seq_cst);
  interrupt::at_first_signal(restore);
  for (const int which : {SIGTSTP, SIGQUIT}) handle(which, end_or_stop);
  handle(SIGCONT, go_on);
  if (::tcsetattr(STDIN_FILENO, TCSANOW, &terminal_for_keys) != 0) return;
  on_ = true;
}

keys::~keys() {
  restore();
  keys_are_on.store(false, std::memory_order_seq_cst);
  interrupt::at_first_signal(nullptr);
}

bool keys::readable() const noexcept { return on_ && !ended_ && in_foreground(); }

key keys::read(rt::time_point until, char& letter) {
  using std::chrono::milliseconds;
  if (const key one = take(letter); one != key::none) return one;
  if (!readable()) return key::none;
  const rt::duration left = until - std::min(rt::monotonic_clock::now(), until);
  const auto wait = std::chrono::floor<milliseconds>(std::min(left, interrupt::slice));
  ::pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (::poll(&input, 1, static_cast<int>(wait.count())) <= 0 || interrupt::seen()) return key::none;
  std::array<char, 64> buffer{};
  const ::ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
  if (got > 0) pending_.append(buffer.data(), static_cast<std::size_t>(got));
  if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) ended_ = true; // the terminal is gone
  return take(letter);
}

key keys::take(char& letter) {
  if (pending_.empty()) return key::none;
  const std::string_view all = pending_;
  // A key that sends several bytes sends them at once: "\x1b[C", or "\x1bOC", and longer ones.
  if (all.size() > 2 && all[0] == '\x1b' && (all[1] == '[' || all[1] == 'O')) {
    std::size_t end = 2;
    while (end < all.size() && (all[end] < '@' || all[end] > '~')) ++end;
    const char last = end < all.size() ? all[end] : '\0';
    pending_.erase(0, std::min(end + 1, all.size()));
    return last == 'C' ? key::right : last == 'D' ? key::left : key::other;
  }
  letter = pending_.front();
  pending_.erase(0, 1);
  return letter == ' ' ? key::space : key::other;
}

} // namespace rowe::tools
