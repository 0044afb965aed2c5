// SPDX-License-Identifier: Apache-2.0
// A receiver asleep at the front door under the explorer: what is delivered wakes it, closing wakes it, and
// what was delivered before closing is received.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "model/door_receiving.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"
#include "model/source_text.hpp"

namespace rowe::model {
namespace door_receiving_test {
namespace {

// The receiver goes on until it is told that the door is closed.
struct receiving {
  modelled_door door;
  std::uint32_t received = 0;

  void receive_all() {
    while (const auto slot = door.receive())
      require(door.texts[*slot].load() == *slot + 100 && *slot == received++, "each in its order, once");
  }
};

struct delivered_then_closed : receiving {
  std::array<actor, 2> actors() {
    return {{{"receiver", [this] { receive_all(); }}, {"service", [this] {
                                                         door.deliver(0);
                                                         door.close();
                                                       }}}};
  }
  void afterwards() { require(received == 1, "what came before closing is received"); }
};

// Nothing but a delivery wakes it.
struct delivered_alone : receiving {
  std::array<actor, 2> actors() {
    return {{{"receiver",
              [this] {
                for (std::uint32_t i = 0; i != 2; ++i)
                  require(door.receive() == i, "without closing it waits for the message");
              }},
             {"service", [this] {
                door.deliver(0);
                door.deliver(1);
              }}}};
  }
};

// Nothing but closing does, by another thread.
struct closed_alone : receiving {
  std::array<actor, 2> actors() {
    return {{{"receiver", [this] { receive_all(); }}, {"closer", [this] { door.close(); }}}};
  }
};

// Both at once.
struct closed_meanwhile : receiving {
  std::array<actor, 3> actors() {
    return {{{"receiver", [this] { receive_all(); }},
             {"service", [this] { door.deliver(0); }},
             {"closer", [this] { door.close(); }}}};
  }
};

// Two changes of thread where the running one could go on are enough to catch what can be caught here.
template <class Scenario>
report explore_two(options o) {
  o.preemptions_max = 2;
  return explore<Scenario>(o);
}

TEST(door_receiving, wakes_for_every_delivery) { expect_passes<delivered_alone>(); }

TEST(door_receiving, wakes_when_it_is_closed) { expect_passes_in_every_interleaving<closed_alone>(); }

TEST(door_receiving, gets_what_came_before_it_was_closed) {
  expect_passes<delivered_then_closed>();
  EXPECT_EQ(explore_two<closed_meanwhile>({}).failure, "");
}

TEST(door_receiving, has_the_accesses_that_the_source_has) {
  const std::string door = "src/service/front_door.cpp";
  const source_access expected[] = {
      {door,
       "if(sleepers_.load(std::memory_order_seq_cst)==0)return;bell_.exchange(bell,std::memory_order_"
       "release);rt::futex::wake(bell_);",
       1},
      {door,
       "places_[tail&(places_.size()-1)].store(slot,std::memory_order_relaxed);inbox_tail_.store(tail+1,"
       "std::memory_order_seq_cst);wake_receiver(static_cast<std::uint32_t>(2*(tail+1)));",
       1},
      {door, "closed_.store(true,std::memory_order_seq_cst);wake_receiver(1);", 1},
      {door, "returnclosed_.load(std::memory_order_seq_cst);", 1},
      {door,
       "head=inbox_head_.load(std::memory_order_acquire);while(head!=inbox_tail_.load(std::memory_order_"
       "seq_cst)){",
       1},
      {door,
       "inbox_head_.compare_exchange_weak(head,head+1,std::memory_order_acq_rel,std::memory_order_"
       "acquire)",
       2},
      {door, "sleepers_.fetch_add(1,std::memory_order_seq_cst);errcwhy", 1},
      {door, "rung=bell_.load(std::memory_order_acquire);constboolclosed=is_closed();found=pop_unexpired(",
       1},
      {door, "sleepers_.fetch_sub(1,std::memory_order_seq_cst);if(why==errc::closed)rt::futex::wake(bell_);",
       1},
      {door, "sleepers_.", 4},                   // and check()
      {door, "rt::futex::wake(room_bell_);", 1}, // of those who send
      {door, "rt::futex::", 4},
  };
  expect_in_sources(expected);
}

TEST(door_receiving, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{named_scenario{"delivered_alone", explore_two<delivered_alone>},
                             named_scenario{"delivered_then_closed", explore_two<delivered_then_closed>},
                             named_scenario{"closed_alone", explore_two<closed_alone>}};
  constexpr const char* several = "it orders several receivers, and here is one";
  const std::array listed{stronger_than_needed{"pop_inbox", "inbox_head.load", order::relaxed, several},
                          stronger_than_needed{"pop_inbox", "inbox_head.exchange", order::relaxed, several},
                          stronger_than_needed{"receive", "sleepers.exchange(0", order::relaxed,
                                               "who still counts it rings in vain"}};
  EXPECT_EQ((mutation_test{"model/door_receiving.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace door_receiving_test
} // namespace rowe::model
