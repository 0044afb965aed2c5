// SPDX-License-Identifier: Apache-2.0
// What counts as work, and how much of it one cycle, or the turn of one peer, may do. Reading, composing and
// writing each have their own unit. service_limits.hpp has the other bounds.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>

#include <rowe/rt/clock.hpp>

#include "service/base/transport.hpp"

namespace rowe::service {

// ---- work of a cycle

// Values taken from one handle in a cycle; more if no subscriber loses one by it. Messages, requests and
// replies taken from one handle, or from all threads together.
inline constexpr std::size_t values_per_cycle = 64;
inline constexpr std::size_t values_per_cycle_ample = 256;
inline constexpr std::size_t entries_per_cycle = 64;
static_assert(values_per_cycle < values_per_cycle_ample);

// Work of reading: a message counts as one, and so does each kilobyte of it and of what is composed for it.
// About 100 us on a fast core.
inline constexpr std::size_t read_work_per_cycle = 100;
inline constexpr std::size_t read_work_bytes = 1024;
// Each value, name and bracket of a message in JSON counts as so many bytes more, but for the first ones,
// which are about as many as an ordinary message has in a kilobyte.
inline constexpr std::size_t token_work_bytes = 16;
inline constexpr std::size_t tokens_uncharged = 128;
// A peer that takes more than this in its turn sits out rounds (turns.hpp).
inline constexpr std::size_t turn_work = 4;
static_assert(turn_work < read_work_per_cycle);
// Requests of a list in one message that are carried out in one turn.
inline constexpr std::uint32_t listed_requests_per_turn = 16;
static_assert(listed_requests_per_turn < read_work_per_cycle);
inline constexpr rt::duration pause_min = std::chrono::seconds{3}; // between cycles, while there are peers
inline constexpr std::uint32_t stops_ahead_max = 64; // stops that are carried out before their turn
// One read in turn does not take more than a cycle's work.
static_assert(transport_sink::read_bytes_in_turn / read_work_bytes < read_work_per_cycle);

// Work of writing in one cycle; after that, other peers wait for the next cycle. A call of the transport
// counts as one, and so does each 16 KiB. About 200 us on a fast core.
inline constexpr std::size_t write_work_per_cycle = 32;
inline constexpr std::size_t write_work_bytes = 16 * 1024;
inline constexpr unsigned batches_per_cycle = 8; // to one peer
// Peers whose frames are gathered before the first of them is written, if each gets a single one.
inline constexpr std::uint32_t group_max = 16;
static_assert(group_max <= write_work_per_cycle);

// Other work, given in bytes whose composition takes as long: one push to a queue, one eviction, and one
// answer of the endpoint itself, which walks all topics, services or counters.
inline constexpr std::size_t push_work = 128;
inline constexpr std::size_t eviction_work = 1024;
inline constexpr std::size_t eviction_pass_work = 16; // for each entry that is passed over
// A look at a message that waits in an inbox.
inline constexpr std::size_t looked_at_work = 8;
inline constexpr std::size_t answer_work = 10 * 1024;
// The percentiles of one loop, which are looked for in a histogram of 30 KiB.
inline constexpr std::size_t percentiles_work = 4 * 1024;
static_assert(push_work < eviction_work && answer_work / read_work_bytes < read_work_per_cycle);
// Messages that may be dropped until one slot is free.
inline constexpr unsigned evictions_max = 64;
// Topics or services that one message lists, and the bytes for each besides its name and type.
inline constexpr std::size_t listed_max = 64;
inline constexpr std::size_t listed_bytes = 128;
// What an answer of /rosapi says around the names that it lists, besides the id and the service.
inline constexpr std::size_t list_envelope_bytes = 192;
// The work of looking at one place that a peer holds for a topic.
inline constexpr std::size_t held_topic_work_bytes = 4;
static_assert(held_topic_work_bytes < push_work);
// Peers that are marked to be closed and are closed in one cycle. Each costs a call of the transport.
inline constexpr std::uint32_t closes_per_cycle = 16;

} // namespace rowe::service
