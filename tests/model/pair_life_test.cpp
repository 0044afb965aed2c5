// SPDX-License-Identifier: Apache-2.0
// Lanes that are opened, refused, used, closed and opened again, and endpoints that are closed while somebody
// waits, under the explorer: see pair_life.hpp.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "model/expect.hpp"
#include "model/mutation.hpp"
#include "model/pair_life.hpp"
#include "model/source_text.hpp"

namespace rowe::model {
namespace pair_life_test {
namespace {

// One thread opens, publishes, closes, and opens again in the same memory.
struct two_lives {
  static constexpr std::uint32_t lives = 2;
  modelled_pair pair;
  event_fd service;
  std::uint32_t taken = 0;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                for (std::uint32_t life = 1; life <= lives; ++life) {
                  require(open_pair(pair, service, life).has_value(), "a pair that was closed is free again");
                  require(publish(pair, life), "an active pair takes what is published");
                  close_pair(pair, service);
                }
              }},
             {"service", [this] {
                for (std::uint32_t gone = 0; gone != lives;) {
                  service.wait();
                  gone += turn_pair(pair, {}, [this](std::uint32_t v) {
                    require(v == ++taken, "what was published comes in order, each once");
                  });
                }
              }}}};
  }
  void afterwards() { require(taken == lives, "closing loses nothing"); }
};

// It is refused with a reason, and then, in the same memory, taken.
struct refused_first {
  static constexpr error why{errc::type_conflict, 7};
  modelled_pair pair;
  event_fd service;

  std::array<actor, 2> actors() {
    return {{{"handle",
              [this] {
                const status first = open_pair(pair, service, 1);
                require(!first && first.error() == why, "who is refused is told why");
                require(open_pair(pair, service, 2).has_value(), "and may ask again");
                close_pair(pair, service);
              }},
             {"service", [this] {
                status answer = why;
                for (bool gone = false; !gone;) {
                  service.wait();
                  gone = turn_pair(pair, answer, [](std::uint32_t) {});
                  answer = {}; // the eventfd is signalled once for each offer
                }
              }}}};
  }
};

// A pair of which two threads have a part.
struct pair_of_two {
  modelled_pair pair;
  event_fd service;
  event_fd handed_over; // the handle, to its thread
  std::array<atomics::variable<bool>, 2> ended;

  void end(std::size_t who) {
    ended[who].store(true, order::seq_cst);
    service.signal();
  }
  // The service thread's part.
  template <class Take>
  void turn(Take take) {
    for (bool last = false; !last;) {
      service.wait();
      last = ended[0].load(order::seq_cst) && ended[1].load(order::seq_cst);
      (void)turn_pair(pair, {}, take);
    }
  }
};

// The handle is used and destroyed on a thread of its own, while set-up opens another queue pair, for which
// there is only the same memory: it may be taken at any moment, or not yet be free.
struct two_threads : pair_of_two {
  std::uint32_t taken = 0;

  std::array<actor, 3> actors() {
    return {{{"set-up",
              [this] {
                require(open_pair(pair, service, 1).has_value(), "the first pair is free");
                handed_over.signal();
                service.signal(); // it turns for many reasons, and finds what it finds
                if (open_pair(pair, service, 2)) close_pair(pair, service);
                end(0);
              }},
             {"handle",
              [this] {
                handed_over.wait();
                require(publish(pair, 5), "an active pair takes what is published");
                close_pair(pair, service);
                end(1);
              }},
             {"service", [this] { turn([this](std::uint32_t) { ++taken; }); }}}};
  }
  void afterwards() { require(taken == 1, "closing loses nothing"); }
};

// A view outlives its handle: set-up, which opens another queue pair, gets the memory before or behind it,
// but not while the view is looked at.
struct outlived_by_a_view : pair_of_two {
  std::array<actor, 3> actors() {
    return {{{"set-up",
              [this] {
                require(open_pair(pair, service, 1).has_value(), "the first pair is free");
                // For the service thread:
                const auto sent = pair.free_ring_out.try_take();
                require(sent && pair.to_handle.in.try_push(*sent), "there is a slot, and a place");
                handed_over.signal();
                if (open_pair(pair, service, 2)) close_pair(pair, service);
                end(0);
              }},
             {"handle",
              [this] {
                handed_over.wait();
                const auto slot = pair.to_handle.out.try_pop();
                require(slot.has_value(), "it has arrived");
                close_pair(pair, service);
                require(pair.built.load() == 1, "a view shows what it showed");
                pair.free_ring_in.release(*slot);
                end(1);
              }},
             {"service", [this] { turn([](std::uint32_t) {}); }}}};
  }
  void afterwards() { require(pair.lifecycle.is_free(), "it is free when the view is gone"); }
};

// A peer comes, and is told what this process publishes, while set-up builds another queue pair.
struct announces_beside_set_up {
  std::array<modelled_pair, 2> pairs;
  std::array<bool, 2> attached{};
  event_fd service;

  std::array<actor, 2> actors() {
    return {{{"set-up",
              [this] {
                std::uint32_t life = 0;
                for (modelled_pair& one : pairs)
                  require(open_pair(one, service, ++life).has_value(), "it is free");
              }},
             {"service", [this] {
                while (!attached[1]) {
                  service.wait();
                  for (std::size_t i = 0; i != pairs.size(); ++i) {
                    (void)turn_pair(pairs[i], {}, [](std::uint32_t) {});
                    attached[i] = pairs[i].audience.advice() == audience::somebody;
                  }
                  look_at_each(pairs, attached);
                }
              }}}};
  }
};

// The endpoint closes while a handle waits: it gets what was delivered, and then is told.
struct closes_a_waiter {
  modelled_pair pair;
  modelled_loop loop;
  event_fd joined; // the service thread has ended
  bool delivers = true;

  explicit closes_a_waiter(bool something = true) : delivers{something} {
    pair.audience.set(audience::somebody);
  }
  std::array<actor, 3> actors() {
    return {{{"handle",
              [this] {
                if (delivers)
                  require(take_or_closed(pair) == 9U, "what was delivered is there after closing");
                require(!take_or_closed(pair), "and then a wait ends because it is over");
              }},
             {"service",
              [this] {
                bool delivered = !delivers;
                loop.run([&] {
                  if (std::exchange(delivered, true)) return;
                  require(pair.to_handle.in.try_push(9), "there is a place");
                  pair.arrival.notify();
                });
                joined.signal();
              }},
             {"closer", [this] {
                loop.stop();
                joined.wait();
                close_handles(pair);
              }}}};
  }
};
struct closes_who_gets_nothing : closes_a_waiter {
  closes_who_gets_nothing() : closes_a_waiter{false} {}
};

// What was published before stop() is taken, and nobody is left waiting.
struct takes_before_it_ends {
  modelled_pair pair;
  modelled_loop loop;
  event_fd joined;
  std::uint32_t taken = 0;

  takes_before_it_ends() { pair.audience.set(audience::somebody); }
  std::array<actor, 2> actors() {
    return {{{"closer",
              [this] {
                require(publish(pair, 1), "it is taken");
                loop.stop();
                joined.wait();
                close_handles(pair);
                require(!publish(pair, 2) && pair.audience.closed(), "nothing is taken afterwards");
              }},
             {"service", [this] {
                loop.run([this] {
                  while (pair.to_service.out.try_pop()) ++taken;
                });
                joined.signal();
              }}}};
  }
  void afterwards() { require(taken == 1, "what was published before the end is taken"); }
};

TEST(pair_life, hands_the_lane_over_and_back_each_time) { expect_passes<two_lives>(); }

TEST(pair_life, tells_why_a_lane_is_refused) { expect_passes<refused_first>(); }

TEST(pair_life, does_not_begin_anew_while_a_view_is_looked_at) {
  EXPECT_EQ(explore_two<outlived_by_a_view>({}).failure, "");
}

TEST(pair_life, gives_memory_to_the_next_lane_only_when_nobody_uses_it) {
  EXPECT_EQ(explore_two<two_threads>({}).failure, "");
}

TEST(pair_life, is_nobody_elses_to_look_at_while_set_up_builds) { expect_passes<announces_beside_set_up>(); }

TEST(closing, ends_every_wait_and_loses_nothing_that_was_delivered) {
  expect_passes<closes_a_waiter>();
  expect_passes<closes_who_gets_nothing>();
}

TEST(closing, takes_what_was_published_before) {
  expect_passes_in_every_interleaving<takes_before_it_ends>();
}

// What is modelled is what the sources do where they do not use the real thing: each access stands there as
// it does here, and there are no others.
TEST(pair_life, has_the_accesses_that_the_sources_have) {
  const std::string audiences = "src/service/topics/audiences.hpp",
                    handles = "src/service/topics/topic_handles.cpp",
                    loop = "src/service/core/service_loop.cpp",
                    released = "src/service/handles/pair_release.hpp";
  const source_access expected[] = {
      {released, "end.free_ring->released()+parked==popped", 1},
      {audiences, "if(!row.attached||row.topic!=index)continue;", 1},
      {audiences, "pair.kind", 1},
      {handles,
       "if(i==pair||!state_.pair_rows[i].attached||state_.pair_rows[i].topic!=state_.pair_rows[pair].topic)"
       "continue;",
       1},
      {handles,
       "if(state_.pair_rows[i].attached&&state_.pair_rows[i].topic==topic&&"
       "detail::subscribes(state_.pairs[i].kind)==that_reads)",
       1},
      {handles,
       "if(!row.attached||row.topic!=topic)continue;"
       "constboolpublishes=detail::publishes(state_.pairs[i].kind);",
       1},
      {handles, "state_.pairs[i].kind", 3},
      {loop, "drain_until_ns_.load(std::memory_order_acquire)", 1},
      {loop,
       "drain_until_ns_.store(std::min(rt::nanoseconds_of(drain_until),rt::nanoseconds_of(rt::never)-1),"
       "std::memory_order_release);transport_.wake();",
       1},
      {loop, "drain_until_ns_.", 2},
  };
  expect_in_sources(expected);
}

TEST(pair_life, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{named_scenario{"two_lives", explore_two<two_lives>},
                             named_scenario{"refused_first", explore_two<refused_first>},
                             named_scenario{"takes_before_it_ends", explore_two<takes_before_it_ends>},
                             named_scenario{"closes_a_waiter", explore_two<closes_a_waiter>},
                             named_scenario{"two_threads", explore_two<two_threads>},
                             named_scenario{"outlived_by_a_view", explore_two<outlived_by_a_view>}};
  const std::array listed{stronger_than_needed{"wait_answer", "pair_phase::free, ", order::relaxed,
                                               "only set-up looks for free pairs, and its mutex orders that"},
                          stronger_than_needed{"hold", "pair_phase::held, ", order::relaxed,
                                               "who finds it held leaves it alone until it is free"}};
  EXPECT_EQ((mutation_test{"rowe/detail/pair_lifecycle.hpp", scenarios, listed}.findings()), "");
  EXPECT_EQ((mutation_test{"model/pair_life.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace pair_life_test
} // namespace rowe::model
