// SPDX-License-Identifier: Apache-2.0
// The masking of RFC 6455 5.3, which is its own inverse: each byte of a payload is combined with one byte of
// the key, in turn. Every byte of a client passes through here once, and is checked for ASCII on the way. So
// it is done in blocks for the widest registers of the compiler's target.
#pragma once
#include <array>
#include <cstddef>
#include <span>

namespace rowe::wire {

// The four bytes of a masking key in the order in which they stand on the wire.
using mask_key = std::array<std::byte, 4>;

// Both: `offset` is the position of the first byte in the payload. True only if the result is all ASCII. A
// key of zeros changes nothing, so nothing is looked at: false. Never waits, never allocates.

// In place.
bool mask(std::span<std::byte> data, mask_key key, std::size_t offset = 0) noexcept;

// From `source` to `target`, which must not overlap and are equally long.
bool mask_copy(std::span<std::byte> target, std::span<const std::byte> source, mask_key key,
               std::size_t offset = 0) noexcept;

} // namespace rowe::wire
