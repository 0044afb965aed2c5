// SPDX-License-Identifier: Apache-2.0
// Who gets a place among the handshakes, and who loses one.
#include "net/handshakes/handshakes.hpp"

#include <algorithm>
#include <utility>

#include "net/http/handshake_answers.hpp"
#include "net/http/send_answer.hpp"

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

// Of the `wanted` sockets whose request is not complete, as far as we know, the oldest; nullptr if there is
// none. One without unread bytes comes first, because unread bytes may complete a request; and, `by_claim`,
// before that one whose source had begun more handshakes lately which have led to nothing.
template <class Wanted>
handshakes::handshake* handshakes::unfinished(bool by_claim, Wanted&& wanted) noexcept {
  const auto rank = [&](const handshake& one) {
    return std::pair{by_claim ? one.before : 0, one.events == 0};
  };
  handshake* found = nullptr;
  (void)header_.oldest_of([&](deadline_node& node) {
    auto& one = static_cast<handshake&>(node);
    if (may_be_evicted(one) && wanted(one) && (found == nullptr || rank(one) > rank(*found))) found = &one;
    return false;
  });
  return found;
}

// A free place; else the place of the socket that has been closing longest, because its answer is sent; else
// that of one whose request is not complete, by claim. Whoever has the weakest claim itself displaces one of
// its own source. A source that has used up its limit gets only the places for the stop in addition; for a
// third it displaces no other source. Where no descriptor is left, there are only those, for all.
handshakes::handshake* handshakes::place(const accepted_socket& came, bool crowded,
                                         std::uint32_t before) noexcept {
  const auto own = [&](const handshake& one) { return same_source(one.peer, came.peer); };
  const auto own_crowded = [&](const handshake& one) {
    return one.now == phase::header && one.crowded && own(one);
  };
  const auto lent = [](const handshake& one) { return one.now != phase::free && one.lent; };
  const auto all_taken = [&](const auto& such) {
    return std::count_if(handshakes_.begin(), handshakes_.end(), such) >=
           static_cast<std::ptrdiff_t>(reserved_for_stop(limits_.handshakes_max));
  };
  const auto by_claim = [&](const auto& such) {
    handshake* const weakest = unfinished(true, such);
    const bool weaker_still = weakest != nullptr && weakest->before < before;
    return weaker_still ? unfinished(false, [&](const handshake& one) { return such(one) && own(one); })
                        : weakest;
  };
  handshake* one = nullptr;
  if (came.lent && all_taken(lent)) {
    one = static_cast<handshake*>(
        closing_.oldest_of([&](deadline_node& node) { return lent(static_cast<handshake&>(node)); }));
    if (one == nullptr) one = by_claim(lent);
  } else if (crowded && all_taken(own_crowded)) {
    one = unfinished(false, own_crowded);
  } else {
    one = free_or_closing();
    if (one == nullptr) one = by_claim([](const handshake&) { return true; });
  }
  if (one == nullptr || one->now == phase::free) return one;
  if (one->now == phase::closing)
    leave(*one);
  else
    evict(*one);
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
