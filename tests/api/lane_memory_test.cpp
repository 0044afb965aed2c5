// SPDX-License-Identifier: Apache-2.0
#include "api/lane_memory.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <new>
#include <optional>

namespace rowe::detail {
namespace {

// A path in memory of exactly the size that is planned for it.
class path {
 public:
  explicit path(std::uint32_t depth)
      : bytes_{path_bytes(keep::all, depth, sizeof(double))},
        memory_{static_cast<std::byte*>(::operator new(bytes_, alignment))} {
    build_path({memory_, bytes_}, keep::all, depth, sizeof(double), fills, empties);
  }
  path(const path&) = delete;
  path& operator=(const path&) = delete;
  ~path() { ::operator delete(memory_, alignment); }

  // Sends one slot; false when none is free. As publish_into().
  bool send() {
    const std::optional<std::uint32_t> slot = fills.home->try_take();
    if (!slot) return false;
    EXPECT_TRUE(fills.out->try_push(*slot)) << "no place for a slot that is free";
    return true;
  }

  filling_end fills;
  emptying_end empties;

 private:
  static constexpr std::align_val_t alignment{rt::line_bytes};
  std::size_t bytes_;
  std::byte* memory_;
};

TEST(lane_memory, has_room_for_exactly_the_slots_that_were_asked_for) {
  for (const std::uint32_t depth : {1U, 2U, 3U, 64U, 100U, 256U}) {
    path lane{depth};
    for (std::uint32_t i = 0; i < depth; ++i) EXPECT_TRUE(lane.send());
    EXPECT_FALSE(lane.send());
  }
}

// Slots go home one by one, places are given back at the end of a batch; the user thread may run at any time
// between.
TEST(lane_memory, has_a_place_for_each_slot_that_is_sent_again_before_the_batch_ends) {
  for (const std::uint32_t depth : {1U, 2U, 3U, 64U, 100U, 256U}) {
    path lane{depth};
    while (lane.send()) {
    }
    for (int batch = 0; batch < 5; ++batch) {
      std::uint32_t sent_again = 0;
      lane.empties.out->drain(
          [&](std::uint32_t slot) {
            lane.empties.home->give(slot);
            sent_again += lane.send() ? 1U : 0U;
          },
          SIZE_MAX);
      EXPECT_EQ(sent_again, depth);
    }
  }
}

} // namespace
} // namespace rowe::detail
