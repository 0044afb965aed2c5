// SPDX-License-Identifier: Apache-2.0
// Definitions, messages and JSON that anybody may have written. The input is a byte that chooses the version
// and the encoding, a definition, a zero, and a message or JSON. What is required: JSON that is written is
// valid, no longer than asked for, and stays the same once it was written and read again; and what was made
// of JSON can be read.
#include <cstdint>
#include <string>
#include <string_view>

#include <rowe/json_value.hpp>
#include <rowe/ros_type.hpp>

#include "fuzz/require.hpp"

namespace {

using rowe::fuzz::require;

constexpr std::size_t bytes_max = 64 << 10;

// Strings may be longer than their type allows once pieces of them are replaced.
bool has_replacements(std::string_view json) { return json.find("\xef\xbf\xbd") != json.npos; }

void read(const rowe::ros_type& type, rowe::ros_encoding encoding, std::string_view message) {
  std::string json, again, bytes, why;
  if (!type.to_json(encoding, message, json, bytes_max, &why)) {
    require(json.empty() && !why.empty(), "there is a reason");
    return;
  }
  require(json.size() <= bytes_max, "the JSON is no longer than asked for");
  require(rowe::json_value::parse(json).has_value(), "the JSON is valid");
  if (!type.from_json(encoding, json, bytes, 16 * bytes_max, &why)) {
    require(has_replacements(json), "what was read can be written");
    return;
  }
  require(bytes.size() <= 2 * message.size() + 3 * json.size(), "not much longer than it was");
  require(type.to_json(encoding, bytes, again, bytes_max, &why).has_value(), "and is read again");
  require(json == again, "as the same");
}

void write(const rowe::ros_type& type, rowe::ros_encoding encoding, std::string_view json) {
  std::string bytes, again, why;
  if (!type.from_json(encoding, json, bytes, bytes_max, &why)) {
    require(bytes.empty() && !why.empty(), "there is a reason");
    return;
  }
  require(bytes.size() <= bytes_max, "the message is no longer than asked for");
  const auto read = type.to_json(encoding, bytes, again, bytes_max, &why);
  require(read || read.code() == rowe::errc::too_big || why.find("empty messages") != why.npos,
          "what was written can be read");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view input{reinterpret_cast<const char*>(data) + 1, size - 1};
  const auto version = static_cast<rowe::ros_version>(data[0] & 1U);
  const auto encoding = static_cast<rowe::ros_encoding>((data[0] >> 1U) % 3);
  const std::size_t zero = input.find('\0');
  std::string why;
  const auto type = rowe::ros_type::parse("test/Root", input.substr(0, zero), version, &why);
  require(type.has_value() != !why.empty(), "a definition is read, or there is a reason");
  if (!type || zero == input.npos) return 0;
  const std::string_view rest = input.substr(zero + 1);
  read(*type, encoding, rest);
  write(*type, encoding, rest);
  return 0;
}
