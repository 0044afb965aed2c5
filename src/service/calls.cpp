// SPDX-License-Identifier: Apache-2.0
#include "service/calls.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <charconv>
#include <utility>

#include "service/router.hpp"

namespace rowe::service {
namespace {

constexpr std::size_t nonce_digits = 16;

std::size_t bucket_count(const limits& bounds) noexcept {
  return std::bit_ceil(std::size_t{bounds.calls_max} * 2);
}

std::size_t stride_of(const limits& bounds) noexcept {
  return call_table::id_bytes_max + bounds.topic_bytes_max;
}

// The number that `text` begins with, and a dot behind it unless it is the last.
template <class T>
bool take_number(std::string_view& text, T& into, bool last) noexcept {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), into);
  if (fault != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (last) return text.empty();
  if (!text.starts_with('.')) return false;
  text.remove_prefix(1);
  return true;
}

} // namespace

std::size_t call_table::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<call>(bounds.calls_max) +
         rt::arena::bytes_for<call_index>(bucket_count(bounds)) +
         rt::arena::bytes_for(bounds.calls_max * stride_of(bounds));
}

call_table::call_table(rt::arena& memory, const limits& bounds) noexcept
    : calls_{memory.carve<call>(bounds.calls_max)},
      free_{calls_},
      buckets_{memory.carve<call_index>(bucket_count(bounds))},
      texts_{memory.carve<char>(bounds.calls_max * stride_of(bounds))},
      text_stride_{stride_of(bounds)},
      service_bytes_max_{bounds.topic_bytes_max} {}

std::uint32_t call_table::open(const party& asked_by, std::string_view id, std::string_view name) noexcept {
  const call_index taken = free_.take();
  if (!taken) return no_index;
  if (id.size() > id_bytes_max) id = {};
  if (name.size() > service_bytes_max_) name = {};
  const std::uint32_t index = taken.value;
  call& opened = calls_[taken];
  opened = {.generation = opened.generation,
            .open = true,
            .asked_by = asked_by,
            .id_bytes = static_cast<std::uint16_t>(id.size()),
            .service_bytes = static_cast<std::uint16_t>(name.size())};
  std::copy(id.begin(), id.end(), texts(index));
  std::copy(name.begin(), name.end(), texts(index) + id_bytes_max);
  if (has_bucket(index)) opened.next = std::exchange(bucket(asked_by.connection(), id), taken);
  return index;
}

void call_table::close(std::uint32_t index) noexcept {
  call& closed = calls_[call_index{index}];
  assert(closed.open);
  if (has_bucket(index)) {
    call_index* link = &bucket(closed.asked_by.connection(), id_raw(index));
    while (link->value != index) link = &calls_[*link].next;
    *link = closed.next;
  }
  closed.open = false;
  if (++closed.generation == 0) closed.generation = 1; // 0 says that there is no call
  free_.give_back(call_index{index});
}

call* call_table::find(detail::call_ref ref) noexcept {
  if (ref.index >= calls_.size()) return nullptr;
  call& found = calls_[call_index{ref.index}];
  return found.open && found.generation == ref.generation ? &found : nullptr;
}

call_index& call_table::bucket(connection_id by, std::string_view id_raw) const noexcept {
  const std::uint64_t hash = hash_of(id_raw) ^ (by.index * 0x9E3779B97F4A7C15u + by.generation);
  return buckets_[(hash ^ hash >> 32) & (buckets_.size() - 1)];
}

std::uint32_t call_table::find_asked(connection_id by, std::string_view id) const noexcept {
  call_index found = bucket(by, id);
  while (found && !(calls_[found].asked_by.is(by) && id_raw(found.value) == id)) found = calls_[found].next;
  return found.value;
}

std::string_view call_table::write_id(std::span<char, our_id_bytes_max> into, std::uint32_t index,
                                      std::uint32_t epoch) const noexcept {
  constexpr char digits[] = "0123456789abcdef";
  char* at = into.data();
  for (std::size_t i = 0; i < nonce_digits; ++i) *at++ = digits[nonce_ >> (60 - 4 * i) & 15U];
  char* const end = into.data() + into.size(); // 16 digits and three numbers of at most 10, with their dots
  for (const std::uint32_t number : {epoch, index, calls_[call_index{index}].generation}) {
    *at++ = '.';
    at = std::to_chars(at, end, number).ptr;
  }
  return {into.data(), static_cast<std::size_t>(at - into.data())};
}

std::optional<detail::call_ref> call_table::read_id(std::string_view raw) const noexcept {
  if (raw.size() < 2 || raw.front() != '"') return std::nullopt;
  raw = raw.substr(1, raw.size() - 2);
  if (raw.size() <= nonce_digits || raw[nonce_digits] != '.') return std::nullopt;
  std::uint64_t nonce = 0;
  const auto [end, fault] = std::from_chars(raw.data(), raw.data() + nonce_digits, nonce, 16);
  if (fault != std::errc{} || end != raw.data() + nonce_digits || nonce != nonce_) return std::nullopt;
  raw.remove_prefix(nonce_digits + 1);
  std::uint32_t epoch = 0;
  detail::call_ref meant;
  if (!take_number(raw, epoch, false) || !take_number(raw, meant.index, false) ||
      !take_number(raw, meant.generation, true)) {
    return std::nullopt;
  }
  return meant;
}

bool call_table::check() const noexcept {
  std::uint32_t open = 0;
  for (const call_index i : calls_.ids()) {
    open += calls_[i].open;
    // No two of one peer have the same id: the second is refused.
    if (calls_[i].open && has_bucket(i.value) &&
        find_asked(calls_[i].asked_by.connection(), id_raw(i.value)) != i.value)
      return false;
  }
  return open == in_flight() && free_.check([](const call& one) { return !one.open; });
}

} // namespace rowe::service
