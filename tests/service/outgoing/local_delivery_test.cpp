// SPDX-License-Identifier: Apache-2.0
#include "service/outgoing/local_delivery.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <string>

#include <rowe/schema.hpp>

#include "service/state/state_fixture.hpp"
#include "json/padded.hpp"

namespace local_delivery_test {

struct point {
  double x, y;
};

} // namespace local_delivery_test
template <>
inline constexpr auto rowe::schema<local_delivery_test::point> =
    rowe::fields<&local_delivery_test::point::x, &local_delivery_test::point::y>{};

namespace local_delivery_test {
namespace {

using namespace std::chrono_literals;
using rowe::errc;
using rowe::detail::pair_kind;
using rowe::detail::queue_pair;
using rowe::service::call_endpoint;
using rowe::service::counter;
using rowe::service::pair_index;
using ::state_fixture::taken;

struct local_delivery_test : state_fixture::state_fixture {
  local_delivery_test() : state_fixture{rowe::endpoint_options{}} {}

  rowe::service::local_delivery delivery{state};
  std::optional<rowe::tests::padded> body; // of the last delivery: `why` refers to it
  rowe::json::decoder::diagnosis why;

  // A handle that is attached.
  pair_index attach(const rowe::detail::pair_request& asked) {
    const pair_index at = offer(asked);
    state.pairs[at].lifecycle.accept(state.pairs[at].arrival);
    state.pair_rows[at].attached = true;
    ++state.pair_rows[at].generation;
    return at;
  }
  pair_index subscribe(std::uint32_t depth = 1) {
    return attach({.kind = pair_kind::subscribe_text, .name = "/t", .in_depth = depth, .in_bytes = 64});
  }
  pair_index subscribe_points() {
    return attach({.kind = pair_kind::subscribe_value,
                   .name = "/t",
                   .in_depth = 1,
                   .in_bytes = sizeof(point),
                   .decoded = &rowe::describe<point>()});
  }
  pair_index call() {
    return attach({.kind = pair_kind::call_text,
                   .name = "/add",
                   .out_depth = 4,
                   .completions_depth = 4,
                   .out_bytes = 64,
                   .completions_bytes = 64});
  }
  rowe::status deliver(pair_index to, std::string_view text) {
    body.emplace(text);
    return delivery.deliver(to, {.stamped_ns = 7}, body->text(), why);
  }
  call_endpoint of(pair_index at) { return call_endpoint::of(at, state.pair_rows[at].generation); }
  queue_pair& pair(pair_index at) { return state.pairs[at]; }
  std::string next(pair_index at) { return taken(state.pairs[at].user.in); }
};

TEST_F(local_delivery_test, takes_no_slot_for_what_is_too_big) {
  const pair_index to = subscribe();
  const rowe::status done = deliver(to, std::string(65, 'x'));
  ASSERT_EQ(done.code(), errc::too_big);
  EXPECT_EQ(done.error().value, 65);
  EXPECT_EQ(done.error().limit, 64);
  EXPECT_TRUE(deliver(to, std::string(64, 'x')));
  EXPECT_EQ(next(to).size(), 64U);
}

TEST_F(local_delivery_test, takes_no_slot_for_what_cannot_be_decoded) {
  const pair_index to = subscribe_points();
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(deliver(to, R"({"x":"text","y":2})"));
    std::array<char, rowe::json::decoder::diagnosis::text_bytes_max> buffer;
    EXPECT_NE(why.text(buffer).find("x"), std::string_view::npos);
    EXPECT_EQ(next(to), "");
  }
  EXPECT_TRUE(deliver(to, R"({"x":1,"y":2})"));
  EXPECT_EQ(deliver(to, R"({"x":3,"y":4})").code(), errc::full);
  const std::string value = next(to);
  point got{};
  ASSERT_EQ(value.size(), sizeof got);
  std::memcpy(&got, value.data(), sizeof got);
  EXPECT_EQ(got.x, 1);
  EXPECT_EQ(got.y, 2);
  EXPECT_TRUE(deliver(to, R"({"x":3,"y":4})"));
}

TEST_F(local_delivery_test, fails_a_call_whose_reply_is_too_long_for_its_handle) {
  const pair_index by = call();
  delivery.complete(of(by), {1, 1}, {}, std::string(65, 'x'));
  auto& ends = pair(by).user.completions;
  const auto slot = ends.ring->try_pop();
  ASSERT_TRUE(slot);
  EXPECT_EQ(ends.memory.header(*slot)->outcome, errc::too_big);
  EXPECT_EQ(ends.memory.header(*slot)->outcome_value, 65);
  EXPECT_EQ(ends.memory.header(*slot)->outcome_limit, 64);
  EXPECT_EQ(ends.memory.header(*slot)->bytes, 0U);
  EXPECT_EQ(counts.read(counter::too_big), 1U);
}

TEST_F(local_delivery_test, tells_a_thread_by_its_slot) {
  const auto slot = submissions.submit({.wants_outcome = true}, "{}");
  ASSERT_TRUE(slot);
  (void)submissions.take([](std::uint32_t) {}, 1);
  delivery.complete({.who = call_endpoint::kind::thread, .index = *slot}, {}, errc::peer_lost);
  EXPECT_TRUE(submissions.wait(*slot, rowe::rt::never));
  EXPECT_EQ(submissions.outcome(*slot).code(), errc::peer_lost);
  submissions.release(*slot);
  EXPECT_TRUE(submissions.all_free());
}

struct shares : local_delivery_test {
  std::size_t send(pair_index to, std::uint32_t peer, std::size_t count) {
    std::size_t delivered = 0;
    for (std::size_t i = 0; i < count; ++i) {
      body.emplace("{}");
      const rowe::detail::peer_ref from{peer, peer == 9 ? 0U : 1U};
      delivered += delivery.may_deliver(to, from) && delivery.deliver(to, {.peer = from}, body->text(), why);
    }
    return delivered;
  }
};

TEST_F(shares, of_an_inbox_leave_room_for_other_peers) {
  const pair_index inbox = subscribe(16), small = subscribe(4), two = subscribe(2), one = subscribe(1);
  state.peers.add();
  EXPECT_EQ(send(inbox, 0, 100), 16U) << "where it is alone, all is its";
  while (state.pairs[inbox].user.in.ring->try_pop()) {
  }
  state.peers.add();
  const pair_index again = subscribe(16);
  EXPECT_EQ(send(again, 0, 100), 12U);
  EXPECT_EQ(send(again, 1, 100), 3U);
  EXPECT_EQ(send(again, 2, 100), 1U) << "each finds a place";
  EXPECT_EQ(send(small, 0, 100), 3U);
  EXPECT_EQ(send(small, 1, 100), 1U);
  EXPECT_EQ(send(two, 0, 100), 1U);
  EXPECT_EQ(send(two, 1, 100), 1U);
  EXPECT_EQ(send(one, 0, 100), 1U);
  const pair_index own = subscribe(16);
  EXPECT_EQ(send(own, 9, 100), 16U) << "this process has no share";
}

} // namespace
} // namespace local_delivery_test
