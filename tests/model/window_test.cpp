// SPDX-License-Identifier: Apache-2.0
// rowe::rt::window under the explorer: a few writes against a few reads. The slots are plain, so a slot that
// is written while it is read is reported as the race it is; that a value is whole and never older than the
// last is asked as well.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>

#include <rowe/rt/window.hpp>

#include "model/atomics.hpp"
#include "model/expect.hpp"
#include "model/mutation.hpp"

namespace rowe::model {
namespace window_test {
namespace {

// The number of the value, twice.
struct pair {
  std::uint64_t first;
  std::uint64_t second;
};
using window = rt::window<pair, atomics>;
using rt::freshness;

struct written_and_read {
  window cell;
  window::writer& in{*cell.take_writer()};
  window::reader& out{*cell.take_reader()};
  std::uint64_t last_read = 0;

  void write() {
    const std::uint64_t number = in.sequence() + 1;
    in.write({number, number});
  }
  void read() {
    pair value{};
    switch (out.read(value)) {
    case freshness::empty: require(last_read == 0, "empty is said only before the first value"); break;
    case freshness::unchanged: require(last_read != 0, "unchanged is said only after a value"); break;
    case freshness::fresh:
      require(value.first == value.second, "a value is never torn");
      require(value.first > last_read, "a fresh value is newer than the last");
      require(value.first == out.sequence(), "the number is that of the value");
      last_read = value.first;
      break;
    }
    require(out.sequence() == last_read, "the number stays that of the value read last");
  }

  void afterwards() {
    require(cell.check() == nullptr, "the invariants hold at rest");
    if (last_read != in.sequence()) read();
    require(last_read == in.sequence(), "at rest the newest value is read");
    read();
    require(cell.check() == nullptr, "the invariants hold after a read at rest");
  }
};

template <int Writes, int Reads>
struct writes_and_reads : written_and_read {
  std::array<actor, 2> actors() {
    return {{{"writer",
              [this] {
                for (int i = 0; i != Writes; ++i) write();
              }},
             {"reader", [this] {
                for (int i = 0; i != Reads; ++i) read();
              }}}};
  }
};

// Another word tells the reader how many values there are; it must find one at least as new.
struct announced_count : written_and_read {
  atomics::variable<std::uint64_t> written{0};
  std::array<actor, 2> actors() {
    return {{{"writer",
              [this] {
                for (std::uint64_t n = 1; n != 3; ++n) {
                  write();
                  written.store(n, order::release);
                }
              }},
             {"reader", [this] {
                for (int i = 0; i != 2; ++i) {
                  const std::uint64_t at_least = written.load(order::acquire);
                  read();
                  require(last_read >= at_least, "a read is at least as new as what the reader knows of");
                }
              }}}};
  }
};

// By slot number, as callers with slots of their own use it. The slot read last stays readable until the next
// fresh one, however much is written meanwhile.
struct holds_the_slot {
  rt::window_core<atomics> core;
  rt::window_core<atomics>::writer& in{*core.take_writer()};
  rt::window_core<atomics>::reader& out{*core.take_reader()};
  std::array<atomics::plain<std::uint64_t>, 4> slots;

  std::array<actor, 2> actors() {
    return {{{"writer",
              [this] {
                for (std::uint64_t n = 1; n != 4; ++n) {
                  const std::uint32_t slot = in.begin_write();
                  slots[slot].store(n);
                  in.end_write(slot);
                }
              }},
             {"reader", [this] {
                for (int i = 0; i != 2; ++i) {
                  const auto found = out.begin_read();
                  if (found.state == freshness::empty) continue;
                  require(slots[found.slot].load() == found.sequence, "the slot holds the value named");
                }
              }}}};
  }
  void afterwards() {
    require(core.check() == nullptr, "the invariants hold at rest");
    const auto found = out.begin_read();
    require(found.sequence == 3 && slots[found.slot].load() == 3, "at rest the newest value is read");
  }
};

struct contested {
  window cell;
  std::array<int, 2> writers{};
  std::array<int, 2> readers{};

  void take(std::size_t who) {
    writers[who] = cell.take_writer() != nullptr;
    readers[who] = cell.take_reader() != nullptr;
  }
  std::array<actor, 2> actors() {
    return {{{"one", [this] { take(0); }}, {"other", [this] { take(1); }}}};
  }
  void afterwards() {
    require(writers[0] + writers[1] == 1, "one thread gets the writer");
    require(readers[0] + readers[1] == 1, "one thread gets the reader");
  }
};

TEST(window, is_never_torn_and_never_goes_back) {
  expect_passes_in_every_interleaving<writes_and_reads<3, 3>>();
  expect_passes<writes_and_reads<4, 4>>();
}

TEST(window, is_never_torn_and_never_goes_back_in_long_random_runs) {
  expect_passes_at_random<writes_and_reads<12, 12>>(3, 20'000);
}

TEST(window, is_never_torn_by_many_writes_about_one_read) {
  expect_passes_in_every_interleaving<writes_and_reads<5, 1>>();
}

TEST(window, shows_a_value_at_least_as_new_as_the_reader_knows_of) {
  expect_passes_in_every_interleaving<announced_count>();
}

TEST(window, keeps_the_slot_read_last_until_the_next_fresh_one) {
  expect_passes_in_every_interleaving<holds_the_slot>();
}

TEST(window, gives_each_end_to_one_thread_only) { expect_passes_in_every_interleaving<contested>(); }

TEST(window, needs_every_memory_order_it_asks_for) {
  const std::array scenarios{scenario<writes_and_reads<3, 2>>("writes_and_reads"),
                             scenario<announced_count>("announced_count"),
                             scenario<holds_the_slot>("holds_the_slot"), scenario<contested>("contested")};
  constexpr const char* once = "who gets an end is decided by the exchange alone, and no data goes with it";
  constexpr const char* at_rest = "check() is called where all of both threads happens before already";
  const std::array listed{stronger_than_needed{"take_writer", "exchange", order::relaxed, once},
                          stronger_than_needed{"take_reader", "exchange", order::relaxed, once},
                          stronger_than_needed{"check", "load", order::relaxed, at_rest}};
  EXPECT_EQ((mutation_test{"rowe/rt/window.hpp", scenarios, listed}.findings()), "");
}

} // namespace
} // namespace window_test
} // namespace rowe::model
