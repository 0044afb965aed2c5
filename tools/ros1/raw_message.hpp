// SPDX-License-Identifier: Apache-2.0
// A ROS message of whatever type, as its bytes. roscpp takes it wherever it takes a message: its type and
// md5sum are `*`, which means any.
#pragma once
#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstring>
#include <string>

namespace rowe::ros1 {
struct raw_message {
  std::string bytes;
};
} // namespace rowe::ros1

namespace ros::message_traits {
template <>
struct IsMessage<rowe::ros1::raw_message> : TrueType {};
template <>
struct MD5Sum<rowe::ros1::raw_message> {
  static const char* value() { return "*"; }
  static const char* value(const rowe::ros1::raw_message&) { return "*"; }
};
template <>
struct DataType<rowe::ros1::raw_message> : MD5Sum<rowe::ros1::raw_message> {};
template <>
struct Definition<rowe::ros1::raw_message> {
  static const char* value() { return ""; }
  static const char* value(const rowe::ros1::raw_message&) { return ""; }
};
} // namespace ros::message_traits

namespace ros::serialization {
template <>
struct Serializer<rowe::ros1::raw_message> {
  template <class Stream>
  static void write(Stream& to, const rowe::ros1::raw_message& message) {
    if (!message.bytes.empty())
      std::memcpy(to.advance(serializedLength(message)), message.bytes.data(), message.bytes.size());
  }
  template <class Stream>
  static void read(Stream& from, rowe::ros1::raw_message& message) {
    const uint32_t length = from.getLength();
    message.bytes.assign(reinterpret_cast<const char*>(from.advance(length)), length);
  }
  static uint32_t serializedLength(const rowe::ros1::raw_message& message) {
    return static_cast<uint32_t>(message.bytes.size());
  }
};
} // namespace ros::serialization
