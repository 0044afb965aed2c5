// SPDX-License-Identifier: Apache-2.0
// ROS 1's message definitions: what is in a .msg or .srv file, or comes in the header of a connection. From
// the text we know how to read and write the bytes; from the md5sum ROS knows that both sides mean the same.
// Nothing here needs ROS. Definitions come from other nodes as well, so all that they can make grow has a
// bound.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rowe::ros1 {

enum class field_kind : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  text,
  time,     // two uint32: seconds, nanoseconds
  duration, // two int32
  message,
};

struct message_type;

struct field {
  enum class how_many : std::uint8_t { one, fixed, variable };

  std::string name;
  field_kind kind = field_kind::boolean;
  how_many many = how_many::one;
  std::uint32_t count = 0;                       // of how_many::fixed
  bool base64 = false;                           // uint8[] and char[], which rosbridge writes as base64
  std::shared_ptr<const message_type> type = {}; // of field_kind::message
};

struct message_type {
  std::string name; // "nav_msgs/Odometry"
  std::vector<field> fields;
  std::string text;      // as it was read, without the types inside
  std::string md5_text;  // what the md5sum is of
  std::string md5;       // 32 hexadecimal digits
  std::size_t depth = 1; // messages within messages
};
using message_type_ptr = std::shared_ptr<const message_type>;

struct service_type {
  std::string name; // "std_srvs/SetBool"
  message_type_ptr request;
  message_type_ptr response;
  std::string md5;
};

inline constexpr std::size_t depth_max = 32;            // messages within messages
inline constexpr std::size_t types_max = 512;           // that one message needs
inline constexpr std::size_t fields_max = 1024;         // of one message
inline constexpr std::uint32_t elements_max = 1U << 24; // of an array whose length is fixed

// The text of a type by its name, "geometry_msgs/Twist"; nothing: there is none.
using definition_source = std::function<std::optional<std::string>(const std::string&)>;

// Reads the type `name` and all types that it needs. Nothing: `why` says what is wrong, and where.
message_type_ptr read_message(const std::string& name, const definition_source& from, std::string& why);
// The same of a service; its text has a line `---` between request and response.
std::optional<service_type> read_service(const std::string& name, std::string_view text,
                                         const definition_source& from, std::string& why);

// The types of a definition as publishers send it: the message's own text, and behind each line of `=` that
// of another type, after `MSG: package/Name`.
definition_source sections_of(const std::string& name, std::string_view whole);
// Such a definition of `type`.
std::string whole_text(const message_type& type);

// "geometry_msgs/Twist" of "geometry_msgs/msg/Twist", as ROS 2 writes it; empty: it is no name of ROS.
std::string plain_type_name(std::string_view type);

} // namespace rowe::ros1
