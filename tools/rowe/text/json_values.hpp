// SPDX-License-Identifier: Apache-2.0
// Looking into JSON by paths such as `pose.x`, `ranges[3]` and `links[0].name`. The text must be valid.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::tools {

// What stands at `path`, as it is spelt; nothing where nothing does. Of members that occur twice, the first.
std::optional<std::string_view> value_at(std::string_view json, std::string_view path) noexcept;

// A number, string, word, or empty object or array, and where it stands.
struct json_leaf {
  std::string path;
  std::string_view value; // as it is spelt
};

// All of them in order; one without a path where the whole is a leaf itself.
std::vector<json_leaf> leaves_of(std::string_view json);

// `object` with the member `name` in front of the others. `value` must be JSON.
std::string with_member(std::string_view object, std::string_view name, std::string_view value);

// `object` without its members of that name, on the top level.
std::string without_member(std::string_view object, std::string_view name);

// Text as a JSON string, quotes and all.
std::string json_string_of(std::string_view utf8);

// A value as a person would write it: a string without its quotes and escapes, but for those of control
// characters, which might move a terminal's cursor; anything else as it is spelt.
std::string plain_text_of(std::string_view value);

} // namespace rowe::tools
