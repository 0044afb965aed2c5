// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/slab.hpp>

namespace rowe::contract {
namespace {

using rt::pool;
using rt::slab;

constexpr std::uint32_t slots = 512;
constexpr std::size_t payload_bytes = 1024;

slab new_slab(real_time& rt) {
  return {rt.array<std::byte>(slab::bytes_for(slots, payload_bytes)), slots, payload_bytes};
}

pool& pool_with(real_time& rt, std::uint32_t taken) {
  pool& p = rt.make<pool>(rt.array<pool::node>(slots));
  while (taken-- > 0) use(p.take());
  return p;
}

constexpr exercise list[] = {
    {"slab::slot", "each in turn, written to",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls(
           [&](std::uint64_t i) { s.slot(static_cast<std::uint32_t>(i % slots)).back() = std::byte{1}; });
     }},
    {"slab::number_of", "an address in it",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls(
           [&](std::uint64_t i) { use(s.number_of(s.slot(static_cast<std::uint32_t>(i % slots)).data())); });
     }},
    {"slab::number_of", "an address beside it",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls([&](std::uint64_t) { use(s.number_of(&rt)); });
     }},
    {"slab::number_of", "an address, without slots",
     [](real_time& rt) {
       const slab s;
       rt.calls([&](std::uint64_t) { use(s.number_of(&rt)); });
     }},
    {"slab::slots", "always",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls([&](std::uint64_t) { use(s.slots()); });
     }},
    {"slab::payload_bytes", "always",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls([&](std::uint64_t) { use(s.payload_bytes()); });
     }},
    {"slab::stride_bytes", "always",
     [](real_time& rt) {
       const slab s = new_slab(rt);
       rt.calls([&](std::uint64_t) { use(s.stride_bytes()); });
     }},

    {"pool::take", "until none is left, and again",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       std::uint32_t taken = 0;
       const auto tickets = rt.array<rt::pool_ticket>(slots);
       rt.calls([&](std::uint64_t) {
         if (const auto ticket = p.take()) {
           tickets[taken++] = *ticket;
         } else {
           while (taken > 0) use(p.give(tickets[--taken]));
         }
       });
     }},
    {"pool::take", "when none is left",
     [](real_time& rt) {
       pool& p = pool_with(rt, slots);
       rt.calls([&](std::uint64_t) { use(p.take()); });
     }},
    {"pool::give", "what was just taken",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       rt.calls([&](std::uint64_t) { use(p.give(*p.take())); });
     }},
    {"pool::holds", "a ticket that is good",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       const auto ticket = *p.take();
       rt.calls([&](std::uint64_t) { use(p.holds(ticket)); });
     }},
    {"pool::holds", "a ticket that is stale",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       const auto ticket = *p.take();
       p.give(ticket);
       rt.calls([&](std::uint64_t) { use(p.holds(ticket)); });
     }},
    {"pool::slots", "always",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       rt.calls([&](std::uint64_t) { use(p.slots()); });
     }},
    {"pool::free_count", "always",
     [](real_time& rt) {
       pool& p = pool_with(rt, 0);
       rt.calls([&](std::uint64_t) { use(p.free_count()); });
     }},
};

} // namespace

std::span<const exercise> exercises_of_slots() { return list; }

} // namespace rowe::contract
