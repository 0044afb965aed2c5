// SPDX-License-Identifier: Apache-2.0
// Who gets a place for a handshake, whose is taken for it, and how it is given back.
#include "net/tls/relays.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "net/handshake_answers.hpp"
#include "net/socket_options.hpp"

namespace rowe::net::tls {

relays::relay* relays::find(place_id place) noexcept {
  if (place.index >= relays_.size()) return nullptr;
  relay& one = relays_[place.index];
  return one.now != phase::free && one.generation == place.generation ? &one : nullptr;
}

place_id relays::id_of(const relay& one) const noexcept {
  return {static_cast<std::uint32_t>(&one - relays_.data()), one.generation};
}

// Whose request is not complete, and who loses its place for that. It is one of the source that holds most
// places (decision 0028): of those the one that has come least far, and of those the oldest. So a source that
// begins handshakes and leaves them displaces itself. With `from`, only that source is looked at. nullptr:
// there is none. Only the 64 oldest are looked through, so that a newcomer costs little.
relays::relay* relays::to_evict(const socket_address* from) noexcept {
  constexpr int looked_through_max = 64;
  struct claim {
    std::ptrdiff_t held = 0; // by its source
    int missing = 0;         // of its handshake; less if it has sent something that was not looked at
    bool operator<(const claim& other) const noexcept {
      return held != other.held ? held < other.held : missing < other.missing;
    }
  };
  const auto claim_of = [&](const relay& one) -> claim {
    const auto of_its_source = [&](const relay& other) {
      return (other.now == phase::shaking || other.now == phase::reading) &&
             same_source(other.peer, one.peer);
    };
    return {from != nullptr ? 0 : std::count_if(relays_.begin(), relays_.end(), of_its_source),
            one.now == phase::shaking ? (one.secure->has_hello() ? 1 : 3) - one.waits : 0};
  };
  relay* found = nullptr;
  claim largest;
  int seen = 0;
  (void)opening_.oldest_of([&](deadline_node& node) {
    auto& one = static_cast<relay&>(node);
    if (from != nullptr && !same_source(one.peer, *from)) return false;
    const claim its = claim_of(one);
    if (found == nullptr || largest < its) {
      found = &one;
      largest = its;
    }
    return ++seen == looked_through_max;
  });
  return found;
}

// A free place; else that of the socket which has been closing longest, because its answer is sent; else that
// of one whose request is not complete; else that of the oldest which does not read its answer. Pages that
// are being written are no more than leave places for the stop (handshakes.hpp).
relays::relay* relays::place_for(const socket_address& peer) noexcept {
  const auto from_there = std::count_if(relays_.begin(), relays_.end(), [&](const relay& one) {
    return one.now != phase::free && one.now != phase::closing && same_source(one.peer, peer);
  });
  const auto most = limits_.connections_per_address_max + kept_for_stop(limits_.handshakes_max);
  relay* found = nullptr;
  if (!is_loopback(peer) && from_there >= static_cast<std::ptrdiff_t>(most)) {
    found = to_evict(&peer);
  } else {
    const auto unused =
        std::find_if(relays_.begin(), relays_.end(), [](const relay& one) { return one.now == phase::free; });
    if (unused != relays_.end()) return &*unused;
    found = static_cast<relay*>(closing_.oldest());
    if (found == nullptr) found = to_evict(nullptr);
    if (found == nullptr) found = static_cast<relay*>(draining_.oldest());
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
  one.looked_at = one.header_passed = one.answered = one.upgrades = one.waits = false;
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
  relay* const one = place_for(accepted.peer);
  if (one == nullptr)
    return outlet_.count(service::counter::tls_failed_evicted); // in no words: it has no TLS
  if (++one->generation == 0) one->generation = 1;
  one->before = begun_.note(accepted.peer, now_);
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
