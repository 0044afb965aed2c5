// SPDX-License-Identifier: Apache-2.0
// The topic in which a recording says what it lost.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "recording/described_topics.hpp"
#include "json/writing/writer.hpp"

namespace rowe::recording {

inline constexpr std::string_view losses_topic = "/rowe/record/lost";
inline constexpr std::string_view losses_type = "rowe/RecordLoss";
inline constexpr std::string_view losses_schema =
    R"({"type":"object","title":"rowe/RecordLoss","properties":{"topic":{"type":"string"},)"
    R"("messages":{"type":"integer"}},"required":["topic","messages"]})";
// That topic itself.
inline described_topic losses() {
  return {.name = std::string{losses_topic},
          .type = std::string{losses_type},
          .schema = std::string{losses_schema}};
}

inline std::string loss_text(std::string_view topic, std::uint64_t count) {
  std::string text(topic.size() * 6 + 64, '\0'); // each byte escaped
  json::writer out{text};
  out.begin_object();
  out.member("topic", topic);
  out.member("messages", count);
  out.end_object();
  text.resize(out.bytes());
  return text;
}

} // namespace rowe::recording
