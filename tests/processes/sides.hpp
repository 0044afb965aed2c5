// SPDX-License-Identifier: Apache-2.0
// The other side as the tests hold it: a process that can be hurt, or a thread. What it tells is gathered,
// and waited for with an end.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "api/seen.hpp"
#include "part.hpp"

namespace sides {

using namespace std::chrono_literals;
using rowe::endpoint;
using rowe::errc;
using rowe::json_text;
using rowe::message;
using rowe::tests::count_of;

inline constexpr auto timeout = 60s; // a watchdog: far above what anything here takes, sanitizers included

// Whether `ready` comes true before the watchdog barks.
template <class Ready>
bool eventually(Ready&& ready) {
  return rowe::tests::eventually(ready, timeout, 1ms); // other processes want the core, too
}

inline std::string url_of(std::uint16_t port) {
  return "ws://" + rowe::tests::own_address() + ":" + std::to_string(port);
}

// Test thread only.
class side {
 public:
  virtual ~side() = default;

  // All that it told so far which begins with `begin`, in order.
  std::vector<std::string> told(std::string_view begin) {
    listen();
    std::vector<std::string> found;
    std::copy_if(lines_.begin(), lines_.end(), std::back_inserter(found),
                 [&](const std::string& line) { return line.starts_with(begin); });
    return found;
  }
  // Waits for the `count`-th line which begins so; empty where it does not come.
  std::string line(std::string_view begin, std::size_t count = 1) {
    std::vector<std::string> found;
    const bool came = eventually([&] {
      found = told(begin);
      return found.size() >= count;
    });
    EXPECT_TRUE(came) << "the other side told no '" << begin << "'";
    return came ? found[count - 1] : std::string{};
  }
  // The process it runs in.
  virtual pid_t process() const = 0;
  // Where it listens; 0 as a client.
  std::uint16_t port() { return static_cast<std::uint16_t>(std::atoi(line("ready ").c_str() + 6)); }

 protected:
  virtual void listen() = 0; // appends to lines_ what is new
  std::vector<std::string> lines_;
};

class thread_side final : public side {
 public:
  explicit thread_side(rowe::endpoint made)
      : as_{std::move(made)},
        acts_{as_, [this](std::string_view what,
                          std::string_view text) { tell(std::string{what} + " " + std::string{text}); }},
        thread_{[this] {
          while (const auto now = loop_.wait()) acts_.step(*now);
        }} {
    tell("ready " + std::to_string(as_.port()));
  }
  ~thread_side() override {
    loop_.stop();
    thread_.join();
  }
  pid_t process() const override { return ::getpid(); }

 private:
  void tell(std::string line) {
    const std::lock_guard lock{mutex_};
    fresh_.push_back(std::move(line));
  }
  void listen() override {
    const std::lock_guard lock{mutex_};
    std::move(fresh_.begin(), fresh_.end(), std::back_inserter(lines_));
    fresh_.clear();
  }

  std::mutex mutex_;
  std::vector<std::string> fresh_;
  rowe::endpoint as_;
  part::actor acts_;
  rowe::rt::periodic loop_{1ms};
  std::thread thread_;
};

// Killed with its test, at the latest.
class process_side final : public side {
 public:
  process_side(const char* role, const std::string& where) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error{"no pipe"};
    const std::string address = rowe::tests::own_address();
    const bool listens = std::strcmp(role, "listen") == 0;
    const char* const words[] = {ROWE_ACTOR, role, where.c_str(), listens ? address.c_str() : nullptr,
                                 nullptr};
    process_ = ::fork();
    if (process_ == 0) { // of a process with threads: only what a signal handler may call
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::dup2(ends[1], STDOUT_FILENO);
      ::execv(words[0], const_cast<char* const*>(words));
      ::_exit(127);
    }
    ::close(ends[1]);
    output_ = ends[0];
    ::fcntl(output_, F_SETFL, O_NONBLOCK);
    (void)line("ready ");
  }
  ~process_side() override {
    kill();
    ::close(output_);
  }
  process_side(const process_side&) = delete;
  process_side& operator=(const process_side&) = delete;

  pid_t process() const override { return process_; }

  // Returns when it is no more; what it told stays.
  void kill() {
    if (process_ <= 0 || dead_) return;
    EXPECT_EQ(::kill(process_, SIGKILL), 0);
    int how = 0;
    EXPECT_EQ(::waitpid(process_, &how, 0), process_);
    EXPECT_TRUE(WIFSIGNALED(how)) << "it had ended by itself, with " << WEXITSTATUS(how);
    dead_ = true;
  }
  // Returns when it stands still: its sockets stay open, and the kernel goes on acknowledging.
  void stop() {
    ASSERT_EQ(::kill(process_, SIGSTOP), 0);
    int how = 0;
    ASSERT_EQ(::waitpid(process_, &how, WUNTRACED), process_);
    ASSERT_TRUE(WIFSTOPPED(how));
  }
  void go_on() { ASSERT_EQ(::kill(process_, SIGCONT), 0); }

 private:
  void listen() override {
    char buffer[4096];
    for (ssize_t bytes; (bytes = ::read(output_, buffer, sizeof buffer)) > 0;) {
      begun_.append(buffer, static_cast<std::size_t>(bytes));
    }
    for (std::size_t end; (end = begun_.find('\n')) != begun_.npos;) {
      lines_.push_back(begun_.substr(0, end));
      begun_.erase(0, end + 1);
    }
  }

  pid_t process_ = -1;
  bool dead_ = false;
  int output_ = -1;
  std::string begun_; // a line without its end
};

inline rowe::time_point clock_now() { return rowe::rt::monotonic_clock::now(); }

// Makes calls that are to run out of time, until `count` of them or more have gone out: one that the service
// thread takes up when its time is over already never does. Where that thread gets no processor for long, it
// does not end them either, and no row is left for another.
template <class Call>
bool go_out(const rowe::endpoint& by, std::uint64_t count, Call&& call) {
  const std::uint64_t all = count_of(by, "calls_out") + count;
  return eventually([&] {
    const rowe::errc how = call().code();
    EXPECT_TRUE(how == rowe::errc::timed_out || how == rowe::errc::too_many_calls) << static_cast<int>(how);
    return count_of(by, "calls_out") >= all;
  });
}

// The next end of a call that was started.
template <class Handle>
auto next_completion(Handle& of) {
  auto ended = of.try_finish();
  EXPECT_TRUE(eventually([&] {
    if (!ended && ended.code() == rowe::errc::empty) ended = of.try_finish();
    return ended || ended.code() != rowe::errc::empty;
  }));
  return ended;
}

// Calls until somebody provides it: a service that was just advertised may still be on its way.
inline rowe::result<part::total> call_when_there(rowe::caller<part::numbers, part::total>& add,
                                                 const part::numbers& what) {
  auto answer = add.call(what, timeout);
  EXPECT_TRUE(eventually([&] {
    if (!answer && answer.code() == rowe::errc::no_service) answer = add.call(what, timeout);
    return answer || answer.code() != rowe::errc::no_service;
  }));
  return answer;
}

template <class Result>
void expect_total(const Result& answer, double sum) {
  ASSERT_TRUE(answer) << answer.error().name();
  EXPECT_EQ(answer->sum, sum);
}

// The other side is asked to ask us, and told our answer.
inline void be_asked(rowe::lane& by, rowe::responder<part::numbers, part::total>& ours, side& there,
                     std::size_t times = 1) {
  ASSERT_TRUE(by.send(R"({"ask":true})", rowe::rt::for_ever));
  auto asked = ours.next(timeout);
  ASSERT_TRUE(asked) << asked.error().name();
  EXPECT_EQ(asked->value().a + asked->value().b, 42);
  ASSERT_TRUE(ours.reply(*asked, {asked->value().a + asked->value().b}));
  EXPECT_EQ(there.line("sum ", times), "sum 42");
}

} // namespace sides
