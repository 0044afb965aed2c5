// SPDX-License-Identifier: Apache-2.0
// rowe::rt::free_ring under the explorer, in the only setting in which it is sound: with a ring that leads
// out. A queue of two or three slots; each slot's payload is plain, so the explorer reports at once if it
// ever has two owners.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace free_ring_test {
namespace {

using free_ring = rt::free_ring<atomics>;
using out_ring = rt::spsc_ring<std::uint32_t, atomics>;

// As many places as slots, both ways.
template <std::uint32_t Slots, std::size_t Places = Slots>
struct queue_pair {
  explicit queue_pair(std::uint64_t first_index = 0)
      : free{free_entries, Slots, first_index}, out{out_entries} {}

  std::array<free_ring::entry, Places> free_entries;
  std::array<out_ring::entry, Places> out_entries;
  free_ring free;
  out_ring out;
  free_ring::consumer& take_completion{*free.take_consumer()};
  free_ring::producer& release_end{*free.take_producer()};
  out_ring::producer& push_end{*out.take_producer()};
  out_ring::consumer& pop_end{*out.take_consumer()};
  std::array<atomics::plain<std::uint32_t>, Slots> payloads;
  std::uint32_t sent = 0;
  std::uint32_t received = 0;
  std::uint32_t seen = 0;

  void send(int tries = 1) {
    for (int i = 0; i != tries; ++i) send_one();
  }
  void send_one() {
    const auto slot = take_completion.try_take();
    if (!slot) return;
    payloads[*slot].store(++sent);
    require(push_end.try_push(*slot), "a ring with a place for every slot is never full");
  }
  // As send(), but looks at what came back first: each number is seen once for each time that it was away.
  void see_and_send() {
    see();
    if (take_completion.seen_by_owner() != 0) send();
  }
  void see() {
    take_completion.see(take_completion.mark(), [this](std::uint32_t slot) {
      require(payloads[slot].load() == 0, "what is seen has come back");
      ++seen;
    });
  }
  void receive(int tries = 1) {
    for (int i = 0; i != tries; ++i) {
      if (const auto slot = pop_end.try_pop()) finish(*slot);
    }
  }
  // The borrower owns the slot until it gives its number back: it may write there too.
  void finish(std::uint32_t slot) {
    require(payloads[slot].load() == ++received, "messages arrive in order, each once");
    payloads[slot].store(0);
    release_end.release(slot);
  }

  void afterwards() {
    require(free.check() == nullptr && out.check() == nullptr, "the invariants hold at rest");
    require(take_completion.free_at_least() == Slots - (sent - received), "at rest the owner counts right");
    while (pop_end.pending_at_least() != 0) receive();
    require(received == sent, "what was sent is received in the end");
    require(take_completion.free_at_least() == Slots, "every slot comes back");
    require(free.check() == nullptr, "no number comes back twice");
  }
};

template <int Tries>
struct two_slots : queue_pair<2> {
  using queue_pair<2>::queue_pair;
  std::array<actor, 2> actors() {
    return {{{"owner", [this] { send(Tries); }}, {"borrower", [this] { receive(Tries); }}}};
  }
};

struct two_slots_at_the_end : two_slots<5> {
  two_slots_at_the_end() : two_slots<5>{std::numeric_limits<std::uint64_t>::max() - 2} {}
};

struct three_slots_in_four_places : queue_pair<3, 4> {
  std::array<actor, 2> actors() {
    return {{{"owner", [this] { send(5); }}, {"borrower", [this] { receive(4); }}}};
  }
};

struct looks_before_it_takes : queue_pair<2> {
  std::array<actor, 2> actors() {
    return {{{"owner",
              [this] {
                for (int i = 0; i != 4; ++i) see_and_send();
              }},
             {"borrower", [this] { receive(3); }}}};
  }
  void afterwards() {
    queue_pair<2>::afterwards();
    see();
    require(seen == sent, "each number that came back is seen once");
  }
};

// The owner waits with one slot for its turn to use the memory of all of them.
struct all_free_again : queue_pair<2> {
  bool used = false;
  std::array<actor, 2> actors() {
    return {{{"owner",
              [this] {
                send(2);
                for (int i = 0; i != 3 && !used; ++i) {
                  if (take_completion.free_at_least() != 2) continue;
                  used = true;
                  for (auto& payload : payloads) payload.store(99);
                }
              }},
             {"borrower", [this] { receive(3); }}}};
  }
};

// As the service thread does it: batches, whose places in the ring out are given back together at the end.
// Numbers are then back before their places are free, so the owner keeps a number that it could not push.
struct drained_in_batches : queue_pair<2> {
  std::optional<std::uint32_t> kept;

  void send_or_keep() {
    if (!kept) {
      kept = take_completion.try_take();
      if (!kept) return;
      payloads[*kept].store(++sent);
    }
    if (push_end.try_push(*kept)) kept.reset();
  }
  std::array<actor, 2> actors() {
    return {{{"owner",
              [this] {
                for (int i = 0; i != 5; ++i) send_or_keep();
              }},
             {"borrower", [this] {
                for (int i = 0; i != 3; ++i)
                  (void)pop_end.drain([this](std::uint32_t slot) { finish(slot); }, 2);
              }}}};
  }
  void afterwards() {
    while (pop_end.pending_at_least() != 0) receive();
    if (kept) require(push_end.try_push(*kept), "a slot that was kept has its place at rest");
    queue_pair::afterwards();
  }
};

struct contested {
  std::array<free_ring::entry, 2> entries;
  free_ring free{entries, 2};
  std::array<int, 2> producers{};
  std::array<int, 2> consumers{};

  void take(std::size_t who) {
    producers[who] = free.take_producer() != nullptr;
    consumers[who] = free.take_consumer() != nullptr;
  }
  std::array<actor, 2> actors() {
    return {{{"one", [this] { take(0); }}, {"other", [this] { take(1); }}}};
  }
  void afterwards() {
    require(producers[0] + producers[1] == 1, "one thread gets the producer");
    require(consumers[0] + consumers[1] == 1, "one thread gets the consumer");
  }
};

TEST(free_ring, brings_every_slot_back_and_never_gives_one_two_owners) {
  expect_passes_in_every_interleaving<two_slots<4>>();
  expect_passes<two_slots<6>>();
}

TEST(free_ring, brings_every_slot_back_in_long_random_runs) {
  expect_passes_at_random<two_slots<14>>(2, 20'000);
}

TEST(free_ring, brings_every_slot_back_where_the_indices_pass_their_end) {
  expect_passes<two_slots_at_the_end>();
}

TEST(free_ring, brings_every_slot_back_when_there_are_more_places_than_slots) {
  expect_passes<three_slots_in_four_places>();
}

TEST(free_ring, says_that_all_are_free_only_when_nobody_touches_any) {
  expect_passes_in_every_interleaving<all_free_again>();
}

TEST(free_ring, shows_each_released_number_once_before_it_is_taken) {
  expect_passes_in_every_interleaving<looks_before_it_takes>();
}

TEST(free_ring, brings_every_slot_back_when_the_ring_out_is_drained_in_batches) {
  expect_passes_in_every_interleaving<drained_in_batches>();
}

TEST(free_ring, gives_each_end_to_one_thread_only) { expect_passes_in_every_interleaving<contested>(); }

TEST(free_ring, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<two_slots<5>>("two_slots"), scenario<all_free_again>("all_free_again"),
                             scenario<contested>("contested")};
  constexpr const char* once = "who gets an end is decided by the exchange alone, and no data goes with it";
  constexpr const char* at_rest = "check() is called where all of both threads happens before already";
  const std::array listed{stronger_than_needed{"take_producer", "exchange", order::relaxed, once},
                          stronger_than_needed{"take_consumer", "exchange", order::relaxed, once},
                          stronger_than_needed{"check", "tail_.load", order::relaxed, at_rest}};
  EXPECT_EQ((mutation_test{"rowe/rt/free_ring.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace free_ring_test
} // namespace rowe::model
