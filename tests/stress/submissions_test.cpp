// SPDX-License-Identifier: Apache-2.0
// The submission queue and the shared inbox between eight ordinary threads and the service thread. The
// threads submit, wait, run out of time, leave messages behind and receive. The service thread completes at
// once, late or in any order, replies, delivers and closes in the middle of it all. Each request has a
// number, and a text made of it, so that a slot with two holders shows. tests/model shows what this run
// cannot: orders that this processor does not use. This run adds the real words, moodycamel's queue, and
// ThreadSanitizer.
#include "service/threads/shared_inbox.hpp"
#include "service/threads/submission_queue.hpp"

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "rt/seed.hpp"
#include "rt/watchdog.hpp"
#include "stress/factor.hpp"

namespace {

using namespace std::chrono_literals;
using namespace rowe;
using service::shared_inbox;
using service::submission_queue;
using tests::stressed;
using tests::watchdog;

constexpr std::chrono::seconds run_time_max = 500s; // sanitized on one busy core some take a minute
constexpr std::uint32_t users = 8;
constexpr std::size_t text_bytes = 48;

limits bounds_with(std::uint32_t slots) {
  limits bounds;
  bounds.door_slots = slots;
  bounds.door_slot_bytes = 128;
  return bounds;
}

struct fixture {
  explicit fixture(std::uint32_t slots)
      : memory{rt::arena::bytes_for<submission_queue>() +
                   submission_queue::footprint_bytes(bounds_with(slots)) +
                   rt::arena::bytes_for<shared_inbox>() + shared_inbox::footprint_bytes(bounds_with(slots)),
               rt::page_lock::none},
        submissions{*memory.make<submission_queue>(memory, bounds_with(slots))},
        inbox{*memory.make<shared_inbox>(memory, bounds_with(slots))} {}
  // With nobody inside.
  void check() {
    EXPECT_STREQ(submissions.check(), nullptr);
    EXPECT_STREQ(inbox.check(), nullptr);
    EXPECT_TRUE(submissions.all_free() && inbox.all_free());
  }
  rt::arena memory;
  submission_queue& submissions;
  shared_inbox& inbox;
};

// The number and then one character that goes with it, so that a torn text shows.
std::string text_of(std::uint64_t number) {
  std::string text = std::to_string(number);
  text.resize(text_bytes, static_cast<char>('a' + number % 26));
  return text;
}
std::uint64_t number_of(std::string_view text) {
  std::uint64_t number = 0;
  (void)std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}
// A request is numbered by its thread and its place in that thread; a reply has the request's number and one
// character more.
constexpr std::uint64_t number(std::uint32_t user, std::uint64_t place) { return place * users + user; }

struct tally {
  std::atomic<std::uint64_t> submitted{0};
  std::atomic<std::uint64_t> answered{0};  // outcomes that their submitters saw
  std::atomic<std::uint64_t> abandoned{0}; // waits that were given up
  std::atomic<std::uint64_t> received{0};
  std::atomic<std::uint64_t> wrong{0};
};

// One ordinary thread. Ends after so many requests, or when the endpoint is closed.
void use(fixture& h, std::uint32_t user, std::uint64_t requests, std::uint64_t seed, tally& count) {
  std::mt19937_64 random{seed + user};
  for (std::uint64_t place = 0; place != requests; ++place) {
    const std::uint64_t own = number(user, place);
    const bool waits = random() % 4 != 0;
    result<std::uint32_t> asked = errc::full;
    while ((asked = h.submissions.submit({.wants_outcome = waits}, text_of(own))).code() == errc::full &&
           !asked)
      std::this_thread::yield();
    if (!asked) break; // closed
    ++count.submitted;
    if (waits) {
      const rt::time_point now = rt::monotonic_clock::now();
      const std::array deadlines{rt::never, rt::time_point{}, now + 1us, now + 20us, now + 500us};
      if (h.submissions.wait(*asked, deadlines[random() % deadlines.size()])) {
        ++count.answered;
        const std::string_view reply = h.submissions.reply_text(*asked);
        const status& outcome = h.submissions.outcome(*asked);
        count.wrong += outcome ? reply != text_of(own) + "!" : outcome.code() != errc::closed;
        h.submissions.release(*asked);
      } else {
        ++count.abandoned;
      }
    }
    if (random() % 2 == 0) {
      const auto arrived = random() % 2 == 0 ? h.inbox.try_receive(rt::monotonic_clock::now())
                                             : h.inbox.receive(rt::monotonic_clock::now() + 30us);
      if (arrived) {
        ++count.received;
        const std::string_view text = h.inbox.text(*arrived);
        count.wrong += text != text_of(number_of(text));
        h.inbox.release(*arrived);
      }
    }
  }
}

// The service thread: takes, keeps some for later, completes in any order. Checks the order of each thread.
class server {
 public:
  server(fixture& h, std::uint64_t seed, tally& count)
      : submissions_{h.submissions}, inbox_{h.inbox}, random_{seed}, count_{count} {}

  void turn() {
    submissions_.take(
        [this](std::uint32_t slot) {
          const std::uint64_t asked = number_of(submissions_.request_text(slot));
          std::uint64_t& last = last_of_[asked % users];
          count_.wrong += submissions_.request_text(slot) != text_of(asked) || asked < last;
          last = asked + 1;
          ++taken;
          held_.push_back(slot);
        },
        1 + random_() % 7);
    while (!held_.empty() && random_() % 3 != 0) complete_one();
    if (random_() % 4 == 0) {
      const std::uint64_t number = delivered;
      // Some are expired when they come.
      const auto expires = random_() % 8 == 0 ? rt::time_point{} : rt::never;
      if (inbox_.deliver({.expires = expires}, text_of(number))) ++delivered;
    }
    if (held_.empty()) std::this_thread::yield();
  }
  void complete_all() {
    while (!held_.empty()) complete_one();
  }

  std::uint64_t taken = 0;
  std::uint64_t delivered = 0;

 private:
  void complete_one() {
    std::swap(held_.back(), held_[random_() % held_.size()]);
    const std::uint32_t slot = held_.back();
    held_.pop_back();
    submissions_.complete(slot, {}, text_of(number_of(submissions_.request_text(slot))) + "!");
  }

  submission_queue& submissions_;
  shared_inbox& inbox_;
  std::mt19937_64 random_;
  tally& count_;
  std::vector<std::uint32_t> held_;
  std::array<std::uint64_t, users> last_of_{}; // the number after the last one seen
};

std::vector<std::thread> send_users(fixture& h, std::uint64_t requests, std::uint64_t seed, tally& count,
                                    std::atomic<std::uint32_t>& inside) {
  std::vector<std::thread> threads;
  inside = users;
  for (std::uint32_t user = 0; user != users; ++user)
    threads.emplace_back([&, user, requests, seed] {
      use(h, user, requests, seed, count);
      --inside;
    });
  return threads;
}

void empty_inbox(fixture& h, tally& count) {
  while (const auto left = h.inbox.try_receive(rt::monotonic_clock::now())) {
    ++count.received;
    h.inbox.release(*left);
  }
}

class submissions_stress : public ::testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(slots, submissions_stress, ::testing::Values(1, 3, 32));

TEST_P(submissions_stress, completes_each_request_once_and_frees_every_slot) {
  const watchdog dog{"eight threads that submit", run_time_max};
  const tests::test_seed seed;
  fixture h{GetParam()};
  tally count;
  std::atomic<std::uint32_t> inside;
  auto threads = send_users(h, stressed(3'000), seed, count, inside);
  server serves{h, seed, count};
  while (inside != 0) serves.turn();
  while (!h.submissions.drained()) {
    serves.turn();
    serves.complete_all();
  }
  for (std::thread& thread : threads) thread.join();
  empty_inbox(h, count);
  EXPECT_EQ(count.wrong, 0U);
  EXPECT_EQ(serves.taken, count.submitted);
  EXPECT_EQ(serves.delivered, count.received + h.inbox.expired());
  h.check();
}

TEST_P(submissions_stress, leaves_nobody_waiting_when_it_finishes_in_the_middle) {
  const watchdog dog{"a submission queue that closes", run_time_max};
  const tests::test_seed seed;
  std::mt19937_64 random{seed};
  for (std::uint64_t round = 0; round != stressed(60); ++round) {
    fixture h{GetParam()};
    tally count;
    std::atomic<std::uint32_t> inside;
    auto threads = send_users(h, UINT64_MAX, seed + round, count, inside);
    server serves{h, seed + round, count};
    const std::uint64_t turns = random() % 300;
    for (std::uint64_t turn = 0; turn != turns; ++turn) serves.turn();
    h.inbox.close();
    if (round % 2 == 0) h.submissions.close();
    h.submissions.finish();
    for (std::thread& thread : threads) thread.join();
    h.submissions.finish(); // completes what was submitted while it finished
    empty_inbox(h, count);
    ASSERT_EQ(count.wrong, 0U);
    ASSERT_LE(serves.taken, count.submitted);
    ASSERT_EQ(serves.delivered, count.received + h.inbox.expired());
    h.check();
    ASSERT_FALSE(HasFailure());
  }
}

// Nobody waits, so that each thread has several messages in flight while they are taken.
TEST_P(submissions_stress, keeps_the_order_of_each_thread) {
  const watchdog dog{"threads that only send", run_time_max};
  constexpr std::uint32_t senders = 2;
  const std::uint64_t messages = stressed(GetParam() == 1 ? 1'000 : 20'000); // one slot keeps any order
  fixture h{GetParam()};
  std::vector<std::thread> threads;
  for (std::uint32_t sender = 0; sender != senders; ++sender)
    threads.emplace_back([&, sender] {
      for (std::uint32_t i = 0; i != messages;) {
        if (h.submissions.submit({.peer = {sender, i}}, "x"))
          ++i;
        else
          std::this_thread::yield();
      }
    });
  std::array<std::uint32_t, senders> next{};
  std::uint64_t wrong = 0;
  std::uint64_t idle = 0;
  for (std::uint64_t taken = 0; taken != senders * messages;) {
    const std::size_t count = h.submissions.take(
        [&](std::uint32_t slot) {
          const detail::peer_ref sent = h.submissions.request(slot).peer;
          wrong += sent.generation != next[sent.index]++;
          h.submissions.complete(slot, {});
        },
        SIZE_MAX);
    if (count == 0 && ++idle % 20'000 == 0) std::this_thread::yield(); // seldom, else they go in step
    taken += count;
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0U);
  h.check();
}

} // namespace
