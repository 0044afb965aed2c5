// SPDX-License-Identifier: Apache-2.0
// Where nothing came for longer than usual. What is usual is known at the end only, so the longest pauses are
// kept until then: so many, however many samples there are.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rowe::tools {

struct gap {
  std::int64_t begin_ns = 0; // of the last sample before it
  std::int64_t end_ns = 0;   // and the first one behind it

  std::int64_t length_ns() const noexcept { return end_ns - begin_ns; }
};

class gap_finder {
 public:
  static constexpr std::size_t kept_max = 1000;
  // A gap is longer than so many usual pauses; usual is what nine of ten are not longer than. With fewer
  // pauses than ten nothing is usual, and there are no gaps. What is shorter than a tenth of a second is
  // none: at 1 kHz any busy machine has pauses of some milliseconds.
  static constexpr std::int64_t pauses_in_a_gap = 4;
  static constexpr std::int64_t gap_ns_min = 100'000'000;
  static constexpr std::uint64_t pauses_min = 10;

  // In the order of the times.
  void add(std::int64_t time_ns);

  // In the order of the times: all of them, or the longest ones where there are more than kept_max.
  std::vector<gap> gaps() const;

 private:
  // A pause of so many nanoseconds is counted in one of eight buckets for each power of two.
  static constexpr unsigned parts_bits = 3;
  static std::size_t bucket_of(std::uint64_t ns) noexcept;
  static std::uint64_t end_of_bucket(std::size_t bucket) noexcept;
  std::int64_t usual_ns() const noexcept;

  bool began_ = false;
  std::int64_t last_ns_ = 0;
  std::uint64_t pauses_ = 0;
  std::array<std::uint64_t, 64U << parts_bits> buckets_{};
  std::vector<gap> longest_; // a heap, whose first one is the shortest
};

} // namespace rowe::tools
