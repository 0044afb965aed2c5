// SPDX-License-Identifier: Apache-2.0
#include <rowe/rt/slab.hpp>

#include <array>
#include <cstring>

#include <gtest/gtest.h>

namespace slab_test {
namespace {

using rowe::rt::headroom_bytes;
using rowe::rt::line_bytes;
using rowe::rt::slab;
using rowe::rt::tailroom_bytes;

constexpr std::uint32_t slots = 5;
constexpr std::size_t payload_bytes = 300;

struct rig {
  alignas(line_bytes) std::array<std::byte, slab::bytes_for(slots, payload_bytes)> region{};
  slab cells{region, slots, payload_bytes};
};

TEST(slab, sets_its_slots_whole_lines_apart) {
  static_assert(slab::stride_for(0) == line_bytes);
  static_assert(slab::stride_for(line_bytes - headroom_bytes - tailroom_bytes) == line_bytes);
  static_assert(slab::stride_for(line_bytes - headroom_bytes - tailroom_bytes + 1) == 2 * line_bytes);
  rig r;
  for (std::uint32_t n = 1; n < slots; ++n)
    EXPECT_EQ(r.cells.slot(n).data() - r.cells.slot(n - 1).data(),
              static_cast<std::ptrdiff_t>(slab::stride_for(payload_bytes)));
}

TEST(slab, leaves_headroom_and_tailroom_in_the_region) {
  rig r;
  EXPECT_EQ(r.cells.slot(0).data() - r.region.data(), static_cast<std::ptrdiff_t>(headroom_bytes));
  const std::byte* const end = r.cells.slot(slots - 1).data() + payload_bytes + tailroom_bytes;
  EXPECT_LE(end, r.region.data() + r.region.size());
}

TEST(slab, aligns_payloads) {
  rig r;
  for (std::uint32_t n = 0; n < slots; ++n)
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(r.cells.slot(n).data()) % rowe::rt::payload_alignment, 0U);
}

TEST(slab, keeps_the_payloads_of_its_slots_apart) {
  rig r;
  for (std::uint32_t n = 0; n < slots; ++n)
    std::memset(r.cells.slot(n).data() - headroom_bytes, static_cast<int>(n + 1),
                headroom_bytes + payload_bytes);
  for (std::uint32_t n = 0; n < slots; ++n)
    for (const std::byte b : r.cells.slot(n)) ASSERT_EQ(b, static_cast<std::byte>(n + 1));
  EXPECT_EQ(r.cells.check(), nullptr);
}

TEST(slab, names_a_write_behind_a_payload) {
  rig r;
  ASSERT_EQ(r.cells.check(), nullptr);
  r.region[2 * slab::stride_for(payload_bytes) + headroom_bytes + payload_bytes] = std::byte{1};
  EXPECT_STREQ(r.cells.check(), "nothing was written behind a payload");
}

} // namespace
} // namespace slab_test
