// SPDX-License-Identifier: Apache-2.0
// The codec of rosbridge v2 (rosbridge.hpp reads and writes the format).
#pragma once
#include "wire/codec/codec.hpp"

namespace rowe::wire {

class rosbridge_codec : public codec {
 public:
  void write_topic_head(json::writer& out, std::string_view topic) const noexcept override;
  std::string_view topic_tail() const noexcept override;
  message_head head_of(const delivery& to) const noexcept override;

  message_kind write_call(json::writer& out, std::string_view service, std::string_view id,
                          const call_args& args) const noexcept override;
  message_kind write_reply(json::writer& out, const call_origin& call,
                           const body& value) const noexcept override;
  message_kind write_failure(json::writer& out, const call_origin& call,
                             const diagnostic& why) const noexcept override;
  bool means_no_service(const request& failed, std::string_view diagnostic,
                        std::string_view service) const noexcept override;
  message_kind write_goal(json::writer& out, const goal_order& what) const noexcept override;
  message_kind write_cancel(json::writer& out, std::string_view action,
                            std::string_view id) const noexcept override;
  message_kind write_feedback(json::writer& out, const call_origin& call,
                              const body& value) const noexcept override;
  void write_fragment(json::writer& out, const text_fragment& what) const noexcept override;
  message_kind write_error(json::writer& out, const error_context& to,
                           const diagnostic& why) const noexcept override;

  message_kind write_subscription(json::writer& out, const announcement& what) const noexcept override;
  message_kind write_advertisement(json::writer& out, const announcement& what) const noexcept override;
  message_kind write_provision(json::writer& out, const announcement& what) const noexcept override;

 protected:
  constexpr explicit rosbridge_codec(const traits& its) noexcept : codec{its} {}
  ~rosbridge_codec() = default;
};

// Topics' messages are JSON as well.
class rosbridge_json_codec final : public rosbridge_codec {
 public:
  constexpr explicit rosbridge_json_codec(codec_id id) noexcept
      : rosbridge_codec{{.id = id, .name = "rosbridge", .fails_as_refusal = false}} {}
};

} // namespace rowe::wire
