// SPDX-License-Identifier: Apache-2.0
// Where the choices of a generator come from: a seed, or the bytes of a fuzzer's input. And what one seed
// leaves out (swarm testing: Groce, Zhang, Eide, Chen, Regehr, "Swarm Testing", ISSTA 2012): a run in which
// everything happens a little finds less than many runs in which each does much of a few things.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarm {

class choices {
 public:
  choices() = default;
  choices(const choices&) = delete;
  choices& operator=(const choices&) = delete;
  virtual ~choices() = default;

  // 0 to bound - 1; bound is 1 or more.
  virtual std::uint64_t below(std::uint64_t bound) = 0;
  bool one_in(std::uint64_t n) { return below(n) == 0; }
  template <class T, std::size_t N>
  const T& one_of(const T (&of)[N]) {
    return of[below(N)];
  }
};

// SplitMix64: good enough, and a new seed costs nothing, so each step of a world has one of its own. Leaving
// a step out then changes no choice of the others, which is what makes failing runs easy to shrink.
class seeded_choices final : public choices {
 public:
  explicit seeded_choices(std::uint64_t seed, std::uint64_t step = 0) { restart(seed, step); }
  void restart(std::uint64_t seed, std::uint64_t step) {
    state_ = mixed(seed * 0x9e3779b97f4a7c15U) ^ mixed(step + 0x51ed2701U);
  }
  std::uint64_t below(std::uint64_t bound) override { return next() % bound; }
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15U;
    return mixed(state_);
  }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  std::uint64_t state_ = 0;
};

// How often each of some alternatives is chosen in one run: 0 leaves it out.
class weights {
 public:
  weights() = default;
  explicit weights(std::size_t count, unsigned each = 1) : of_(count, each) {}

  // About half of them stay, and weigh 1 to 8.
  void randomise(choices& from) { randomise(from, 0, of_.size()); }
  // Those from `first` on, before `end`.
  void randomise(choices& from, std::size_t first, std::size_t end) {
    for (; first < end; ++first) of_[first] = from.one_in(2) ? 0 : 1U << from.below(4);
  }
  unsigned& operator[](std::size_t which) { return of_[which]; }
  unsigned operator[](std::size_t which) const { return of_[which]; }
  std::size_t size() const { return of_.size(); }

  // One of `count` alternatives from `first` on for which `may` holds; `otherwise` when all are left out.
  template <class May>
  std::size_t choose(choices& from, std::size_t first, std::size_t count, std::size_t otherwise,
                     May&& may) const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += may(i) ? of_[first + i] : 0;
    if (sum == 0) return otherwise;
    std::uint64_t at = from.below(sum);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t weight = may(i) ? of_[first + i] : 0;
      if (at < weight) return i;
      at -= weight;
    }
    return otherwise;
  }

 private:
  std::vector<unsigned> of_;
};

} // namespace swarm
