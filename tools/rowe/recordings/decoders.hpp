// SPDX-License-Identifier: Apache-2.0
// Recorded messages as JSON, which is what is published. Here, and only here, is said which encodings that
// works for.
#pragma once
#include <functional>
#include <optional>
#include <string_view>

#include <rowe/recording.hpp>

namespace rowe::tools {

// The JSON object that a message is, valid until the next call. Nothing: it is none.
using message_decoder = std::function<std::optional<std::string_view>(std::string_view data)>;

// For the messages of a topic, by its encoding and schema. Empty: nobody knows how.
message_decoder decoder_for(const recorded_topic& topic);

} // namespace rowe::tools
