// SPDX-License-Identifier: Apache-2.0
// rowe::rt::spsc_ring under the explorer: rings of two places, so that full, empty and the wrap of the places
// are reached within a few operations.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>

#include <rowe/rt/spsc_ring.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace spsc_ring_test {
namespace {

using ring = rt::spsc_ring<std::uint32_t, atomics>;

// A ring of two, and for each item pushed something plain that must be visible when it is popped.
struct ring_of_two {
  static constexpr std::size_t items_max = 20;

  explicit ring_of_two(std::uint64_t first_index = 0) : queue{entries, first_index} {}

  std::array<ring::entry, 2> entries;
  ring queue;
  ring::producer& in{*queue.take_producer()};
  ring::consumer& out{*queue.take_consumer()};
  std::array<atomics::plain<std::uint32_t>, items_max> payloads;
  std::uint32_t pushed = 0;
  std::uint32_t popped = 0;

  bool push() {
    payloads[pushed].store(100 + pushed);
    if (!in.try_push(pushed)) return false;
    ++pushed;
    return true;
  }
  void receive(std::uint32_t item) {
    require(item == popped, "items arrive in order, each once");
    require(payloads[item].load() == 100 + item, "the payload is there when its item is");
    ++popped;
  }
  bool pop() {
    const auto item = out.try_pop();
    if (item) receive(*item);
    return item.has_value();
  }

  // Nothing is lost: what was pushed and not yet popped is still there, and the ring says so of itself.
  void afterwards() {
    require(queue.check() == nullptr, "the invariants hold at rest");
    require(out.pending_at_least() == pushed - popped, "at rest the consumer counts right");
    require(in.room_at_least() == 2 - (pushed - popped), "at rest the producer counts right");
    require(queue.approximate_size() == pushed - popped, "at rest the size is exact");
    while (pop()) {
    }
    require(popped == pushed, "what was pushed is popped in the end");
  }
};

// Item by item. The producer tries more often than there are places, the consumer more often than there are
// items.
template <int Tries>
struct pushes_and_pops : ring_of_two {
  using ring_of_two::ring_of_two;
  std::array<actor, 2> actors() {
    return {{{"producer",
              [this] {
                for (int i = 0; i != Tries; ++i) (void)push();
              }},
             {"consumer", [this] {
                for (int i = 0; i != Tries; ++i) (void)pop();
              }}}};
  }
};

// The same where the 64-bit indices pass their end.
struct pushes_and_pops_at_the_end : pushes_and_pops<6> {
  pushes_and_pops_at_the_end() : pushes_and_pops<6>{std::numeric_limits<std::uint64_t>::max()} {}
};

// In batches. What room_at_least() promises is kept, and so is what pending_at_least() does.
struct pushes_and_drains : ring_of_two {
  std::array<actor, 2> actors() {
    return {{{"producer",
              [this] {
                for (int i = 0; i != 3; ++i) {
                  const bool has_room = in.room_at_least() != 0;
                  require(push() || !has_room, "there was room, and only the consumer changes that");
                }
              }},
             {"consumer", [this] {
                const std::size_t waiting = out.pending_at_least();
                const std::size_t first = out.drain([this](std::uint32_t item) { receive(item); }, 2);
                require(first >= waiting, "what waited is drained");
                (void)out.drain([this](std::uint32_t item) { receive(item); }, 1);
                (void)out.drain([this](std::uint32_t item) { receive(item); }, 2);
              }}}};
  }
};

// A third thread watches the size. Items that never were are not counted: head is read before tail.
struct watched : ring_of_two {
  std::array<actor, 3> actors() {
    return {{{"producer", [this] { (void)push(); }},
             {"consumer",
              [this] {
                for (int i = 0; i != 2; ++i) (void)pop();
              }},
             {"watcher",
              [this] { require(queue.approximate_size() <= 1, "no more items than were ever pushed"); }}}};
  }
};

// Two threads want both ends.
struct contested {
  std::array<ring::entry, 2> entries;
  ring queue{entries};
  std::array<int, 2> producers{};
  std::array<int, 2> consumers{};

  void take(std::size_t who) {
    producers[who] = queue.take_producer() != nullptr;
    consumers[who] = queue.take_consumer() != nullptr;
  }
  std::array<actor, 2> actors() {
    return {{{"one", [this] { take(0); }}, {"other", [this] { take(1); }}}};
  }
  void afterwards() {
    require(producers[0] + producers[1] == 1, "one thread gets the producer");
    require(consumers[0] + consumers[1] == 1, "one thread gets the consumer");
  }
};

const std::array scenarios{scenario<pushes_and_pops<5>>("pushes_and_pops"),
                           scenario<pushes_and_drains>("pushes_and_drains"), scenario<watched>("watched"),
                           scenario<contested>("contested")};

TEST(spsc_ring, loses_doubles_and_reorders_nothing) {
  expect_passes_in_every_interleaving<pushes_and_pops<5>>();
  expect_passes<pushes_and_pops<7>>();
}

TEST(spsc_ring, loses_doubles_and_reorders_nothing_in_long_random_runs) {
  expect_passes_at_random<pushes_and_pops<20>>(1, 20'000);
}

TEST(spsc_ring, loses_nothing_where_the_indices_pass_their_end) {
  expect_passes<pushes_and_pops_at_the_end>();
}

TEST(spsc_ring, drains_in_batches_without_loss) { expect_passes_in_every_interleaving<pushes_and_drains>(); }

TEST(spsc_ring, counts_no_item_that_was_never_pushed) { expect_passes_in_every_interleaving<watched>(); }

TEST(spsc_ring, gives_each_end_to_one_thread_only) { expect_passes_in_every_interleaving<contested>(); }

TEST(spsc_ring, needs_every_memory_order_it_asks_for) {
  constexpr const char* once = "who gets an end is decided by the exchange alone, and no data goes with it";
  constexpr const char* at_rest = "check() is called where all of both threads happens before already";
  const std::array listed{stronger_than_needed{"take_producer", "exchange", order::relaxed, once},
                          stronger_than_needed{"take_consumer", "exchange", order::relaxed, once},
                          stronger_than_needed{"check", "tail_.load", order::relaxed, at_rest},
                          stronger_than_needed{"check", "head_.load", order::relaxed, at_rest}};
  EXPECT_EQ((mutation_test{"rowe/rt/spsc_ring.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace spsc_ring_test
} // namespace rowe::model
