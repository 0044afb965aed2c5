// SPDX-License-Identifier: Apache-2.0
#include "service/handles/thread_submissions.hpp"

#include <gtest/gtest.h>

#include <string>

#include "service/core/all_parts.hpp"

namespace thread_submissions_test {
namespace {

using namespace all_parts;

struct thread_submissions_test : all_parts::all_parts {
  thread_submissions_test()
      : all_parts{::state_fixture::with(
            {.connections_max = 3,
             .door_slots = 8, // threads receive, so all may be parked; four for a lone peer
             .handles_max = 1})} {}

  rowe::service::thread_submissions& submitted = parts.thread_submissions_;

  rowe::result<std::uint32_t> submit(std::string_view text, rowe::detail::peer_ref to) {
    rowe::service::submission_header asked;
    asked.what = rowe::detail::entry::message;
    asked.peer = to;
    asked.stamped = cycle.now;
    asked.expires = rowe::rt::never;
    return submissions.submit(asked, text);
  }
  // Until one message to the peer is parked.
  void fill(const connection& to) {
    for (int i = 0; i < 1000 && !submitted.waits(); ++i) {
      ASSERT_TRUE(submit("{\"n\":0}", ref(to)));
      submitted.take();
    }
    ASSERT_TRUE(submitted.waits());
  }
};

TEST_F(thread_submissions_test, keep_their_order_while_they_are_parked) {
  connection& slow = connect();
  block(slow);
  fill(slow);
  for (const std::string_view text : {"{\"n\":1}", "{\"n\":2}"}) ASSERT_TRUE(submit(text, ref(slow)));
  submitted.take();
  EXPECT_EQ(submissions.incomplete(), 3U);
  EXPECT_FALSE(submitted.drained());
  const auto freed = cycle.places_freed;
  unblock(slow);
  std::string all = hear(slow);
  submitted.take();
  EXPECT_FALSE(submitted.waits());
  EXPECT_EQ(cycle.places_freed, freed + 3);
  all += hear(slow);
  EXPECT_LT(all.rfind("{\"n\":0}"), all.find("{\"n\":1}"));
  EXPECT_LT(all.find("{\"n\":1}"), all.find("{\"n\":2}"));
  EXPECT_NE(all.find("{\"n\":2}"), all.npos);
  EXPECT_TRUE(submissions.all_free());
}

} // namespace
} // namespace thread_submissions_test
