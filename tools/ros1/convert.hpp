// SPDX-License-Identifier: Apache-2.0
// Between the bytes of ROS 1 and JSON, as rosbridge writes it: times are {"secs","nsecs"}, uint8[] and char[]
// base64, a float that is not finite null. Integers keep every digit, and a float32 has as few as it needs.
// Both directions work on what others sent, and stop at `bytes_max`.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include <rowe/json_value.hpp>

#include "definition.hpp"

namespace rowe::ros1 {

enum class converted : std::uint8_t {
  done,
  wrong,   // the bytes are not of this type, or the JSON is not
  too_big, // longer than `bytes_max`
};

// Appends the message to `json`.
converted to_json(const message_type& type, std::string_view bytes, std::string& json, std::size_t bytes_max);

// Appends the message's bytes to `bytes`. Members that are left out are zero or empty, as with rosbridge;
// unknown ones are wrong, and so is a member that is there twice. Bytes may be base64 or an array of numbers,
// and times as ROS 2 has them (`sec`, `nanosec`). `why` says what is wrong: the member's path, and what was
// wanted.
converted from_json(const message_type& type, json_value json, std::string& bytes, std::size_t bytes_max,
                    std::string& why);

} // namespace rowe::ros1
