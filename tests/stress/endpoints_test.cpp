// SPDX-License-Identifier: Apache-2.0
// Two endpoints in full use. Each has a loop with a publisher, a responder, a caller and a lane, which never
// waits; ordinary threads, which send, receive, invoke and reply, and run out of time; and one that opens and
// closes handles with calls in flight. A third endpoint connects, sends and calls, and leaves. Each call has
// a number that its reply must carry, and is in an account (traffic.hpp) until it completes, once.
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
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

// A call may end with any error but `closed` while peers and providers come and go.
void expect_call_error(failures& to, const char* where, errc code) {
  to.expect(
      where, code,
      {errc::timed_out, errc::refused, errc::peer_lost, errc::no_service, errc::full, errc::too_many_calls});
}

// A loop: none of its calls waits.
class loop {
 public:
  loop(rowe::endpoint& at, std::string_view provides, std::string_view calls, bool receives,
       std::uint64_t seed, failures& to)
      : readings_{at.advertise<reading>("/readings").value()},
        seen_{at.subscribe<reading>("/readings", {.depth = 8}).value()},
        provides_{at.serve<addends, total>(provides, small_service).value()},
        calls_{at.client<addends, total>(calls, small_service).value()},
        talk_{at.open_lane(small_lane(receives)).value()},
        sums_{to},
        echoes_{to},
        random_{seed},
        to_{to} {}

  void turn(bool asks) {
    const auto now = rowe::rt::monotonic_clock::now();
    ++turns_;
    publish(now);
    provide(now);
    receive(now);
    if (asks) ask(now);
    finish();
  }
  bool settled() const { return sums_.settled() && echoes_.settled(); }
  // Of its calls.
  std::uint64_t answered() const { return sums_.answered() + echoes_.answered(); }

 private:
  void publish(rowe::time_point now) {
    const auto published = readings_.publish({turns_, 2 * turns_}, now);
    if (!published) to_.expect("publish", published.code(), {errc::full, errc::no_peer});
    while (const auto taken = seen_.try_take()) {
      if (taken->value().twice != 2 * taken->value().n) to_.add("a value is torn");
    }
  }
  // Answers at once, later, with a refusal or not at all.
  void provide(rowe::time_point now) {
    if (auto asked = provides_.try_next(now)) {
      switch (random_.below(8)) {
      case 0: (void)provides_.refuse(*asked, "not today", now); break; // the caller may be gone
      case 1: break;
      case 2:
      case 3: held_.push_back(std::move(*asked)); break;
      default: answer(*asked, now);
      }
    } else {
      to_.expect("try_next", asked.code(), {errc::empty, errc::full});
    }
    if (held_.size() > 2 || (!held_.empty() && random_.below(16) == 0)) {
      answer(held_.front(), now);
      held_.erase(held_.begin());
    }
  }
  void answer(rowe::request<addends>& to, rowe::time_point now) {
    const auto said = provides_.reply(to, {to.value().a + to.value().b}, now);
    if (!said) to_.expect("reply", said.code(), {errc::peer_lost, errc::expired});
  }
  void receive(rowe::time_point now) {
    while (const auto came = talk_.try_receive(now)) {
      if (!came->wants_reply() || random_.below(8) == 0) continue;
      const auto said = random_.below(8) == 0
                            ? talk_.try_refuse(*came, "no", now)
                            : talk_.try_reply(*came, message{"n", number_in(came->value(), "n")}, now);
      if (!said) to_.expect("try_reply", said.code(), {errc::peer_lost, errc::expired, errc::full});
    }
  }
  void ask(rowe::time_point now) {
    const std::int64_t number = ++asked_;
    if (const auto begun = calls_.start({number, number}, call_time(), now)) {
      sums_.begin(*begun, 2 * number);
      if (random_.below(8) == 0) {
        calls_.cancel(*begun);
        sums_.cancel(*begun);
      }
    } else {
      to_.expect("start", begun.code(), {errc::full, errc::too_many_calls});
    }
    if (const auto begun = talk_.start(message{"service", "echo", "n", number}, call_time(), now)) {
      echoes_.begin(*begun, number);
    } else {
      to_.expect("start", begun.code(), {errc::full, errc::too_many_calls});
    }
    if (random_.below(4) != 0) return;
    const auto sent = talk_.try_send(message{"n", number}, random_.time(), now);
    if (!sent) to_.expect("try_send", sent.code(), {errc::full});
  }
  // Until one was answered, calls have the time that a busy machine needs.
  rowe::duration call_time() { return answered() == 0 ? rowe::duration{5s} : random_.time(); }
  void finish() {
    for (;;) {
      const auto ended = calls_.try_finish();
      if (!ended) break;
      if (!ended->reply) expect_call_error(to_, "caller", ended->reply.code());
      sums_.end(ended->id, ended->reply ? std::optional{ended->reply->sum} : std::nullopt);
    }
    for (;;) {
      const auto ended = talk_.try_finish();
      if (!ended) break;
      if (!ended->reply) expect_call_error(to_, "lane", ended->reply.code());
      echoes_.end(ended->id,
                  ended->reply ? std::optional{number_in(ended->reply->value(), "n")} : std::nullopt);
    }
  }

  rowe::publisher<reading> readings_;
  rowe::subscriber<reading> seen_;
  rowe::responder<addends, total> provides_;
  rowe::caller<addends, total> calls_;
  rowe::lane talk_;
  std::vector<rowe::request<addends>> held_;
  account sums_;
  account echoes_;
  random_source random_;
  failures& to_;
  std::int64_t turns_ = 0;
  std::int64_t asked_ = 0;
};

// An ordinary thread.
class ordinary_thread {
 public:
  ordinary_thread(rowe::endpoint& at, std::string_view asks_for, std::uint64_t seed, failures& to)
      : at_{at}, sums_{asks_for}, random_{seed}, to_{to}, number_{static_cast<std::int64_t>(seed << 20)} {}

  void turn() {
    ++number_;
    switch (random_.below(8)) {
    case 0: return expect_sent(at_.send(message{"n", number_}, random_.time()));
    case 1: return expect_sent(at_.try_send(message{"n", number_}, random_.time()));
    case 2:
    case 3:
      return check("a sum", at_.invoke(message{"service", sums_, "a", number_, "b", number_}, random_.time()),
                   "sum", 2 * number_);
    case 4: return check("an echo", at_.invoke(echo("echo"), random_.time()), "n", number_);
    case 5: return check("a passing echo", at_.invoke(echo("passing"), random_.time()), "n", number_);
    default: return receive();
    }
  }

 private:
  message echo(std::string_view service) const { return message{"service", service, "n", number_}; }
  void expect_sent(const rowe::status& sent) {
    if (!sent) to_.expect("send", sent.code(), {errc::expired, errc::full, errc::peer_lost});
  }
  void check(const char* what, const rowe::result<rowe::received>& reply, std::string_view member,
             std::int64_t number) {
    if (!reply) return expect_call_error(to_, what, reply.code());
    if (number_in(reply->value(), member) != number) to_.add("a call got the reply of another one", what);
  }
  // Answers, refuses, or does not answer.
  void receive() {
    const auto came = at_.receive(random_.time());
    if (!came) return to_.expect("receive", came.code(), {errc::timed_out});
    if (!came->wants_reply()) return;
    const message reply{"n", number_in(came->value(), "n")};
    rowe::status said;
    switch (random_.below(8)) {
    case 0: return;
    case 1: said = at_.refuse(*came, "no"); break;
    case 2: said = at_.try_reply(*came, reply); break;
    default: said = at_.reply(*came, reply, random_.time());
    }
    if (!said) to_.expect("reply", said.code(), {errc::peer_lost, errc::expired, errc::full});
  }

  rowe::endpoint& at_;
  std::string_view sums_;
  random_source random_;
  failures& to_;
  std::int64_t number_;
};

// Opens handles, uses them a little and gives them up, with calls in flight and requests unanswered.
void open_and_close(rowe::endpoint& at, random_source& random, failures& to) {
  const auto now = rowe::rt::monotonic_clock::now();
  auto talk = at.open_lane(small_lane(false));
  auto passing = at.serve<rowe::json_text, rowe::json_text>("passing", small_service);
  auto readings = at.advertise<reading>("/readings", {.keep = rowe::keep::newest});
  auto seen = at.subscribe<rowe::json_text>("/readings", {.depth = 2, .text_bytes_max = 256});
  if (!talk || !readings || !seen) return to.add("a handle cannot be opened");
  if (!passing) to.expect("serve", passing.code(), {errc::service_taken}); // the other end was first
  account calls{to};
  for (std::int64_t n = 0; n != 6; ++n) {
    (void)readings->publish({n, 2 * n}, now); // what becomes of it is another test's
    if (const auto begun = talk->start(message{"service", "echo", "n", n}, random.time(), now))
      calls.begin(*begun, n);
  }
  if (random.below(2) == 0) {
    const auto sent = talk->send(message{"n", 0}, random.time());
    if (!sent) to.expect("lane::send", sent.code(), {errc::expired, errc::full, errc::too_many_calls});
  }
  if (random.below(2) == 0) {
    const auto echoed = talk->invoke(message{"service", "echo", "n", 7}, random.time());
    if (!echoed)
      expect_call_error(to, "lane::invoke", echoed.code());
    else if (number_in(echoed->value(), "n") != 7)
      to.add("a call got the reply of another one");
  }
  if (passing) {
    auto asked = passing->next(random.time());
    if (asked && random.below(2) == 0) (void)passing->reply(*asked, asked->value()); // the caller may be gone
  }
  (void)seen->take(random.time()); // likewise
  for (;;) {
    const auto ended = talk->try_finish();
    if (!ended) break;
    calls.end(ended->id, ended->reply ? std::optional{number_in(ended->reply->value(), "n")} : std::nullopt);
  }
}

// A peer that connects, calls and is called, and leaves in the middle of it.
void visit(const rowe::endpoint& host, random_source& random, failures& to) {
  auto guest = rowe::endpoint::connect(url_of(host), options()).value();
  if (!guest.wait_peer(20s)) return to.add("a guest is not accepted");
  auto talk = guest.open_lane(small_lane(random.below(2) == 0)).value();
  auto adds = guest.client<addends, total>("add", small_service).value();
  account calls{to};
  for (std::int64_t n = 0; n != 3; ++n) {
    const auto begun = adds.start({n, 1}, 1s, rowe::rt::monotonic_clock::now());
    if (begun) calls.begin(*begun, n + 1);
    (void)talk.try_send(message{"n", n}, 1s); // it may go before it is written
  }
  const auto echoed = talk.invoke(message{"service", "echo", "n", 9}, random.time());
  if (echoed && number_in(echoed->value(), "n") != 9) to.add("a guest got the reply of another call");
  for (;;) {
    const auto ended = adds.try_finish();
    if (!ended) break;
    calls.end(ended->id, ended->reply ? std::optional{ended->reply->sum} : std::nullopt);
  }
  if (random.below(2) == 0) (void)guest.close(random.time()); // else by its destructor
}

TEST(endpoints_stress, end_each_call_once_with_its_own_reply) {
  const watchdog dog{"two endpoints in full use", 500s};
  const rowe::tests::test_seed seed;
  failures wrong;
  auto robot = rowe::endpoint::listen(0, options()).value();
  auto desk = rowe::endpoint::connect(url_of(robot), options()).value();
  ASSERT_TRUE(desk.wait_peer(20s));
  std::atomic<int> busy{1}; // this thread, until all have begun
  std::atomic<int> looping{0};
  std::atomic<bool> answered{false};
  std::deque<std::thread> threads;

  // All go on until a call of a loop was answered, however late on a machine that is busy: a direct message
  // that no thread receives any more would keep what its peer sends after it from being read. Loops go on
  // until their own calls have ended, too.
  const auto run_loop = [&](rowe::endpoint& at, const char* provides, const char* asks, bool receives) {
    threads.emplace_back([&, provides, asks, receives, own = seed + threads.size()] {
      loop one{at, provides, asks, receives, own, wrong};
      ++looping;
      for (; busy != 0; std::this_thread::yield()) {
        one.turn(true);
        if (one.answered() != 0) answered = true;
      }
      for (; !one.settled(); std::this_thread::yield()) one.turn(false);
    });
  };
  const auto run = [&](std::uint64_t turns, auto turn) {
    ++busy;
    threads.emplace_back([&busy, &answered, turns, turn]() mutable {
      for (std::uint64_t i = 0; i < turns || !answered; ++i) turn();
      --busy;
    });
  };
  run_loop(robot, "add", "mul", true);
  run_loop(desk, "mul", "add", false);
  while (looping != 2) std::this_thread::yield();
  for (std::uint64_t i = 0; i != 2; ++i) {
    run(stressed(300), [one = ordinary_thread{robot, "mul", seed + 10 + i, wrong}]() mutable { one.turn(); });
    run(stressed(300), [one = ordinary_thread{desk, "add", seed + 20 + i, wrong}]() mutable { one.turn(); });
  }
  run(stressed(30),
      [&, random = random_source{seed + 30}]() mutable { open_and_close(robot, random, wrong); });
  run(stressed(30),
      [&, random = random_source{seed + 31}]() mutable { open_and_close(desk, random, wrong); });
  run(stressed(15), [&, random = random_source{seed + 32}]() mutable { visit(robot, random, wrong); });
  --busy;
  for (std::thread& thread : threads) thread.join();

  EXPECT_EQ(wrong.text(), "");
  for (const rowe::endpoint* one : {&robot, &desk}) {
    EXPECT_EQ(count_of(*one, "replies_foreign"), 0U);
    EXPECT_EQ(count_of(*one, "violations"), 0U);
  }
}

} // namespace
