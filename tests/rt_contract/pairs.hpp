// SPDX-License-Identifier: Apache-2.0
// Lanes for exercises of handles, built as an endpoint builds them, with the exercise's own thread in the
// service thread's place: so every state can be brought about at will. service_test.cpp has the real thread.
#pragma once
#include <cstring>
#include <string_view>

#include <rowe/detail/pair_request.hpp>
#include <rowe/schema.hpp>

#include "api/pair_memory.hpp"
#include "contract.hpp"

struct contract_odometry {
  double stamp, x, y, heading, speed;
};
template <>
inline constexpr auto rowe::schema<contract_odometry> =
    rowe::fields<&contract_odometry::stamp, &contract_odometry::x, &contract_odometry::y,
                 &contract_odometry::heading, &contract_odometry::speed>{};

namespace rowe::contract {

using namespace std::chrono_literals;
using detail::audience;
using odometry = contract_odometry;

inline constexpr std::uint32_t depth = 64; // of 192 bytes each: three pages
inline constexpr std::uint32_t text_bytes = 100;
inline constexpr rt::time_point now{1000s};
inline constexpr std::string_view text = R"({"data":"hello"})";

// Place 1 of the endpoint's connections is in use, for the fifth time.
inline constexpr connection somebody{1, 5};
inline constexpr connection somebody_gone{1, 4};

// As the service thread says it, or whoever has joined it.
inline void set_audience(detail::queue_pair& on, audience listening) {
  listening == audience::closed ? on.audience.close() : on.audience.set(listening);
}

inline detail::queue_pair& pair_for(real_time& rt, const detail::pair_request& asked,
                                    audience listening = audience::somebody) {
  auto& made = rt.make<detail::queue_pair>();
  const auto generations = rt.array<rt::std_atomics::variable<std::uint32_t>>(2);
  generations[1].store(5, std::memory_order_relaxed); // relaxed: one thread here
  made.memory = rt.array<std::byte>(detail::pair_bytes(asked));
  detail::build_pair(made, asked, generations);
  made.waker = rt.waker_for(made.published);
  set_audience(made, listening);
  return made;
}

inline detail::pair_handle handle_of(detail::queue_pair& on) { return {nullptr, on}; }

// A handle and its queue pair.
template <class Handle>
struct offered {
  detail::queue_pair& on;
  Handle& handle;
};
template <class Handle>
offered<Handle> offer(real_time& rt, const detail::pair_request& asked,
                      audience listening = audience::somebody) {
  detail::queue_pair& on = pair_for(rt, asked, listening);
  return {on, rt.make<Handle>(handle_of(on))};
}
inline constexpr service_options service{.depth = 16, .text_bytes_max = text_bytes};

inline void close(detail::queue_pair& on) { on.audience.close(); }

// What the service thread puts into a queue; nothing when no slot is free.
inline void fill(const detail::producer_end& end, detail::value_header header, const void* value,
                 std::size_t bytes) {
  const auto slot = end.free_ring->try_take();
  if (!slot) return;
  header.bytes = static_cast<std::uint32_t>(bytes);
  *end.memory.header(*slot) = header;
  std::memcpy(end.memory.value(*slot), value, bytes);
  use(end.ring->try_push(*slot));
}

inline void arrive(detail::queue_pair& on, rt::time_point expires = rt::never) {
  detail::value_header header;
  header.expires_ns = rt::nanoseconds_of(expires);
  header.peer = {somebody.index, somebody.generation};
  fill(on.service.in, header, text.data(), text.size());
}
// What it does with a value that has arrived.
inline void decode(detail::queue_pair& on, const odometry& value = {1, 2, 3, 4, 5},
                   rt::time_point over = rt::never) {
  const detail::producer_end& end = on.service.in;
  const detail::value_header header{.expires_ns = rt::nanoseconds_of(over)};
  if (end.newest == nullptr) return fill(end, header, &value, sizeof value);
  const std::uint32_t slot = end.newest->begin_write();
  *end.memory.header(slot) = header;
  std::memcpy(end.memory.value(slot), &value, sizeof value);
  end.newest->end_write(slot);
}
// A call: of text, or of a struct.
inline void ask(detail::queue_pair& on, rt::time_point expires = rt::never, connection by = somebody) {
  static constexpr odometry value{1, 2, 3, 4, 5};
  detail::value_header header;
  header.what = detail::entry::invocation;
  header.expires_ns = rt::nanoseconds_of(expires);
  header.peer = {by.index, by.generation};
  header.call = {3, 1};
  if (on.kind == detail::pair_kind::respond_value) return fill(on.service.in, header, &value, sizeof value);
  fill(on.service.in, header, text.data(), text.size());
}

// Takes what the handle sent and gives the slots back; calls end with `outcome`.
inline void serve(detail::queue_pair& on, const status& outcome = {}) {
  if (on.service.out.newest != nullptr) return use(on.service.out.newest->begin_read());
  on.service.out.ring->drain(
      [&](std::uint32_t slot) {
        detail::value_header header = *on.service.out.memory.header(slot);
        on.service.out.free_ring->release(slot);
        if (header.own.generation == 0) return;
        header.what = detail::entry::completion;
        header.failed = !outcome;
        header.outcome = outcome.code();
        if (on.kind == detail::pair_kind::call_value && outcome) {
          const odometry reply{1, 2, 3, 4, 5};
          return fill(on.service.completions, header, &reply, sizeof reply);
        }
        fill(on.service.completions, header, text.data(), text.size());
      },
      2 * std::size_t{depth});
}

} // namespace rowe::contract
