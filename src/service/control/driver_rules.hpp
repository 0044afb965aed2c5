// SPDX-License-Identifier: Apache-2.0
// Folder control: who drives a topic, and which commands are in force. No calls.
// The rules of one driven topic (docs/drive.md), as a function of time and of what peers do. No I/O, no
// clock, no connections: a peer is a name and a number that is never used again. Service thread only; nothing
// waits or allocates.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include <rowe/rt/clock.hpp>

namespace rowe::service {

// As peers get times.
constexpr std::int64_t whole_ms(rt::duration time) noexcept {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
}

class driver_rules {
 public:
  static constexpr std::size_t name_bytes_max = 64; // a longer one is cut
  // How long a driver keeps control at least, counted from its last command that was accepted, or from when
  // it last said that it keeps control.
  static constexpr rt::duration kept_for_min = std::chrono::seconds{2};
  // How old a tick may be that comes with a request for control.
  static constexpr rt::duration tick_age_max = std::chrono::seconds{2};
  // After somebody took over, how long nobody else may.
  static constexpr rt::duration take_over_pause = std::chrono::seconds{1};

  // Who asks. `peer`: 0 is nobody's.
  struct asker {
    std::uint64_t peer = 0;
    std::string_view name{};
    bool may_drive = true;
    bool may_take_over = true;
  };

  // Nobody drives, and nothing that was sent until `now` counts.
  void begin(rt::duration lease, rt::time_point now) noexcept;
  // Of several handles, the shortest.
  void set_lease(rt::duration lease) noexcept;
  rt::duration lease() const noexcept { return lease_; }
  rt::duration kept_for() const noexcept;

  // ---- control
  enum class refusal : std::uint8_t { none, topic, action, tick, role, driven, pause };
  static std::string_view name_of(refusal why) noexcept; // empty for none

  // Takes control, or keeps it. `over`: also from somebody else. `issued`: when the newest tick that the
  // asker had was issued; never: it had none.
  refusal take(const asker& by, bool over, rt::time_point issued, rt::time_point now) noexcept;
  // Ends the control of this peer, if it has it.
  void release(std::uint64_t peer, rt::time_point now) noexcept;

  // ---- commands
  enum class verdict : std::uint8_t {
    accepted,
    refused,  // somebody else drives
    unproven, // not known when it was sent
    stale,    // sent so long ago that the lease is over; or before the newest stop or reset
  };
  struct judged {
    verdict is;
    rt::time_point until{}; // accepted: until when it is in force
  };
  // What becomes of a command that was sent not before `sent`; never: not known. It changes nothing yet.
  judged judge(std::uint64_t peer, rt::time_point sent, rt::time_point now) noexcept;
  // A command that was judged as accepted has reached a loop, so it counts. If nobody drives, its sender does
  // from now on.
  void count(const asker& by, rt::time_point sent, rt::time_point now) noexcept;
  // What was sent until `now` does not count any more, for the robot was stopped or reset.
  void void_commands(rt::time_point now) noexcept;

  // ---- time. In each cycle: ends the control of a driver that has been silent for too long.
  void update(rt::time_point now) noexcept {
    if (driver_ != 0 && kept_until_ <= now) end(now);
  }
  // When update() is needed at the latest.
  rt::time_point next_update() const noexcept { return driver_ != 0 ? kept_until_ : rt::never; }

  // ---- state
  bool driven() const noexcept { return driver_ != 0; }
  bool driven_by(std::uint64_t peer) const noexcept { return driver_ == peer && driver_ != 0; }
  std::string_view driver() const noexcept { return {name_.data(), name_bytes_}; }
  // Raised when somebody takes control, so two drivers of one name have two numbers.
  std::uint64_t number() const noexcept { return number_; }
  rt::time_point since() const noexcept { return since_; }             // this driver drives, or nobody
  rt::time_point accepted_at() const noexcept { return accepted_at_; } // its last command; zero: none
  // Raised when commands that were accepted before are not in force any more.
  std::uint64_t turn() const noexcept { return turn_; }
  // Raised when something that peers see changes, except ages.
  std::uint64_t version() const noexcept { return version_; }

 private:
  void give(const asker& to, rt::time_point now) noexcept;
  void end(rt::time_point now) noexcept;
  bool set_name(std::string_view name) noexcept;

  rt::duration lease_{};
  std::uint64_t driver_ = 0; // the peer; 0: nobody
  std::array<char, name_bytes_max> name_{};
  std::uint8_t name_bytes_ = 0;
  std::uint64_t number_ = 0;
  std::uint64_t turn_ = 0;
  std::uint64_t version_ = 1;
  rt::time_point since_{};
  rt::time_point kept_until_{};
  rt::time_point accepted_at_{};
  rt::time_point counts_after_{};  // only what was sent later counts: the newest stop or reset
  rt::time_point taken_over_at_{}; // zero: not yet
};

} // namespace rowe::service
