// SPDX-License-Identifier: Apache-2.0
// Looks one host name up, as often as it is asked, on a helper thread: getaddrinfo() may take many seconds,
// and the service thread waits for nobody. The two threads share one word, `turn`, which says who owns the
// rest of the shared state. The thread that is done hands the turn over and wakes the other one.
//
// A look-up cannot be cancelled. If the resolver is destroyed during one, the helper finishes it alone, and
// frees the shared state.
#pragma once
#include <pthread.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include <rowe/result.hpp>

#include "net/base/address.hpp"

namespace rowe::net {

struct resolved_host {
  static constexpr std::size_t addresses_max = 8; // of more, the first
  std::array<socket_address, addresses_max> addresses;
  std::size_t count = 0;
  int failure = 0; // an EAI_ code of getaddrinfo(), or 0
  int code = 0;    // errno, where failure is EAI_SYSTEM
};

class resolver {
 public:
  // Starts the helper: ordinary scheduling, all signals blocked, named "rowe-resolver". `waker` is an eventfd
  // that it writes to when an answer is there; it keeps a duplicate. Set-up. Errors: no_thread (value:
  // errno), no_memory.
  static result<std::unique_ptr<resolver>> open(std::string_view host, std::uint16_t port, int waker);
  ~resolver();
  resolver(const resolver&) = delete;
  resolver& operator=(const resolver&) = delete;

  // Asks for a look-up, unless one is under way. Service thread; never waits, enters the kernel.
  void ask() noexcept;
  // True, once for each look-up, when its answer is written to `answer`. Service thread; never waits.
  bool try_take(resolved_host& answer) noexcept;

 private:
  struct shared;
  explicit resolver(std::shared_ptr<shared> state) noexcept;
  static void* help(void* state);

  std::shared_ptr<shared> shared_;
  pthread_t helper_{};
};

} // namespace rowe::net
