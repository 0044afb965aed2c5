// SPDX-License-Identifier: Apache-2.0
// Reads what clients of Foxglove's protocol say (foxglove_codec.hpp writes what they are told).
#pragma once
#include "wire/codec/codec.hpp"

namespace rowe::wire {

class foxglove_decoder final : public message_decoder {
 public:
  constexpr explicit foxglove_decoder(codec_id id) noexcept : id_{id} {}

  decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                 diagnostic& why) const noexcept override;
  decoded decode_binary(std::span<const std::byte> message, const decode_buffers& buffers, request& into,
                        diagnostic& why) const noexcept override;
  std::size_t body_begins(std::byte first) const noexcept override;
  codec_id guess(std::string_view, codec_id) const noexcept override { return id_; }
  bool may_be_stop(opcode what, std::string_view begins) const noexcept override;

 private:
  codec_id id_;
};

} // namespace rowe::wire
