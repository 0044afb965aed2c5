// SPDX-License-Identifier: Apache-2.0
// Ordinary threads of a simulated process: they carry out what the grammar says of them. By the submission
// queue and the shared inbox they send, call, receive, reply and wait, or give up before the outcome is
// there. By local_stop they ask for the stop and for its reset, as detail::local_stops does; a step at a
// time, for a world has one thread. What each step came upon is a state of the coverage table.
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "service/core/core_harness.hpp"
#include "service/threads/local_stop.hpp"
#include "swarm_coverage.hpp"
#include "swarm_grammar.hpp"

namespace swarm {

class threads {
 public:
  using connection_ref = rowe::detail::peer_ref;

  explicit threads(harness::core_harness& on) : on_{on} {}

  // Connections that are there, and some that have ended.
  std::vector<connection_ref> connections{}, ended{};

  // What it came upon, which says nothing where it asks for a stop or a reset. Empty where it did not get as
  // far.
  std::optional<state> carry_out(choices& from, const recipe& what, const saying& said) {
    const std::string_view name = operations()[what.operation].name;
    if (name == "thread_message") return submit(from, what, said, rowe::detail::entry::message);
    if (name == "thread_call") return submit(from, what, said, rowe::detail::entry::invocation);
    if (name == "thread_receive") return receive();
    if (name == "thread_reply") return answer(what, said, rowe::detail::entry::reply);
    if (name == "thread_refusal") return answer(what, said, rowe::detail::entry::refusal);
    if (name == "thread_wait") return wait(from);
    if (name == "thread_stop") return stop(what);
    if (name == "thread_reset") return reset(from, what, said);
    return hear();
  }

  // Takes the outcomes that are there, gives up the others, and gives back what was received.
  void finish_up() {
    while (!waiting_.empty()) (void)take_outcome(0);
    while (receive() != state::inbox_empty) continue;
    asked_calls_.clear();
    answered_calls_.clear();
  }

  // ---- the stop, for those who check it

  // Whether a thread of this process has asked for a stop since the last call.
  bool take_asked() { return std::exchange(stop_asked_, false); }
  // The reset that is waited for: how many stops had been carried out when the service thread had first
  // looked at it (what it had read before is older), and whether threads of this process have asked for one
  // since.
  bool resets() const { return asked_.resets != answered_.resets; }
  rowe::time_point reset_until() const { return asked_.until; }
  const std::optional<std::uint64_t>& stops_at_reset() const { return stops_at_reset_; }
  void note_looked() {
    if (!stops_at_reset_) stops_at_reset_ = on_.count(rowe::service::counter::stops);
  }
  bool reset_overtaken() const { return reset_overtaken_; }
  const rowe::service::local_stop_answered& answered() const { return answered_; }
  bool waits_for_stop() const { return asked_.stops != answered_.stops; }
  // After a cycle.
  void listen() { on_.shared.stops.read_answers(answered_); }

 private:
  rowe::duration time_of(choices& from, std::string_view how) const {
    using namespace std::chrono_literals;
    constexpr rowe::duration longs[] = {40ms, 200ms, 1s};
    if (how == "none") return 0ns;
    if (how == "short") return 3ms;
    if (how == "long") return from.one_of(longs);
    return rowe::rt::for_ever;
  }
  connection_ref addressee(choices& from, std::string_view how) const {
    const auto& of = how == "peer" ? connections : ended;
    return how == "everyone" || of.empty() ? connection_ref{} : of[from.below(of.size())];
  }
  std::optional<state> submitted(const rowe::result<std::uint32_t>& slot, bool waits) {
    if (!slot) return slot.code() == rowe::errc::full ? state::queue_full : state::queue_refuses;
    if (waits) waiting_.push_back(*slot);
    return state::queue_takes;
  }

  std::optional<state> submit(choices& from, const recipe& what, const saying& said, rowe::detail::entry as) {
    const bool calls = as == rowe::detail::entry::invocation;
    const bool waits = calls || value_of(what, "outcome") == "waits";
    const rowe::duration time = time_of(from, value_of(what, calls ? "timeout" : "ttl"));
    return submitted(on_.submissions.submit({.what = as,
                                             .wants_outcome = waits,
                                             .peer = addressee(from, value_of(what, "to")),
                                             .stamped = on_.now,
                                             .expires = rowe::rt::deadline_after(on_.now, time)},
                                            said.text),
                     waits);
  }

  state receive() {
    const auto slot = on_.inbox.try_receive(on_.now);
    if (!slot) return state::inbox_empty;
    const auto came = on_.inbox.header(*slot);
    (void)on_.inbox.release(*slot); // the next cycle comes anyway
    if (came.what != rowe::detail::entry::invocation) return state::inbox_message;
    asked_calls_.push_back(came.call);
    return state::inbox_call;
  }

  std::optional<state> answer(const recipe& what, const saying& said, rowe::detail::entry as) {
    const std::string_view which = value_of(what, "call");
    std::deque<rowe::detail::call_ref>& of = which == "answered" ? answered_calls_ : asked_calls_;
    if (asked_calls_.empty()) (void)receive(); // a thread that has no call to answer looks for one
    if (of.empty()) return {};
    const rowe::detail::call_ref call = which == "newest" ? of.back() : of.front();
    if (which != "answered") {
      which == "newest" ? of.pop_back() : of.pop_front();
      answered_calls_.push_back(call);
      if (answered_calls_.size() > 4) answered_calls_.pop_front();
    }
    const bool waits = value_of(what, "outcome") == "waits";
    return submitted(on_.submissions.submit(
                         {.what = as, .wants_outcome = waits, .call = call, .stamped = on_.now}, said.text),
                     waits);
  }

  // A thread that gives up before the end may not look again.
  state take_outcome(std::size_t which) {
    auto& queue = on_.submissions;
    const std::uint32_t slot = waiting_[which];
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(which));
    if (!queue.wait(slot, rowe::time_point{std::chrono::nanoseconds{1}})) // long past, so it does not sleep
      return state::outcome_given_up;
    const bool good = static_cast<bool>(queue.outcome(slot));
    queue.release(slot);
    return good ? state::outcome_good : state::outcome_bad;
  }
  std::optional<state> wait(choices& from) {
    if (waiting_.empty()) return {};
    return take_outcome(static_cast<std::size_t>(from.below(waiting_.size())));
  }

  // ---- the stop

  template <std::size_t Bytes>
  static void assign_cut(rowe::fixed_string<Bytes>& to, std::string_view how, std::uint64_t odd) {
    std::string text;
    if (how == "one") text = "thread";
    if (how == "one_of_many") text = "t" + std::to_string(odd % 1000);
    if (how == "longest") text = std::string(Bytes, 's');
    if (how == "long_escaped") text = std::string(Bytes + 40, '\n');
    if (how == "number") text = "7";
    (void)to.assign(std::string_view{text}.substr(0, Bytes)); // so it fits
  }
  void write_request() {
    if (words_behind_) ++asked_.stops;
    on_.shared.stops.write_request(asked_);
    on_.shared.stops.request();
    note_stop();
    words_behind_ = false;
  }
  void note_stop() {
    stop_asked_ = true;
    if (resets()) reset_overtaken_ = true;
  }
  // Another thread is handing in its words: the stop goes in front of ours.
  std::optional<state> stop(const recipe& what) {
    if (words_behind_) write_request();
    assign_cut(asked_.source, value_of(what, "source"), what.odd);
    assign_cut(asked_.reason, value_of(what, "reason"), what.odd);
    if (value_of(what, "words") == "with_it") {
      ++asked_.stops;
      write_request();
    } else {
      on_.shared.stops.request();
      note_stop();
      words_behind_ = true;
    }
    return state::heard_nothing;
  }
  // By one thread at a time, from its asking to its answer.
  std::optional<state> reset(choices& from, const recipe& what, const saying& said) {
    if (resets()) return {};
    if (words_behind_) write_request();
    ++asked_.resets;
    asked_.number = static_cast<std::uint64_t>(said.number); // 0 where none is named
    asked_.until = rowe::rt::deadline_after(on_.now, time_of(from, value_of(what, "timeout")));
    asked_.count_before_reset = on_.shared.stops.count();
    stops_at_reset_.reset();
    reset_overtaken_ = false;
    on_.shared.stops.write_request(asked_);
    return state::heard_nothing;
  }
  state hear() {
    if (words_behind_) write_request();
    listen();
    if (resets() || (answered_.resets == said_resets_ && answered_.stops == said_stops_))
      return state::heard_nothing;
    if (std::exchange(said_stops_, answered_.stops) != answered_.stops && answered_.resets == said_resets_)
      return state::heard_acknowledged;
    said_resets_ = answered_.resets;
    if (answered_.reset_outcome) return state::heard_reset;
    return answered_.reset_outcome.code() == rowe::errc::timed_out ? state::heard_too_late
                                                                   : state::heard_refused;
  }

  harness::core_harness& on_;
  std::vector<std::uint32_t> waiting_; // slots of the submission queue
  std::deque<rowe::detail::call_ref> asked_calls_, answered_calls_;

  rowe::service::local_stop_asked asked_{};
  rowe::service::local_stop_answered answered_{};
  std::uint64_t said_stops_ = 0, said_resets_ = 0; // of which this was said
  std::optional<std::uint64_t> stops_at_reset_{};
  bool stop_asked_ = false;
  bool reset_overtaken_ = false;
  bool words_behind_ = false;
};

} // namespace swarm
