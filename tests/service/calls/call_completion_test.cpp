// SPDX-License-Identifier: Apache-2.0
#include "service/calls/call_completion.hpp"

#include <gtest/gtest.h>

#include "service/calls/call_parts.hpp"
#include "json/padded.hpp"

namespace call_completion_test {
namespace {

using namespace call_parts;
using rowe::errc;
using rowe::service::timer;

struct call_completion_test : call_parts::call_parts {
  const rowe::tests::padded nothing{"{}"};

  // A call of `from`, which `by` is to answer.
  rowe::service::call_index ask(const connection& from, const call_endpoint& by,
                                rowe::rt::time_point until = rowe::rt::never) {
    const auto index = completion.open(of(from), "\"1\"", "/add", until);
    if (index) calls.at(index).callee = by;
    return index;
  }
  static call_endpoint of(const connection& c) { return call_endpoint::of(c.id, c.protocol->first.id()); }
  static constexpr call_endpoint handle{.who = call_endpoint::kind::pair, .index = 0, .generation = 1};

  call_completion_test() { state.pair_rows[{0}] = {.attached = true, .generation = 1}; }
};

TEST_F(call_completion_test, puts_the_others_there_at_the_end_of_their_cycle) {
  connection& caller = join(0);
  const auto index = ask(caller, handle, cycle.now + 1s);
  EXPECT_EQ(due.next_wake(), rowe::rt::never);
  completion.arm_open();
  cycle.now += 2s;
  const auto late = due.take_due(cycle.now);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->what, timer::call);
  EXPECT_EQ(late->index, index.value);
  completion.time_out(index);
  EXPECT_EQ(counts.read(counter::calls_timed_out), 1U);
  ASSERT_EQ(told(caller).size(), 1U);
  EXPECT_NE(told(caller)[0].find("did not answer in time"), std::string::npos);
}

TEST_F(call_completion_test, lets_a_call_without_any_time_end_in_its_cycle) {
  ask(join(0), handle, cycle.now);
  const auto late = due.take_due(cycle.now + rowe::rt::timer_wheel::tick);
  ASSERT_TRUE(late); // nobody called arm_open()
  completion.time_out({late->index});
}

TEST_F(call_completion_test, keeps_a_call_whose_reply_finds_no_room_for_who_tries_again) {
  connection& caller = join(0);
  const auto index = ask(caller, handle);
  fill(caller);
  const call_endpoint thread{.who = call_endpoint::kind::thread, .index = 0};
  const auto refused_now =
      completion.answer(handle, calls.ref(index), {.text = nothing.text(), .waits = thread});
  EXPECT_EQ(refused_now.code(), errc::full);
  EXPECT_EQ(calls.in_flight(), 1U);
  EXPECT_EQ(completion.answer(handle, calls.ref(index), {.text = nothing.text()}).code(), errc::full);
  EXPECT_EQ(calls.in_flight(), 0U); // nobody was to try again
}

TEST_F(call_completion_test, takes_answers_only_of_the_one_that_was_asked) {
  connection& caller = join(0);
  connection& asked = join(1);
  const auto index = ask(caller, of(asked));
  const auto which = calls.ref(index);
  EXPECT_EQ(completion.answer(handle, which, {.text = nothing.text()}).code(), errc::peer_lost);
  EXPECT_EQ(completion.refuse({.who = call_endpoint::kind::thread}, which, "no").code(), errc::peer_lost);
  EXPECT_EQ(counts.read(counter::replies_unsent), 2U);
  std::array<char, rowe::service::call_table::our_id_bytes_max> buffer;
  const std::string id = '"' + std::string{calls.write_id(buffer, index, 1)} + '"';
  rowe::wire::request said;
  said.id_raw = id;
  completion.take_reply(caller, said);
  EXPECT_EQ(counts.read(counter::replies_foreign), 1U);
  completion.take_reply(asked, said);
  EXPECT_EQ(calls.in_flight(), 0U);
  completion.take_reply(asked, said);
  EXPECT_EQ(counts.read(counter::replies_late), 1U);
  EXPECT_EQ(told(caller).size(), 1U);
}

TEST_F(call_completion_test, fails_what_a_handle_was_to_answer_that_is_gone) {
  connection& caller = join(0);
  ask(caller, handle);
  completion.forget_pair({0});
  ASSERT_EQ(told(caller).size(), 1U);
  EXPECT_NE(told(caller)[0].find("/add"), std::string::npos); // there is no such service
}

} // namespace
} // namespace call_completion_test
