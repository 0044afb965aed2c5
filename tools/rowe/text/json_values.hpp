// SPDX-License-Identifier: Apache-2.0
// JSON for people and from people, on top of rowe/json_value.hpp.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include <rowe/json_value.hpp>

namespace rowe::tools {

// The value that a text is; null where it is no JSON.
json_value read_json(std::string_view text) noexcept;

// What is wrong with a text that should be one JSON object, to be read behind it: "is no JSON object: it ends
// too early (at byte 1)". Empty: nothing. The service thread would refuse it as well, but could not say so to
// whoever wrote it.
std::string object_fault(std::string_view text);

// A string as it is spelt, without its quotes.
std::string_view spelling_of(json_value string) noexcept;

// A number, string, word, or empty object or array, and where it stands.
struct json_leaf {
  std::string path; // names as they are spelt
  json_value value;
};

// All of them in order; one without a path where the whole is a leaf itself.
std::vector<json_leaf> leaves_of(json_value json);

// `object`, a text, with the member `name` in front of the others. `value` must be JSON.
std::string with_member(std::string_view object, std::string_view name, std::string_view value);

// `object` without its members of that name, on the top level.
std::string without_member(json_value object, std::string_view name);

// Text as a JSON string, quotes and all.
std::string json_string_of(std::string_view utf8);

// A value as a person would write it: a string without its quotes and escapes, but for those of control
// characters, which might move a terminal's cursor; anything else as it is spelt.
std::string plain_text_of(json_value value);

} // namespace rowe::tools
