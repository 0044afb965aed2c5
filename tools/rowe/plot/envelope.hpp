// SPDX-License-Identifier: Apache-2.0
// What a line of a plot needs of its samples, however many there are: of each column of the picture the
// first, the last, the lowest and the highest one. A line drawn through these covers the same pixels as one
// through all samples, if the columns are those of the picture (M4: Jugel, Jerzak, Hackenbroich, Markl: "M4:
// A Visualization-Oriented Time Series Data Aggregation", VLDB 2014). So the memory depends on the columns,
// not on the samples.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rowe::tools {

struct sample {
  std::int64_t time_ns = 0;
  double value = 0;
  double other = 0; // what was measured with it, and is kept with it
};

class envelope {
 public:
  // Of the times [begin_ns, end_ns]; what lies outside belongs to the first or the last column. At least one
  // column.
  envelope(std::int64_t begin_ns, std::int64_t end_ns, std::size_t columns);

  // In the order of their times; of equal times in any order.
  void add(const sample& one);

  // At most four of each column, in their order, none twice.
  std::vector<sample> kept() const;

  std::uint64_t samples() const noexcept { return samples_; }
  double lowest() const noexcept { return lowest_; }
  double highest() const noexcept { return highest_; }

 private:
  // A sample and its number, by which they are in order.
  struct numbered {
    std::uint64_t number = 0;
    sample what{};
  };
  struct column {
    std::uint64_t count = 0;
    numbered first{}, last{}, low{}, high{};
  };
  std::size_t column_of(std::int64_t time_ns) const noexcept;

  std::int64_t begin_ns_;
  double columns_a_ns_;
  std::vector<column> columns_;
  std::uint64_t samples_ = 0;
  double lowest_ = 0;
  double highest_ = 0;
};

} // namespace rowe::tools
