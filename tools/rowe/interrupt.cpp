// SPDX-License-Identifier: Apache-2.0
#include "interrupt.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>

#include <rowe/rt/periodic.hpp>

namespace rowe::tools::interrupt {
namespace {

std::atomic<bool> signalled{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the handler may only touch what is lock-free");

std::atomic<void (*)() noexcept> action_at_first{nullptr};
static_assert(std::atomic<void (*)() noexcept>::is_always_lock_free);

void note_signal(int) noexcept {
  signalled.store(true, std::memory_order_seq_cst);
  if (auto* const action = action_at_first.load(std::memory_order_seq_cst)) action();
}

} // namespace

void watch() noexcept {
  struct sigaction noting {};
  noting.sa_handler = note_signal;
  noting.sa_flags =
      static_cast<int>(SA_RESETHAND); // the second one is fatal again; no SA_RESTART: sleeps end early
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) ::sigaction(signal, &noting, nullptr);
  }
  struct sigaction ignoring {};
  ignoring.sa_handler = SIG_IGN;
  for (const int signal : {SIGPIPE, SIGXFSZ}) ::sigaction(signal, &ignoring, nullptr);
}

void at_first_signal(void (*action)() noexcept) noexcept {
  action_at_first.store(action, std::memory_order_seq_cst);
}

bool seen() noexcept { return signalled.load(std::memory_order_seq_cst); }

void sleep_until(rt::time_point deadline) noexcept {
  for (auto now = rt::monotonic_clock::now(); now < deadline && !seen(); now = rt::monotonic_clock::now()) {
    rt::kernel_clock::sleep_until(std::min(deadline, now + slice));
  }
}

} // namespace rowe::tools::interrupt
