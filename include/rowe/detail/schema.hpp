// SPDX-License-Identifier: Apache-2.0
// How rowe/schema.hpp turns types into descriptions. Nothing here is for users. Every wrong schema ends in
// one of the static_asserts below.
#pragma once
#include <limits>
#include <memory>
#include <new>

#include <rowe/schema.hpp>

namespace rowe::detail {

template <class T>
consteval value_description describe_value() noexcept;

// One object for each type, so that descriptions can point to each other.
template <class T>
inline constexpr value_description value_description_of = describe_value<T>();

template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;
template <class T>
inline constexpr bool is_std_array = false;
template <class T, std::size_t N>
inline constexpr bool is_std_array<std::array<T, N>> = true;
template <class T>
inline constexpr bool is_bounded_array = false;
template <class T, std::size_t N>
inline constexpr bool is_bounded_array<bounded_array<T, N>> = true;
template <class T>
inline constexpr bool is_fixed_string = false;
template <std::size_t N>
inline constexpr bool is_fixed_string<fixed_string<N>> = true;
template <class T>
inline constexpr bool is_character =
    std::same_as<T, char> || std::same_as<T, wchar_t> || std::same_as<T, char8_t> ||
    std::same_as<T, char16_t> || std::same_as<T, char32_t>;

template <class>
inline constexpr bool unsupported = false;

template <std::integral T>
consteval value_kind integer_kind() noexcept {
  static_assert(sizeof(T) <= 8, "rowe::schema: integers have at most 64 bits");
  constexpr bool is_signed = std::is_signed_v<T>;
  switch (sizeof(T)) {
  case 1: return is_signed ? value_kind::int8 : value_kind::uint8;
  case 2: return is_signed ? value_kind::int16 : value_kind::uint16;
  case 4: return is_signed ? value_kind::int32 : value_kind::uint32;
  default: return is_signed ? value_kind::int64 : value_kind::uint64;
  }
}

template <class Array>
const void* elements_of(const void* array) noexcept {
  const Array& a = *static_cast<const Array*>(array);
  if constexpr (std::is_array_v<Array>) {
    return &a[0];
  } else {
    return a.data();
  }
}

// Arrays of all kinds; `Array` is the type in memory.
template <class Array, class Element>
consteval value_description describe_array(std::size_t count_max) noexcept {
  static_assert(
      !is_character<Element>,
      "rowe::schema: an array of characters is neither text nor numbers; use rowe::fixed_string<N> for "
      "text, or an array of std::int8_t or std::uint8_t for numbers");
  value_description d;
  d.kind = value_kind::array;
  d.bytes = sizeof(Array);
  d.count_max = count_max;
  d.element = &value_description_of<Element>;
  d.elements = &elements_of<Array>;
  if constexpr (is_bounded_array<Array>) {
    d.count = [](const void* array) noexcept { return static_cast<const Array*>(array)->size(); };
    d.resize = [](void* array, std::size_t count) noexcept {
      return static_cast<Array*>(array)->resize(count);
    };
  }
  return d;
}

template <class T>
consteval value_description describe_value() noexcept {
  static_assert(std::same_as<T, std::remove_cv_t<T>>);
  if constexpr (std::is_array_v<T>) {
    return describe_array<T, std::remove_cv_t<std::remove_extent_t<T>>>(std::extent_v<T>);
  } else if constexpr (is_std_array<T>) {
    static_assert(std::tuple_size_v<T> > 0, "rowe::schema: a std::array of no elements has nothing to write");
    return describe_array<T, typename T::value_type>(std::tuple_size_v<T>);
  } else if constexpr (is_bounded_array<T>) {
    return describe_array<T, typename T::value_type>(T::capacity());
  } else {
    value_description d;
    d.bytes = sizeof(T);
    if constexpr (std::same_as<T, bool>) {
      d.kind = value_kind::boolean;
    } else if constexpr (is_character<T>) {
      static_assert(
          unsupported<T>,
          "rowe::schema: a character is neither text nor a number; use rowe::fixed_string<N> for text, "
          "std::int8_t or std::uint8_t for a number");
    } else if constexpr (std::integral<T>) {
      d.kind = integer_kind<T>();
    } else if constexpr (std::same_as<T, float>) {
      d.kind = value_kind::float32;
    } else if constexpr (std::same_as<T, double>) {
      d.kind = value_kind::float64;
    } else if constexpr (std::is_enum_v<T>) {
      d = describe_value<std::underlying_type_t<T>>();
    } else if constexpr (is_fixed_string<T>) {
      d.kind = value_kind::text;
      d.count_max = T::capacity();
      d.text = [](const void* string) noexcept { return static_cast<const T*>(string)->view(); };
      d.resize_text = [](void* string, std::size_t bytes) noexcept -> char* {
        T& s = *static_cast<T*>(string);
        return s.resize(bytes) ? s.data() : nullptr;
      };
    } else if constexpr (is_optional<T>) {
      d.kind = value_kind::optional;
      d.element = &value_description_of<typename T::value_type>;
      d.engaged = [](const void* optional) noexcept -> const void* {
        const T& o = *static_cast<const T*>(optional);
        return o ? std::addressof(*o) : nullptr;
      };
      if constexpr (std::default_initializable<typename T::value_type>) {
        d.emplace = [](void* optional) noexcept -> void* {
          return std::addressof(static_cast<T*>(optional)->emplace());
        };
      }
      d.reset = [](void* optional) noexcept { static_cast<T*>(optional)->reset(); };
    } else if constexpr (described<T>) {
      d.kind = value_kind::object;
      d.object = &describe<T>();
    } else {
      static_assert(
          unsupported<T>,
          "rowe::schema: this type cannot be written as JSON. Members may be bool, integers, float, "
          "double, enums, types with a schema of their own (template <> inline constexpr auto "
          "rowe::schema<T> = rowe::fields<...>{}; at global scope, before the first use), std::array or C "
          "arrays, rowe::bounded_array, rowe::fixed_string and std::optional of these");
    }
    return d;
  }
}

// ---- members ----

constexpr bool is_integer(value_kind k) noexcept { return k >= value_kind::int8 && k <= value_kind::uint64; }
constexpr bool is_real(value_kind k) noexcept { return k == value_kind::float32 || k == value_kind::float64; }

// The kind of value to which the member's form applies: the value itself, or the elements of arrays and
// optionals.
constexpr value_kind innermost_kind(const value_description& d) noexcept {
  return d.kind == value_kind::array || d.kind == value_kind::optional ? innermost_kind(*d.element) : d.kind;
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
  static_assert(std::derived_from<T, typename pointer::class_type>,
                "rowe::schema: a member listed in the schema belongs to another type");
  member_description m;
  constexpr literal_piece spelled = spelled_name<Member>();
  m.name = name.empty() ? std::string_view{spelled.begin, spelled.end} : name;
  m.type = &value_description_of<typename pointer::value_type>;
  m.address = &address_of<T, Member>;
  return m;
}

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
    member_description m = describe_member<T, Member>(Name.view());
    using member_type = typename member_pointer<decltype(Member)>::value_type;
    constexpr value_description type = value_description_of<member_type>;
    static_assert(!spec.quoted || is_integer(innermost_kind(type)),
                  "rowe::field: as_string() is for integers and arrays of integers");
    static_assert(spec.digits == -1 || is_real(innermost_kind(type)),
                  "rowe::field: decimals() is for float, double and arrays of these");
    static_assert(spec.digits >= -1 && spec.digits <= 9, "rowe::field: decimals() takes 0 to 9");
    m.as_string = spec.quoted;
    m.or_default = spec.may_miss;
    m.other_name = Other.view();
    m.decimals = spec.digits;
    if constexpr (!std::same_as<std::remove_cv_t<decltype(Count)>, std::nullptr_t>) {
      using pointer = member_pointer<decltype(Count)>;
      static_assert(type.kind == value_kind::array && !is_bounded_array<member_type>,
                    "rowe::counted: the first argument must be a std::array or C array member");
      static_assert(std::integral<typename pointer::value_type> &&
                        std::derived_from<T, typename pointer::class_type>,
                    "rowe::counted: the second argument must be an integer member of the same type");
      using count_type = typename pointer::value_type;
      constexpr auto count_limit = static_cast<std::size_t>(std::numeric_limits<count_type>::max());
      m.count = &count_of<T, Count>;
      m.count_address = &address_of<T, Count>;
      m.count_limit = type.count_max < count_limit ? type.count_max : count_limit;
      if constexpr (!pointer::constant) m.set_count = &set_count_of<T, Count>;
    }
    return m;
  }
  (Entry);
}

template <std::size_t N>
consteval bool names_differ(const std::array<member_description, N>& members) noexcept {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (members[i].name == members[j].name || members[i].other_name == members[j].name) return false;
      if (members[i].name == members[j].other_name) return false;
      if (!members[i].other_name.empty() && members[i].other_name == members[j].other_name) return false;
    }
    if (members[i].other_name == members[i].name) return false;
  }
  return true;
}

// For a member that a schema lists: neither it nor its counting member is const, and its value is decodable.
template <auto Member>
consteval bool is_decodable_member() noexcept {
  using pointer = member_pointer<decltype(Member)>;
  return !pointer::constant && is_decodable<typename pointer::value_type>();
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
  d.type_name = schema<T>.type_name;
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
