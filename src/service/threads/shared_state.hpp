// SPDX-License-Identifier: Apache-2.0
// Folder threads: what other threads share with the service thread. No tables; how it sleeps is in core.
// What the service thread publishes to the other threads of the process: counters, the connected peers, and
// events.
//
// Each place for a connection has a generation, 0 while nobody is there, and the peer's address. The service
// thread stores 0, then the texts, then the new generation. A reader loads the generation, the address, and
// the generation again. Every word of an address is stored with release and loaded with acquire. So a reader
// that saw a word of a newer address sees at the second look that the generation has changed. No generation
// is used twice, so an address between two equal ones is whole.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <rowe/connection.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/detail/stop_permit.hpp>
#include <rowe/event.hpp>
#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>
#include <rowe/rt/atomics.hpp>
#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "service/base/counters.hpp"
#include "service/threads/local_stop.hpp"
#include "service/threads/parameter_table.hpp"

namespace rowe::service {

class shared_state {
  using events = rt::spsc_ring<event>;

 public:
  using generation_word = rt::std_atomics::variable<std::uint32_t>;

  static std::size_t footprint_bytes(const limits& bounds) noexcept {
    return rt::arena::bytes_for<events::entry>(events::places_for(bounds.events_max)) +
           2 * rt::arena::bytes_for<generation_word>(bounds.connections_max) +
           rt::arena::bytes_for<peer_words>(bounds.connections_max) +
           parameter_table::footprint_bytes(bounds);
  }
  shared_state(rt::arena& memory, const limits& bounds) noexcept
      : parameters{memory, bounds},
        generations_{memory.carve<generation_word>(bounds.connections_max)},
        takers_{memory.carve<generation_word>(bounds.connections_max)},
        addresses_{memory.carve<peer_words>(bounds.connections_max)},
        events_{memory.carve<events::entry>(events::places_for(bounds.events_max))},
        writer_{events_.take_producer()},
        reader_{events_.take_consumer()} {}

  // Service thread. Events that peers can cause at will may fill three quarters of the ring. The rest is for
  // others: stops, warnings, attempts to connect that failed.
  void post(const event& what) noexcept {
    const bool has_room = !by_peers(what.what_kind) || writer_->room_at_least() > events_.capacity() / 4;
    if (!has_room || !writer_->try_push(what)) counts.add(counter::events_lost);
  }
  void set_peers(std::uint32_t count) noexcept {
    // release: pairs with acquire in peers()
    peers_.store(count, std::memory_order_release);
    peers_changed.notify();
  }
  // Says who is at a place, and by which identity, if any. Before another peer comes, it must be nobody,
  // generation 0. An address is cut at 63 bytes.
  void set_connection(std::uint32_t index, std::uint32_t generation, std::string_view peer,
                      std::string_view identity = {}) noexcept {
    // release: pairs with the acquires of the words in read_connection(): whoever reads a new word then also
    // reads this 0, or a newer generation
    generations_[index].store(0, std::memory_order_release);
    set_taking(index, generation);
    if (generation == 0) return;
    std::array<std::uint64_t, peer_words_count> words{};
    auto* const bytes = reinterpret_cast<char*>(words.data());
    (void)peer.copy(bytes, address_bytes_max);
    (void)identity.copy(bytes + address_words_count * sizeof(std::uint64_t), identity_bytes_max);
    for (std::size_t i = 0; i < peer_words_count; ++i) {
      // release: pairs with the acquire of the word in read_connection()
      addresses_[index].words[i].store(words[i], std::memory_order_release);
    }
    // release: pairs with the first acquire in read_connection()
    generations_[index].store(generation, std::memory_order_release);
  }

  // Whether messages to the peer at a place are taken: its generation, or 0.
  void set_taking(std::uint32_t index, std::uint32_t generation) noexcept {
    // relaxed: advice, as generations_ are; pairs with the loads of those who send
    takers_[index].store(generation, std::memory_order_relaxed);
  }

  // Says how many queue pairs the service thread must look at in each cycle; those behind were never used.
  // Set-up calls it under its lock, before it offers the queue pair.
  void use_pair(std::uint32_t index) noexcept {
    // relaxed: set-up alone writes it; release: pairs with the acquire in pairs_used()
    if (index >= pairs_used_.load(std::memory_order_relaxed))
      pairs_used_.store(index + 1, std::memory_order_release);
  }
  std::uint32_t pairs_used() const noexcept {
    return pairs_used_.load(std::memory_order_acquire); // acquire: pairs with the release in use_pair()
  }

  // One other thread at a time.
  std::optional<event> try_event() noexcept { return reader_->try_pop(); }

  // Any thread.
  std::uint32_t peers() const noexcept {
    return peers_.load(std::memory_order_acquire); // acquire: pairs with release in set_peers()
  }
  // Handles read these to see whether a peer that they name is gone.
  std::span<const generation_word> generations() const noexcept { return generations_; }
  // Handles read these to see whether a peer takes messages: it does not while its share of parked messages
  // is used up.
  std::span<const generation_word> takers() const noexcept { return takers_; }
  // The name of the identity of a connection; empty if it has none, or is gone.
  identity_name identity_of(const rowe::connection& of) const noexcept {
    identity_name name;
    const auto text = read_texts(of.index);
    if (text && text->generation == of.generation) (void)name.assign(text->identity()); // it fits
    return name;
  }
  // The connections now. It has each connection that existed during all of the call, and perhaps some that
  // did not.
  std::vector<peer> connections() const {
    std::vector<peer> all;
    for (std::uint32_t i = 0; i < generations_.size(); ++i) {
      if (auto one = read_connection(i)) all.push_back(std::move(*one));
    }
    return all;
  }

  counters counts;
  detail::permit_word<> permit; // of the stop; withdrawn as long as nothing is granted
  local_stop<> stops;           // asked for by threads of this process
  parameter_table parameters;
  rt::notification<> peers_changed;

 private:
  static constexpr bool by_peers(event::kind what) noexcept {
    using kind = event::kind;
    switch (what) {
    case kind::peer_joined:
    case kind::peer_left:
    case kind::refused_handshake:
    case kind::refused_request:
    case kind::status_from_peer:
    case kind::limit:
    case kind::denied: return true;
    case kind::cannot_connect:
    case kind::warning:
    case kind::stop: break;
    }
    return false;
  }

  static constexpr std::size_t address_words_count = 8;
  static constexpr std::size_t address_bytes_max = address_words_count * sizeof(std::uint64_t) - 1; // and a 0
  static constexpr std::size_t identity_words_count = 9;
  static constexpr std::size_t identity_bytes_max = identity_words_count * sizeof(std::uint64_t) - 1;
  static_assert(identity_bytes_max >= identity_name::capacity());
  static constexpr std::size_t peer_words_count = address_words_count + identity_words_count;
  struct peer_words {
    std::array<rt::std_atomics::variable<std::uint64_t>, peer_words_count> words{};
  };
  struct peer_texts {
    std::uint32_t generation = 0;
    std::array<char, peer_words_count * sizeof(std::uint64_t)> bytes;
    const char* address() const noexcept { return bytes.data(); }
    const char* identity() const noexcept {
      return bytes.data() + address_words_count * sizeof(std::uint64_t);
    }
  };

  std::optional<peer> read_connection(std::uint32_t index) const {
    const auto texts = read_texts(index);
    if (!texts) return std::nullopt;
    return peer{{index, texts->generation}, texts->address(), texts->identity()};
  }
  std::optional<peer_texts> read_texts(std::uint32_t index) const noexcept {
    if (index >= generations_.size()) return std::nullopt;
    // acquire: pairs with the last release in set_connection()
    const std::uint32_t before = generations_[index].load(std::memory_order_acquire);
    if (before == 0) return std::nullopt;
    peer_texts texts;
    for (std::size_t i = 0; i < peer_words_count; ++i) {
      // acquire: pairs with the release of the word in set_connection()
      const std::uint64_t word = addresses_[index].words[i].load(std::memory_order_acquire);
      std::memcpy(texts.bytes.data() + i * sizeof word, &word, sizeof word);
    }
    // relaxed: behind the acquires, so not older than the 0 that went before any newer word they saw
    if (generations_[index].load(std::memory_order_relaxed) != before) return std::nullopt;
    texts.generation = before;
    return texts;
  }

  std::span<generation_word> generations_;
  std::span<generation_word> takers_;
  std::span<peer_words> addresses_;
  events events_;
  events::producer* writer_;
  events::consumer* reader_;
  rt::std_atomics::variable<std::uint32_t> peers_{0};
  rt::std_atomics::variable<std::uint32_t> pairs_used_{0};
};

// Reads a counter, and adds the part of it that user threads count in their queue pairs. Any thread.
inline std::uint64_t read_count(const shared_state& shared, std::span<const detail::queue_pair> pairs,
                                counter which) noexcept {
  std::uint64_t sum = shared.counts.read(which);
  if (which != counter::full && which != counter::no_peer && which != counter::too_big &&
      which != counter::inbound_expired) {
    return sum;
  }
  for (const detail::queue_pair& queues : pairs) {
    if (queues.lifecycle.is_detached()) continue; // its counts were added to the shared ones before
    sum += which == counter::full              ? queues.refused_full.get()
           : which == counter::no_peer         ? queues.no_peer.get()
           : which == counter::inbound_expired ? queues.expired_here.get()
                                               : queues.refused_too_big.get();
  }
  return sum;
}

} // namespace rowe::service
