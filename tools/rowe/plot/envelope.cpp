// SPDX-License-Identifier: Apache-2.0
#include "envelope.hpp"

#include <algorithm>

namespace rowe::tools {

envelope::envelope(std::int64_t begin_ns, std::int64_t end_ns, std::size_t columns)
    : begin_ns_{begin_ns},
      columns_a_ns_{static_cast<double>(std::max<std::size_t>(columns, 1)) /
                    static_cast<double>(std::max<std::int64_t>(end_ns - begin_ns, 1))},
      columns_(std::max<std::size_t>(columns, 1)) {}

std::size_t envelope::column_of(std::int64_t time_ns) const noexcept {
  if (time_ns <= begin_ns_) return 0;
  const double at = static_cast<double>(time_ns - begin_ns_) * columns_a_ns_;
  const auto last = columns_.size() - 1;
  return at >= static_cast<double>(last) ? last : static_cast<std::size_t>(at);
}

void envelope::add(const sample& one) {
  column& into = columns_[column_of(one.time_ns)];
  const numbered next{samples_, one};
  if (into.count == 0) into.first = into.low = into.high = next;
  into.last = next;
  if (one.value < into.low.what.value) into.low = next;
  if (one.value > into.high.what.value) into.high = next;
  ++into.count;
  lowest_ = samples_ == 0 ? one.value : std::min(lowest_, one.value);
  highest_ = samples_ == 0 ? one.value : std::max(highest_, one.value);
  ++samples_;
}

std::vector<sample> envelope::kept() const {
  std::vector<sample> all;
  for (const column& one : columns_) {
    if (one.count == 0) continue;
    std::array four{one.first, one.low, one.high, one.last};
    if (four[2].number < four[1].number) std::swap(four[1], four[2]);
    for (std::size_t i = 0; i < four.size(); ++i) {
      if (i == 0 || four[i].number != four[i - 1].number) all.push_back(four[i].what);
    }
  }
  return all;
}

} // namespace rowe::tools
