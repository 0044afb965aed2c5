// SPDX-License-Identifier: Apache-2.0
#include "service/state/latch_store.hpp"

#include <algorithm>
#include <cassert>

#include "json/writing/writer.hpp"

namespace rowe::service {

std::size_t latch_store::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<latch_block>(block_count(bounds)) +
         2 * rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
}

latch_store::latch_store(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept
    : chunks_{chunks},
      blocks_{memory.carve<latch_block>(block_count(bounds))},
      free_{blocks_},
      held_{memory.carve<std::uint32_t>(bounds.connections_max)},
      claims_{blocks() / 2, bounds.connections_max},
      long_held_{memory.carve<std::uint32_t>(bounds.connections_max)} {}

bool latch_store::store(latched_value& into, std::string_view body, latch_owner owner,
                        rt::time_point expires) noexcept {
  const bool of_peer = owner.who == latch_owner::kind::peer;
  if (!of_peer || into.owner == owner) clear(into);
  const auto needed =
      static_cast<std::uint32_t>((body.size() + latch_block_bytes_max - 1) / latch_block_bytes_max);
  if (needed == 0 || needed > free_.free()) return false;
  if (of_peer) {
    if (!claims_.may_take(held_[{owner.index}], left_of(blocks() / 2, of_peers_), needed)) return false;
    claims_.take(held_[{owner.index}], needed);
    of_peers_ += needed;
  }
  clear(into);
  for (std::string_view rest = body; !rest.empty();) {
    const block_id taken = free_.take();
    rest.remove_prefix(rest.copy(blocks_[taken].text.data(), latch_block_bytes_max));
    into.text.push_back(blocks_, taken);
  }
  into.blocks = needed;
  into.bytes = static_cast<std::uint32_t>(body.size());
  into.owner = owner;
  into.expires = expires;
  return true;
}

// Of what peers have left, one may take no more than it leaves.
bool latch_store::store_long(latched_value& into, text_id value, latch_owner owner,
                             rt::time_point expires) noexcept {
  const bool of_peer = owner.who == latch_owner::kind::peer;
  if (!of_peer || into.owner == owner) clear(into);
  const std::uint32_t needed = chunks_.chunks_of(value);
  const std::uint32_t share = reserve_of(chunks_.chunks());
  if (of_peer) {
    std::uint32_t& held = long_held_[{owner.index}];
    const std::uint32_t left = left_of(share, long_of_peers_);
    if (needed > left || held + needed > left - needed + 1) return false;
    held += needed;
    long_of_peers_ += needed;
  } else {
    if (needed > left_of(share, long_of_handles_)) return false;
    long_of_handles_ += needed;
  }
  clear(into);
  chunks_.retain(value);
  into.chunks = value;
  into.blocks = needed;
  into.bytes = static_cast<std::uint32_t>(chunks_.bytes(value));
  into.owner = owner;
  into.expires = expires;
  return true;
}

void latch_store::clear(latched_value& what) noexcept {
  if (what.empty()) return;
  if (what.chunks) {
    const bool of_peer = what.owner.who == latch_owner::kind::peer;
    if (of_peer) long_held_[{what.owner.index}] -= what.blocks;
    (of_peer ? long_of_peers_ : long_of_handles_) -= what.blocks;
    chunks_.release(what.chunks);
    what = {};
    return;
  }
  if (what.owner.who == latch_owner::kind::peer) {
    assert(held_[{what.owner.index}] >= what.blocks && of_peers_ >= what.blocks);
    claims_.give_back(held_[{what.owner.index}], what.blocks);
    of_peers_ -= what.blocks;
  }
  while (!what.text.empty()) free_.give_back(what.text.pop_front(blocks_));
  what = {};
}

void latch_store::write(const latched_value& what, json::writer& into) const noexcept {
  chunk_store::place place;
  for (std::size_t at = 0; what.chunks && at != what.bytes;) {
    const auto here = chunks_.read(what.chunks, at, place);
    into.append({reinterpret_cast<const char*>(here.data()), here.size()});
    at += here.size();
  }
  std::size_t left = what.bytes;
  for (block_id i = what.text.head; i; i = blocks_[i].next) {
    const std::size_t here = std::min(left, latch_block_bytes_max);
    into.append({blocks_[i].text.data(), here});
    left -= here;
  }
}

} // namespace rowe::service
