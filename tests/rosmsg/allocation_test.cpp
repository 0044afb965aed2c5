// SPDX-License-Identifier: Apache-2.0
// Messages are converted without an allocation once the strings have their capacity. This program's malloc
// counts; the C++ heap comes through it.
#include <atomic>

#include "rt/sanitized.hpp"
#include "types.hpp"

namespace {
std::atomic<std::uint64_t> allocations{0}; // relaxed: read by the one thread that counts
} // namespace

#ifndef ROWE_TEST_SANITIZED
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* malloc(std::size_t bytes) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}
}
#endif

namespace allocation_test {
namespace {

using namespace rosmsg_tests;

TEST(allocation, never_happens_in_converting_messages_in_steady_state) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizer owns the heap";
#endif
  const ros_type type = ros2("string text\nuint8[] bytes\nfloat64[] numbers\nwstring wide\nT[] list\n"
                             "builtin_interfaces/Time time\n" +
                             part("test/T", "string<=30 name\nint32 value 5\nfloat32[] reals [1.5, 2]"));
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < 50; ++i) {
    std::string text(i * 37 % 200, i % 3 == 0 ? '\1' : 'x');
    std::string escaped;
    for (const char c : text) escaped += c == '\1' ? std::string{"\\u0001"} : std::string{c};
    std::string list;
    for (std::size_t n = 0; n < i; ++n)
      list += (n == 0 ? "" : ",") + std::string{R"({"value":3,"name":"abc"})"};
    texts.push_back(R"({"time":{"sec":1},"text":")" + escaped +
                    R"(","bytes":"AQIDBA==","numbers":[0.1,1e300,null],)" +
                    R"("wide":"\ud83d\ude00","unknown":[{}],"list":[)" + list + "]}");
  }
  std::string message, json;
  std::uint64_t made[2], bytes = 0;
  for (int round = 0; round < 2; ++round) {
    const std::uint64_t before = allocations.load(std::memory_order_relaxed);
    for (std::size_t i = 0; i < 20'000; ++i) {
      const ros_encoding encoding = i % 2 == 0 ? ros_encoding::cdr : ros_encoding::ros1;
      ASSERT_TRUE(type.from_json(encoding, texts[i * 7 % texts.size()], message, plenty));
      ASSERT_TRUE(type.to_json(encoding, message, json, plenty));
      bytes += json.size();
    }
    made[round] = allocations.load(std::memory_order_relaxed) - before;
  }
  EXPECT_GT(made[0], 0U) << "the count does not count";
  EXPECT_EQ(made[1], 0U);
  EXPECT_GT(bytes, 1'000'000U);
}

} // namespace
} // namespace allocation_test
