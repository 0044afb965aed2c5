// SPDX-License-Identifier: Apache-2.0
#include "tools/rowe/text/topic_pattern.hpp"

#include <gtest/gtest.h>

#include <random>
#include <regex>
#include <string>

namespace rowe::tools {
namespace topic_pattern_test {
namespace {

TEST(topic_pattern, describes_names_with_and_without_their_first_slash) {
  EXPECT_TRUE(topic_matches("/odom", "odom"));
  EXPECT_TRUE(topic_matches("odom", "/odom"));
  EXPECT_FALSE(topic_matches("/odo", "/odom"));
  EXPECT_FALSE(topic_matches("/odom", "/odo"));
}

TEST(topic_pattern, takes_one_star_within_a_level_and_two_across_levels) {
  EXPECT_TRUE(topic_matches("/arm/*", "/arm/left"));
  EXPECT_TRUE(topic_matches("/arm/*/pose", "/arm/left/pose"));
  EXPECT_FALSE(topic_matches("/arm/*", "/arm/left/pose"));
  EXPECT_TRUE(topic_matches("/arm/**", "/arm/left/pose"));
  EXPECT_TRUE(topic_matches("**", "/anything/at/all"));
  EXPECT_TRUE(topic_matches("/**/pose", "/a/b/pose"));
  EXPECT_TRUE(topic_matches("*", "/"));
}

TEST(topic_pattern, is_what_a_regular_expression_says) {
  const unsigned seed = std::random_device{}();
  std::mt19937 random{seed};
  const auto text = [&](std::string_view of, std::size_t most) {
    std::string made;
    for (std::size_t n = random() % (most + 1); made.size() < n;) made += of[random() % of.size()];
    return made;
  };
  for (int i = 0; i < 3000; ++i) {
    const std::string pattern = text("ab/**", 8), name = text("ab/", 8);
    std::string like;
    const std::string_view shown = without_slash(pattern);
    for (std::size_t at = 0; at < shown.size(); ++at) {
      if (shown.substr(at, 2) == "**") {
        like += ".*";
        ++at;
      } else {
        like += shown[at] == '*' ? std::string{"[^/]*"} : std::string{shown[at]};
      }
    }
    const bool wanted = std::regex_match(std::string{without_slash(name)}, std::regex{like});
    ASSERT_EQ(topic_matches(pattern, name), wanted) << pattern << " " << name << ", seed " << seed;
  }
}

} // namespace
} // namespace topic_pattern_test
} // namespace rowe::tools
