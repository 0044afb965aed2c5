// SPDX-License-Identifier: Apache-2.0
// What is true in a world of drivers (flow_driving.hpp), known without the core's rules: when each command
// was really sent, and by which connection; who was told that it drives; and since when the robot is stopped.
// A command carries a number of its own, by which it is known wherever it appears.
#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rowe/detail/stop_permit.hpp>
#include <rowe/schema.hpp>

#include "swarm_context.hpp"

namespace flow {

// What loops are driven by.
struct driven_command {
  std::int64_t n; // its number
};

} // namespace flow

template <>
inline constexpr auto
    rowe::schema<flow::driven_command> = rowe::fields<&flow::driven_command::n>{}.type("sim/Driven");

namespace flow {

using namespace std::chrono_literals;
using rowe::rt::duration;
using rowe::rt::time_point;

class driving_oracle {
 public:
  using author = std::uint32_t; // a connection, numbered anew when its peer connects again
  static constexpr author this_process = 0;
  static constexpr author nobody = UINT32_MAX;
  static constexpr duration hold_min = 2s;      // as hold_ms says
  static constexpr duration under_way_max = 5s; // what is said, on any link
  using failing = std::function<void(std::string_view invariant, const std::string& what)>;

  driving_oracle(time_point start, failing fail) : start_{start}, fail_{std::move(fail)} {}

  void fail(std::string_view invariant, const std::string& what) { fail_(invariant, what); }
  void add_topic(const std::string& name, duration lease) { topics_[name].lease = lease; }
  duration lease(const std::string& topic) const { return topics_.at(topic).lease; }
  duration hold(const std::string& topic) const { return std::max(lease(topic), hold_min); }

  // ---- who there is

  // `shown`: as the state of control names it, unless it chooses a name; "": it cannot be told from others.
  author add_author(std::string shown) {
    authors_.push_back({.shown = std::move(shown)});
    return static_cast<author>(authors_.size() - 1);
  }
  // The core knows that this connection is over.
  void note_gone(author who, time_point now) { authors_[who].gone_at = std::min(authors_[who].gone_at, now); }
  bool gone(author who) const { return authors_[who].gone_at != rowe::rt::never; }

  // ---- what they say

  // A command is sent at `now`, by a connection that may be `nobody` yet. With a tick that was made up, which
  // nobody can tell from one that was issued, it counts as sent when that tick is issued.
  std::int64_t say(author by, const std::string& topic, time_point now, std::int64_t tick) {
    const time_point at = counted(now, tick);
    commands_.push_back({by, at});
    if (by != nobody) note_said(by, topic, at);
    return static_cast<std::int64_t>(commands_.size()) - 1;
  }
  // One that nobody has sent yet waits for a connection, and this is it. It is as old as it is.
  void give(std::int64_t n, author by, const std::string& topic) {
    commands_[index(n)].by = by;
    note_said(by, topic, sent(n));
  }
  // A request to take control, or to keep it.
  void ask(author by, const std::string& topic, time_point now, std::int64_t tick) {
    note_said(by, topic, counted(now, tick));
  }
  void release(author by, const std::string& topic, time_point now) { topics_[topic].released[by] = now; }
  // Of what a command is sent with: each fourth has a time to live of its own.
  static duration ttl(std::int64_t n) {
    constexpr duration ttls[] = {10ms, 40ms, 120ms, 2000ms};
    return n % 4 == 0 ? ttls[index(n / 4) % std::size(ttls)] : rowe::rt::for_ever;
  }
  author author_of(std::int64_t n) const { return known(n) ? commands_[index(n)].by : nobody; }
  time_point sent(std::int64_t n) const { return commands_[index(n)].at; }
  bool known(std::int64_t n) const { return n > 0 && index(n) < commands_.size(); }
  // When the newest command was sent, or the newest request to keep control.
  time_point newest() const { return newest_; }
  time_point newest(author by, const std::string& topic) const {
    const auto& all = topics_.at(topic).said;
    const auto found = all.find(by);
    return found == all.end() ? time_point{} : found->second;
  }

  // ---- what the core says

  // A tick that the core issues at `now`. From one follow the times of all.
  void note_tick(std::int64_t tick, time_point now) { tick_0_ = tick - milliseconds(now); }
  // The word by which loops are stopped and let go, after a cycle.
  void note_permit(std::uint64_t word, time_point now) {
    const bool stopped = rowe::detail::permit::time_of(word) == 0;
    const auto number = rowe::detail::permit::number_of(word);
    if (stopped != stopped_ || number != permit_number_) voided_at_ = now;
    stopped_ = stopped;
    permit_number_ = number;
  }
  bool stopped() const { return stopped_; }
  time_point voided_at() const { return voided_at_; } // the newest stop or reset

  // The state of control after a cycle. `driver`: as it is written; "null": nobody.
  void note_state(const std::string& topic, std::int64_t number, std::string_view driver, time_point now) {
    auto& of = topics_[topic];
    of.before = {of.number, of.driver};
    of.number = number;
    of.driver = driver == "null" ? "" : std::string{driver};
    of.changed_at = now;
    if (const author who = shown_as(of.driver); who != nobody)
      claim(topic, number, who, "is shown as the driver");
  }
  // An answer to one that asked for control.
  void note_answer(author to, const std::string& topic, std::int64_t number, bool yours) {
    if (yours) claim(topic, number, to, "is told that it drives");
  }
  bool driven(const std::string& topic) const { return !topics_.at(topic).driver.empty(); }
  std::int64_t number(const std::string& topic) const { return topics_.at(topic).number; }
  // Who drives, as far as it is known.
  author driver(const std::string& topic) const {
    const auto& of = topics_.at(topic);
    const auto found = of.owners.find(of.number);
    return of.driver.empty() || found == of.owners.end() ? nobody : found->second;
  }

  // ---- what must hold

  // After each cycle, with what it admitted: the commands that somebody was passed who has no lease.
  void check_cycle(const std::string& topic, const std::vector<std::int64_t>& admitted, time_point now) {
    auto& of = topics_[topic];
    std::int64_t changes = 0;
    for (const std::int64_t n : admitted) {
      if (!known(n)) continue;                    // one with wrong members
      if (author_of(n) == this_process) continue; // anybody here hears it, whether or not it counts
      check_age(topic, n, now, "is admitted");
      if (sent(n) <= voided_at_)
        fail_("drive_stop", named(n, now) + " is admitted, sent before the newest stop or reset");
      changes += author_of(n) != of.admitted_last;
      of.admitted_last = author_of(n);
      of.admitted_at = now;
    }
    if (changes > of.number - of.number_then)
      fail_("drive_two", "commands of " + std::to_string(changes) + " other drivers on " + topic +
                             ", and control has changed " + std::to_string(of.number - of.number_then) +
                             " times");
    if (of.admitted_at == now) of.number_then = std::max(of.number_then + changes, of.number_before);
    of.number_before = of.number;
    const author who = driver(topic);
    if (who == nobody) return;
    // One that was cut off at the end of a cycle is shown until the next one.
    if (authors_[who].gone_at < now)
      fail_("drive_gone", "connection " + std::to_string(who) + " is over, and drives " + topic);
    if (const duration silent = now - newest(who, topic); silent >= hold(topic))
      fail_("drive_hold", "connection " + std::to_string(who) + " drives " + topic +
                              ", and has been silent for " + text(silent));
  }
  // At each look of a loop: what is in force then.
  void check_in_force(const std::string& topic, std::int64_t n, time_point now) {
    if (!known(n)) return fail_("whole", "nobody has said what is in force: " + std::to_string(n));
    check_age(topic, n, now, "is in force");
    if (stopped_) fail_("drive_stop", named(n, now) + " is in force while the robot is stopped");
    if (sent(n) <= voided_at_)
      fail_("drive_stop", named(n, now) + " is in force, sent before the newest stop or reset");
    if (!driven(topic))
      return fail_("drive_two", named(n, now) + " is in force on " + topic + ", which nobody drives");
    claim(topic, number(topic), author_of(n), "has a command in force");
    if (gone(author_of(n))) fail_("drive_gone", named(n, now) + " is in force, of who is gone");
  }
  // Whether the newest driver of the topic took over from one that had not let go: it said so, left, or was
  // silent for some time.
  bool took_over(const std::string& topic) const {
    const auto& of = topics_.at(topic);
    if (of.driver.empty() || of.before.driver.empty() || of.number != of.before.number + 1) return false;
    const auto found = of.owners.find(of.before.number);
    if (found == of.owners.end()) return false;
    const author who = found->second;
    const auto released = of.released.find(who);
    const bool let_go = released != of.released.end() && of.changed_at - released->second < under_way_max;
    return !gone(who) && !let_go && of.admitted_last == who && of.changed_at - of.admitted_at < hold_min / 2;
  }

 private:
  struct sent_command {
    author by;
    time_point at; // that it counts from
  };
  struct author_row {
    std::string shown;
    time_point gone_at = rowe::rt::never;
  };
  struct shown_state {
    std::int64_t number = 0;
    std::string driver;
  };
  struct topic_row {
    duration lease{};
    std::int64_t number = 0;
    std::string driver; // as it is written; empty: nobody
    shown_state before;
    time_point changed_at{};
    std::map<std::int64_t, author> owners; // of each number of control
    std::map<author, time_point> released; // it has asked for that last
    std::map<author, time_point> said;
    author admitted_last = nobody;
    time_point admitted_at{};
    std::int64_t number_before = 0; // at the end of the last cycle
    std::int64_t number_then = 0;   // when something was admitted last, at least
  };

  static std::size_t index(std::int64_t n) { return static_cast<std::size_t>(n); }
  static std::string text(duration d) { return std::to_string(d / 1us) + " us"; }
  std::int64_t milliseconds(time_point now) const {
    return std::chrono::floor<std::chrono::milliseconds>(now - start_).count();
  }
  time_point counted(time_point now, std::int64_t tick) const {
    if (tick < tick_0_ || tick - tick_0_ > 1'000'000'000) return now; // of no time there is
    return std::max(now, start_ + 1ms * (tick - tick_0_));
  }
  void note_said(author by, const std::string& topic, time_point at) {
    auto& newest = topics_[topic].said[by];
    newest = std::max(newest, at);
    newest_ = std::max(newest_, at);
  }
  std::string named(std::int64_t n, time_point now) const {
    return "command " + std::to_string(n) + " of connection " + std::to_string(author_of(n)) + ", sent " +
           text(now - sent(n)) + " ago,";
  }
  void check_age(const std::string& topic, std::int64_t n, time_point now, const char* what) {
    if (now - sent(n) >= lease(topic))
      fail_("drive_lease", named(n, now) + ' ' + what + ", and the lease is " + text(lease(topic)));
    if (author_of(n) != this_process && now - sent(n) >= ttl(n))
      fail_("drive_ttl", named(n, now) + ' ' + what + ", and its time to live is " + text(ttl(n)));
  }
  // The connection that the state of control shows so; nobody: none, or not one alone.
  author shown_as(std::string_view driver) const {
    author found = nobody;
    for (author who = 0; who < authors_.size() && !driver.empty(); ++who) {
      if (gone(who) || driver != '"' + authors_[who].shown + '"') continue;
      if (found != nobody) return nobody;
      found = who;
    }
    return found;
  }
  // Each number of control is one driver's.
  void claim(const std::string& topic, std::int64_t number, author who, const char* why) {
    const auto [at, is_new] = topics_[topic].owners.try_emplace(number, who);
    if (is_new || at->second == who) return;
    fail_("drive_two", "connection " + std::to_string(who) + ' ' + why + " under number " +
                           std::to_string(number) + " of " + topic + ", which is that of connection " +
                           std::to_string(at->second));
  }

  time_point start_;
  failing fail_;
  std::vector<author_row> authors_{{.shown = "this process"}};
  std::vector<sent_command> commands_{{nobody, {}}};
  std::map<std::string, topic_row> topics_;
  time_point newest_{};
  std::int64_t tick_0_ = INT64_MAX; // that of the start, once it is known
  bool stopped_ = true;
  rowe::detail::latch_number permit_number_ = 0;
  time_point voided_at_{};
};

} // namespace flow
