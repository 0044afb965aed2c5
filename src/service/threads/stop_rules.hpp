// SPDX-License-Identifier: Apache-2.0
// The rules of the stop, as a function of time and of what peers and loops say: who stops, who may reset, and
// what the permit is. No I/O, no clock, no connections: a peer is a name and a number that is never used
// again. The core passes in what arrives, and asks what to publish. docs/stop.md has the rules in words.
// Service thread only.
//
// A tick is a number of milliseconds since the endpoint was opened, plus a seed chosen then. So a tick says
// when it was issued, and a tick of an earlier run is invalid.
//
// A stop has two numbers. `number` is its name for peers: every stop by a new source, and every reset, has
// one of its own, which is never used again. `latch` fits into the loops' words, 16 bits: it is raised with
// the number, but at most once in the millisecond of a tick. To the loops, the stops of one millisecond are
// one stop: a loop that has stopped for the first has stopped for all of them. Why that is enough:
// docs/decisions/0027-show-loops-one-stop-a-millisecond.md.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include <rowe/detail/stop_permit.hpp>
#include <rowe/options.hpp>
#include <rowe/rt/clock.hpp>

namespace rowe::json {
class writer;
}

namespace rowe::service {

enum class stop_cause : std::uint8_t { start, request, guard, loop, service };

class stop_rules {
 public:
  using latch_number = detail::latch_number;
  static constexpr std::size_t guards_max = 8;
  static constexpr std::size_t loops_max = 8;
  static constexpr std::size_t name_bytes_max = 31;   // of a guard or a loop
  static constexpr std::size_t source_bytes_max = 64; // of who stopped; a longer one is cut
  static constexpr std::uint32_t no_loop = UINT32_MAX;
  // How old a tick may be that comes with a reset.
  static constexpr rt::duration reset_tick_age_max = std::chrono::seconds{2};

  // `seed` decides where latch numbers and ticks begin. `options` stay where they are, and are settled().
  stop_rules(const stop_options& options, rt::time_point start, std::uint64_t seed) noexcept;

  // Whether names of guards and loops may have these characters: a to z, A to Z, 0 to 9 and . _ : / -
  static bool good_name(std::string_view name) noexcept;

  // ---- loops. The stop is in use from the first one on.
  bool in_use() const noexcept { return in_use_; }
  // no_loop when there are loops_max already. `words` must live until remove_loop().
  std::uint32_t add_loop(std::string_view name, rt::duration timeout, const detail::latch_words<>& words,
                         rt::time_point now) noexcept;
  // A loop that leaves while the robot may move stops it.
  void remove_loop(std::uint32_t loop, rt::time_point now) noexcept;

  // ---- requests of peers. `peer` tells one from another; two requests with the same peer and source are
  // repeats.
  void request(std::string_view source, std::uint64_t peer, rt::time_point now) noexcept;

  enum class refusal : std::uint8_t { none, number, tick, role, guards, loops, name };
  // `number` and `tick` as the peer sent them; negative: none.
  refusal reset(std::int64_t number, std::int64_t tick, bool role, rt::time_point now) noexcept;
  // A guard's heartbeat; the first one registers.
  refusal heartbeat(std::string_view guard, std::int64_t tick, bool resigns, std::uint64_t peer, bool role,
                    rt::time_point now) noexcept;
  // A connection has ended.
  void peer_gone(std::uint64_t peer, rt::time_point now) noexcept;
  bool guards_include(std::uint64_t peer) const noexcept;

  // ---- time. To be called in each cycle: looks at the loops' words, the guards and the clock.
  void update(rt::time_point now) noexcept;
  // When update() is needed at the latest, if nothing is asked before.
  rt::time_point next_update(rt::time_point now) const noexcept;
  // What update() and the requests granted or withdrew, for the permit.
  void write_permit(detail::permit_word<>& into) noexcept;

  // ---- state
  bool running() const noexcept { return running_; }
  // Below 2^53, which browsers can count to, for half a century of five million stops a second.
  std::uint64_t number() const noexcept { return number_; }
  latch_number latch() const noexcept { return latch_; }
  std::string_view source() const noexcept { return {source_.data(), source_bytes_}; }
  stop_cause cause() const noexcept { return cause_; }
  std::string_view cause_name() const noexcept; // empty when running
  // Raised whenever something that peers get changes, except ticks and ages.
  std::uint64_t version() const noexcept { return version_; }
  std::uint64_t tick(rt::time_point now) const noexcept;
  // When a tick was issued; never for one that was not.
  rt::time_point issued(std::int64_t tick, rt::time_point now) const noexcept;
  // When the last loop acknowledged this stop, as of the last update(); never, while one has not, or if there
  // is no loop.
  rt::time_point observed() const noexcept;
  // {"state":…} as docs/stop.md has it.
  void write_state(json::writer& into, rt::time_point now) const noexcept;
  static std::string_view name_of(refusal why) noexcept; // empty for none

 private:
  struct guard {
    std::array<char, name_bytes_max> name_buffer{};
    std::uint8_t name_bytes = 0; // 0: the place is free
    std::uint64_t peer = 0;      // 0: its connection has ended
    rt::time_point issued{};     // the newest tick it echoed
    rt::time_point until{};      // when its timeout ends

    std::string_view name() const noexcept { return {name_buffer.data(), name_bytes}; }
  };
  struct loop {
    const detail::latch_words<>* words = nullptr; // null: the place is free
    std::array<char, name_bytes_max> name_buffer{};
    std::uint8_t name_bytes = 0;
    rt::duration timeout{};
    rt::time_point since{};                           // it counts as having looked then
    detail::latch_words<>::acknowledgment answered{}; // the one that update() saw last,
    std::uint64_t answered_number = 0;                // and the stop's number that it was for

    std::string_view name() const noexcept { return {name_buffer.data(), name_bytes}; }
  };

  void stop(stop_cause cause, std::string_view source, rt::time_point now) noexcept;
  void raise_number(rt::time_point now) noexcept;
  void set_source(std::string_view source) noexcept;
  bool is_held(latch_number by_a_loop) const noexcept;
  void outdate_ticks(rt::time_point now) noexcept;
  bool is_new(std::uint64_t asker) noexcept;
  guard* find_guard(std::string_view name) noexcept;
  bool guarded(rt::time_point now) const noexcept;
  bool loops_ready(rt::time_point now) const noexcept;
  rt::time_point last_look(const loop& l) const noexcept;
  // Stops if a guard or a loop has failed. True if one has.
  bool find_trouble(rt::time_point now) noexcept;
  rt::time_point run_until(rt::time_point now) const noexcept; // until when loops may move

  const stop_options& options_;
  const rt::time_point start_;
  const std::uint64_t first_tick_;

  bool in_use_ = false;
  bool running_ = false;
  stop_cause cause_ = stop_cause::start;
  std::uint64_t number_;
  latch_number latch_;
  std::uint64_t latch_number_{};   // the stop's number when the latch's was raised last,
  std::uint64_t latch_tick_;       // and the tick
  std::uint64_t reset_tick_least_; // a reset must have a tick issued after the newest request to stop
  rt::time_point since_;           // of this number: when it was stopped or reset
  std::array<char, source_bytes_max> source_{};
  std::size_t source_bytes_ = 0;
  std::uint64_t version_ = 1;

  // Who asked for this stop. If the list is full, an asker that is not in it counts as new each time. That
  // errs on the safe side.
  std::array<std::uint64_t, 16> askers_{};
  std::size_t asker_count_ = 0;

  std::array<guard, guards_max> guards_{};
  std::array<loop, loops_max> loops_{};

  rt::time_point until_{}; // what the permit is to say; 0: withdrawn
  bool permit_changed_ = true;
};

} // namespace rowe::service
