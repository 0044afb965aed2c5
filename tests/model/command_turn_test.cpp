// SPDX-License-Identifier: Apache-2.0
// The turn of commands under the explorer, with the permit and the window that order it: a loop that looks at
// the permit, reads the newest command and asks whether its turn lasts, as subscriber::latest_within() does.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/detail/command_turn.hpp>
#include <rowe/detail/stop_permit.hpp>
#include <rowe/rt/window.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"

namespace rowe::model {
namespace command_turn_test {
namespace {

using command_window = rt::window<std::int64_t, atomics>; // a command is the number of its turn

constexpr rt::time_point at(std::int64_t n) {
  return rt::time_point{rt::duration{n << detail::permit::unit_shift}};
}
constexpr rt::time_point far = at(1000);

struct loop_and_service {
  command_window commands;
  command_window::writer& in{*commands.take_writer()};
  command_window::reader& out{*commands.take_reader()};
  detail::command_turn<atomics> turn;
  detail::permit_word<atomics> granted;
  detail::latch_words<atomics> words;
  detail::latch_memory own;
  std::int64_t newest = -1; // that the loop has read
  std::int64_t time = 0;

  loop_and_service() {
    turn.reset();
    words.reset();
    granted.grant(1, far);
    in.write(0);
  }
  // The turn of the command on which the loop acts now; -1: it stands still.
  std::int64_t acts_on() {
    if (detail::latch_engaged(granted, words, own, at(++time))) {
      detail::latch_acknowledge(words, own, at(time));
      return -1;
    }
    (void)out.read(newest);
    return newest >= 0 && turn.is(newest) ? newest : -1;
  }
};

// The robot is stopped, and reset as soon as the loop has acknowledged: the old command is not in force
// again.
struct is_reset : loop_and_service {
  bool was_reset = false;

  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                for (int i = 0; i != 4; ++i)
                  require(acts_on() != 0 || own.acknowledged == 0, "no command of before the stop after it");
              }},
             {"service", [this] {
                turn.set(1); // stop_switch::write_permit()
                granted.withdraw(1);
                for (int i = 0; i != 2 && !was_reset; ++i) {
                  if (words.acknowledged(far).number != 1) continue;
                  turn.set(2);
                  granted.grant(2, far);
                  was_reset = true;
                }
              }}}};
  }
  void afterwards() { require(acts_on() == -1, "and at rest it stands still"); }
};

// Somebody else drives: who has read a command of the new driver never acts on one of the old.
struct changes_hands : loop_and_service {
  std::array<actor, 2> actors() {
    return {{{"loop",
              [this] {
                bool changed = false;
                for (int i = 0; i != 3; ++i) {
                  const std::int64_t on = acts_on();
                  require(on != 0 || !changed, "no command of the old driver after one of the new");
                  changed = changed || on == 1;
                }
              }},
             {"service", [this] {
                turn.set(1);
                in.write(1);
              }}}};
  }
  void afterwards() { require(acts_on() == 1, "at rest it obeys the new driver"); }
};

TEST(command_turn, lets_no_command_survive_a_stop) { expect_passes_in_every_interleaving<is_reset>(); }

TEST(command_turn, lets_nobody_drive_beside_the_next) {
  expect_passes_in_every_interleaving<changes_hands>();
}

} // namespace
} // namespace command_turn_test
} // namespace rowe::model
