// SPDX-License-Identifier: Apache-2.0
// Litmus programs as data: a few threads of a few loads, stores and exchanges of a few words, all initially
// 0; and the set of all outcomes that the explorer finds for one.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "model/atomics.hpp"

namespace rowe::model {

inline constexpr std::size_t program_words_max = 4;

struct instruction {
  operation what;
  std::size_t word;
  std::uint64_t value; // of a store or an exchange
  order asks;
};

inline instruction load(std::size_t word, order o) { return {operation::load, word, 0, o}; }
inline instruction store(std::size_t word, std::uint64_t value, order o) {
  return {operation::store, word, value, o};
}
inline instruction exchange(std::size_t word, std::uint64_t value, order o) {
  return {operation::exchange, word, value, o};
}

using program = std::vector<std::vector<instruction>>;

// What every load and exchange read, thread by thread from the first on, and then what each word holds at the
// end.
struct outcome {
  std::vector<std::uint64_t> reads;
  std::array<std::uint64_t, program_words_max> last{};
  friend auto operator<=>(const outcome&, const outcome&) = default;
};

inline std::string text_of(const outcome& o) {
  std::string text = "read";
  for (const std::uint64_t value : o.reads) (text += ' ') += std::to_string(value);
  text += ", left";
  for (const std::uint64_t value : o.last) (text += ' ') += std::to_string(value);
  return text;
}

inline std::string text_of(const program& p) {
  std::string text;
  for (const auto& thread : p) {
    text += " ";
    for (const instruction& i : thread) {
      text += std::string{" "} + name_of(i.what) + "(" + std::to_string(i.word) +
              (i.what == operation::load ? std::string{} : ", " + std::to_string(i.value)) + ", " +
              name_of(i.asks) + ")";
    }
    text += "\n";
  }
  return text;
}

// One run of a program.
class program_run {
 public:
  program_run(const program& p, std::set<outcome>& found) : program_{p}, found_{found} {}

  std::vector<actor> actors() {
    std::vector<actor> threads;
    for (std::size_t t = 0; t != program_.size(); ++t) threads.push_back({"thread", [this, t] { act(t); }});
    return threads;
  }

  void afterwards() {
    outcome o;
    for (std::size_t t = 0; t != program_.size(); ++t) {
      for (std::size_t i = 0; i != program_[t].size(); ++i) {
        if (program_[t][i].what != operation::store) o.reads.push_back(reads_[t][i]);
      }
    }
    for (std::size_t w = 0; w != program_words_max; ++w) o.last[w] = words_[w].load(order::relaxed);
    found_.insert(o);
  }

 private:
  void act(std::size_t t) {
    for (std::size_t i = 0; i != program_[t].size(); ++i) {
      const instruction& now = program_[t][i];
      switch (now.what) {
      case operation::load: reads_[t][i] = words_[now.word].load(now.asks); break;
      case operation::store: words_[now.word].store(now.value, now.asks); break;
      case operation::exchange: reads_[t][i] = words_[now.word].exchange(now.value, now.asks); break;
      }
    }
  }

  const program& program_;
  std::set<outcome>& found_;
  std::array<atomics::variable<std::uint64_t>, program_words_max> words_;
  std::array<std::array<std::uint64_t, 8>, threads_max> reads_{};
};

// Every outcome, with no bound on preemptions.
inline std::set<outcome> explored_outcomes(const program& p) {
  std::set<outcome> found;
  options unbounded;
  unbounded.preemptions_max = steps_max;
  const report r = explore(unbounded, [&] { return program_run{p, found}; });
  if (!r.passed) found.clear();
  return found;
}

} // namespace rowe::model
