// SPDX-License-Identifier: Apache-2.0
// Reads the messages of peers: decodes each to its requests, for request_router.hpp. Service thread only;
// nothing waits or allocates.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <rowe/limits.hpp>
#include <rowe/rt/arena.hpp>

#include "service/incoming/fragment_ingress.hpp"
#include "service/incoming/ingress.hpp"
#include "service/incoming/long_ingress.hpp"
#include "service/incoming/refusals.hpp"
#include "service/parameters/parameters.hpp"
#include "service/requests/request_router.hpp"
#include "service/state/core_state.hpp"
#include "wire/codec/codec.hpp"
#include "wire/codec/refusal.hpp"

namespace rowe::service {

struct dispatcher_needs {
  core_state& state_;
  ingress& ingress_;
  long_ingress& long_ingress_;
  fragment_ingress& fragment_ingress_;
  request_router& request_router_;
};

class dispatcher : dispatcher_needs {
 public:
  static std::size_t footprint_bytes(const limits& bounds) noexcept;
  dispatcher(rt::arena& memory, const dispatcher_needs& parts) noexcept;

  // A message of a peer. Its text may be written to.
  void dispatch(peer_index from, std::span<std::byte> message, bool binary) noexcept;
  // A piece of a long message of a peer; the last one, with which it is complete, is its event.
  void dispatch_piece(peer_index from, const wire::frame_step& step) noexcept;
  // A message that was parked (ingress::park), or of which some is left (ingress::go_on).
  void dispatch_again(peer_index from, std::span<std::byte> message, bool binary) noexcept;
  // Whether dispatch() would carry out a stop. It makes the same decisions and changes nothing. It decodes
  // the message as a request, so it must not be called while another one is carried out.
  bool is_stop(peer_index from, std::span<const std::byte> message, bool binary) noexcept;

 private:
  using diagnostic_buffer = std::array<char, wire::refusal::text_bytes_max>;

  wire::decode_buffers decode_buffers(diagnostic_buffer& diagnostic,
                                      wire::list_place from = {}) const noexcept {
    return {.scratch = scratch_,
            .diagnostic = diagnostic,
            .limits = {.name_bytes_max = state_.bounds().topic_bytes_max, .parameters_max = parameters_max_},
            .from = from};
  }
  void read(connection& c, std::span<std::byte> message, bool binary) noexcept {
    binary ? read_binary(c, message) : read_text(c, message);
  }
  void read_text(connection& c, std::span<std::byte> message) noexcept;
  status validate(std::string_view text) noexcept;
  void read_binary(connection& c, std::span<std::byte> message) noexcept;
  void read_long(connection& c, const long_arrival& message, std::span<const std::byte> front) noexcept;
  void take_fragments(connection& c, fragment_ingress::due due) noexcept;
  void carry_out_whole(connection& c) noexcept;

  const std::uint32_t parameters_max_; // that are looked at in a list: more than there are
  std::span<char> scratch_;            // the names and the id of the request; only decoders write here
};

} // namespace rowe::service
