// SPDX-License-Identifier: Apache-2.0
// How rowe/schema.hpp turns structs into descriptions. Nothing here is for users. Every wrong schema ends in
// one of the static_asserts below, or in those of detail/schema_values.hpp.
#pragma once
#include <limits>
#include <memory>
#include <new>

#include <rowe/detail/schema_values.hpp>
#include <rowe/schema.hpp>

namespace rowe::detail {

// ---- members ----

constexpr bool is_integer(value_kind k) noexcept { return k >= value_kind::int8 && k <= value_kind::uint64; }
constexpr bool is_real(value_kind k) noexcept { return k == value_kind::float32 || k == value_kind::float64; }

// The value to which the member's form applies: the value itself, or the elements of arrays and optionals.
constexpr const value_description& innermost(const value_description& d) noexcept {
  return d.kind == value_kind::array || d.kind == value_kind::optional ? innermost(*d.element) : d;
}

// Whether the value is bytes, or consists of such.
constexpr bool holds_bytes(const value_description& d) noexcept {
  const bool has_element = d.kind == value_kind::array || d.kind == value_kind::optional;
  return d.is_bytes || (has_element && holds_bytes(*d.element));
}
// Whether JSON has this array, of a member or inside of one, as text in base64.
constexpr bool is_base64(const value_description& d, const member_description& owner) noexcept {
  return d.is_bytes && !owner.as_numbers && !owner.as_string && !owner.by_name;
}

// How many decimals a second has in this unit; -1 if it is no second divided by ten, a few times.
constexpr int decimals_of(const unit_description& unit) noexcept {
  constexpr int decimals_max = 9;
  int decimals = 0;
  std::int64_t denominator = unit.denominator;
  while (denominator > 1 && denominator % 10 == 0) {
    denominator /= 10;
    ++decimals;
  }
  return unit.numerator == 1 && denominator == 1 && decimals <= decimals_max ? decimals : -1;
}

template <class T, auto Member>
const void* address_of(const void* object) noexcept {
  return std::addressof(static_cast<const T*>(object)->*Member);
}

template <class T, auto Count>
std::size_t count_of(const void* object) noexcept {
  const auto count = static_cast<const T*>(object)->*Count;
  if constexpr (std::is_signed_v<decltype(count)>) {
    if (count < 0) return 0;
  }
  return static_cast<std::size_t>(count);
}

template <class T, auto Count>
void set_count_of(void* object, std::size_t count) noexcept {
  auto& member = static_cast<T*>(object)->*Count;
  member = static_cast<std::remove_reference_t<decltype(member)>>(count);
}

// Can such a value be written if its object exists? (This asks the type, because g++ cannot compare functions
// with null at compile time when it builds for sanitizers.)
template <class T>
consteval bool is_decodable() noexcept {
  if constexpr (std::is_array_v<T>) {
    return is_decodable<std::remove_cv_t<std::remove_extent_t<T>>>();
  } else if constexpr (is_std_array<T> || is_bounded_array<T>) {
    return is_decodable<typename T::value_type>();
  } else if constexpr (is_optional<T>) {
    return std::default_initializable<typename T::value_type> && is_decodable<typename T::value_type>();
  } else if constexpr (described<T>) {
    return describe<T>().decodable;
  } else {
    return true;
  }
}

template <class T, auto Member>
consteval member_description describe_member(std::string_view name) noexcept {
  using pointer = member_pointer<decltype(Member)>;
  static_assert(
      pointer::value,
      "rowe::fields: list pointers to data members (&odometry::x), rowe::field<...> or rowe::counted<...>");
  member_description m;
  if constexpr (pointer::value) {
    constexpr bool is_own = std::derived_from<T, typename pointer::class_type>;
    static_assert(is_own, "rowe::schema: a member listed in the schema belongs to another type");
    constexpr literal_piece spelled = spelled_name<Member>();
    m.name = name.empty() ? std::string_view{spelled.begin, spelled.end} : name;
    m.type = &value_description_of<typename pointer::value_type>;
    if constexpr (is_own) m.address = &address_of<T, Member>;
  }
  return m;
}

template <class T, class Pointer>
inline constexpr bool counts = false;
template <class T, class Pointer>
requires Pointer::value inline constexpr bool counts<T, Pointer> =
    std::integral<typename Pointer::value_type> && std::derived_from<T, typename Pointer::class_type>;

template <class T, auto Entry>
consteval member_description describe_entry() noexcept {
  return describe_member<T, Entry>({});
}

template <class T, auto Entry>
requires is_field_spec<std::remove_cv_t<decltype(Entry)>>
consteval member_description describe_entry() noexcept {
  return
      []<auto Member, auto Name, auto Other, auto Count>(field_spec<Member, Name, Other, Count>) consteval {
    constexpr field_spec<Member, Name, Other, Count> spec = Entry;
    if constexpr (member_pointer<decltype(Member)>::value) {
      member_description m = describe_member<T, Member>(Name.view());
      using member_type = typename member_pointer<decltype(Member)>::value_type;
      constexpr value_description type = value_description_of<member_type>;
      constexpr const value_description& value = innermost(value_description_of<member_type>);
      static_assert(!spec.quoted || is_integer(value.kind),
                    "rowe::field: as_string() is for integers and arrays of integers");
      static_assert(spec.digits == -1 || is_real(value.kind),
                    "rowe::field: decimals() is for float, double and arrays of these");
      static_assert(spec.digits >= -1 && spec.digits <= 9, "rowe::field: decimals() takes 0 to 9");
      static_assert(
          !spec.named || (is_integer(value.kind) && !value.enumerators.empty()),
          "rowe::field: by_name() is for enums whose names are listed beside them, at global scope: "
          "template <> inline constexpr auto rowe::names<E> = rowe::enumerators<E::value, ...>{};");
      static_assert(!spec.seconds || (is_integer(value.kind) && decimals_of(value.unit) >= 0),
                    "rowe::field: as_seconds() is for std::chrono durations and times that count seconds, or "
                    "decimal parts of a second down to 10^-9, as integers");
      static_assert(!spec.numbers || holds_bytes(type),
                    "rowe::field: as_numbers() is for arrays of std::uint8_t or std::byte");
      static_assert(spec.quoted + spec.named + spec.seconds + spec.numbers <= 1,
                    "rowe::field: give one form: as_string(), by_name(), as_seconds() or as_numbers()");
      m.as_string = spec.quoted;
      m.or_default = spec.may_miss;
      m.other_name = Other.view();
      m.decimals = spec.digits;
      m.by_name = spec.named;
      m.as_seconds = spec.seconds;
      m.as_numbers = spec.numbers;
      if constexpr (!std::same_as<std::remove_cv_t<decltype(Count)>, std::nullptr_t>) {
        using pointer = member_pointer<decltype(Count)>;
        static_assert(type.kind == value_kind::array && !is_bounded_array<member_type>,
                      "rowe::counted: the first argument must be a std::array or C array member");
        static_assert(counts<T, pointer>,
                      "rowe::counted: the second argument must be an integer member of the same type");
        if constexpr (counts<T, pointer>) {
          using count_type = typename pointer::value_type;
          constexpr auto count_limit = static_cast<std::size_t>((std::numeric_limits<count_type>::max)());
          m.count = &count_of<T, Count>;
          m.count_address = &address_of<T, Count>;
          m.count_limit = type.count_max < count_limit ? type.count_max : count_limit;
          if constexpr (!pointer::constant) m.set_count = &set_count_of<T, Count>;
        }
      }
      return m;
    } else {
      return member_description{}; // rowe::field has said what is wrong
    }
  }
  (Entry);
}

template <std::size_t N>
consteval bool names_differ(const std::array<member_description, N>& members) noexcept {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (members[i].name.empty() || members[j].name.empty()) continue; // no member: an error said so
      if (members[i].name == members[j].name || members[i].other_name == members[j].name) return false;
      if (members[i].name == members[j].other_name) return false;
      if (!members[i].other_name.empty() && members[i].other_name == members[j].other_name) return false;
    }
    if (members[i].other_name == members[i].name && !members[i].name.empty()) return false;
  }
  return true;
}

// For a member that a schema lists: neither it nor its counting member is const, and its value is decodable.
template <auto Member>
consteval bool is_decodable_member() noexcept {
  using pointer = member_pointer<decltype(Member)>;
  if constexpr (pointer::value) return !pointer::constant && is_decodable<typename pointer::value_type>();
  return false;
}
template <auto Entry>
consteval bool is_decodable_entry() noexcept {
  return is_decodable_member<Entry>();
}
template <auto Entry>
requires is_field_spec<std::remove_cv_t<decltype(Entry)>>
consteval bool is_decodable_entry() noexcept {
  return
      []<auto Member, auto Name, auto Other, auto Count>(field_spec<Member, Name, Other, Count>) consteval {
    return is_decodable_member<Member>() && !member_pointer<decltype(Count)>::constant;
  }
  (Entry);
}

// The members as a static array. It is a class template, because the list must be taken out of the schema's
// type.
template <class T, class Fields>
struct members_of {
  static_assert(unsupported<T>, "rowe::schema: a schema must read `= rowe::fields<&T::member, ...>{}`");
  static constexpr std::array<member_description, 0> list{};
  static constexpr std::array<bool, 0> decodable{};
};
template <class T, auto... Entries>
struct members_of<T, fields<Entries...>> {
  static constexpr std::array<member_description, sizeof...(Entries)> list{describe_entry<T, Entries>()...};
  static_assert(names_differ(list),
                "rowe::schema: two members have the same name; rename one with rowe::field");
  static constexpr std::array<bool, sizeof...(Entries)> decodable{is_decodable_entry<Entries>()...};
};

template <class T>
consteval schema_description describe_schema() noexcept {
  using fields_type = std::remove_cv_t<decltype(schema<T>)>;
  schema_description d;
  if constexpr (requires { schema<T>.type_name; }) d.type_name = schema<T>.type_name;
  d.bytes = sizeof(T);
  d.alignment = alignof(T);
  d.members = members_of<T, fields_type>::list;
  if constexpr (std::default_initializable<T>) {
    d.set_default = [](void* at) noexcept { ::new (at) T{}; }; // in place: T may be too large for a stack
    d.decodable = true;
    for (const bool one : members_of<T, fields_type>::decodable) d.decodable = d.decodable && one;
  }
  return d;
}

template <class T>
inline constexpr schema_description schema_description_of = describe_schema<T>();
// Used after a static_assert has said what is wrong, so there is no second error.
inline constexpr schema_description nothing_described{};

} // namespace rowe::detail

namespace rowe {

template <class T>
constexpr const schema_description& describe() noexcept {
  static_assert(described<T>,
                "rowe: this type has no schema. Write, at global scope and before the first use: "
                "template <> inline constexpr auto rowe::schema<T> = rowe::fields<&T::member, ...>{};");
  static_assert(
      std::is_trivially_copyable_v<T>,
      "rowe: a type with a schema must be trivially copyable, because real-time loops copy it bit by bit; "
      "use rowe::fixed_string and rowe::bounded_array instead of std::string and std::vector");
  if constexpr (described<T> && std::is_trivially_copyable_v<T>) {
    return detail::schema_description_of<T>;
  } else {
    return detail::nothing_described;
  }
}

} // namespace rowe
