// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/rt/slab.hpp>

namespace rowe::contract {
namespace {

using rt::slab;

constexpr std::uint32_t slots = 512;
constexpr std::size_t payload_bytes = 1024;

slab new_slab(real_time& rt) {
  return {rt.array<std::byte>(slab::bytes_for(slots, payload_bytes)), slots, payload_bytes};
}

constexpr exercise list[] = {
    {"slab::slot", "each in turn, written to", calls_on<new_slab>([](auto& s, auto i) {
       s.slot(static_cast<std::uint32_t>(i % slots)).back() = std::byte{1};
     })},
    {"slab::slot_count", "always", calls_on<new_slab>([](auto& s) { return s.slot_count(); })},
    {"slab::payload_bytes", "always", calls_on<new_slab>([](auto& s) { return s.payload_bytes(); })},
};

} // namespace

std::span<const exercise> exercises_of_slots() { return list; }

} // namespace rowe::contract
