// SPDX-License-Identifier: Apache-2.0
// Looks one host name up, again and again if asked, on a helper thread: getaddrinfo() may take many seconds,
// and the service thread waits for nobody. The two threads share one word, `turn`, which says whose the rest
// of the shared state is; the thread that is done gives the turn away and wakes the other.
//
// A look-up cannot be called off. If the resolver is destroyed in the middle of one, the helper is left to
// finish it alone, and takes the shared state with it.
#pragma once
#include <pthread.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include <rowe/result.hpp>

#include "net/address.hpp"

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
  // that it rings when an answer is there; it keeps a duplicate. Set-up. Errors: no_thread (value: errno),
  // no_memory.
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
