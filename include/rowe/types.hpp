// SPDX-License-Identifier: Apache-2.0
// What others need to know of a type with a schema, made of the schema: a JSON Schema for validators and
// Foxglove, declarations for TypeScript, the text of a message for ROS. For set-up, or for a step of the
// build that writes the files of a page (docs/examples/types.cpp):
//
//   std::puts(rowe::typescript<odometry, command>().c_str());
//
// They say what is written: a member by another name, as_string(), by_name() or as_seconds() is as it is in
// the text, and a member that is optional may be missing. Reading is more lenient (rowe/schema.hpp). Two
// values are not described, because JSON has none for them, and nobody should have to expect them: a float
// that is not finite is written as null and counted (`nonfinite`), and a value of an enum by_name() that has
// no name, as its number.
//
// All of these are for ordinary threads: they allocate, and throw std::bad_alloc only. They never wait. A
// schema may not nest deeper than a publisher takes it (32 levels).
#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>

#include <rowe/schema.hpp>

namespace rowe {

// JSON Schema, draft 2020-12, in one line. Every type is written out where it is used, and has one `type`,
// because some readers know no more. Lengths of strings are bytes in the schema and characters in JSON
// Schema: a string that fits is no longer in characters.
std::string json_schema(const schema_description& type);

// Text of a message, or the sentence that says why the type has none.
struct ros_text {
  std::string text;
  std::string reason;

  explicit operator bool() const noexcept { return reason.empty(); }
};

// The definition of the message, and of all types inside of it, as `rosmsg` and gendeps print them: its
// md5sum is that of a ROS package with the same members. A type for it is called "package/Name", or
// "package/msg/Name" as in ROS 2, and so are all types inside. There is no text for what ROS does not have:
// optional members, arrays of arrays, names of members that are no identifiers. "std_msgs/Time" and
// "std_msgs/Duration", if they are two integers of 32 bits, are ROS 1's built-in `time` and `duration`.
ros_text ros_message(const schema_description& type);

// A type, and what it is called where its schema says nothing (rowe::my_robot::odometry).
struct named_type {
  const schema_description* type = nullptr;
  std::string_view name;
};

// Declarations for TypeScript, to be written into a file of their own: an interface for each type, and for
// each type with a name inside of it. "nav_msgs/Odometry" is nav_msgs.Odometry there. Types without a name
// are written out where they are used, and so is a type whose name another one has already.
std::string typescript(std::span<const named_type> types);

// The names by which programs ask a robot, and their types; null where one is not known.
struct typed_topic {
  std::string_view name; // "/odom"
  const schema_description* type = nullptr;
};
struct typed_service {
  std::string_view name;
  const schema_description* request = nullptr;
  const schema_description* response = nullptr;
};

// The same, and two interfaces that map names to types, so that `topics["/odom"]` is nav_msgs.Odometry, and
// `services["/add"]["request"]` what the service is asked. Types that are not known are `unknown`. Types that
// are called `topics` or `services` themselves are written out where they are used.
std::string typescript(std::span<const named_type> types, std::span<const typed_topic> topics,
                       std::span<const typed_service> services);

// ---- by type ----

template <class T>
std::string json_schema() {
  return json_schema(describe<T>());
}

template <class T>
ros_text ros_message() {
  return ros_message(describe<T>());
}

namespace detail {

// The type's own name, cut from the compiler's spelling of this function: g++ writes
// `... [with T = robot::odometry]`, clang `... [T = robot::odometry]`.
template <class T>
constexpr std::string_view spelled_type() noexcept {
  const std::string_view all = __PRETTY_FUNCTION__;
  const std::size_t begin = all.find("T = ") + 4;
  return all.substr(begin, all.find_first_of(";]", begin) - begin);
}

} // namespace detail

template <class... Types>
std::string typescript() {
  static_assert(sizeof...(Types) > 0,
                "rowe::typescript: name at least one type: rowe::typescript<odometry>()");
  return typescript(std::array<named_type, sizeof...(Types)>{
      named_type{&describe<Types>(), detail::spelled_type<Types>()}...});
}

} // namespace rowe
