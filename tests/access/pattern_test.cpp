// SPDX-License-Identifier: Apache-2.0
#include "access/pattern.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include <rowe/access.hpp>

#include "meaning.hpp"

namespace pattern_test {
namespace {

using access_meaning::means;
using rowe::access::matches;

TEST(pattern, without_a_star_stands_for_itself) {
  EXPECT_TRUE(matches("/odom", "/odom"));
  EXPECT_FALSE(matches("/odom", "/odo"));
  EXPECT_FALSE(matches("/odom", "/odom2"));
  EXPECT_FALSE(matches("/odom", "/Odom"));
}

TEST(pattern, is_the_same_for_programs) {
  EXPECT_TRUE(rowe::pattern_matches("/arm/*", "arm/left"));
  EXPECT_FALSE(rowe::pattern_matches("/arm/*", "/arm/left/pose"));
}

TEST(pattern, means_the_same_with_and_without_the_first_slash) {
  EXPECT_TRUE(matches("odom", "/odom"));
  EXPECT_TRUE(matches("/odom", "odom"));
  EXPECT_TRUE(matches("/*", "odom"));
  EXPECT_FALSE(matches("//odom", "odom"));
}

TEST(pattern, with_one_star_stays_between_slashes) {
  EXPECT_TRUE(matches("/robot/*", "/robot/odom"));
  EXPECT_TRUE(matches("/robot/*", "/robot/"));
  EXPECT_FALSE(matches("/robot/*", "/robot/arm/joint"));
  EXPECT_TRUE(matches("/*/odom", "/a/odom"));
  EXPECT_FALSE(matches("/*/odom", "/a/b/odom"));
  EXPECT_TRUE(matches("/cmd_*_vel", "/cmd_a_b_vel"));
  EXPECT_FALSE(matches("*", "/a/b"));
}

TEST(pattern, with_two_stars_crosses_slashes) {
  EXPECT_TRUE(matches("**", ""));
  EXPECT_TRUE(matches("**", "/a/b/c"));
  EXPECT_TRUE(matches("/rosapi/**", "/rosapi/topics"));
  EXPECT_FALSE(matches("/rosapi/**", "/rosapi"));
  EXPECT_TRUE(matches("/**/odom", "/a/b/odom"));
  EXPECT_FALSE(matches("/**/odom", "/a/b/odometry"));
  EXPECT_TRUE(matches("/**/a*b/**", "/x/y/acb/z"));
  EXPECT_FALSE(matches("/**/a*b/**", "/x/y/ac/b/z"));
}

TEST(pattern, matches_what_its_meaning_says_whatever_it_is) {
  std::mt19937 random{1};
  const auto text = [&](std::string_view letters, std::size_t most) {
    std::string made;
    for (auto left = random() % (most + 1); left != 0; --left) made += letters[random() % letters.size()];
    return made;
  };
  int matched = 0;
  for (int i = 0; i < 200'000; ++i) {
    std::string pattern = "x", name = "x"; // no first slash
    for (auto left = random() % 5; left != 0; --left) {
      constexpr std::string_view pieces[] = {"*", "**", "a", "b", "/"};
      const std::string_view piece = pieces[random() % std::size(pieces)];
      if (!(pattern.ends_with('*') && piece.starts_with('*'))) pattern += piece;
    }
    name += text("ab/", 6);
    ASSERT_EQ(matches(pattern, name), means(pattern, name)) << pattern << " and " << name;
    matched += matches(pattern, name);
  }
  EXPECT_GT(matched, 10'000);
}

TEST(pattern, of_many_stars_ends_soon) {
  std::string pattern, name(128, 'a');
  for (int i = 0; i < 42; ++i) pattern += "*a";
  pattern += 'b';
  EXPECT_FALSE(matches(pattern, name)); // a backtracking matcher would never end
  pattern.clear();
  for (int i = 0; i < 42; ++i) pattern += "**a";
  pattern += 'b';
  EXPECT_FALSE(matches(pattern, name));
}

} // namespace
} // namespace pattern_test
