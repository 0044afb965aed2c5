// SPDX-License-Identifier: Apache-2.0
// Who gets a place among the handshakes, and who loses one.
#include "net/handshakes.hpp"

#include <algorithm>

#include "net/handshake_answers.hpp"
#include "net/send_answer.hpp"

namespace rowe::net {

handshakes::handshake* handshakes::free_or_closing() noexcept {
  const auto found = std::find_if(handshakes_.begin(), handshakes_.end(),
                                  [](const handshake& one) { return one.now == phase::free; });
  if (found != handshakes_.end()) return &*found;
  auto* closing = static_cast<handshake*>(closing_.oldest());
  if (closing) leave(*closing);
  return closing;
}

// True if its request is not complete, as far as we know.
bool handshakes::may_be_evicted(const handshake& one) const noexcept {
  return one.now == phase::header && one.turn != turn_ && (one.events == 0 || one.looked_at);
}

// The oldest `wanted` socket whose request is not complete, as far as we know; nullptr if there is none.
// Sockets without unread bytes come first, because unread bytes may complete a request.
template <class Wanted>
handshakes::handshake* handshakes::oldest_unfinished(Wanted&& wanted) noexcept {
  const auto handshake_of = [](deadline_node& node) -> handshake& { return static_cast<handshake&>(node); };
  auto* found = header_.oldest_of([&](deadline_node& node) {
    const handshake& one = handshake_of(node);
    return one.events == 0 && may_be_evicted(one) && wanted(one);
  });
  if (found == nullptr) {
    found = header_.oldest_of([&](deadline_node& node) {
      const handshake& one = handshake_of(node);
      return may_be_evicted(one) && wanted(one);
    });
  }
  return found != nullptr ? &handshake_of(*found) : nullptr;
}

// A free place; else the place of the socket that has been closing longest, because its answer is sent; else
// the place of the oldest socket whose request is not complete. A source that has used up its limit gets only
// the places for the stop in addition; for a third it displaces no other source.
handshakes::handshake* handshakes::place(const socket_address& peer, bool crowded) noexcept {
  const auto is_such = [&](const handshake& one) {
    return one.now == phase::header && one.crowded && same_source(one.peer, peer);
  };
  handshake* one = nullptr;
  if (crowded && std::count_if(handshakes_.begin(), handshakes_.end(), is_such) >=
                     static_cast<std::ptrdiff_t>(kept_for_stop(limits_.handshakes_max))) {
    one = oldest_unfinished(is_such);
    if (one == nullptr) return nullptr;
  } else {
    one = free_or_closing();
    if (one == nullptr) one = oldest_unfinished([](const handshake&) { return true; });
  }
  if (one != nullptr && one->now != phase::free) evict(*one);
  return one;
}

bool handshakes::must_wait() const noexcept {
  bool any_header = false;
  for (const handshake& one : handshakes_) {
    if (one.now == phase::free || one.now == phase::closing || may_be_evicted(one)) return false;
    any_header = any_header || one.now == phase::header;
  }
  return any_header; // it will be looked at, or known to be silent, in a turn to come
}

void handshakes::evict(handshake& one) noexcept {
  ++counters_.handshakes_evicted;
  if (one.scanned != 0) { // who has said nothing expects nothing
    send_answer(one.socket.get(), answer::evicted());
  }
  leave(one);
}

bool handshakes::too_many_from(const socket_address& peer) const noexcept {
  if (is_loopback(peer)) return false;
  const auto waiting = std::count_if(handshakes_.begin(), handshakes_.end(), [&](const handshake& one) {
    return one.now != phase::free && one.now != phase::closing && same_source(one.peer, peer);
  });
  return connections_.count_from(peer) + static_cast<std::uint32_t>(waiting) >=
         limits_.connections_per_address_max;
}

} // namespace rowe::net
