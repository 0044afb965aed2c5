// SPDX-License-Identifier: Apache-2.0
#include "service/latch_store.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "json/writer.hpp"

namespace rowe::service {

std::size_t latch_store::footprint_bytes(const limits& bounds) noexcept {
  return rt::arena::bytes_for<block>(block_count(bounds)) +
         rt::arena::bytes_for<std::uint32_t>(bounds.connections_max);
}

latch_store::latch_store(rt::arena& memory, const limits& bounds) noexcept
    : blocks_{memory.carve<block>(block_count(bounds))},
      held_{memory.carve<std::uint32_t>(bounds.connections_max)},
      claims_{blocks() / 2, bounds.connections_max} {
  for (std::uint32_t i = blocks(); i-- > 0;) {
    blocks_[i].next = free_;
    free_ = i;
  }
}

bool latch_store::store(latched_value& into, std::string_view body, latch_owner owner,
                        rt::time_point expires) noexcept {
  const bool of_peer = owner.who == latch_owner::kind::peer;
  if (!of_peer || into.owner == owner) clear(into);
  const auto needed = static_cast<std::uint32_t>((body.size() + block_bytes - 1) / block_bytes);
  if (needed == 0 || needed > blocks() - in_use_) return false;
  if (of_peer) {
    if (!claims_.may_take(held_[owner.index], left_of(blocks() / 2, of_peers_), needed)) return false;
    claims_.take(held_[owner.index], needed);
    of_peers_ += needed;
  }
  clear(into);
  std::uint32_t* link = &into.first;
  for (std::string_view rest = body; !rest.empty(); rest.remove_prefix(std::min(rest.size(), block_bytes))) {
    const std::uint32_t taken = free_;
    block& here = blocks_[taken];
    free_ = here.next;
    rest.copy(here.text.data(), block_bytes);
    here.next = no_index;
    *link = taken;
    link = &here.next;
  }
  in_use_ += needed;
  into.blocks = needed;
  into.bytes = static_cast<std::uint32_t>(body.size());
  into.owner = owner;
  into.expires = expires;
  return true;
}

void latch_store::clear(latched_value& what) noexcept {
  if (what.empty()) return;
  if (what.owner.who == latch_owner::kind::peer) {
    assert(held_[what.owner.index] >= what.blocks && of_peers_ >= what.blocks);
    claims_.give_back(held_[what.owner.index], what.blocks);
    of_peers_ -= what.blocks;
  }
  in_use_ -= what.blocks;
  for (std::uint32_t i = what.first; i != no_index;) {
    const std::uint32_t next = blocks_[i].next;
    blocks_[i].next = free_;
    free_ = i;
    i = next;
  }
  what = {};
}

void latch_store::write(const latched_value& what, json::writer& into) const noexcept {
  std::size_t left = what.bytes;
  for (std::uint32_t i = what.first; i != no_index; i = blocks_[i].next) {
    const std::size_t here = std::min(left, block_bytes);
    into.append({blocks_[i].text.data(), here});
    left -= here;
  }
}

} // namespace rowe::service
