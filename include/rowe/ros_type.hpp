// SPDX-License-Identifier: Apache-2.0
// Types of ROS's messages that only a running program gets to know: from the definitions that recordings
// carry, or that ROS sends. They turn messages into JSON, as rosbridge and rowe write it, and back.
//
//   const rowe::recorded_topic& topic = file->topics()[message->topic];
//   std::string why, json;
//   const auto type = rowe::ros_type::parse(topic.type, topic.schema, rowe::ros_version::ros2, &why);
//   if (type && type->to_json(rowe::ros_encoding::cdr, message->data, json, 1 << 20, &why)) show(json);
//
// | in the definition             | in JSON                                                              |
// | bool                          | true, false                                                          |
// | int8 ... uint64, byte, char   | a number, with every digit (char and ROS 2's byte are uint8, ROS 1's |
// |                               | byte is int8)                                                        |
// | float32, float64              | a number, as few digits as it takes; NaN and infinities: null        |
// | string, wstring               | a string; what is no UTF-8, or no UTF-16, is U+FFFD                  |
// | time, duration                | {"secs":1,"nsecs":5}; in ROS 2, also of builtin_interfaces:          |
// |                               | {"sec":1,"nanosec":5}                                                |
// | arrays of uint8               | base64 (RFC 4648, part 4)                                            |
// | other arrays; other types     | arrays; objects, whose members have the order of the definition      |
//
// For ordinary threads. Nothing here waits. What allocates may throw std::bad_alloc, and nothing else.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <rowe/result.hpp>

namespace rowe {

class json_value;

// Whose words a definition is in. Recordings call the texts "ros1msg" and "ros2msg".
enum class ros_version : std::uint8_t { ros1, ros2 };

// How a message is written. Recordings call them "ros1" and "cdr".
enum class ros_encoding : std::uint8_t {
  ros1,           // of ROS 1: little-endian, without padding
  cdr,            // of ROS 2: plain CDR (XCDR1) behind its four bytes of head; either byte order is read,
                  // and little-endian is written. A wstring has 16 bits a unit; there were versions of ROS 2
                  // with 32, which the bytes do not say
  cdr_big_endian, // the same; big-endian is written
};

// Any number of threads may use one at the same time.
class ros_type {
 public:
  // Reads the definition of the type `name` ("nav_msgs/Odometry", or "nav_msgs/msg/Odometry"): its members
  // and, behind each line of =, a line `MSG: package/Type` and the members of that type. Types without a
  // package are of that of the type they are in. A type that is there twice counts once. `time` and
  // `duration` are built in, and so are builtin_interfaces/Time and Duration in ROS 2.
  //
  // Errors: bad_definition, and `why`, if given, is assigned what is wrong, with the line. So it is with a
  // type that has itself as a member, more than 32 types within types, 1024 types, 1024 members of one or
  // 16384 in all, a text of more than 1 MiB, and with arrays of fixed length by which a message would have
  // more than 2^28 bytes, or 2^20 objects, at least.
  static result<ros_type> parse(std::string_view name, std::string_view definition, ros_version version,
                                std::string* why = nullptr);
  ros_type(ros_type&&) noexcept;
  ros_type& operator=(ros_type&&) noexcept;
  ~ros_type();

  const std::string& name() const noexcept; // as it was given
  ros_version version() const noexcept;

  // Assigns the JSON of a message to `json`, in one line. Takes steps in proportion to the message and what
  // is written, whatever lengths the message claims. Allocates where `json` has not the capacity, 64 bytes
  // more than are written at most, and then in proportion to these. Errors leave `json` empty, and assign
  // `why`, if given, what is wrong, with the member: bad_message (value: the byte; the bytes end too early or
  // too late, an array or a string is longer than the definition allows, or they are neither plain CDR nor
  // ROS 1's), too_big (the JSON is longer than json_bytes_max).
  status to_json(ros_encoding encoding, std::string_view bytes, std::string& json, std::size_t json_bytes_max,
                 std::string* why = nullptr) const;

  // Assigns the message of a JSON object to `bytes`. Members that are left out have the definition's
  // default, or are zero, empty or false; those that the definition has not are passed over. Integers may be
  // written as 3, 3.0 or 3e0; null is a float that is NaN; an array of uint8 may also be an array of numbers;
  // times may have the names of either version. Allocates where `bytes` has not the capacity, likewise.
  // Errors leave `bytes` empty, and assign `why`, if given, what is wrong, with the member: malformed,
  // too_deep (64 levels), not_an_object, wrong_type, out_of_range, duplicate_member; too_long (value: the
  // bytes of a string or the elements of an array, limit: those that it may have, or must); too_big (the
  // message is longer than bytes_max).
  status from_json(ros_encoding encoding, std::string_view json, std::string& bytes, std::size_t bytes_max,
                   std::string* why = nullptr) const;
  // The same of JSON that was checked already, as received messages are (rowe/json_value.hpp): the check
  // takes some 40 % of the time. Errors: the same but for malformed and too_deep.
  status from_json(ros_encoding encoding, const json_value& json, std::string& bytes, std::size_t bytes_max,
                   std::string* why = nullptr) const;

 private:
  struct parts;
  explicit ros_type(std::unique_ptr<const parts> made) noexcept;
  std::unique_ptr<const parts> parts_;
};

} // namespace rowe
