// SPDX-License-Identifier: Apache-2.0
// Queue pairs whose handle is gone while views or requests of it are left: their memory is nobody else's
// until the last slot is released.
#include "service/handles/pair_release.hpp"

#include "service/core/core_fixtures.hpp"

#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/responder.hpp>

#include <optional>

namespace pair_release_test {
namespace {

using namespace harness;
using rowe::json_text;
using rowe::detail::pair_phase;

struct outliving : core_test {
  // As the handle's destructor does.
  void close(rowe::detail::queue_pair& one) {
    one.lifecycle.close();
    on.cycle();
  }
  rowe::detail::queue_pair& subscribe() {
    rowe::detail::queue_pair& one =
        on.offer_now(rowe::detail::pair_kind::subscribe_text, "/heard", 100, {.depth = 4});
    return one;
  }
  void publish(int count) {
    for (int i = 0; i < count; ++i) other.say(R"({"op":"publish","topic":"/heard","msg":{"n":1}})");
    on.cycle();
  }

  peer other{on};
};

TEST_F(outliving, lane_is_free_at_once_when_nobody_looks_at_its_slots) {
  rowe::detail::queue_pair& one = subscribe();
  publish(3); // two of which nobody takes
  {
    rowe::subscriber<json_text> handle{core_harness::handle_of(one)};
    EXPECT_TRUE(handle.try_take());
  }
  close(one);
  EXPECT_EQ(one.lifecycle.look(), pair_phase::free);
}

TEST_F(outliving, view_keeps_the_lane_until_it_is_gone) {
  rowe::detail::queue_pair& one = subscribe();
  publish(3);
  std::optional<rowe::subscriber<json_text>> handle{core_harness::handle_of(one)};
  auto first = std::optional{handle->try_take()};
  auto second = std::optional{handle->try_take()};
  handle.reset();
  close(one);
  on.cycles(10);
  EXPECT_EQ(one.lifecycle.look(), pair_phase::held);
  EXPECT_EQ((*first)->value(), R"({"n":1})");
  publish(1); // no longer for it
  EXPECT_EQ(on.count(counter::no_peer), 1U);
  first.reset();
  on.cycle();
  EXPECT_EQ(one.lifecycle.look(), pair_phase::held);
  second.reset();
  on.cycle();
  EXPECT_EQ(one.lifecycle.look(), pair_phase::free);
}

TEST_F(outliving, lane_that_is_held_is_counted_once) {
  rowe::detail::queue_pair& one = subscribe();
  publish(1);
  std::optional<rowe::subscriber<json_text>> handle{core_harness::handle_of(one)};
  const auto view = handle->try_take();
  one.refused_full.add(3);
  handle.reset();
  close(one);
  EXPECT_EQ(on.count(counter::full), 3U);
}

TEST_F(outliving, reply_keeps_the_lane_and_ends_that_were_parked_do_not) {
  rowe::detail::queue_pair& one = on.offer_now(
      rowe::detail::talk_request({.depth = 4, .inbox_depth = 4, .calls = 4, .text_bytes_max = 200}));
  std::optional<rowe::lane> handle{core_harness::handle_of(one)};
  ASSERT_TRUE(handle->start(R"({"service":"/rosapi/topics"})", 1s, on.now));
  ASSERT_TRUE(handle->start(R"({"service":"/rosapi/topics"})", 1s, on.now));
  on.cycle();
  auto end = std::optional{handle->try_finish()};
  ASSERT_TRUE(*end);
  EXPECT_EQ(rowe::detail::take_completion_of(one, {}), std::nullopt); // parks the other one
  handle.reset();
  close(one);
  EXPECT_EQ(one.lifecycle.look(), pair_phase::held);
  end.reset();
  on.cycle();
  EXPECT_EQ(one.lifecycle.look(), pair_phase::free);
}

TEST_F(outliving, request_keeps_the_lane_until_it_is_gone) {
  rowe::detail::queue_pair& one =
      on.offer_now(rowe::detail::serve_request<json_text, json_text>("/do", {.depth = 4}));
  other.tell(R"({"op":"call_service","service":"/do"})");
  std::optional<rowe::responder<json_text, json_text>> handle{core_harness::handle_of(one)};
  auto asked = std::optional{handle->try_next(on.now)};
  ASSERT_TRUE(*asked);
  EXPECT_EQ(handle->try_next(on.now).code(), rowe::errc::empty); // a slot for an answer is parked
  handle.reset();
  close(one);
  EXPECT_EQ(one.lifecycle.look(), pair_phase::held);
  asked.reset(); // refuses the call, which has ended
  on.cycle();
  EXPECT_EQ(one.lifecycle.look(), pair_phase::free);
}

} // namespace
} // namespace pair_release_test
