// SPDX-License-Identifier: Apache-2.0
#include "net/client/resolver.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <string>
#include <utility>

#include "net/base/descriptor.hpp"
#include "net/base/helper_thread.hpp"

namespace rowe::net {

namespace {

enum turn : std::uint32_t {
  resting,  // the service thread's
  asked,    // the helper's
  answered, // the service thread's
  leaving,  // nobody's: the resolver is gone
};

void look_up(const char* host, std::uint16_t port, resolved_host& answer) noexcept {
  answer = {};
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  answer.failure = ::getaddrinfo(host, nullptr, &hints, &list);
  if (answer.failure != 0) {
    answer.code = answer.failure == EAI_SYSTEM ? errno : 0;
    return;
  }
  for (const addrinfo* one = list; one && answer.count < resolved_host::addresses_max; one = one->ai_next) {
    auto address = address_of(one->ai_addr);
    if (!address) continue;
    set_port(*address, port);
    answer.addresses[answer.count++] = *address;
  }
  ::freeaddrinfo(list);
}

} // namespace

struct resolver::shared {
  std::string host;
  std::uint16_t port = 0;
  descriptor waker;
  std::atomic<std::uint32_t> turn{resting};
  resolved_host answer;
};

resolver::resolver(std::shared_ptr<shared> state) noexcept : shared_{std::move(state)} {}

result<std::unique_ptr<resolver>> resolver::open(std::string_view host, std::uint16_t port, int waker) {
  auto state = std::make_shared<shared>();
  state->host = host;
  state->port = port;
  state->waker.reset(::fcntl(waker, F_DUPFD_CLOEXEC, 0));
  if (!state->waker) return error{errc::no_memory};

  std::unique_ptr<resolver> made{new resolver{state}};
  auto helpers = std::make_unique<std::shared_ptr<shared>>(std::move(state));
  const int failure = start_helper(made->helper_, "rowe-resolver", &resolver::help, helpers.get());
  if (failure != 0) {
    made->shared_.reset(); // there is no helper to end
    return error{errc::no_thread, failure};
  }
  (void)helpers.release(); // the helper's
  return made;
}

resolver::~resolver() {
  if (!shared_) return;
  // acq_rel: release pairs with the helper's acquire load, acquire with its release of `answered`.
  const std::uint32_t before = shared_->turn.exchange(leaving, std::memory_order_acq_rel);
  shared_->turn.notify_one();
  if (before == asked)
    ::pthread_detach(helper_);
  else
    ::pthread_join(helper_, nullptr);
}

void resolver::ask() noexcept {
  // acquire: pairs with the helper's release of `answered`, whose answer is then overwritten.
  const std::uint32_t now = shared_->turn.load(std::memory_order_acquire);
  if (now == asked) return;
  shared_->turn.store(asked, std::memory_order_release); // pairs with the acquire load in help()
  shared_->turn.notify_one();
}

bool resolver::try_take(resolved_host& answer) noexcept {
  // acquire: pairs with the release of `answered` in help().
  if (shared_->turn.load(std::memory_order_acquire) != answered) return false;
  answer = shared_->answer;
  shared_->turn.store(resting, std::memory_order_relaxed); // own word; nothing is handed over with it
  return true;
}

void* resolver::help(void* state) {
  const std::unique_ptr<std::shared_ptr<shared>> owned{static_cast<std::shared_ptr<shared>*>(state)};
  shared& mine = **owned;
  for (;;) {
    // acquire: pairs with the release of `asked` in ask(), and with that of `leaving` in the destructor.
    const std::uint32_t now = mine.turn.load(std::memory_order_acquire);
    if (now == leaving) return nullptr;
    if (now != asked) {
      mine.turn.wait(now, std::memory_order_acquire); // as above
      continue;
    }
    look_up(mine.host.c_str(), mine.port, mine.answer);
    // release: pairs with the acquire load in try_take(). Over `leaving`, nobody looks any more.
    if (mine.turn.exchange(answered, std::memory_order_release) == leaving) return nullptr;
    (void)::eventfd_write(mine.waker.get(), 1); // can only fail when it is already rung
  }
}

} // namespace rowe::net
