// SPDX-License-Identifier: Apache-2.0
// How short a token may be. What diagnostics quote of a request, before its client was let in, is shorter.
#pragma once
#include <cstddef>

namespace rowe::wire {

inline constexpr std::size_t token_bytes_min = 16; // 96 bits, if they are random ones of base64

} // namespace rowe::wire
