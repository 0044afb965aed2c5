// SPDX-License-Identifier: Apache-2.0
// Builds queue pairs as requested: their rings, windows, slots and tables, in given memory, and their
// compiled schemas. Set-up.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include <rowe/detail/pair_request.hpp>
#include <rowe/detail/queue_pair.hpp>
#include <rowe/options.hpp>

#include "json/structs/decoder.hpp"
#include "json/structs/encoder.hpp"

namespace rowe::detail {

// What a queue takes that holds `depth` values of `value_bytes` (keep::all) or the newest one.
std::size_t queue_bytes(rowe::keep kept, std::uint32_t depth, std::size_t value_bytes) noexcept;

// Builds it at the beginning of `memory`, which is queue_bytes() long and aligned to a line, and hands out
// its two ends.
void build_queue(std::span<std::byte> memory, rowe::keep kept, std::uint32_t depth, std::size_t value_bytes,
                 producer_end& producer, consumer_end& consumer) noexcept;

// What the queues and tables of a queue pair take together.
std::size_t pair_bytes(const pair_request& asked) noexcept;

// Writes all members of a free queue pair that set-up writes, except its encoder and decoder. Builds what the
// request asks for in `built.memory`, which is pair_bytes() long or more, and aligned to a line. The name and
// the type have at most queue_pair::name_bytes_max bytes.
void build_pair(queue_pair& built, const pair_request& asked,
                std::span<const rt::std_atomics::variable<std::uint32_t>> peer_generations) noexcept;

// The compiled schemas of a queue pair. Outlive it.
struct pair_codecs {
  std::optional<json::encoder> encoder;
  std::optional<json::other_encoders> other; // of publishers
  std::optional<json::decoder> decoder;

  // Allocates. Errors: bad_argument (a schema that nests too deep, or is too large); too_big: no text of the
  // struct is as short as a message may be long (value: its longest text, limit: that of messages, which may
  // be long ones for a publisher); no_memory.
  static result<pair_codecs> compile(const pair_request& asked, const limits& bounds);

  // For the queue pair; null: it publishes no values. Valid until this is moved.
  const json::other_encoders* others() noexcept {
    if (other) other->json = &*encoder;
    return other ? &*other : nullptr;
  }

 private:
  status check_length(const pair_request& asked, const limits& bounds) const noexcept;
};

} // namespace rowe::detail
