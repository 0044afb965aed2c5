// SPDX-License-Identifier: Apache-2.0
// What a test gives the explorer, and what it gets back: actors, options, and the report.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/choices.hpp"
#include "model/site.hpp"

namespace rowe::model {

using order = std::memory_order;

inline constexpr std::size_t threads_max = 5; // four actors, and the thread that sets up and looks afterwards
inline constexpr std::size_t steps_max =
    256; // operations a run: half for the actors, half for what comes afterwards

// One thread of a scenario. A scenario is a type whose constructor sets up, `actors()` returns an array of
// these, and `afterwards()`, if there is one, looks at the end when all actors have ended. It is made anew
// for each run. Actors keep nothing on their stacks that owns memory, and depend on nothing but shared words.
struct actor {
  const char* name;
  std::function<void()> act;
};

enum class operation : std::uint8_t { load, store, exchange };

// An atomic access in the source, with the order it asks for.
struct use {
  site where;
  operation what;
  order asks;
  friend bool operator==(const use&, const use&) noexcept = default;
};

// Replaces the order of one access by a weaker one.
struct weakening {
  use of;
  order to;
};

struct options {
  std::size_t preemptions_max = 3;
  // Exhaustively: exploring more runs than this is a failure, never a silent end. At random: so many runs.
  std::uint64_t runs_max = 4'000'000;
  std::optional<std::uint64_t> seed{};  // random rows of choices instead of all
  std::optional<choices::row> replay{}; // one run only: the choices a failure has printed
  std::optional<weakening> weaken{};
  std::size_t early_returns_max = 1; // of waits in the kernel, a run
};

struct report {
  bool passed = true;
  std::uint64_t runs = 0;
  std::string failure;   // what was violated
  choices::row row;      // the choices that led there, for options::replay
  std::string trace;     // every operation of that run
  std::vector<use> uses; // every atomic access that was executed, in any run

  std::string text() const {
    if (passed) return "passed in " + std::to_string(runs) + " runs";
    return failure + "\nin run " + std::to_string(runs) + ", choices " + text_of(row) + "\n" + trace;
  }
};

inline const char* name_of(order o) noexcept {
  switch (o) {
  case order::relaxed: return "relaxed";
  case order::acquire: return "acquire";
  case order::release: return "release";
  case order::acq_rel: return "acq_rel";
  case order::seq_cst: return "seq_cst";
  default: return "consume";
  }
}

inline const char* name_of(operation o) noexcept {
  return o == operation::load ? "load" : o == operation::store ? "store" : "exchange";
}

} // namespace rowe::model
