// SPDX-License-Identifier: Apache-2.0
// Rows of the table of keys, made from members: what kind of value one has, and how it is got and set.
#pragma once
#include <concepts>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "config/keys.hpp"

namespace rowe::config {

// ---- where in a configuration the structs are

template <class Type, class As>
concept is_a = std::same_as<std::remove_const_t<Type>, As>;

auto& part(is_a<endpoint_options> auto& all, endpoint_options*) noexcept { return all; }
auto& part(is_a<endpoint_options> auto& all, stop_options*) noexcept { return all.stop; }
auto& part(is_a<endpoint_options> auto& all, access_options*) noexcept { return all.access; }
auto& part(is_a<endpoint_options> auto& all, tls_options*) noexcept { return all.tls; }
auto& part(is_a<role> auto& all, role*) noexcept { return all; }
auto& part(is_a<identity> auto& all, identity*) noexcept { return all; }
auto& part(is_a<configuration> auto& all, serve_options*) noexcept { return all.serve; }
auto& part(is_a<configuration> auto& all, record_settings*) noexcept { return all.record; }
auto& part(is_a<configuration> auto& all, black_box_settings*) noexcept { return all.black_box; }
template <class Struct>
auto& part(is_a<configuration> auto& all, Struct* which) noexcept {
  return part(all.endpoint, which);
}

template <class Member>
struct member;
template <class Class, class Type>
struct member<Type Class::*> {
  using owner = Class;
  using type = Type;
};

template <auto Member>
auto& place(auto& all) noexcept {
  return part(all, static_cast<typename member<decltype(Member)>::owner*>(nullptr)).*Member;
}

// ---- members as values

template <class Type>
inline constexpr bool is_number = std::same_as<Type, duration> || std::is_enum_v<Type> ||
                                  (std::integral<Type> && !std::same_as<Type, bool>);

template <class Type>
consteval kind kind_of() noexcept {
  if (std::same_as<Type, bool>) return kind::boolean;
  if (std::same_as<Type, duration>) return kind::time;
  if (std::is_enum_v<Type>) return kind::word;
  if (std::integral<Type>) return kind::integer;
  return std::same_as<Type, std::string> ? kind::text : kind::texts;
}

template <class Owner, auto Member>
value get(const Owner& of) {
  using type = typename member<decltype(Member)>::type;
  const type& found = place<Member>(of);
  if constexpr (std::same_as<type, duration>) {
    return std::int64_t{found.count()};
  } else if constexpr (is_number<type>) {
    return static_cast<std::int64_t>(found);
  } else {
    return found;
  }
}

template <class Owner, auto Member>
void set(Owner& of, value&& to) {
  using type = typename member<decltype(Member)>::type;
  type& found = place<Member>(of);
  if constexpr (std::same_as<type, duration>) {
    found = duration{std::get<std::int64_t>(to)};
  } else if constexpr (is_number<type>) {
    found = static_cast<type>(std::get<std::int64_t>(to));
  } else {
    found = std::get<type>(std::move(to));
  }
}

// Of members of endpoint_options that are integers, times or words.
template <auto Member>
std::int64_t number(const endpoint_options& of) noexcept {
  const auto& found = place<Member>(of);
  if constexpr (std::same_as<std::remove_cvref_t<decltype(found)>, duration>)
    return found.count();
  else
    return static_cast<std::int64_t>(found);
}

template <class Struct>
concept of_endpoint = requires(endpoint_options& all, Struct* which) {
  part(all, which);
};

// What a row says besides the member itself.
struct facts {
  std::string_view name;
  std::string_view option;
  std::string_view meaning;
  std::int64_t least = 0;
  std::int64_t most = 0;
  std::span<const std::string_view> words{};
  argument which = argument::unnamed;
  std::string_view bound{};
  bool is_path = false;
  bool is_size = false;

  consteval facts within(std::int64_t from, std::int64_t to, argument called) const noexcept {
    facts all = *this;
    all.least = from;
    all.most = to;
    all.which = called;
    return all;
  }
  consteval facts one_of(std::span<const std::string_view> choices,
                         argument called = argument::unnamed) const noexcept {
    facts all = *this;
    all.words = choices;
    all.which = called;
    return all;
  }
  // What else its range depends on.
  consteval facts bounded_by(std::string_view what) const noexcept {
    facts all = *this;
    all.bound = what;
    return all;
  }
  // Of an integer that counts bytes.
  consteval facts bytes(std::int64_t from, std::int64_t to) const noexcept {
    facts all = within(from, to, argument::unnamed);
    all.is_size = true;
    return all;
  }
  // Of a text.
  consteval facts path() const noexcept {
    facts all = *this;
    all.is_path = true;
    return all;
  }
};
consteval facts named(std::string_view name, std::string_view option = {},
                      std::string_view meaning = {}) noexcept {
  return {.name = name, .option = option, .meaning = meaning};
}

template <class Owner, auto Member>
consteval key<Owner> row(std::string_view section, const facts& of) noexcept {
  using type = typename member<decltype(Member)>::type;
  const std::int64_t most = of.words.empty() ? of.most : static_cast<std::int64_t>(of.words.size()) - 1;
  key<Owner> made{.section = section,
                  .name = of.name,
                  .what = {of.is_path   ? kind::path
                           : of.is_size ? kind::size
                                        : kind_of<type>(),
                           of.least, most, of.words},
                  .get = get<Owner, Member>,
                  .set = set<Owner, Member>,
                  .option = of.option,
                  .meaning = of.meaning,
                  .which = of.which,
                  .bounded_by = of.bound};
  if constexpr (std::same_as<Owner, configuration> && is_number<type> &&
                of_endpoint<typename member<decltype(Member)>::owner>)
    made.number = number<Member>;
  return made;
}

consteval std::int64_t ns(duration time) noexcept { return time.count(); }

} // namespace rowe::config
