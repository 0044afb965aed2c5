// SPDX-License-Identifier: Apache-2.0
// Which fields of which topics are plotted, as they are asked for, and what is known of them.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

struct field_wish {
  std::string topic{};
  std::string path{};
  std::size_t lane = 0; // which of the axes, one below the other
  std::string x_path{}; // what stands to the right in place of the time, of the same topic; empty: the time

  // "/odom:pose.x".
  std::string name() const { return topic + ":" + path; }
};

// What --field was given: "/odom:pose.x,pose.y" is two fields on one axis; each --field has an axis of its
// own. A field that is asked for twice is plotted once. Nothing: `wrong` says what is.
std::optional<std::vector<field_wish>> fields_of(const std::vector<std::string>& given, std::string& wrong);

// Likewise --xy: "/odom:pose.x,pose.y" is one path. All of them are on the same axes.
std::optional<std::vector<field_wish>> paths_of(const std::vector<std::string>& given, std::string& wrong);

// Whether a topic is meant: "x" and "/x" are the same name.
bool is_same_name(std::string_view one, std::string_view other) noexcept;

// "; did you mean /odom?" or, if none is near, which there are; to be read behind a sentence.
std::string hint_of(std::string_view word, const std::vector<std::string>& known);
// The same of a path in a message that has no number there.
std::string hint_of_path(std::string_view path, json_value message);

// The unit of a field, where the JSON Schema of its type tells one: "s", "m/s". Else empty.
std::string unit_in(std::string_view json_schema, std::string_view path);

} // namespace rowe::tools
