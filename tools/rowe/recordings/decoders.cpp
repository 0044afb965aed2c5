// SPDX-License-Identifier: Apache-2.0
#include "decoders.hpp"

#include "../text/json_values.hpp"
#include "own_topics.hpp"

namespace rowe::tools {
namespace {

std::optional<std::string_view> as_it_is(std::string_view json) {
  const auto read = json_value::parse(json);
  if (!read || read->kind() != json_kind::object) return std::nullopt;
  return json;
}

} // namespace

message_decoder decoder_for(const recorded_topic& topic) {
  if (topic.encoding == json_encoding) return as_it_is;
  return {};
}

} // namespace rowe::tools
