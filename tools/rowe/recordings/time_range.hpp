// SPDX-License-Identifier: Apache-2.0
// The part of a recording that --from and --to choose.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "recorded_messages.hpp"

namespace rowe::tools {

struct time_range {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;    // where it ends
  std::int64_t until_ns = 0; // what is before that is part of it; with the end of the file, all that follows
  bool to_the_end = true;
};

// `from` and `to` as they were given; empty: from the begin, to the end. The file has a message. Nothing:
// `wrong` says what is.
std::optional<time_range> time_range_of(const std::string& from, const std::string& to,
                                        const recorded_messages& file, std::string& wrong);

} // namespace rowe::tools
