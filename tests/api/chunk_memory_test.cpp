// SPDX-License-Identifier: Apache-2.0
// The memory of long messages takes no page before it is used, whether the process locks its memory or not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include "api/chunk_memory.hpp"

namespace chunk_memory_test {
namespace {

using rowe::detail::chunk_memory;

constexpr std::size_t bytes_total = 4 * 1024 * 1024;
constexpr std::size_t step = 1024 * 1024;

std::size_t resident_bytes(const chunk_memory& of) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> there(of.bytes().size() / page);
  if (::mincore(of.bytes().data(), of.bytes().size(), there.data()) != 0) return SIZE_MAX;
  return page * static_cast<std::size_t>(std::count_if(there.begin(), there.end(),
                                                       [](unsigned char one) { return (one & 1) != 0; }));
}

// Opens a part, and uses a page of it.
void use(chunk_memory& one) {
  EXPECT_EQ(resident_bytes(one), 0U);
  ASSERT_TRUE(one.open(step));
  EXPECT_EQ(resident_bytes(one), 0U);
  std::memset(one.bytes().data(), 1, 4096);
  EXPECT_GT(resident_bytes(one), 0U);
  EXPECT_LT(resident_bytes(one), bytes_total); // huge pages have 2 MiB
  ASSERT_TRUE(one.open(bytes_total));
  EXPECT_TRUE(one.open(step)); // it stays open
  std::memset(one.bytes().data() + bytes_total - 1, 1, 1);
}

struct locked_process : testing::Test {
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root may lock as much as it likes";
  }
  void TearDown() override { (void)::munlockall(); }
};

TEST(chunk_memory, takes_no_page_before_it_is_used) {
  chunk_memory one{bytes_total};
  ASSERT_EQ(one.bytes().size(), bytes_total);
  use(one);
}

TEST(chunk_memory, says_why_there_is_none) {
  const chunk_memory none{std::size_t{1} << 60};
  EXPECT_TRUE(none.bytes().empty());
  EXPECT_NE(none.map_errno(), 0);
}

TEST_F(locked_process, takes_no_page_of_it_when_it_locks_its_memory_before) {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) GTEST_SKIP() << "memory cannot be locked here";
  chunk_memory one{bytes_total};
  ASSERT_EQ(one.bytes().size(), bytes_total);
  use(one);
}

TEST_F(locked_process, takes_no_page_of_it_when_it_locks_its_memory_behind) {
  chunk_memory one{bytes_total};
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) GTEST_SKIP() << "memory cannot be locked here";
  use(one);
}

} // namespace
} // namespace chunk_memory_test
