// SPDX-License-Identifier: Apache-2.0
// rosbridge's `compression`: the messages of a topic in CBOR, in ROS 1's serialisation within CBOR, or as the
// pixels of a PNG. All else that is said to such a peer is rosbridge's JSON, as in the reference server.
#pragma once
#include "wire/rosbridge/rosbridge_codec.hpp"

namespace rowe::wire {

// {"op":"png","data":"..."}, of the JSON that others get.
class rosbridge_png_codec final : public rosbridge_codec {
 public:
  constexpr explicit rosbridge_png_codec(codec_id id) noexcept
      : rosbridge_codec{
            {.id = id, .name = "rosbridge_png", .fails_as_refusal = false, .writes_whole = true}} {}
  message_kind write_message(json::writer& out, const topic_message& what) const noexcept override;
};

// {"op","topic","msg"} in a binary frame.
class rosbridge_cbor_codec final : public rosbridge_codec {
 public:
  constexpr explicit rosbridge_cbor_codec(codec_id id) noexcept
      : rosbridge_codec{{.id = id,
                         .name = "rosbridge_cbor",
                         .fails_as_refusal = false,
                         .writes_whole = true,
                         .writes_types = true}} {}
  message_kind write_message(json::writer& out, const topic_message& what) const noexcept override;
};

// The same with "msg" {"secs","nsecs","bytes"}: the time at which it was published, and ROS 1's bytes. What
// has no struct of a type that ROS has is CBOR as above.
class rosbridge_cbor_raw_codec final : public rosbridge_codec {
 public:
  constexpr explicit rosbridge_cbor_raw_codec(codec_id id) noexcept
      : rosbridge_codec{{.id = id,
                         .name = "rosbridge_cbor_raw",
                         .fails_as_refusal = false,
                         .writes_whole = true,
                         .writes_types = true}} {}
  message_kind write_message(json::writer& out, const topic_message& what) const noexcept override;
  std::string_view lacks_without_type() const noexcept override;
};

} // namespace rowe::wire
