// SPDX-License-Identifier: Apache-2.0
// Who gets a place for a handshake, whose is taken for it, and how it is given back.
#include "net/tls/relays.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "net/base/socket_options.hpp"

namespace rowe::net::tls {

relays::relay* relays::find(place_id place) noexcept {
  if (place.index >= relays_.size()) return nullptr;
  relay& one = relays_[place.index];
  return one.now != phase::free && one.generation == place.generation ? &one : nullptr;
}

place_id relays::id_of(const relay& one) const noexcept {
  return {static_cast<std::uint32_t>(&one - relays_.data()), one.generation};
}

// The oldest of those whose request is not complete, or that do not read their answer.
template <class Wanted>
relays::relay* relays::oldest_unserved(Wanted&& wanted) noexcept {
  for (deadline_list* const list : {&draining_, &opening_}) {
    auto* const found = list->oldest_of([&](deadline_node& one) { return wanted(static_cast<relay&>(one)); });
    if (found != nullptr) return static_cast<relay*>(found);
  }
  return nullptr;
}

// Who of the `wanted` loses its place to a newcomer: one whose source had begun most handshakes lately that
// have led to nothing, and of those the oldest. So the first handshake of a source comes before all those of
// a flood, however many sources that has. A newcomer that has the weakest claim itself displaces one of its
// own source. nullptr: there is none.
template <class Wanted>
relays::relay* relays::to_evict(const socket_address& by, std::uint32_t before, Wanted&& wanted) noexcept {
  relay* found = nullptr;
  (void)oldest_unserved([&](relay& one) {
    if (wanted(one) && (found == nullptr || found->before < one.before)) found = &one;
    return false;
  });
  if (found == nullptr || found->before >= before) return found;
  return oldest_unserved([&](const relay& one) { return wanted(one) && same_source(one.peer, by); });
}

relays::relay* relays::oldest_closing(bool lent) noexcept {
  for (deadline_list* const list : {&closing_, &late_}) {
    auto* const found =
        list->oldest_of([&](deadline_node& one) { return !lent || static_cast<relay&>(one).lent; });
    if (found != nullptr) return static_cast<relay*>(found);
  }
  return nullptr;
}

// Whether fewer of them are lent than there are places reserved for the stop.
bool relays::may_lend() const noexcept {
  return std::count_if(relays_.begin(), relays_.end(), [](const relay& one) {
           return one.now != phase::free && one.lent;
         }) < static_cast<std::ptrdiff_t>(reserved_for_stop(limits_.handshakes_max));
}

// A free place; else that of the socket which has been closing longest, because its answer is sent; else that
// of one whose answer is late on purpose; else the one to be evicted. Pages that are being written are no
// more than leave places for the stop (handshakes.hpp). A source that has all it may have displaces one of
// its own; and who gets the descriptor of one who stops, one of those.
relays::relay* relays::place_for(const accepted_socket& came, std::uint32_t before) noexcept {
  const auto own = [&](const relay& one) { return same_source(one.peer, came.peer); };
  const auto from_there = std::count_if(relays_.begin(), relays_.end(), [&](const relay& one) {
    return one.now != phase::free && one.now != phase::closing && own(one);
  });
  const auto most = limits_.connections_per_address_max + reserved_for_stop(limits_.handshakes_max);
  relay* found = nullptr;
  if (came.lent && !may_lend()) {
    found = oldest_closing(true);
    if (found == nullptr) found = to_evict(came.peer, before, [](const relay& one) { return one.lent; });
  } else if (!is_loopback(came.peer) && from_there >= static_cast<std::ptrdiff_t>(most)) {
    found = oldest_unserved(own);
  } else {
    const auto unused =
        std::find_if(relays_.begin(), relays_.end(), [](const relay& one) { return one.now == phase::free; });
    if (unused != relays_.end()) return &*unused;
    found = oldest_closing(false);
    if (found == nullptr) found = to_evict(came.peer, before, [](const relay&) { return true; });
  }
  if (found == nullptr || found->now != phase::closing) outlet_.note_eviction();
  if (found != nullptr) {
    fail(*found, service::counter::tls_failed_evicted);
    leave(*found);
  }
  return found;
}

void relays::begin(relay& one, descriptor socket, const socket_address& peer) {
  one.peer = peer;
  one.looked_at = one.header_passed = one.answered = one.welcome = one.upgrades = one.waits = false;
  one.of_pair = 0;
  one.header_bytes = 0;
  send_at_once(socket.get());
  const int fd = socket.get();
  one.secure = session::open(with_.current(), std::move(socket), remote_.empty() ? nullptr : remote_.c_str());
  const place_id id = id_of(one);
  one.of_socket = remote_.empty() ? EPOLLIN : EPOLLOUT;
  one.now = phase::shaking;
  opening_.arm(one, now_);
  if (one.secure && polled_.add(fd, one.of_socket, {source::tls, id.index, id.generation})) return;
  fail(one, service::counter::tls_failed_resources);
  leave(one);
}

void relays::accept(accepted_socket accepted) {
  const std::uint32_t before = begun_.note(accepted.peer, now_);
  relay* const one = place_for(accepted, before);
  if (one == nullptr)
    return outlet_.count(service::counter::tls_failed_evicted); // in no words: it has no TLS
  if (++one->generation == 0) one->generation = 1;
  one->before = before;
  one->lent = accepted.lent;
  begin(*one, std::move(accepted.socket), accepted.peer);
}

void relays::connect(descriptor socket, std::uint32_t attempt) {
  relay& one = relays_.front();
  if (one.now != phase::free) {
    fail(one, service::counter::tls_failed_evicted);
    leave(one);
  }
  one.generation = attempt;
  begin(one, std::move(socket), {});
}

void relays::drop(place_id place) noexcept {
  relay* const one = find(place);
  if (one == nullptr) return;
  fail(*one, service::counter::tls_failed_timeout);
  leave(*one);
}

// Counts why the handshake has failed, if one was under way.
void relays::fail(const relay& one, service::counter why) noexcept {
  if (one.now == phase::shaking) outlet_.count(why);
}

void relays::leave(relay& one) noexcept {
  one.disarm();
  one.now = phase::free;
  if (one.secure) polled_.remove(one.secure->descriptor_number());
  if (one.pair && one.of_pair != 0) polled_.remove(one.pair.get());
  if (one.secure && one.secure->cut_by()) outlet_.count(*one.secure->cut_by());
  one.secure.reset();
  one.pair.reset();
}

} // namespace rowe::net::tls
