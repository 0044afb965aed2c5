// SPDX-License-Identifier: Apache-2.0
#include "service/kept_ids.hpp"

#include <gtest/gtest.h>

#include <string>

namespace kept_ids_test {
namespace {

using rowe::service::call_id_bytes_max;
using rowe::service::kept_id;
using rowe::service::peer_index;

rowe::limits few() {
  return {
      .connections_max = 4,
      .subscriptions_max = 256 // 128 blocks of 28 bytes, 16 of them the claim of each peer
  };
}

struct kept_ids_test : testing::Test {
  rowe::limits bounds = few();
  rowe::rt::arena memory{rowe::service::kept_ids::footprint_bytes(bounds), rowe::rt::page_lock::none};
  rowe::service::kept_ids ids{memory, bounds, bounds.connections_max};

  std::string read(const kept_id& what) {
    std::array<char, call_id_bytes_max> buffer{};
    return std::string{ids.read(what, buffer)};
  }
  void TearDown() override { EXPECT_TRUE(ids.check()); }
};

TEST_F(kept_ids_test, are_read_as_they_were_written) {
  kept_id one;
  EXPECT_EQ(read(one), "");
  for (const std::size_t bytes : {0U, 1U, 27U, 28U, 29U, 56U, 57U, 252U, 256U}) {
    std::string id(bytes, 'x');
    for (std::size_t i = 0; i < bytes; ++i) id[i] = static_cast<char>('a' + i % 26);
    ids.keep(one, peer_index{0}, id);
    EXPECT_EQ(read(one), id);
    EXPECT_EQ(ids.in_use(), (bytes + 27) / 28) << "the one before was given back";
  }
  ids.keep(one, peer_index{0}, std::string(257, 'x'));
  EXPECT_EQ(read(one), "") << "no request has so long a one";
  EXPECT_EQ(ids.in_use(), 0U);
}

TEST_F(kept_ids_test, of_one_peer_leave_others_their_share) {
  std::array<kept_id, 120> many;
  std::uint32_t kept = 0;
  for (kept_id& one : many) {
    ids.keep(one, peer_index{0}, "an id");
    kept += read(one) == "an id";
  }
  EXPECT_EQ(kept, ids.in_use());
  EXPECT_GE(kept, 32U);
  EXPECT_LE(kept, 128U - 3 * 16);
  for (std::uint32_t peer = 1; peer < 4; ++peer) {
    kept_id one;
    ids.keep(one, peer_index{peer}, std::string(100, 'x'));
    EXPECT_EQ(read(one), std::string(100, 'x'));
    ids.drop(one, peer_index{peer});
  }
  for (kept_id& one : many) ids.drop(one, peer_index{0});
  EXPECT_EQ(ids.in_use(), 0U);
}

} // namespace
} // namespace kept_ids_test
