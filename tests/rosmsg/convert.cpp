// SPDX-License-Identifier: Apache-2.0
// Converts messages for tests against other makers (tests/web/clients). Each line of the input is six words:
//
//   to_json|from_json  ros1|ros2  ros1|cdr|cdr_big_endian  NAME  DEFINITION  MESSAGE or JSON
//
// The last two are in hexadecimal digits behind an x. For each there is a line: the JSON, the message in such
// digits, or `wrong` and the reason.
#include <iostream>
#include <sstream>
#include <string>

#include <rowe/ros_type.hpp>

namespace {

std::string bytes_of(const std::string& digits) {
  std::string bytes;
  for (std::size_t i = 1; i + 1 < digits.size(); i += 2)
    bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
  return bytes;
}
std::string digits_of(const std::string& bytes) {
  std::string digits;
  for (const char c : bytes) {
    digits += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
    digits += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
  }
  return digits;
}

std::string converted(const std::string& line) {
  std::istringstream words{line};
  std::string verb, version, encoding, name, definition, from, into, why;
  words >> verb >> version >> encoding >> name >> definition >> from;
  const auto type =
      rowe::ros_type::parse(name, bytes_of(definition),
                            version == "ros1" ? rowe::ros_version::ros1 : rowe::ros_version::ros2, &why);
  if (!type) return "wrong " + why;
  const auto how = encoding == "ros1"  ? rowe::ros_encoding::ros1
                   : encoding == "cdr" ? rowe::ros_encoding::cdr
                                       : rowe::ros_encoding::cdr_big_endian;
  constexpr std::size_t bytes_max = 1 << 24;
  const bool reads = verb == "to_json";
  const auto done = reads ? type->to_json(how, bytes_of(from), into, bytes_max, &why)
                          : type->from_json(how, bytes_of(from), into, bytes_max, &why);
  if (!done) return "wrong " + why;
  return reads ? into : digits_of(into);
}

} // namespace

int main() {
  std::ios::sync_with_stdio(false);
  for (std::string line; std::getline(std::cin, line);) std::cout << converted(line) << '\n';
  return 0;
}
