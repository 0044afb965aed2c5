// SPDX-License-Identifier: Apache-2.0
#include "service/base/chunk_store.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace rowe::service {
namespace {

constexpr std::uint32_t chunks_opened_min = 64; // 1 MiB at a time

} // namespace

std::uint32_t chunk_store::chunk_count(const limits& bounds) noexcept {
  return in_use(bounds) ? bounds.long_slots * chunks_for(bounds.long_message_bytes_max) : 0;
}

// A text that is longer than message_bytes_max has some chunks. What is cut to a shorter one may find no row.
// Latched values may be as short as one chunk, and have a half of all chunks at most.
std::size_t chunk_store::text_count(const limits& bounds) noexcept {
  const std::uint32_t least = std::max(chunks_for(bounds.message_bytes_max), 1U);
  return chunk_count(bounds) / least + 2 * std::size_t{reserve_of(chunk_count(bounds))};
}

std::size_t chunk_store::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<chunk_id>(chunk_count(bounds)) +
         rt::arena::bytes_for<chain>(text_count(bounds));
}

chunk_store::chunk_store(rt::arena& memory, std::span<std::byte> pool, const limits& bounds,
                         pool_opener* opener) noexcept
    : text_bytes_max_{pool.empty() ? 0 : bounds.long_message_bytes_max},
      whole_{pool.first(pool.empty() ? 0 : whole_bytes(bounds))},
      chunks_{pool.subspan(whole_.size())},
      links_{memory.carve<chunk_id>(pool.empty() ? 0 : chunk_count(bounds))},
      opener_{opener},
      open_{opener != nullptr ? 0 : links_.size()},
      texts_{memory.carve<chain>(pool.empty() ? 0 : text_count(bounds))},
      free_{texts_} {
  assert(pool.empty() || pool.size() == pool_bytes(bounds));
}

// ---- chunks

// Makes sure that so many more can be taken.
bool chunk_store::open_for(std::uint32_t more) noexcept {
  const std::uint32_t used_before = untouched_ - in_use_; // and free now
  const std::uint32_t wanted = untouched_ + (more > used_before ? more - used_before : 0);
  if (wanted <= open_) return true;
  const std::uint32_t opened = std::min(std::max(wanted, open_ + chunks_opened_min), chunks());
  if (!opener_->open(whole_.size() + std::size_t{opened} * chunk_bytes)) return false;
  open_ = opened;
  return true;
}

inline chunk_id chunk_store::take_chunk() noexcept {
  chunk_id taken = free_chunk_;
  if (taken) {
    free_chunk_ = links_[taken];
  } else {
    taken = {untouched_++};
  }
  links_[taken] = {};
  ++in_use_;
  return taken;
}

// Gives back the chunks from `first` up to, and without, `end`.
void chunk_store::give_back(chunk_id first, chunk_id end) noexcept {
  while (first != end) {
    const chunk_id next = links_[first];
    links_[first] = free_chunk_;
    free_chunk_ = first;
    --in_use_;
    first = next;
  }
}

// ---- texts

text_id chunk_store::begin(std::size_t bytes_max) noexcept {
  const std::uint32_t wanted = std::max(chunks_for(bytes_max), 1U);
  if (free() < wanted || !open_for(wanted)) return {};
  const text_id begun = free_.take();
  if (!begun) return {};
  texts_[begun] = {};
  texts_[begun].references = 1;
  (void)grow(begun, std::max<std::size_t>(bytes_max, 1)); // there are so many
  texts_[begun].last_written = texts_[begun].first;
  return begun;
}

bool chunk_store::grow(text_id which, std::size_t bytes_max) noexcept {
  chain& of = texts_[which];
  const std::uint32_t wanted = chunks_for(bytes_max);
  if (wanted <= of.chunks) return true;
  if (wanted - of.chunks > free() || !open_for(wanted - of.chunks)) return false;
  chunk_id last = of.last_written; // behind it are those that were not written to
  while (last && links_[last]) last = links_[last];
  for (; of.chunks != wanted; ++of.chunks) {
    const chunk_id added = take_chunk();
    (last ? links_[last] : of.first) = added;
    last = added;
  }
  return true;
}

void chunk_store::append(text_id which, std::span<const std::byte> bytes) noexcept {
  chain& of = texts_[which];
  assert(of.begins_at == 0 && of.bytes + bytes.size() <= of.chunks * chunk_bytes);
  of.bytes += bytes.size();
  while (!bytes.empty()) {
    if (of.end_at == chunk_bytes) {
      of.last_written = links_[of.last_written];
      of.end_at = 0;
    }
    const std::size_t here = std::min(bytes.size(), chunk_bytes - of.end_at);
    std::memcpy(bytes_of(of.last_written).data() + of.end_at, bytes.data(), here);
    of.end_at += static_cast<std::uint32_t>(here);
    bytes = bytes.subspan(here);
  }
}

void chunk_store::cut(text_id which, std::size_t at, std::size_t bytes) noexcept {
  chain& of = texts_[which];
  assert(bytes != 0 && at + bytes <= of.bytes);
  const std::size_t begins = of.begins_at + at;
  const auto skipped = static_cast<std::uint32_t>(begins / chunk_bytes);
  chunk_id first = of.first;
  for (std::uint32_t i = 0; i != skipped; ++i) first = links_[first];
  give_back(of.first, first);
  of.first = first;
  of.begins_at = static_cast<std::uint32_t>(begins % chunk_bytes);
  of.bytes = bytes;
  of.chunks = chunks_for(of.begins_at + bytes);
  chunk_id last = first;
  for (std::uint32_t i = 1; i != of.chunks; ++i) last = links_[last];
  give_back(std::exchange(links_[last], {}), {});
  of.last_written = last;
  of.end_at = static_cast<std::uint32_t>(of.begins_at + bytes - (of.chunks - 1) * chunk_bytes);
}

void chunk_store::free(text_id which) noexcept {
  give_back(texts_[which].first, {});
  texts_[which] = {};
  free_.give_back(which);
}

// ---- reading

std::span<const std::byte> chunk_store::read(text_id which, std::size_t at, place& from) const noexcept {
  const chain& of = texts_[which];
  if (at >= of.bytes) return {};
  if (!from.chunk) from = {of.first, 0};
  const std::size_t within = of.begins_at + at;
  while (within - from.chunk_at >= chunk_bytes) {
    from.chunk = links_[from.chunk];
    from.chunk_at += chunk_bytes;
  }
  const std::size_t in_chunk = within - from.chunk_at;
  return bytes_of(from.chunk).subspan(in_chunk, std::min(chunk_bytes - in_chunk, of.bytes - at));
}

void chunk_store::copy(text_id which, std::size_t at, place& from, std::span<std::byte> into) const noexcept {
  while (!into.empty()) {
    const auto here = read(which, at, from);
    const std::size_t bytes = std::min(here.size(), into.size());
    assert(bytes != 0);
    std::memcpy(into.data(), here.data(), bytes);
    into = into.subspan(bytes);
    at += bytes;
  }
}

// ---- checks

bool chunk_store::check() const noexcept {
  std::uint32_t held = 0;
  for (const chain& of : texts_) {
    std::uint32_t chunks = 0;
    for (chunk_id i = of.first; i; i = links_[i]) {
      if (++chunks > of.chunks) return false;
    }
    if (chunks != of.chunks || (of.references == 0) != !of.first) return false;
    if (of.first && of.begins_at + of.bytes > of.chunks * chunk_bytes) return false;
    held += chunks;
  }
  std::uint32_t free_again = 0;
  for (chunk_id i = free_chunk_; i; i = links_[i]) {
    if (++free_again > untouched_) return false;
  }
  return held == in_use_ && free_again + in_use_ == untouched_ && untouched_ <= open_;
}

} // namespace rowe::service
