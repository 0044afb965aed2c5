// SPDX-License-Identifier: Apache-2.0
// How a struct is written as JSON. A schema lists the members, in the order in which they are written. Their
// names are those of the members:
//
//   struct odometry { double stamp, x, y, heading; };
//   template <> inline constexpr auto rowe::schema<odometry> =                    // at global scope
//       rowe::fields<&odometry::stamp, &odometry::x, &odometry::y, &odometry::heading>{};
//
// If the name or the form of a member should differ:
//
//   rowe::fields<&scan::stamp,
//                rowe::field<&scan::frame, "frame_id">,              // renamed
//                rowe::field<&scan::nsecs, "nsecs", "nanosec">,      // written by the first, read by either
//                rowe::field<&scan::seq>.or_default(),               // a text may leave it out
//                rowe::field<&scan::serial>.as_string(),             // "9007199254740993": beyond 2^53
//                rowe::field<&scan::angle>.decimals(4),              // fixed precision: shorter, faster
//                rowe::field<&scan::mode>.by_name(),                 // "mapping", see below
//                rowe::field<&scan::age>.as_seconds(),               // 0.0125, of std::chrono::nanoseconds
//                rowe::field<&scan::bits>.as_numbers(),              // [1,255]: bytes, else in base64
//                rowe::counted<&scan::ranges, &scan::range_count>    // the first `range_count` elements
//               >{}.type("sensor_msgs/LaserScan")                    // the type's name for ROS and others
//
// A member may be a bool, an integer, a float or a double, an enum (written as its number), a
// std::chrono::duration or time_point (written as its count(): the number of its own units), a type with a
// schema of its own, a std::array or C array of these, a rowe::bounded_array, a rowe::fixed_string, or a
// std::optional (left out of the text while empty; null inside an array). Arrays of std::uint8_t or std::byte
// are bytes: they are written as text, in base64 with padding, and read from that or from an array of
// numbers. Anything else does not compile, and the message says why.
//
// The names of an enum's values are listed once, beside the enum. Members that are by_name() are written with
// them, and all descriptions of the type (rowe/types.hpp) have them:
//
//   enum class scan_mode : std::uint8_t { off, mapping, locating };
//   template <> inline constexpr auto rowe::names<scan_mode> =                   // at global scope
//       rowe::enumerators<scan_mode::off, scan_mode::mapping,
//                         rowe::enumerator<scan_mode::locating, "localizing">>{}; // renamed
//
// A member that is by_name() is read from a name, or from the number of one: nothing else gets into it from
// outside, so a loop that handles all names handles all messages. A value without a name is written as its
// number, so it is seen; whoever reads by name refuses it.
//
// Everything here is evaluated at compile time. At run time there is describe<T>(), a constant table, of the
// same type for all T. The library works with that.
#pragma once
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include <rowe/bounded_array.hpp>
#include <rowe/fixed_string.hpp>

namespace rowe {

// ---- the description, without types ----

// clang-format off
enum class value_kind : std::uint8_t {
  boolean, int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64,
  text,      // fixed_string
  object,    // a type with a schema
  array,     // `count_max` elements, of which count() are in use where there is such a function
  optional,  // one element, or none
};
// clang-format on

struct schema_description;

// A value of an enum, with its name.
struct enumerator_description {
  std::string_view name;
  std::int64_t value = 0; // of an unsigned one of 64 bits: its bits
};

// What 1 stands for in a duration or a time: numerator / denominator seconds. 0 / 0: it is no time.
struct unit_description {
  std::int64_t numerator = 0;
  std::int64_t denominator = 0;
  bool since_1970 = false; // a time of std::chrono::system_clock
};

// A type of value: its kind, and how to reach what is inside. Functions take the address of such a value;
// they touch only the value, and never allocate or wait. Those that change the value always exist, whatever
// schema_description::decodable says, except emplace.
struct value_description {
  value_kind kind{};
  std::size_t bytes = 0;                                         // its size in memory
  std::size_t count_max = 0;                                     // array: elements; text: bytes
  bool is_bytes = false;                                         // array: of std::uint8_t or std::byte
  const value_description* element = nullptr;                    // array, optional
  const schema_description* object = nullptr;                    // object
  const void* (*elements)(const void* array) noexcept = nullptr; // array: the first element; the rest follow
  std::size_t (*count)(const void* array) noexcept = nullptr;    // array: elements in use; null: all
  const void* (*engaged)(const void* optional) noexcept = nullptr; // optional: the element, or null
  // text; null, and resize_text as well: chars that end in '\0', count_max + 1 of them
  std::string_view (*text)(const void* string) noexcept = nullptr;

  // array with count(): sets the number of elements in use, without changing their values. False, and nothing
  // changed, beyond count_max.
  bool (*resize)(void* array, std::size_t count) noexcept = nullptr;
  // text: sets its length, and returns the address of its first byte, to be written. Null, and nothing
  // changed, beyond count_max.
  char* (*resize_text)(void* string, std::size_t bytes) noexcept = nullptr;
  // optional: makes an element of default value and returns its address. Null if there is no such value.
  void* (*emplace)(void* optional) noexcept = nullptr;
  void (*reset)(void* optional) noexcept = nullptr; // optional: to nothing

  std::span<const enumerator_description> enumerators{}; // integers: of an enum, if its names are listed
  unit_description unit{};                               // numbers: of a duration or a time
};

// A member of a struct.
struct member_description {
  std::string_view name;
  const value_description* type = nullptr;
  const void* (*address)(const void* object) noexcept = nullptr; // of the member; reads nothing
  std::size_t (*count)(const void* object) noexcept =
      nullptr;                   // counted: elements in use, may exceed the array
  bool as_string = false;        // integers are written in quotes
  bool or_default = false;       // a text that is read may leave it out; then it is what T{} has
  std::string_view other_name{}; // that it is read by as well; empty: none
  int decimals = -1; // digits behind the point; -1: as many as are needed to read back the same value

  // counted: the counting member; reads nothing.
  const void* (*count_address)(const void* object) noexcept = nullptr;
  // counted: sets the counting member, to at most count_limit; null where it is constant.
  void (*set_count)(void* object, std::size_t count) noexcept = nullptr;
  std::size_t count_limit = 0; // counted: what the array holds and the counting member can say

  bool by_name = false;    // an enum's names are written instead of its numbers
  bool as_seconds = false; // integers of a unit of 10^-n seconds are written in seconds, with a point
  bool as_numbers = false; // bytes are written as an array of numbers, not in base64

  // Added to the object's address before it is given to address(), and to count(), count_address() and
  // set_count(). 0 where these know the member; else, of a type that only run time knows, they are the same
  // for all members.
  std::size_t offset = 0;
  std::size_t count_offset = 0;
};

// A struct.
struct schema_description {
  std::string_view type_name; // "nav_msgs/Odometry"; empty where none was given
  std::size_t bytes = 0;
  std::size_t alignment = 0;
  std::span<const member_description> members;

  // Constructs an object of default value, T{}, in memory for one. Null if there is no such value, or if it
  // is all zeroes and the type is decodable all the same.
  void (*set_default)(void* storage) noexcept = nullptr;
  // Can objects be read from text? Not if a member is const, or if the type, or that of an optional's
  // element, has no default value.
  bool decodable = false;
};

// ---- writing a schema ----

namespace detail {

struct no_schema {};
struct no_names {};

// A string literal as a template argument.
template <std::size_t N>
struct name_literal {
  char text[N] = {};
  consteval name_literal(const char (&literal)[N]) noexcept { // NOLINT(google-explicit-constructor)
    for (std::size_t i = 0; i < N; ++i) text[i] = literal[i];
  }
  constexpr std::string_view view() const noexcept { return {text, N - 1}; }
};

// A piece of a string literal. It is no std::string_view, because g++ writes out the full type of such an
// alias.
struct literal_piece {
  const char* begin;
  const char* end;
};

// The member's own name, cut from the compiler's spelling of this function: g++ writes
// `... [with auto Member = &robot::x]`, clang `... [Member = &robot::x]`, and both end in the name.
template <auto Member>
consteval literal_piece spelled_name() noexcept {
  const char* const begin = __PRETTY_FUNCTION__;
  const char* last = begin + sizeof __PRETTY_FUNCTION__ - 1;
  while (last > begin && (last[-1] == ']' || last[-1] == ')')) --last;
  const char* first = last;
  while (first > begin && first[-1] != ':' && first[-1] != '&' && first[-1] != ' ') --first;
  return {first, last};
}

template <class T>
struct member_pointer : std::false_type {
  static constexpr bool constant = false;
};
template <class Value, class Class>
struct member_pointer<Value Class::*> : std::bool_constant<!std::is_function_v<Value>> {
  using value_type = std::remove_cv_t<Value>;
  using class_type = Class;
  static constexpr bool constant = std::is_const_v<Value>;
};

// A member with its form, as rowe::field and rowe::counted make it. Its data members are public because those
// of a template argument must be.
template <auto Member, auto Name, auto Other, auto Count>
struct field_spec {
  static_assert(member_pointer<decltype(Member)>::value,
                "rowe::field: the first argument must be a pointer to a data member, such as &odometry::x");
  bool quoted = false;
  int digits = -1;
  bool may_miss = false;
  bool named = false;
  bool seconds = false;
  bool numbers = false;

  // An integer is written in quotes, because a browser rounds numbers beyond 2^53.
  consteval field_spec as_string() const noexcept { return with(&field_spec::quoted, true); }
  // Numbers are rounded to `count` digits (0 to 9) behind the point; trailing zeros are not written. Numbers
  // too large for that (|x| x 10^count >= 2^53) keep the digits they need.
  consteval field_spec decimals(int count) const noexcept { return with(&field_spec::digits, count); }
  // A text that is read may leave the member out; then it is as in T{}.
  consteval field_spec or_default() const noexcept { return with(&field_spec::may_miss, true); }
  // An enum is written by its names, which rowe::names lists.
  consteval field_spec by_name() const noexcept { return with(&field_spec::named, true); }
  // A duration or a time is written in seconds, exactly: 1.5 for 1500 ms. Its unit is 1, 10^-1 ... 10^-9
  // seconds, and its count an integer. What is read is rounded to that unit; beyond its range it is refused.
  consteval field_spec as_seconds() const noexcept { return with(&field_spec::seconds, true); }
  // An array of std::uint8_t or std::byte is written as an array of numbers.
  consteval field_spec as_numbers() const noexcept { return with(&field_spec::numbers, true); }

 private:
  template <class Value>
  consteval field_spec with(Value field_spec::*which, Value value) const noexcept {
    field_spec changed = *this;
    changed.*which = value;
    return changed;
  }
};

template <class T>
inline constexpr bool is_field_spec = false;
template <auto Member, auto Name, auto Other, auto Count>
inline constexpr bool is_field_spec<field_spec<Member, Name, Other, Count>> = true;

// A value of an enum with its name, as rowe::enumerator makes it.
template <auto Value, auto Name>
struct enumerator_spec {};

} // namespace detail

// A member with another name or in another form. It is written as `Name` and read as `Name` or `Other`. A
// text that has both is refused, as if it had a member twice.
template <auto Member, detail::name_literal Name = "", detail::name_literal Other = "">
inline constexpr detail::field_spec<Member, Name, Other, nullptr> field{};

// An array of which only the first `Count` elements are in use. Count is an integer member of the same
// struct; it is written only if it is listed, too. A negative count means none; one that is too large means
// all.
template <auto Array, auto Count, detail::name_literal Name = "">
inline constexpr detail::field_spec<Array, Name, detail::name_literal<1>{""}, Count> counted{};

// The members of a struct, in the order in which they are written.
template <auto... Members>
struct fields {
  std::string_view type_name{};

  // Names the type as others know it: "nav_msgs/Odometry". `name` must outlive the program (a literal).
  consteval fields type(std::string_view name) const noexcept { return {name}; }
};

// A value of an enum with another name.
template <auto Value, detail::name_literal Name>
inline constexpr detail::enumerator_spec<Value, Name> enumerator{};

// The values of an enum that have names, in the order in which descriptions list them: enumerators, or what
// rowe::enumerator makes of them.
template <auto... Values>
struct enumerators {};

// The names of an enum: specialise it, at global scope, beside the enum.
template <class Enum>
inline constexpr detail::no_names names{};

// A type's schema: specialise it, at global scope, for each type that is published, subscribed or served.
template <class T>
inline constexpr detail::no_schema schema{};

template <class T>
concept described = !std::same_as<std::remove_cv_t<decltype(schema<T>)>, detail::no_schema>;

// The description of T; static, the same object each time. T must have a schema and be trivially copyable.
template <class T>
constexpr const schema_description& describe() noexcept;

} // namespace rowe

#include <rowe/detail/schema.hpp> // how a description is made
