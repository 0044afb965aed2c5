// SPDX-License-Identifier: Apache-2.0
#include "api/lane_memory.hpp"

#include <cassert>
#include <memory>
#include <new>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/slab.hpp>

namespace rowe::detail {
namespace {

using rt::arena;

constexpr std::size_t stride_of(std::size_t value_bytes) noexcept {
  return arena::bytes_for(value_offset + value_bytes + rt::tailroom_bytes);
}

// Places of the ring that carries `depth` slots out. Twice as many, because the service thread empties it in
// batches and sends each slot home at once, but gives the places back at the end of the batch
// (spsc_ring::drain): up to `depth` slots of that batch can be on their way again while their former places
// still count as taken.
constexpr std::size_t places_out(std::size_t depth) noexcept { return number_ring::places_for(2 * depth); }

// The places of both rings and the slots, one behind the other. Only ever as much as path_bytes() counted.
class builder {
 public:
  explicit builder(std::span<std::byte> memory) noexcept : left_{memory} {}

  template <class T, class... Arguments>
  T* make(Arguments&&... arguments) noexcept {
    return std::construct_at(reinterpret_cast<T*>(take(sizeof(T)).data()),
                             std::forward<Arguments>(arguments)...);
  }
  template <class T>
  std::span<T> array(std::size_t count) noexcept {
    T* const first = reinterpret_cast<T*>(take(count * sizeof(T)).data());
    std::uninitialized_value_construct_n(first, count);
    return {first, count};
  }
  std::span<std::byte> take(std::size_t bytes) noexcept {
    const std::size_t whole = arena::bytes_for(bytes);
    assert(whole <= left_.size());
    const auto taken = left_.first(whole);
    left_ = left_.subspan(whole);
    return taken;
  }

 private:
  std::span<std::byte> left_;
};

} // namespace

std::size_t path_bytes(rowe::keep kept, std::uint32_t depth, std::size_t value_bytes) noexcept {
  if (kept == keep::newest) {
    return arena::bytes_for<newest_window>() + newest_window::slots * stride_of(value_bytes);
  }
  return arena::bytes_for<number_ring>() + arena::bytes_for<number_ring::entry>(places_out(depth)) +
         arena::bytes_for<numbers_home>() +
         arena::bytes_for<numbers_home::entry>(numbers_home::places_for(depth)) +
         depth * stride_of(value_bytes);
}

void build_path(std::span<std::byte> memory, rowe::keep kept, std::uint32_t depth, std::size_t value_bytes,
                filling_end& fills, emptying_end& empties) noexcept {
  builder from{memory};
  fills = {};
  empties = {};
  const std::size_t stride = stride_of(value_bytes);
  std::size_t slots = depth;
  if (kept == keep::newest) {
    auto* const window = from.make<newest_window>();
    fills.newest = window->take_writer();
    empties.newest = window->take_reader();
    slots = newest_window::slots;
  } else {
    const auto places = from.array<number_ring::entry>(places_out(depth));
    auto* const out = from.make<number_ring>(places);
    const auto homes = from.array<numbers_home::entry>(numbers_home::places_for(depth));
    auto* const home = from.make<numbers_home>(homes, depth);
    fills.out = out->take_producer();
    fills.home = home->take_consumer();
    empties.out = out->take_consumer();
    empties.home = home->take_producer();
  }
  fills.slots = empties.slots = {from.take(slots * stride).data(), stride, value_bytes};
}

} // namespace rowe::detail
