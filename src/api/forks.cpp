// SPDX-License-Identifier: Apache-2.0
#include "api/forks.hpp"

#include <pthread.h>

#include <mutex>
#include <vector>

#include "api/endpoint_state.hpp"

namespace rowe::detail::forks {
namespace {

struct registry {
  std::mutex mutex; // held while the process is forked, so the child's list is whole
  std::vector<endpoint_state*> open;
};

registry& all();

void before() { all().mutex.lock(); }
void in_parent() { all().mutex.unlock(); }
void in_child() {
  for (endpoint_state* const one : all().open) one->enter_child();
  all().mutex.unlock();
}

// Never destroyed: an endpoint may be static, and is closed after what was made later.
registry& all() {
  static registry& only = *[] {
    ::pthread_atfork(before, in_parent, in_child);
    return new registry;
  }();
  return only;
}

} // namespace

void watch(endpoint_state& one) {
  const std::lock_guard lock{all().mutex};
  all().open.push_back(&one);
}

void forget(endpoint_state& one) noexcept {
  const std::lock_guard lock{all().mutex};
  std::erase(all().open, &one);
}

} // namespace rowe::detail::forks
