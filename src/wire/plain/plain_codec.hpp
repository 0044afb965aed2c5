// SPDX-License-Identifier: Apache-2.0
// The codec of the plain format (plain.hpp reads and writes the format). It has messages and calls, and no
// topics.
#pragma once
#include "wire/codec/codec.hpp"

namespace rowe::wire {

class plain_codec final : public codec {
 public:
  constexpr explicit plain_codec(codec_id id) noexcept
      : codec{{.id = id, .name = "plain", .fails_as_refusal = true}} {}

  // Of a plain message. Its shared text must begin with the brace.
  message_head head_of(const delivery& to) const noexcept override;

  message_kind write_call(json::writer& out, std::string_view service, std::string_view id,
                          const call_args& args) const noexcept override;
  message_kind write_reply(json::writer& out, const call_origin& call,
                           const body& value) const noexcept override;
  message_kind write_failure(json::writer& out, const call_origin& call,
                             const diagnostic& why) const noexcept override;
  bool means_no_service(const request& failed, std::string_view diagnostic,
                        std::string_view service) const noexcept override;
  message_kind write_error(json::writer& out, const error_context& to,
                           const diagnostic& why) const noexcept override;
};

} // namespace rowe::wire
