// SPDX-License-Identifier: Apache-2.0
#include "service/topics/stored_ids.hpp"

#include <gtest/gtest.h>

#include <string>

namespace stored_ids_test {
namespace {

using rowe::service::call_id_bytes_max;
using rowe::service::peer_index;
using rowe::service::stored_id;

struct stored_ids_test : testing::Test {
  rowe::limits bounds{
      .connections_max = 4,
      .subscriptions_max = 256 // 128 blocks of 28 bytes, 16 of them the claim of each peer
  };
  rowe::rt::arena memory{rowe::service::stored_ids::footprint_bytes(bounds), rowe::rt::page_lock::none};
  rowe::service::stored_ids ids{memory, bounds, bounds.connections_max};

  std::string read(const stored_id& what) {
    std::array<char, call_id_bytes_max> buffer{};
    return std::string{ids.read(what, buffer)};
  }
  void TearDown() override { EXPECT_TRUE(ids.check()); }
};

TEST_F(stored_ids_test, are_read_as_they_were_written) {
  stored_id one;
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

} // namespace
} // namespace stored_ids_test
