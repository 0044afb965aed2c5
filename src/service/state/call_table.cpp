// SPDX-License-Identifier: Apache-2.0
#include "service/state/call_table.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <charconv>
#include <utility>

#include <rowe/detail/mutation_points.hpp>

#include "service/base/names.hpp"
#include "json/text/digits.hpp"

namespace rowe::service {
namespace {

constexpr std::size_t nonce_digits = 16;

std::size_t call_buckets(const limits& bounds) noexcept {
  return std::bit_ceil(std::size_t{bounds.calls_max} * 2);
}

std::size_t stride_of(const limits& bounds) noexcept { return call_id_bytes_max + bounds.topic_bytes_max; }

// Reads the number at the beginning of `text`, and the dot behind it unless the number is the last one.
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
         rt::arena::bytes_for<call_index>(call_buckets(bounds)) +
         rt::arena::bytes_for(bounds.calls_max * stride_of(bounds)) +
         rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
}

call_table::call_table(rt::arena& memory, const limits& bounds, std::uint32_t connections) noexcept
    : calls_{memory.carve<call>(bounds.calls_max)},
      free_{calls_},
      buckets_{memory.carve<call_index>(call_buckets(bounds))},
      texts_{memory.carve<char>(bounds.calls_max * stride_of(bounds))},
      text_stride_{stride_of(bounds)},
      service_bytes_max_{bounds.topic_bytes_max},
      open_calls_{memory.carve<std::uint32_t>(bounds.connections_max)},
      per_connection_max_{bounds.calls_per_connection_max},
      of_peers_max_{calls_of_peers(bounds)},
      of_process_max_{bounds.calls_max - reserve_of(bounds.calls_max)},
      claims_{of_peers_max_, connections} {}

call_index call_table::open(const call_endpoint& caller, std::string_view id,
                            std::string_view name) noexcept {
  const bool by_peer = caller.who == call_endpoint::kind::peer;
  if (!by_peer && in_flight() - of_peers_ >= of_process_max_ && !ROWE_MUTANT(process_calls)) return {};
  const call_index taken = free_.take();
  if (!taken) return {};
  if (id.size() > call_id_bytes_max) id = {};
  if (name.size() > service_bytes_max_) name = {};
  const call_index index = taken;
  call& opened = calls_[taken];
  opened = {.generation = opened.generation,
            .open = true,
            .id_bytes = static_cast<std::uint16_t>(id.size()),
            .service_bytes = static_cast<std::uint16_t>(name.size()),
            .caller = caller};
  std::copy(id.begin(), id.end(), texts(index));
  std::copy(name.begin(), name.end(), texts(index) + call_id_bytes_max);
  if (has_bucket(index)) opened.next = std::exchange(bucket(caller.connection(), id), taken);
  if (by_peer) {
    claims_.take(open_calls_[{caller.index}]);
    ++of_peers_;
  }
  return index;
}

void call_table::close(call_index index) noexcept {
  call& closed = calls_[index];
  assert(closed.open);
  if (has_bucket(index)) {
    call_index* link = &bucket(closed.caller.connection(), id_raw(index));
    while (*link != index) link = &calls_[*link].next;
    *link = closed.next;
  }
  if (closed.caller.who == call_endpoint::kind::peer) {
    claims_.give_back(open_calls_[{closed.caller.index}]);
    --of_peers_;
  }
  closed.open = false;
  if (++closed.generation == 0) closed.generation = 1; // 0 says that there is no call
  free_.give_back(index);
}

call* call_table::find(detail::call_ref ref) noexcept {
  if (ref.index >= calls_.size()) return nullptr;
  call& found = calls_[{ref.index}];
  const bool same = found.generation == ref.generation || ROWE_MUTANT(goal_late);
  return found.open && same ? &found : nullptr;
}

call_index call_table::note(detail::call_ref which, slot_id slot, bool written) noexcept {
  call* const of = find(which);
  if (of == nullptr || of->request.index != slot || (written && !of->answered)) return {};
  (written ? of->long_written : of->long_lost) = true;
  return {which.index};
}

call_index& call_table::bucket(connection_id by, std::string_view id_raw) const noexcept {
  const std::uint64_t hash = hash_of(id_raw) ^ (by.index * 0x9E3779B97F4A7C15u + by.generation);
  return buckets_[(hash ^ hash >> 32) & (buckets_.size() - 1)];
}

call_index call_table::find_asked(connection_id by, std::string_view id) const noexcept {
  call_index found = bucket(by, id);
  while (found && !(calls_[found].caller.is(by) && id_raw(found) == id)) found = calls_[found].next;
  return found;
}

std::string_view call_table::write_id(std::span<char, our_id_bytes_max> into, call_index index,
                                      std::uint32_t epoch) const noexcept {
  static_assert(nonce_digits == json::hex_text_bytes);
  char* at = json::write_hex(into.data(), nonce_);
  char* const end = into.data() + into.size(); // 16 digits and three numbers of at most 10, with their dots
  for (const std::uint32_t number : {epoch, index.value, calls_[index].generation}) {
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
  std::uint32_t of_peers = 0;
  for (const call_index i : calls_.ids()) {
    open += calls_[i].open;
    of_peers += calls_[i].open && calls_[i].caller.who == call_endpoint::kind::peer;
    // No two calls of one peer have the same id: the second is refused.
    if (calls_[i].open && has_bucket(i) && find_asked(calls_[i].caller.connection(), id_raw(i)) != i)
      return false;
  }
  // The part of the claims that is reserved for peers is the part that they have not taken.
  std::uint32_t asked = 0;
  std::uint32_t unclaimed = claims_.connections() * claims_.claim();
  for (const std::uint32_t held : open_calls_) {
    asked += held;
    unclaimed -= claims_.claim() - claims_.kept_for(held);
  }
  if (of_peers != of_peers_ || asked != of_peers_ || unclaimed != claims_.unclaimed()) return false;
  return open == in_flight() && free_.check([](const call& one) { return !one.open; });
}

} // namespace rowe::service
