// SPDX-License-Identifier: Apache-2.0
// What the kernel says about the arena's pages, read from /proc and from the fault counter of the thread.
#include <rowe/rt/arena.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>

#include "rt/sanitized.hpp"

namespace arena_test {
namespace {

using rowe::rt::arena;
using rowe::rt::line_bytes;
using rowe::rt::page_lock;

constexpr std::size_t some_bytes = 256 * 1024;

// The VmFlags of the mapping that begins at `address`, as /proc/self/smaps prints them.
std::string flags_of_mapping(const void* address) {
  char begin[32];
  std::snprintf(begin, sizeof begin, "%zx-", reinterpret_cast<std::uintptr_t>(address));
  std::ifstream smaps{"/proc/self/smaps"};
  bool found = false;
  for (std::string line; std::getline(smaps, line);) {
    if (line.compare(0, std::strlen(begin), begin) == 0) found = true;
    if (found && line.compare(0, 8, "VmFlags:") == 0) return line + " ";
  }
  return {};
}

// What of these bytes has memory, in whole pages.
std::size_t resident_bytes_of(std::span<std::byte> bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> pages((bytes.size() + page - 1) / page);
  EXPECT_EQ(::mincore(bytes.data(), bytes.size(), pages.data()), 0);
  return page *
         static_cast<std::size_t>(std::ranges::count_if(pages, [](auto one) { return (one & 1U) != 0; }));
}

long minor_faults_of_this_thread() {
  rusage use;
  ::getrusage(RUSAGE_THREAD, &use);
  return use.ru_minflt;
}

// How often the thread faults when it writes to each page.
long faults_when_written(std::span<std::byte> bytes) {
  const long before = minor_faults_of_this_thread();
  for (std::size_t at = 0; at < bytes.size(); at += 4096)
    *const_cast<volatile std::byte*>(&bytes[at]) = std::byte{1};
  return minor_faults_of_this_thread() - before;
}

// A forked child that lives, doing nothing, as long as this object does.
class idle_child {
 public:
  idle_child() {
    if (::pipe(pipe_) != 0) return;
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::close(pipe_[1]);
    char none;
    (void)!::read(pipe_[0], &none, 1); // returns when the parent closes its end
    ::_exit(0);
  }
  ~idle_child() {
    ::close(pipe_[0]);
    ::close(pipe_[1]);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
  }
  bool alive() const { return pid_ > 0; }

 private:
  int pipe_[2] = {-1, -1};
  pid_t pid_ = -1;
};

TEST(arena, is_empty_until_it_is_mapped) {
  arena none;
  EXPECT_FALSE(none);
  EXPECT_EQ(none.bytes_total(), 0U);
  EXPECT_TRUE(none.carve_bytes(1).empty());
}

TEST(arena, maps_whole_pages_of_zeros) {
  arena memory{some_bytes - 1, page_lock::none};
  ASSERT_TRUE(memory) << memory.map_errno();
  EXPECT_EQ(memory.map_errno(), 0);
  EXPECT_EQ(memory.bytes_total(), some_bytes);
  EXPECT_EQ(memory.bytes_used(), 0U);
  for (const std::byte b : memory.carve_bytes(some_bytes)) ASSERT_EQ(b, std::byte{0});
}

TEST(arena, says_why_it_cannot_be_mapped) {
  EXPECT_EQ((arena{0, page_lock::none}.map_errno()), EINVAL);
  EXPECT_EQ((arena{SIZE_MAX, page_lock::none}.map_errno()), EINVAL);
  arena too_big{SIZE_MAX / 4, page_lock::none};
  EXPECT_FALSE(too_big);
  EXPECT_EQ(too_big.map_errno(), ENOMEM);
}

TEST(arena, is_shared_and_locked) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizers replace mlock by a function that does nothing";
#endif
  arena memory{some_bytes, page_lock::attempted};
  ASSERT_TRUE(memory);
  rlimit limit;
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  if (!memory.locked() && limit.rlim_cur < some_bytes) GTEST_SKIP() << "RLIMIT_MEMLOCK forbids locking here";
  EXPECT_TRUE(memory.locked()) << memory.lock_errno();
  EXPECT_EQ(memory.lock_errno(), 0);
  const std::string flags = flags_of_mapping(memory.carve_bytes(1).data());
  EXPECT_NE(flags.find(" sh "), std::string::npos) << flags;
  EXPECT_NE(flags.find(" lo "), std::string::npos) << flags;
}

TEST(arena, is_not_locked_unless_asked_to) {
  arena memory{some_bytes, page_lock::none};
  EXPECT_FALSE(memory.locked());
  EXPECT_EQ(memory.lock_errno(), 0);
  const std::string flags = flags_of_mapping(memory.carve_bytes(1).data());
  EXPECT_NE(flags.find(" sh "), std::string::npos) << flags;
  EXPECT_EQ(flags.find(" lo "), std::string::npos) << flags;
}

// What another thread has in the same page stays.
TEST(arena, in_parts_takes_memory_for_a_part_when_that_is_prepared) {
  arena memory{some_bytes, page_lock::in_parts};
  ASSERT_TRUE(memory) << memory.map_errno();
  const auto all = memory.carve_bytes(some_bytes);
  EXPECT_EQ(resident_bytes_of(all), 0U);
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const auto first = all.subspan(page, 100), second = all.subspan(page + 128, page);
  EXPECT_EQ(arena::prepare_part(first).populate_errno, 0);
  EXPECT_EQ(resident_bytes_of(all), page);
  first[0] = std::byte{7};
  EXPECT_EQ(arena::prepare_part(second).populate_errno, 0);
  EXPECT_EQ(resident_bytes_of(all), 2 * page);
  EXPECT_EQ(first[0], std::byte{7});
}

TEST(arena, works_and_says_why_when_it_cannot_be_locked) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizers replace mlock by a function that does nothing";
#endif
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const rlimit nothing{0, 0};
    if (::setrlimit(RLIMIT_MEMLOCK, &nothing) != 0) ::_exit(2);
    if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) ::_exit(3); // leaves CAP_IPC_LOCK behind
    arena memory{some_bytes, page_lock::attempted};
    if (!memory || memory.carve_bytes(some_bytes).size() != some_bytes) ::_exit(4);
    if (memory.locked()) ::_exit(5);
    ::_exit(memory.lock_errno() == EPERM || memory.lock_errno() == ENOMEM ? 0 : 6);
  }
  int outcome = 0;
  ASSERT_EQ(::waitpid(child, &outcome, 0), child);
  EXPECT_TRUE(WIFEXITED(outcome));
  EXPECT_EQ(WEXITSTATUS(outcome), 0);
}

TEST(arena, does_not_fault_when_first_used) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizer's shadow memory faults";
#endif
  arena memory{some_bytes, page_lock::none};
  const auto bytes = memory.carve_bytes(some_bytes);
  EXPECT_EQ(faults_when_written(bytes), 0);
}

TEST(arena, does_not_fault_after_a_fork_where_a_private_mapping_does) {
#ifdef ROWE_TEST_SANITIZED
  GTEST_SKIP() << "the sanitizer's shadow memory faults";
#endif
  arena memory{some_bytes, page_lock::attempted};
  ASSERT_TRUE(memory);
  const auto shared = memory.carve_bytes(some_bytes);
  void* const mapped =
      ::mmap(nullptr, some_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  ASSERT_NE(mapped, MAP_FAILED);
  const std::span exclusive{static_cast<std::byte*>(mapped), some_bytes};
  ASSERT_EQ(faults_when_written(exclusive), 0);

  const idle_child child;
  ASSERT_TRUE(child.alive());
  faults_when_written(shared.first(1)); // makes the stack this thread's own again

  EXPECT_GT(faults_when_written(exclusive), 0) << "else this test sees nothing";
  EXPECT_EQ(faults_when_written(shared), 0);
  ::munmap(mapped, some_bytes);
}

TEST(arena, carves_whole_lines_so_that_a_plan_adds_up) {
  arena memory{some_bytes, page_lock::none};
  const auto a = memory.carve_bytes(1);
  const auto b = memory.carve_bytes(line_bytes + 1);
  const auto c = memory.carve<std::uint64_t>(3);
  EXPECT_EQ(b.data() - a.data(), static_cast<std::ptrdiff_t>(line_bytes));
  EXPECT_EQ(reinterpret_cast<std::byte*>(c.data()) - b.data(), static_cast<std::ptrdiff_t>(2 * line_bytes));
  EXPECT_EQ(memory.bytes_used(),
            arena::bytes_for(1) + arena::bytes_for(line_bytes + 1) + arena::bytes_for<std::uint64_t>(3));
}

TEST(arena, aligns_what_it_carves) {
  arena memory{some_bytes, page_lock::none};
  memory.carve_bytes(1);
  const auto aligned = memory.carve_bytes(10, 4096);
  ASSERT_EQ(aligned.size(), 10U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(aligned.data()) % 4096, 0U);
}

TEST(arena, refuses_what_does_not_fit_and_takes_nothing) {
  arena memory{some_bytes, page_lock::none};
  memory.carve_bytes(line_bytes);
  EXPECT_TRUE(memory.carve_bytes(some_bytes).empty());
  EXPECT_TRUE(memory.carve_bytes(SIZE_MAX).empty());
  EXPECT_TRUE(memory.carve<std::uint64_t>(SIZE_MAX / 4).empty());
  EXPECT_TRUE(memory.carve_bytes(0).empty());
  EXPECT_EQ(memory.bytes_used(), line_bytes);
  EXPECT_EQ(memory.carve_bytes(some_bytes - line_bytes).size(), some_bytes - line_bytes);
  EXPECT_TRUE(memory.carve_bytes(1).empty());
  EXPECT_EQ(memory.make<int>(1), nullptr);
}

TEST(arena, builds_rings_and_windows_in_place) {
  arena memory{some_bytes, page_lock::none};
  using ring = rowe::rt::spsc_ring<std::uint32_t>;
  auto* const out = memory.make<ring>(memory.carve<ring::entry>(8));
  auto* const newest = memory.make<rowe::rt::window<double>>();
  ASSERT_NE(out, nullptr);
  ASSERT_NE(newest, nullptr);
  EXPECT_TRUE(out->take_producer()->try_push(3));
  newest->take_writer()->write(0.5);
  double value = 0;
  EXPECT_EQ(newest->take_reader()->read(value), rowe::rt::freshness::fresh);
  EXPECT_EQ(value, 0.5);
}

TEST(arena, moves_with_its_memory) {
  arena first{some_bytes, page_lock::none};
  const auto bytes = first.carve_bytes(8);
  arena second{std::move(first)};
  EXPECT_FALSE(first);
  EXPECT_EQ(first.bytes_total(), 0U);
  EXPECT_EQ(second.bytes_total(), some_bytes);
  arena third;
  third = std::move(second);
  bytes[0] = std::byte{1};
  EXPECT_EQ(third.bytes_used(), line_bytes);
}

} // namespace
} // namespace arena_test
