// SPDX-License-Identifier: Apache-2.0
#include "service/state/latched_values.hpp"

#include <algorithm>
#include <span>

namespace rowe::service {
namespace {

// One for each value that there may be: it takes a block, or a chunk, of which values have a half at most.
std::uint32_t row_count(const limits& bounds) noexcept {
  const auto blocks = static_cast<std::uint32_t>(bounds.latched_bytes / sizeof(latch_block));
  const std::uint32_t long_ones = chunk_store::in_use(bounds) ? chunk_store::chunk_count(bounds) / 2 : 0;
  return std::max(blocks + long_ones, 1U);
}

} // namespace

std::size_t latched_values::footprint_bytes(const limits& bounds) noexcept {
  return latch_store::footprint_bytes(bounds) + rt::arena::bytes_for<latched_row>(row_count(bounds));
}

latched_values::latched_values(rt::arena& memory, chunk_store& chunks, const limits& bounds) noexcept
    : chunks_{chunks},
      texts_{memory, chunks, bounds},
      rows_{memory.carve<latched_row>(row_count(bounds))},
      free_{rows_} {}

latch_id latched_values::begin(latched_list& of, latch_owner owner) noexcept {
  forget(of, owner);
  return free_.take();
}

bool latched_values::end(latched_list& of, latch_id row, bool kept, rt::time_point published) noexcept {
  if (!kept) {
    free_.give_back(row);
    return false;
  }
  rows_[row].number = ++last_number_;
  rows_[row].value.published = published;
  of.push_back(rows_, row);
  return true;
}

bool latched_values::keep(latched_list& of, std::string_view body, latch_owner owner,
                          rt::time_point published, rt::time_point expires) noexcept {
  const latch_id row = begin(of, owner);
  if (!row) return false;
  latched_value& value = rows_[row].value;
  bool kept = texts_.store(value, body, owner, expires);
  if (!kept && !body.empty() && chunks_.left() >= chunk_store::chunks_for(body.size())) {
    if (const text_id text = chunks_.begin(body.size())) {
      chunks_.append(text, std::as_bytes(std::span{body}));
      kept = texts_.store_long(value, text, owner, expires);
      chunks_.release(text);
    }
  }
  return end(of, row, kept, published);
}

bool latched_values::keep_long(latched_list& of, text_id text, latch_owner owner, rt::time_point published,
                               rt::time_point expires) noexcept {
  const latch_id row = begin(of, owner);
  return row && end(of, row, texts_.store_long(rows_[row].value, text, owner, expires), published);
}

void latched_values::forget(latched_list& of, latch_owner owner) noexcept {
  latch_id before{};
  for (latch_id i = of.head; i; before = i, i = rows_[i].next) {
    if (rows_[i].value.owner != owner) continue;
    of.erase_behind(rows_, before);
    return release(i);
  }
}

void latched_values::clear(latched_list& of) noexcept {
  while (!of.empty()) release(of.pop_front(rows_));
}

void latched_values::release(latch_id row) noexcept {
  texts_.clear(rows_[row].value);
  rows_[row].number = 0;
  free_.give_back(row);
}

void latched_values::drop_expired(latched_list& of, rt::time_point now) noexcept {
  latch_id before{};
  for (latch_id i = of.head; i;) {
    const latch_id behind = rows_[i].next;
    if (rows_[i].value.expires > now) {
      before = i;
    } else {
      of.erase_behind(rows_, before);
      release(i);
    }
    i = behind;
  }
}

latch_id latched_values::next(const latched_list& of, const latched_place& after,
                              std::uint64_t until) const noexcept {
  const bool is_there = after.number != 0 && rows_[after.row].number == after.number;
  for (latch_id i = is_there ? rows_[after.row].next : of.head; i; i = rows_[i].next) {
    if (rows_[i].number > after.number) return rows_[i].number <= until ? i : latch_id{};
  }
  return {};
}

} // namespace rowe::service
