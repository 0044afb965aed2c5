// SPDX-License-Identifier: Apache-2.0
// The life of queue pairs, free to offered to active to closing to free, with all three queues in use.
// Threads open handles and give them up at once, with calls in flight in either direction, while others are
// opened at their places. Nothing is left behind: in the end all pairs, all their memory and all places for
// calls are free again. The accounts show it if a late completion or reply reaches the next user of a place.
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <optional>
#include <thread>
#include <vector>

#include "rt/seed.hpp"
#include "rt/watchdog.hpp"
#include "stress/factor.hpp"
#include "stress/traffic.hpp"

namespace {

using namespace traffic;
using rowe::errc;
using rowe::message;
using rowe::tests::stressed;
using rowe::tests::watchdog;

constexpr std::uint32_t lanes = 12;
constexpr std::uint32_t calls = 16;
constexpr std::uint32_t threads = 4;

rowe::endpoint_options narrow() {
  rowe::endpoint_options made = options();
  made.limits.handles_max = lanes;
  made.limits.handle_bytes = lanes * 40 * 1024; // of small ones
  made.limits.calls_max = calls;
  return made;
}

// Two of each thread's handles are there at a time; all of them ask "sum", which one of them provides, now
// and then.
class short_lived {
 public:
  short_lived(rowe::endpoint& at, std::uint64_t seed, failures& to, std::atomic<std::uint64_t>& answered)
      : at_{at}, random_{seed}, to_{to}, answered_{answered} {}

  void turn() {
    const auto now = rowe::rt::monotonic_clock::now();
    auto asks = at_.client<addends, total>("sum", small_service);
    if (!asks) return to_.add("client", asks.error().name());
    auto other = at_.open_lane(small_lane(random_.below(2) == 0));
    if (!other) return to_.add("open_lane", other.error().name());
    account sums{to_};
    for (std::uint64_t left = random_.below(6); left != 0; --left) {
      ++number_;
      if (const auto begun = asks->start({number_, 1}, random_.time(), now)) sums.begin(*begun, number_ + 1);
      (void)other->start(message{"service", "sum", "a", number_, "b", 1}, random_.time(), now); // to be lost
    }
    if (random_.below(2) == 0) provide();
    for (std::uint64_t left = random_.below(4); left != 0; --left) std::this_thread::yield();
    for (;;) {
      const auto ended = asks->try_finish();
      if (!ended) break;
      sums.end(ended->id, ended->reply ? std::optional{ended->reply->sum} : std::nullopt);
    }
    answered_ += sums.answered();
  }

 private:
  void provide() {
    auto provides = at_.serve<addends, total>("sum", small_service);
    if (!provides) return to_.expect("serve", provides.code(), {errc::service_taken});
    for (std::uint64_t left = random_.below(4); left != 0; --left) {
      auto asked = provides->next(random_.time());
      if (asked && random_.below(2) == 0)
        (void)provides->reply(*asked, {asked->value().a + asked->value().b});
    }
  }

  rowe::endpoint& at_;
  random_source random_;
  failures& to_;
  std::atomic<std::uint64_t>& answered_;
  std::int64_t number_ = 0;
};

// That nothing is left behind.
void expect_all_lanes_free(rowe::endpoint& of) {
  std::vector<rowe::lane> all;
  for (std::uint32_t i = 0; i != lanes; ++i) {
    auto one = of.open_lane(small_lane(false));
    ASSERT_TRUE(one) << one.error().name() << " at lane " << i;
    all.push_back(std::move(*one));
  }
}
void expect_all_calls_free(rowe::endpoint& of) {
  constexpr std::uint32_t of_this_process = calls - calls / 4; // a quarter is for peers
  const rowe::service_options deep{.depth = calls, .text_bytes_max = 256};
  auto holds = of.serve<rowe::json_text, rowe::json_text>("held", deep).value();
  auto asks = of.client<rowe::json_text, rowe::json_text>("held", deep).value();
  std::vector<rowe::request<rowe::json_text>> held;
  for (std::uint32_t i = 0; i != of_this_process; ++i) {
    ASSERT_TRUE(asks.start("{}", rowe::rt::for_ever, rowe::rt::monotonic_clock::now()));
    auto asked = holds.next(rowe::rt::for_ever); // the watchdog ends it
    ASSERT_TRUE(asked) << asked.error().name() << " at call " << i;
    held.push_back(std::move(*asked));
  }
  EXPECT_EQ(of.invoke(message{"service", "held"}, rowe::rt::for_ever).code(), errc::too_many_calls);
  EXPECT_EQ(asks.try_finish().code(), errc::empty);
}

TEST(lanes_stress, leave_nothing_behind) {
  const watchdog dog{"threads that open handles and give them up", 500s};
  const rowe::tests::test_seed seed;
  failures wrong;
  std::atomic<std::uint64_t> answered{0};
  auto endpoint = rowe::endpoint::listen(0, narrow()).value();
  std::deque<std::thread> all;
  for (std::uint32_t i = 0; i != threads; ++i) {
    all.emplace_back([one = short_lived{endpoint, seed + i, wrong, answered}]() mutable {
      for (std::uint64_t turn = 0; turn != stressed(800); ++turn) one.turn();
    });
  }
  for (std::thread& one : all) one.join();
  EXPECT_EQ(wrong.text(), "");
  EXPECT_GT(answered, 0U);
  expect_all_lanes_free(endpoint);
  expect_all_calls_free(endpoint);
}

} // namespace
