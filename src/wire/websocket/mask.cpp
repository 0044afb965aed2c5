// SPDX-License-Identifier: Apache-2.0
#include "wire/websocket/mask.hpp"

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>

namespace rowe::wire {
namespace {

constexpr std::uint64_t high_bits = 0x8080'8080'8080'8080;

// The key, twice, rotated for data that begins at `offset` of the payload.
std::uint64_t turned(mask_key key, std::size_t offset) noexcept {
  const auto whole = std::bit_cast<std::uint32_t>(key);
  const auto bits = static_cast<int>(offset % sizeof key * 8);
  const std::uint32_t half =
      std::endian::native == std::endian::little ? std::rotr(whole, bits) : std::rotl(whole, bits);
  return std::uint64_t{half} << 32 | half;
}

// Two words in one register, if the processor has such. This is an extension of gcc and clang, which would
// pass blocks of plain words through memory.
using pair [[gnu::vector_size(16)]] = std::uint64_t;

pair load(const std::byte* from) noexcept {
  pair words;
  std::memcpy(&words, from, sizeof words);
  return words;
}

// `to` may be `from`: a block is read before it is written. Returns all bytes of the result, combined.
std::uint64_t combine(std::byte* to, const std::byte* from, std::size_t bytes, std::uint64_t key) noexcept {
  constexpr std::size_t block_bytes = 2 * sizeof(pair);
  const pair keys{key, key};
  pair seen_first{}, seen_second{};
  for (; bytes >= block_bytes; bytes -= block_bytes, to += block_bytes, from += block_bytes) {
    const pair first = load(from) ^ keys;
    const pair second = load(from + sizeof(pair)) ^ keys;
    seen_first |= first;
    seen_second |= second;
    std::memcpy(to, &first, sizeof first);
    std::memcpy(to + sizeof first, &second, sizeof second);
  }
  const pair seen = seen_first | seen_second;
  std::uint64_t any = seen[0] | seen[1];
  for (; bytes >= sizeof key; bytes -= sizeof key, to += sizeof key, from += sizeof key) {
    std::uint64_t word = 0;
    std::memcpy(&word, from, sizeof word);
    word ^= key;
    any |= word;
    std::memcpy(to, &word, sizeof word);
  }
  const auto rest = std::bit_cast<std::array<std::byte, sizeof key>>(key);
  for (std::size_t i = 0; i < bytes; ++i) {
    to[i] = from[i] ^ rest[i];
    any |= std::to_integer<std::uint64_t>(to[i]);
  }
  return any;
}

} // namespace

bool mask(std::span<std::byte> data, mask_key key, std::size_t offset) noexcept {
  if (key == mask_key{}) return false;
  return (combine(data.data(), data.data(), data.size(), turned(key, offset)) & high_bits) == 0;
}

bool mask_copy(std::span<std::byte> target, std::span<const std::byte> source, mask_key key,
               std::size_t offset) noexcept {
  assert(target.size() == source.size());
  if (source.empty()) return false;
  if (key == mask_key{}) {
    std::memcpy(target.data(), source.data(), source.size());
    return false;
  }
  return (combine(target.data(), source.data(), source.size(), turned(key, offset)) & high_bits) == 0;
}

} // namespace rowe::wire
