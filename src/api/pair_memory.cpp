// SPDX-License-Identifier: Apache-2.0
#include "api/pair_memory.hpp"

#include <algorithm>
#include <cassert>
#include <memory>
#include <utility>

#include <rowe/rt/arena.hpp>
#include <rowe/rt/slab.hpp>

#include "json/structs/description.hpp"
#include "json/structs/times.hpp"

namespace rowe::detail {
namespace {

using rt::arena;

constexpr std::size_t stride_of(std::size_t value_bytes) noexcept {
  return arena::bytes_for(value_offset + value_bytes + rt::tailroom_bytes);
}

// Places of the ring that carries `depth` slots: twice as many. The service thread drains it in batches. It
// releases each slot at once, but the ring's places only at the end of the batch (spsc_ring::drain). So up to
// `depth` slots of a batch can be pushed again while their former places still count as taken.
constexpr std::size_t places_out(std::size_t depth) noexcept { return number_ring::places_for(2 * depth); }

// Places both rings and the slots one behind the other, in as many bytes as queue_bytes() counted.
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

std::size_t queue_bytes(rowe::keep kept, std::uint32_t depth, std::size_t value_bytes) noexcept {
  if (kept == keep::newest) {
    return arena::bytes_for<newest_window>() + newest_window::slot_count * stride_of(value_bytes);
  }
  return arena::bytes_for<number_ring>() + arena::bytes_for<number_ring::entry>(places_out(depth)) +
         arena::bytes_for<number_free_ring>() +
         arena::bytes_for<number_free_ring::entry>(number_free_ring::places_for(depth)) +
         depth * stride_of(value_bytes);
}

void build_queue(std::span<std::byte> memory, rowe::keep kept, std::uint32_t depth, std::size_t value_bytes,
                 producer_end& producer, consumer_end& consumer) noexcept {
  builder from{memory};
  producer = {};
  consumer = {};
  const std::size_t stride = stride_of(value_bytes);
  std::size_t slots = depth;
  if (kept == keep::newest) {
    auto* const window = from.make<newest_window>();
    producer.newest = window->take_writer();
    consumer.newest = window->take_reader();
    slots = newest_window::slot_count;
  } else {
    const auto places = from.array<number_ring::entry>(places_out(depth));
    auto* const out = from.make<number_ring>(places);
    const auto free_places = from.array<number_free_ring::entry>(number_free_ring::places_for(depth));
    auto* const free_ring = from.make<number_free_ring>(free_places, depth);
    producer.ring = out->take_producer();
    producer.free_ring = free_ring->take_consumer();
    consumer.ring = out->take_consumer();
    consumer.free_ring = free_ring->take_producer();
  }
  producer.count = static_cast<std::uint32_t>(slots);
  producer.memory = consumer.memory = {from.take(slots * stride).data(), stride, value_bytes};
}

namespace {

// A queue that may be there or not.
std::size_t queue_bytes_of(const pair_request& asked, std::uint32_t depth, std::size_t value_bytes) noexcept {
  return depth == 0 ? 0 : queue_bytes(asked.keep, depth, value_bytes);
}

// Slots of a responder's `out` that may be parked.
std::uint32_t replies_of(const pair_request& asked) noexcept {
  return responds(asked.kind) ? asked.out_depth : 0;
}

void build_calls(queue_pair::user_side& of, std::span<pending_call> places) noexcept {
  of.calls = places;
  of.free_call = 0;
  of.calls_open = 0;
  for (std::uint32_t i = 0; i < places.size(); ++i) places[i].next_free = i + 1;
}

std::uint8_t copy_text(std::string_view from, std::array<char, queue_pair::name_bytes_max>& to) noexcept {
  std::copy(from.begin(), from.end(), to.begin());
  return static_cast<std::uint8_t>(from.size());
}

} // namespace

std::size_t pair_bytes(const pair_request& asked) noexcept {
  constexpr std::size_t least = rt::line_bytes; // its address identifies a queue pair
  return least + (is_latch(asked.kind) ? arena::bytes_for<loop_timing>() : 0) +
         queue_bytes_of(asked, asked.out_depth, asked.out_bytes) +
         queue_bytes_of(asked, asked.in_depth, asked.in_bytes) +
         queue_bytes_of(asked, asked.completions_depth, asked.completions_bytes) +
         arena::bytes_for<pending_call>(asked.completions_depth) +
         arena::bytes_for<std::uint32_t>(asked.completions_depth) +
         arena::bytes_for<std::uint32_t>(replies_of(asked));
}

void build_pair(queue_pair& built, const pair_request& asked,
                std::span<const rt::std_atomics::variable<std::uint32_t>> peer_generations) noexcept {
  built.kind = asked.kind;
  built.keep = asked.keep;
  built.priority = asked.priority;
  built.latched = asked.latched;
  built.shared = asked.shared;
  built.ttl = asked.ttl;
  built.period = asked.period;
  built.lease = asked.lease;
  built.throttle = asked.throttle;
  built.turn.reset();
  built.receives = asked.receives;
  built.peer_generations = peer_generations;
  built.peers_taking = peer_generations;                // until set-up says otherwise
  built.room_asked.store(0, std::memory_order_relaxed); // relaxed: `offered` publishes it
  built.name_bytes = copy_text(asked.name, built.name_text);
  built.type_bytes = copy_text(asked.type, built.type_text);
  built.encoded = asked.encoded;
  built.decoded = asked.decoded;
  built.encoder = nullptr;
  built.other_encoders = nullptr;
  built.decoder = nullptr;
  built.granted = nullptr;
  built.loop_timeout = asked.loop_timeout;
  built.sink = asked.sink;
  built.latch.reset();
  built.user = {};
  built.service = {};
  for (rt::counter* one :
       {&built.published, &built.refused_full, &built.refused_too_big, &built.no_peer, &built.expired_here}) {
    one->set(0);
  }

  builder from{built.memory};
  const auto build = [&](std::uint32_t depth, std::size_t bytes, producer_end& producer,
                         consumer_end& consumer) {
    const std::size_t takes = queue_bytes_of(asked, depth, bytes);
    if (takes != 0) build_queue(from.take(takes), asked.keep, depth, bytes, producer, consumer);
  };
  build(asked.out_depth, asked.out_bytes, built.user.out, built.service.out);
  build(asked.in_depth, asked.in_bytes, built.service.in, built.user.in);
  build(asked.completions_depth, asked.completions_bytes, built.service.completions, built.user.completions);
  built.timing = is_latch(asked.kind) ? from.make<loop_timing>() : nullptr;
  build_calls(built.user, from.array<pending_call>(asked.completions_depth));
  built.user.parked_completions.places = from.array<std::uint32_t>(asked.completions_depth);
  built.user.spare_replies.places = from.array<std::uint32_t>(replies_of(asked));
}

// A struct that never fits is refused here. One that may fit is published as far as it does.
status pair_codecs::check_length(const pair_request& asked, const limits& bounds) const noexcept {
  const bool may_be_long = asked.kind == pair_kind::publish_value;
  const std::size_t longest =
      std::max(bounds.message_bytes_max, may_be_long ? bounds.long_message_bytes_max : 0);
  if (json::shortest_text(*asked.encoded) <= longest) return {};
  return error{errc::too_big, static_cast<std::int64_t>(encoder->bytes_max()),
               static_cast<std::int64_t>(longest),
               may_be_long ? argument::long_message_bytes_max : argument::message_bytes_max};
}

result<pair_codecs> pair_codecs::compile(const pair_request& asked, const limits& bounds) {
  pair_codecs made;
  if (asked.encoded != nullptr) {
    auto encoder = json::encoder::compile(*asked.encoded);
    if (!encoder) return encoder.error();
    made.encoder.emplace(std::move(encoder).value());
    if (const status fits = made.check_length(asked, bounds); !fits) return fits.error();
    if (asked.kind == pair_kind::publish_value) {
      made.other.emplace();
      if (json::holds_time(*asked.encoded)) {
        auto timed = json::encoder::compile(*asked.encoded, json::encoding::sec_nsec);
        if (!timed) return timed.error();
        made.other->sec_nsec.emplace(std::move(timed).value());
      }
      if (auto cbor = json::encoder::compile(*asked.encoded, json::encoding::cbor); cbor)
        made.other->cbor.emplace(std::move(cbor).value());
      else
        return cbor.error();
      if (auto ros1 = json::encoder::compile(*asked.encoded, json::encoding::ros1); ros1)
        made.other->ros1.emplace(std::move(ros1).value());
    }
  }
  if (asked.decoded != nullptr && asked.kind != pair_kind::listen) {
    auto decoder =
        json::decoder::compile(*asked.decoded, asked.fill_missing ? json::decoder::missing::filled
                                                                  : json::decoder::missing::refused);
    if (!decoder) return decoder.error();
    made.decoder.emplace(std::move(decoder).value());
    if (asked.lease != duration{}) made.decoder->refuse_null_numbers();
  }
  return made;
}

} // namespace rowe::detail
