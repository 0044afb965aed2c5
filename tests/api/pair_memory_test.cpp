// SPDX-License-Identifier: Apache-2.0
#include "api/pair_memory.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <optional>

#include <rowe/ros.hpp>
#include <rowe/rt/slab.hpp>

#include "handle_harness.hpp"

namespace {
struct speed {
  double ahead = 0;
};
} // namespace
template <>
inline constexpr auto rowe::schema<speed> = rowe::fields<&speed::ahead>{};

namespace rowe::detail {
namespace pair_memory_test {
namespace {

using handle_harness::pair_harness;

bool fills_in(const pair_request& asked) { return asked.fill_missing; }

TEST(subscribe_request, fills_in_what_a_message_of_a_type_of_ros_leaves_out_unless_told_otherwise) {
  EXPECT_TRUE(fills_in(subscribe_request<ros::twist>("/cmd_vel", {})));
  EXPECT_TRUE(fills_in(subscribe_request<ros2::odometry>("/odom", {})));
  EXPECT_FALSE(fills_in(subscribe_request<ros::twist>("/cmd_vel", {.fill_missing = false})));
  EXPECT_FALSE(fills_in(subscribe_request<speed>("/speed", {})));
  EXPECT_TRUE(fills_in(subscribe_request<speed>("/speed", {.fill_missing = true})));
  EXPECT_TRUE(fills_in(subscribe_request<speed>("/speed", {.type = "std_msgs/Float64"})));
  EXPECT_FALSE(fills_in(subscribe_request<ros::twist>("/cmd_vel", {.type = "my_robot/Twist"})));
}

TEST(is_ros_type, knows_packages_and_not_what_begins_like_them) {
  for (const char* const one :
       {"std_msgs/String", "sensor_msgs/msg/LaserScan", "builtin_interfaces/msg/Time"})
    EXPECT_TRUE(is_ros_type(one)) << one;
  for (const char* const one : {"", "std_msgs", "std_msgs_too/String", "my_msgs/String", "/std_msgs/String"})
    EXPECT_FALSE(is_ros_type(one)) << one;
}

// A queue in memory of exactly the size that is planned for it.
class end {
 public:
  explicit end(std::uint32_t depth)
      : bytes_{queue_bytes(keep::all, depth, sizeof(double))},
        memory_{static_cast<std::byte*>(::operator new(bytes_, alignment))} {
    build_queue({memory_, bytes_}, keep::all, depth, sizeof(double), fills, empties);
  }
  end(const end&) = delete;
  end& operator=(const end&) = delete;
  ~end() { ::operator delete(memory_, alignment); }

  // Sends one slot; false when none is free. As publish_into().
  bool send() {
    const std::optional<std::uint32_t> slot = fills.free_ring->try_take();
    if (!slot) return false;
    EXPECT_TRUE(fills.ring->try_push(*slot)) << "no place for a slot that is free";
    return true;
  }

  producer_end fills;
  consumer_end empties;

 private:
  static constexpr std::align_val_t alignment{rt::line_bytes};
  std::size_t bytes_;
  std::byte* memory_;
};

TEST(pair_memory, has_room_for_exactly_the_slots_that_were_asked_for) {
  for (const std::uint32_t depth : {1U, 2U, 3U, 64U, 100U, 256U}) {
    end pair{depth};
    for (std::uint32_t i = 0; i < depth; ++i) EXPECT_TRUE(pair.send());
    EXPECT_FALSE(pair.send());
  }
}

// Slots are released one by one, places are given back at the end of a batch; the user thread may run at any
// time between.
TEST(pair_memory, has_a_place_for_each_slot_that_is_sent_again_before_the_batch_ends) {
  for (const std::uint32_t depth : {1U, 2U, 3U, 64U, 100U, 256U}) {
    end pair{depth};
    while (pair.send()) {
    }
    for (int batch = 0; batch < 5; ++batch) {
      std::uint32_t sent_again = 0;
      pair.empties.ring->drain(
          [&](std::uint32_t slot) {
            pair.empties.free_ring->release(slot);
            sent_again += pair.send() ? 1U : 0U;
          },
          SIZE_MAX);
      EXPECT_EQ(sent_again, depth);
    }
  }
}

std::uint32_t slots_of(const producer_end& end) {
  std::uint32_t count = 0;
  while (end.free_ring != nullptr && end.free_ring->try_take()) ++count;
  return count;
}

TEST(pair_memory, has_the_queues_that_each_kind_of_handle_needs) {
  for (const std::uint32_t depth : {1U, 3U, 64U}) {
    pair_harness said{advertise_request<json_text>("/a", {.depth = depth})};
    EXPECT_EQ(slots_of(said->user.out), depth);
    EXPECT_EQ(said->user.in.ring, nullptr);
    pair_harness heard{subscribe_request<json_text>("/a", {.keep = keep::newest, .depth = depth})};
    EXPECT_EQ(slots_of(heard->service.in), depth); // texts are kept all
    EXPECT_EQ(heard->user.out.ring, nullptr);
    pair_harness serves{serve_request<json_text, json_text>("/a", {.depth = depth})};
    EXPECT_EQ(slots_of(serves->user.out), 2 * depth);
    EXPECT_EQ(slots_of(serves->service.in), depth);
    EXPECT_EQ(serves->user.spare_replies.places.size(), 2 * depth);
    pair_harness calls{client_request<json_text, json_text>("/a", {.depth = depth})};
    EXPECT_EQ(slots_of(calls->user.out), depth);
    EXPECT_EQ(slots_of(calls->service.completions), depth);
    EXPECT_EQ(calls->user.calls.size(), depth);
    pair_harness talks{talk_request({.depth = depth, .inbox_depth = 2 * depth, .calls = 5})};
    EXPECT_EQ(slots_of(talks->user.out), depth);
    EXPECT_EQ(slots_of(talks->service.in), 2 * depth);
    EXPECT_EQ(slots_of(talks->service.completions), 5U);
    EXPECT_EQ(talks->user.parked_completions.places.size(), 5U);
  }
}

TEST(pair_memory, holds_a_value_of_full_size_in_every_slot_and_what_is_read_behind_it) {
  pair_harness talks{talk_request({.depth = 3, .inbox_depth = 3, .calls = 3, .text_bytes_max = 1000})};
  for (const producer_end* end : {&talks->user.out, &talks->service.in, &talks->service.completions}) {
    for (std::uint32_t slot = 0; slot < end->count; ++slot) {
      *end->memory.header(slot) = {};
      std::memset(end->memory.value(slot), 0xff, 1000 + rt::tailroom_bytes);
    }
  }
  EXPECT_EQ(talks->user.completions.memory.header(2)->bytes, 0U); // nobody wrote over it
}

} // namespace
} // namespace pair_memory_test
} // namespace rowe::detail
