// SPDX-License-Identifier: Apache-2.0
#include "mcap/compression.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace compression_test {
namespace {

using rowe::mcap::compression;
using rowe::mcap::compressor;
using rowe::mcap::decompressor;

std::string text_of(std::size_t bytes, bool random) {
  std::string made;
  std::mt19937 numbers{7};
  while (made.size() < bytes) made += random ? static_cast<char>(numbers()) : "abcdefgh"[made.size() % 8];
  return made;
}

struct compressed : testing::TestWithParam<compression> {};

TEST_P(compressed, gives_back_what_it_was_given) {
  compressor packs{GetParam()};
  decompressor unpacks;
  for (const std::size_t bytes : {0UL, 1UL, 100UL, 70'000UL, (1UL << 20) - 1, 1UL << 20, 3'000'001UL}) {
    for (const bool random : {false, true}) {
      const std::string plain = text_of(bytes, random);
      std::string packed = "before";
      packs.append(packed, plain);
      ASSERT_TRUE(packed.starts_with("before"));
      std::string back;
      EXPECT_TRUE(unpacks.unpack(GetParam(), std::string_view{packed}.substr(6), bytes, back)) << bytes;
      EXPECT_EQ(back, plain);
    }
  }
}

TEST_P(compressed, refuses_what_is_longer_shorter_or_damaged) {
  compressor packs{GetParam()};
  decompressor unpacks;
  const std::string plain = text_of(200'000, true);
  std::string packed, back;
  packs.append(packed, plain);
  EXPECT_FALSE(unpacks.unpack(GetParam(), packed, plain.size() - 1, back));
  EXPECT_FALSE(unpacks.unpack(GetParam(), packed, plain.size() + 1, back));
  EXPECT_FALSE(
      unpacks.unpack(GetParam(), std::string_view{packed}.substr(0, packed.size() - 1), plain.size(), back));
  EXPECT_FALSE(unpacks.unpack(GetParam(), packed + "x", plain.size(), back));
  if (GetParam() == compression::none) return;
  packed[1] = static_cast<char>(packed[1] ^ 0x55);
  EXPECT_FALSE(unpacks.unpack(GetParam(), packed, plain.size(), back));
  EXPECT_FALSE(unpacks.unpack(GetParam(), "", 1, back));
  // It still works after that.
  packed.clear();
  packs.append(packed, plain);
  EXPECT_TRUE(unpacks.unpack(GetParam(), packed, plain.size(), back));
}

TEST_P(compressed, takes_no_memory_for_a_length_that_is_a_lie) {
  compressor packs{GetParam()};
  decompressor unpacks;
  std::string packed, back;
  packs.append(packed, "short");
  EXPECT_FALSE(unpacks.unpack(GetParam(), packed, std::uint64_t{1} << 40, back));
  EXPECT_LT(back.capacity(), std::size_t{4} << 20);
}

INSTANTIATE_TEST_SUITE_P(all, compressed,
                         testing::Values(compression::none, compression::lz4, compression::zstd));

TEST(compressions, are_known_by_their_names) {
  for (const auto one : {compression::none, compression::lz4, compression::zstd})
    EXPECT_EQ(rowe::mcap::compression_named(rowe::mcap::name_of(one)), one);
  EXPECT_FALSE(rowe::mcap::compression_named("bz2"));
}

} // namespace
} // namespace compression_test
