// SPDX-License-Identifier: Apache-2.0
// Reads text messages of the two JSON formats. Each message is recognised by itself: an object with a string
// member `op` is rosbridge's, everything else is in the plain format.
#pragma once
#include <array>

#include "wire/codec/codec.hpp"

namespace rowe::wire {

class json_decoder final : public message_decoder {
 public:
  // The codecs of rosbridge's encodings of messages, by rosbridge_encoding.
  using encodings = std::array<codec_id, 4>;
  constexpr json_decoder(codec_id plain, const encodings& rosbridge) noexcept
      : plain_{plain}, rosbridge_{rosbridge[0]}, encodings_{rosbridge} {}

  decoded decode(const json::document& text, const decode_buffers& buffers, request& into,
                 diagnostic& why) const noexcept override;
  codec_id guess(std::string_view text, codec_id spoke_last) const noexcept override;
  bool may_be_stop(opcode what, std::string_view begins) const noexcept override;

 private:
  decoded decode_rosbridge(const json::document& text, const decode_buffers& buffers, request& into,
                           diagnostic& why) const noexcept;
  decoded decode_other(const json::document& text, const decode_buffers& buffers, request& into,
                       diagnostic& why) const noexcept;

  codec_id plain_;
  codec_id rosbridge_;
  encodings encodings_;
};

} // namespace rowe::wire
