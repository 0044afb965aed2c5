// SPDX-License-Identifier: Apache-2.0
// Every exercise under every circumstance; and proof that the harness would have caught a breach: one of each
// kind is planted. With `--functions` the program only prints what it exercises, one name a line, for
// completeness.py.
#include "contract.hpp"

#include <rowe/rt/clock.hpp>

#include "rt/watchdog.hpp"

#include <gtest/gtest.h>

#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <string>

namespace rowe::contract {
namespace {

std::string text(const rt::tripwire::report& report) {
  char buffer[300];
  return std::string{report.text(buffer)};
}

// The kernel takes pages back that were not used for a while, also of the program's own text, unless they are
// locked: whoever touches one next has a page fault that no call caused. A real-time program locks them.
class locked_memory {
 public:
  locked_memory() {
    if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return;
    std::printf("memory is not locked (%s): a page fault may be the kernel's\n", std::strerror(errno));
  }
  ~locked_memory() { (void)::munlockall(); } // fails where nothing was locked
};

void expect_all_to_keep_the_contract(circumstance under) {
  const tests::watchdog guard{"the real-time contract", std::chrono::seconds{580}};
  const locked_memory stays;
  std::uint64_t told = 0;
  for (const exercise& one : all_exercises()) {
    SCOPED_TRACE(testing::Message() << one.function << ", " << one.state);
    const outcome result = perform(one, under);
    ASSERT_EQ(result.trouble, "");
    if (under == circumstance::with_a_clock_in_the_kernel && one.reads_clock) {
      EXPECT_EQ(result.seen.system_calls, trapped_calls_made)
          << "reads the clock once a call, and was seen doing so";
      EXPECT_EQ(result.seen.last_system_call, SYS_clock_gettime);
    } else {
      EXPECT_TRUE(result.seen.clean()) << text(result.seen);
    }
    EXPECT_EQ(result.seen.wake_writes, result.told) << "one write for each thing that is handed over";
    told += result.told;
  }
  if (under == circumstance::beside_a_sleeping_service_thread) {
    EXPECT_GT(told, 50 * trapped_calls_made) << "dozens of exercises hand something over";
  } else {
    EXPECT_EQ(told, 0u);
  }
}

TEST(rt_contract, is_kept_by_every_function_in_every_state) {
  expect_all_to_keep_the_contract(circumstance::ordinary);
}

TEST(rt_contract, is_kept_beside_a_forked_child) {
  expect_all_to_keep_the_contract(circumstance::beside_a_forked_child);
}

TEST(rt_contract, is_kept_without_a_vdso_by_all_that_do_not_read_the_clock) {
  expect_all_to_keep_the_contract(circumstance::with_a_clock_in_the_kernel);
}

TEST(rt_contract, is_kept_under_wake_but_for_one_write_to_one_descriptor_while_the_service_thread_sleeps) {
  expect_all_to_keep_the_contract(circumstance::beside_a_sleeping_service_thread);
}

TEST(rt_contract, is_kept_under_wake_while_the_service_thread_is_awake) {
  expect_all_to_keep_the_contract(circumstance::beside_one_that_is_told_and_awake);
}

TEST(rt_contract, finds_a_clock_in_the_kernel_not_cheap) {
  put_clock_into_the_kernel(true);
  const rt::clock_cost cost = rt::clock_is_cheap();
  put_clock_into_the_kernel(false);
  EXPECT_FALSE(cost.cheap) << cost.read.count() << " ns against " << cost.system_call.count() << " ns";
}

// The planted breaches.

rt::tripwire::report planted(void (*breach)(real_time&), circumstance under = circumstance::ordinary) {
  const outcome result = perform({"planted", "on purpose", breach}, under);
  EXPECT_EQ(result.trouble, "");
  EXPECT_FALSE(result.seen.clean());
  return result.seen;
}

TEST(rt_contract, catches_one_malloc_in_all_calls) {
  const auto seen = planted([](real_time& rt) {
    rt.calls([](std::uint64_t i) {
      if (i == calls_made / 2) use(std::make_unique<int>(1));
    });
  });
  EXPECT_EQ(seen.allocations, 2u);
}

TEST(rt_contract, catches_an_uncontended_mutex) {
  const auto seen = planted([](real_time& rt) {
    std::mutex mutex;
    rt.calls([&](std::uint64_t) { const std::lock_guard lock{mutex}; });
  });
  EXPECT_EQ(seen.locks, calls_made);
  EXPECT_EQ(seen.system_calls, 0u);
}

TEST(rt_contract, catches_a_system_call) {
  const auto seen = planted([](real_time& rt) {
    rt.calls([](std::uint64_t i) {
      if (i == calls_made / 2) use(::write(-1, "", 0));
    });
  });
  EXPECT_EQ(seen.system_calls, 1u);
  EXPECT_EQ(seen.last_system_call, SYS_write);
}

TEST(rt_contract, catches_a_write_that_is_not_the_wakers) {
  const auto seen = planted(
      [](real_time& rt) {
        rt.calls([](std::uint64_t i) {
          if (i == trapped_calls_made / 2) use(::write(-1, "", 0));
        });
      },
      circumstance::beside_a_sleeping_service_thread);
  EXPECT_EQ(seen.system_calls, 1u);
  EXPECT_EQ(seen.wake_writes, 0u);
}

TEST(rt_contract, catches_a_fresh_page) {
  const auto seen = planted([](real_time& rt) {
    void* const fresh =
        ::mmap(nullptr, std::size_t{1} << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    rt.calls([&](std::uint64_t i) { static_cast<volatile char*>(fresh)[i] = 1; });
    ::munmap(fresh, std::size_t{1} << 20);
  });
  EXPECT_GT(seen.page_faults, 0u);
  EXPECT_EQ(seen.system_calls, 0u);
}

TEST(rt_contract, catches_private_memory_beside_a_forked_child) {
  static void* memory = nullptr; // one page, present and private
  memory = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  constexpr auto write_to_it = [](real_time& rt) {
    rt.calls([](std::uint64_t i) { *static_cast<volatile std::uint64_t*>(memory) = i; });
  };
  const outcome before = perform({"planted", "on purpose", write_to_it}, circumstance::ordinary);
  EXPECT_TRUE(before.seen.clean()) << text(before.seen);
  EXPECT_EQ(planted(write_to_it, circumstance::beside_a_forked_child).page_faults, 1u);
  ::munmap(memory, 4096);
}

TEST(rt_contract, catches_a_breach_that_only_another_thread_brings_about) {
  static std::atomic<bool> disturbed;
  const auto seen = planted([](real_time& rt) {
    disturbed = false;
    rt.beside([] { disturbed = true; });
    rt.calls([](std::uint64_t) {
      if (disturbed.exchange(false)) use(std::make_unique<int>(1));
    });
  });
  EXPECT_GT(seen.allocations, 0u);
}

TEST(rt_contract, catches_an_exercise_that_measures_nothing) {
  EXPECT_EQ(perform({"planted", "on purpose", [](real_time&) {}}, circumstance::ordinary).trouble,
            "no call was measured");
}

} // namespace
} // namespace rowe::contract

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view{argv[1]} == "--functions") {
    for (const auto& one : rowe::contract::all_exercises()) std::puts(one.function);
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
