// SPDX-License-Identifier: Apache-2.0
// A driven topic in a swarm world, on which anybody publishes and this process too. Its loop looks after each
// cycle: what is in force then must not be older than its lease, nor of a peer that has gone, and nothing is
// while the robot is stopped. Worlds without one draw nothing here, so they stay as they are.
#pragma once
#include <optional>
#include <string>
#include <utility>

#include <rowe/detail/stop_permit.hpp>

#include "swarm_context.hpp"
#include "swarm_process.hpp"

namespace swarm {

// Of the stream of choices about what only such worlds have.
inline constexpr std::uint64_t of_driving = 0xd1d1d1d1d1d1d1d1U;

class driven_loop {
 public:
  driven_loop(context& in, process& of, std::uint64_t seed)
      : in_{in}, process_{of}, seed_{seed}, random_{seed ^ of_driving}, start_{in.on.now} {}

  // Before anybody comes.
  void begin() {
    open();
    publisher_ = process_.open(
        handle_kind::publish_value,
        rowe::detail::advertise_request<reading>(driven_topic, {.shared = true, .type = "sim/Usual"}));
    if (publisher_ != nullptr) publisher_->honest = true;
    in_.on.cycle();
    far_end first{in_.on, in_.ours};
    first.tell(R"({"op":"call_service","service":"/rowe/control"})", 3);
    for (const std::string& text : first.hear()) tick_ = integer_after(text, R"("tick":)");
    first.leave();
    in_.on.cycles(3);
    first_tick_ = tick_ - milliseconds();
  }

  void act() {
    random_.restart(seed_ ^ of_driving, in_.step + 1);
    in_.known.control_tick = first_tick_ + milliseconds();
    if (loop_ == nullptr) return open();
    if (random_.one_in(400) || loop_->phase() == pair_phase::refused) {
      if (obeys_) in_.seen.add(flow_event::anybody_reopened);
      process_.close(*std::exchange(loop_, nullptr));
    }
    if (publisher_ != nullptr && random_.one_in(owns_ ? 4 : 200)) publisher_->act();
    if (random_.one_in(100)) owns_ = random_.one_in(4);
  }

  // Before the process closes all it has.
  void end() { loop_ = publisher_ = nullptr; }

  // After each cycle.
  void look() {
    note_dropped();
    obeys_ = false;
    if (loop_ == nullptr || loop_->phase() != pair_phase::active) return;
    const auto in_force = loop_->in_force();
    if (!in_force) return;
    obeys_ = true;
    const publication& of = in_.message(static_cast<std::uint32_t>(in_force->n));
    in_.seen.add(of.by == 0 ? flow_event::anybody_own : flow_event::anybody_obeyed);
    const std::string named = "command " + std::to_string(in_force->n) + " of p" + std::to_string(of.by);
    if (in_.stop_in_use && rowe::detail::permit::time_of(in_.on.shared.permit.read()) == 0)
      in_.fail("commands", named + " is in force while the robot is stopped");
    if (in_.on.now - of.said >= lease_)
      in_.fail("commands", named + " is in force " + std::to_string((in_.on.now - of.said) / 1us) +
                               " us after it was said, and the lease is " + std::to_string(lease_ / 1us));
    if (of.gone != 0)
      in_.fail("commands", named + " is in force, and that peer left in step " + std::to_string(of.gone));
  }

 private:
  std::int64_t milliseconds() const {
    return std::chrono::floor<std::chrono::milliseconds>(in_.on.now - start_).count();
  }
  void open() {
    constexpr duration leases[] = {50ms, 300ms, 1000ms};
    lease_ = random_.one_of(leases);
    loop_ = process_.open(
        handle_kind::subscribe_value,
        rowe::detail::subscribe_request<reading>(driven_topic, {.type = "sim/Usual", .lease = lease_}));
    if (loop_ != nullptr) loop_->honest = true;
  }
  void note_dropped() {
    constexpr std::pair<counter, flow_event> all[] = {
        {counter::commands_stale, flow_event::anybody_stale},
        {counter::commands_unproven, flow_event::anybody_unproven},
        {counter::commands_refused, flow_event::anybody_refused},
        {counter::commands_stopped, flow_event::anybody_stopped},
        {counter::undecodable, flow_event::anybody_unreadable}};
    for (std::size_t i = 0; i < std::size(all); ++i) {
      const std::uint64_t now = in_.on.count(all[i].first);
      if (std::exchange(dropped_[i], now) != now) in_.seen.add(all[i].second);
    }
  }

  context& in_;
  process& process_;
  std::uint64_t seed_;
  seeded_choices random_;
  time_point start_;
  handle* loop_ = nullptr; // null: for a while there is none
  handle* publisher_ = nullptr;
  duration lease_{};
  std::int64_t tick_ = 0, first_tick_ = 0;
  std::array<std::uint64_t, 5> dropped_{};
  bool owns_ = false;  // this process publishes much
  bool obeys_ = false; // at the last look
};

} // namespace swarm
