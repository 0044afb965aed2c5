// SPDX-License-Identifier: Apache-2.0
// A receiver asleep at the shared inbox under the explorer: a delivery wakes it, closing wakes it, and what
// was delivered before closing is received.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include "model/expect.hpp"
#include "model/inbox_receiving.hpp"
#include "model/mutation.hpp"
#include "model/source_text.hpp"

namespace rowe::model {
namespace inbox_receiving_test {
namespace {

// The receiver goes on until it is told that the inbox is closed.
struct receiving {
  modelled_inbox inbox;
  std::uint32_t received = 0;

  void receive_all() {
    while (const auto slot = inbox.receive())
      require(inbox.texts[*slot].load() == *slot + 100 && *slot == received++, "each in its order, once");
  }
};

struct delivered_then_closed : receiving {
  std::array<actor, 2> actors() {
    return {{{"receiver", [this] { receive_all(); }}, {"service", [this] {
                                                         inbox.deliver(0);
                                                         inbox.close();
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
                  require(inbox.receive() == i, "without closing it waits for the message");
              }},
             {"service", [this] {
                inbox.deliver(0);
                inbox.deliver(1);
              }}}};
  }
};

// Nothing but closing does, by another thread.
struct closed_alone : receiving {
  std::array<actor, 2> actors() {
    return {{{"receiver", [this] { receive_all(); }}, {"closer", [this] { inbox.close(); }}}};
  }
};

// Both at once.
struct closed_meanwhile : receiving {
  std::array<actor, 3> actors() {
    return {{{"receiver", [this] { receive_all(); }},
             {"service", [this] { inbox.deliver(0); }},
             {"closer", [this] { inbox.close(); }}}};
  }
};

TEST(inbox_receiving, wakes_for_every_delivery) { expect_passes<delivered_alone>(); }

TEST(inbox_receiving, wakes_when_it_is_closed) { expect_passes_in_every_interleaving<closed_alone>(); }

TEST(inbox_receiving, gets_what_came_before_it_was_closed) {
  expect_passes<delivered_then_closed>();
  EXPECT_EQ(explore_two<closed_meanwhile>({}).failure, "");
}

TEST(inbox_receiving, has_the_accesses_that_the_source_has) {
  const std::string source = "src/service/threads/shared_inbox.cpp";
  const source_access expected[] = {
      {source,
       "if(sleepers_.load(std::memory_order_seq_cst)==0)return;wake_count_.exchange(count,std::memory_"
       "order_release);rt::futex::wake(wake_count_);",
       1},
      {source,
       "places_[tail&(places_.size()-1)].store(slot,std::memory_order_relaxed);tail_.store(tail+1,std::"
       "memory_order_seq_cst);wake_receiver(static_cast<std::uint32_t>(2*(tail+1)));",
       1},
      {source, "closed_.store(true,std::memory_order_seq_cst);wake_receiver(1);", 1},
      {"src/service/threads/shared_inbox.hpp", "returnclosed_.load(std::memory_order_seq_cst);", 1},
      {source,
       "head=head_.load(std::memory_order_acquire);while(head!=tail_.load(std::memory_order_seq_cst)){", 1},
      {source, "head_.compare_exchange_weak(head,head+1,std::memory_order_acq_rel,std::memory_order_acquire)",
       2},
      {source, "sleepers_.fetch_add(1,std::memory_order_seq_cst);errcwhy", 1},
      {source,
       "seen=wake_count_.load(std::memory_order_acquire);constboolclosed=is_closed();found=pop_unexpired(",
       1},
      {source,
       "sleepers_.fetch_sub(1,std::memory_order_seq_cst);if(why==errc::closed)rt::futex::wake(wake_count_);",
       1},
      {source, "sleepers_.", 4}, // and check()
      {source, "rt::futex::", 3},
  };
  expect_in_sources(expected);
}

TEST(inbox_receiving, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{named_scenario{"delivered_alone", explore_two<delivered_alone>},
                             named_scenario{"delivered_then_closed", explore_two<delivered_then_closed>},
                             named_scenario{"closed_alone", explore_two<closed_alone>}};
  constexpr const char* several = "it orders several receivers, and here is one";
  const std::array listed{stronger_than_needed{"pop", "inbox_head.load", order::relaxed, several},
                          stronger_than_needed{"pop", "inbox_head.exchange", order::relaxed, several},
                          stronger_than_needed{"receive", "sleepers.exchange(0", order::relaxed,
                                               "whoever still counts it wakes in vain"}};
  EXPECT_EQ((mutation_test{"model/inbox_receiving.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace inbox_receiving_test
} // namespace rowe::model
