// SPDX-License-Identifier: Apache-2.0
#include "tools/doctor/cpu_list.hpp"

#include <gtest/gtest.h>

namespace rowe::tools::fitness {
namespace cpu_list_test {
namespace {

TEST(cpu_list, reads_lists_as_the_kernel_writes_them) {
  EXPECT_EQ(cpu_list::of_list("0-3,7")->text(), "0-3,7");
  EXPECT_EQ(cpu_list::of_list("7,1,2,1")->text(), "1-2,7");
  EXPECT_EQ(cpu_list::of_list("")->text(), "");
  EXPECT_TRUE(cpu_list::of_list("")->empty());
}

TEST(cpu_list, refuses_what_is_no_list) {
  for (const char* const text : {"a", "1-", "-1", "3-1", "1,", ",1", "1 2", "0-99999", "(null)", "1--2"}) {
    EXPECT_FALSE(cpu_list::of_list(text)) << text;
  }
}

TEST(cpu_list, reads_masks_of_many_words) {
  EXPECT_EQ(cpu_list::of_mask("3")->text(), "0-1");
  EXPECT_EQ(cpu_list::of_mask("ff,00000001")->text(), "0,32-39");
  EXPECT_EQ(cpu_list::of_mask("80000000,00000000,0")->text(), "95");
  EXPECT_FALSE(cpu_list::of_mask("xyz"));
  EXPECT_FALSE(cpu_list::of_mask("1ffffffff"));
}

TEST(cpu_list, compares_sets) {
  const cpu_list some{{0, 2, 3}};
  EXPECT_TRUE(some.contains(2));
  EXPECT_FALSE(some.contains(1));
  EXPECT_TRUE(some.contains_all(cpu_list{{0, 3}}));
  EXPECT_FALSE(some.contains_all(cpu_list{{0, 1}}));
  EXPECT_EQ(some.both(cpu_list{{1, 2}}).text(), "2");
  EXPECT_EQ(some.without(cpu_list{{2}}).text(), "0,3");
}

} // namespace
} // namespace cpu_list_test
} // namespace rowe::tools::fitness
