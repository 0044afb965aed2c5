// SPDX-License-Identifier: Apache-2.0
// The completion of a submission under the explorer: a submitter that waits, with deadlines that may come at
// any moment, and the service thread, which completes each request once. The slot's text is plain, so the
// explorer reports at once if the slot ever has two holders.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <utility>

#include <rowe/rt/notification.hpp>
#include <rowe/rt/spsc_ring.hpp>

#include "service/threads/completion.hpp"

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace completion_test {
namespace {

using service::slot_holder;
using completion = service::completion<atomics, futex>;
using ring = rt::spsc_ring<std::uint32_t, atomics>;

constexpr rt::time_point soon{}; // may come at any moment

// A slot of the submission queue, the ring through which the service thread gets it, and the ring by which
// the service thread gives it back if the submitter has left.
struct one_slot {
  std::array<ring::entry, 2> requests;
  std::array<ring::entry, 2> returns;
  ring out{requests};
  ring back{returns};
  ring::producer& out_end{*out.take_producer()};
  ring::consumer& in_end{*out.take_consumer()};
  ring::producer& return_end{*back.take_producer()};
  ring::consumer& returned_end{*back.take_consumer()};
  completion word;
  atomics::plain<std::uint32_t> text; // the request's, then the reply's
  atomics::plain<std::uint32_t>
      header; // the service thread leaves it alone, so the submitter may read it before it waits
  std::uint32_t came_back = 0; // to the submitter with its completion, or by the service thread
  std::uint32_t asked = 0;

  static constexpr std::uint32_t answer = 100;

  void ask(bool waits) {
    text.store(++asked);
    header.store(asked);
    word.arm(waits);
    require(out_end.try_push(asked), "there is a place for the request");
  }
  // What the submitter finds when it is told that the completion is there; the slot is its own again.
  void read() {
    require(text.load() == asked + answer, "the completion comes with its outcome");
    use_for_something_else();
    ++came_back;
  }
  void use_for_something_else() {
    text.store(0);
    header.store(0);
  }
  bool wait(rt::time_point deadline) {
    require(header.load() == asked, "the header stays as it was");
    if (word.wait_until(deadline) != slot_holder::submitter) return false;
    read();
    return true;
  }
  // The service thread's whole part: nothing is waited for.
  void complete_one() {
    const auto request = in_end.try_pop();
    if (!request) return;
    require(text.load() == *request, "the service thread reads what is asked");
    text.store(*request + answer);
    if (word.complete() == slot_holder::submitter) return;
    use_for_something_else();
    require(return_end.try_push(*request), "there is a place for every slot");
  }
  void take_returned() {
    while (returned_end.try_pop()) {
      require(text.load() == 0, "who gives the slot back had it alone");
      ++came_back;
    }
  }
  // The submitter does this, and the service thread its part beside it.
  std::array<actor, 2> beside_the_service(std::function<void()> act) {
    return {{{"submitter", std::move(act)}, {"service", [this] { complete_one(); }}}};
  }
  void afterwards() {
    complete_one();
    take_returned();
    require(came_back == asked, "every slot comes back, once for each request");
  }
};

// The service thread has an eventfd of its own, so that a wait without a deadline must end.
struct waits_for_ever : one_slot {
  event_fd asked_for;
  std::array<actor, 2> actors() {
    return {{{"submitter",
              [this] {
                ask(true);
                asked_for.signal();
                require(wait(rt::never), "without a deadline a wait ends only with the completion");
              }},
             {"service", [this] {
                asked_for.wait();
                complete_one();
              }}}};
  }
};

struct runs_out_of_time : one_slot {
  std::array<actor, 2> actors() {
    return beside_the_service([this] {
      ask(true);
      (void)wait(soon);
    });
  }
};

struct leaves_without_waiting : one_slot {
  std::array<actor, 2> actors() {
    return beside_the_service([this] {
      ask(true);
      require(header.load() == asked, "the header stays as it was");
      if (word.abandon() == slot_holder::submitter) read();
    });
  }
};

struct asks_without_waiting : one_slot {
  std::array<actor, 2> actors() {
    return beside_the_service([this] {
      ask(false);
      take_returned();
    });
  }
};

// The slot is used again at once, whoever brought it back: a wake of the first use may come in the second.
struct asks_again : one_slot {
  event_fd once;
  event_fd again;
  std::array<actor, 2> actors() {
    return {{{"submitter",
              [this] {
                ask(true);
                once.signal();
                if (!wait(soon)) take_returned();
                if (came_back == 0) return again.signal(); // still on its way
                ask(true);
                again.signal();
                require(wait(rt::never), "the second wait is not confused by the first");
              }},
             {"service", [this] {
                once.wait();
                complete_one();
                again.wait();
                complete_one();
              }}}};
  }
};

TEST(completion, wakes_whoever_waits_for_it) { expect_passes_in_every_interleaving<waits_for_ever>(); }

TEST(completion, leaves_the_slot_to_exactly_one_side_when_time_runs_out) {
  expect_passes_in_every_interleaving<runs_out_of_time>();
}

TEST(completion, leaves_the_slot_to_exactly_one_side_when_the_submitter_leaves_at_once) {
  expect_passes_in_every_interleaving<leaves_without_waiting>();
}

TEST(completion, leaves_the_slot_to_the_service_thread_when_nobody_waits) {
  expect_passes_in_every_interleaving<asks_without_waiting>();
}

TEST(completion, is_not_confused_when_its_slot_is_used_again) { expect_passes<asks_again>(); }

TEST(completion, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{
      scenario<waits_for_ever>("waits_for_ever"), scenario<runs_out_of_time>("runs_out_of_time"),
      scenario<leaves_without_waiting>("leaves_without_waiting"),
      scenario<asks_without_waiting>("asks_without_waiting"), scenario<asks_again>("asks_again")};
  EXPECT_EQ((mutation_test{"service/threads/completion.hpp", scenarios, {}}.findings()), "");
}

} // namespace
} // namespace completion_test
} // namespace rowe::model
