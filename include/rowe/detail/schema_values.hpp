// SPDX-License-Identifier: Apache-2.0
// How rowe/schema.hpp describes types of values. Nothing here is for users. A type that cannot be described
// ends in one of the static_asserts below, and in no other error: what follows one is left out.
#pragma once
#include <memory>

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

// Durations and times of std::chrono, by what they have: <chrono> is a large header, and whoever has such a
// member has included it.
template <class T>
concept is_duration = requires(const T& t) {
  typename T::rep;
  T::period::num;
  T::period::den;
  { t.count() } -> std::same_as<typename T::rep>;
};
template <class T>
concept is_time_point = requires(const T& t) {
  T::clock::is_steady;
  { t.time_since_epoch() } -> std::same_as<typename T::duration>;
  requires is_duration<typename T::duration>;
};

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

// ---- the names of enums ----

constexpr bool is_identifier(std::string_view text) noexcept {
  const auto is_part = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           static_cast<unsigned char>(c) > 0x7f;
  };
  for (const char c : text) {
    if (!is_part(c)) return false;
  }
  return !text.empty() && !(text[0] >= '0' && text[0] <= '9');
}

template <auto Value>
consteval enumerator_description describe_enumerator() noexcept {
  constexpr literal_piece spelled = spelled_name<Value>();
  constexpr std::string_view name{spelled.begin, spelled.end};
  static_assert(is_identifier(name),
                "rowe::enumerators: this value of the enum has no name; give it one with rowe::enumerator");
  return {name, static_cast<std::int64_t>(Value)};
}

// What an enum's list holds; without a name where a static_assert has said what is wrong.
template <class Enum, auto Entry>
struct enumerator_entry {
  static constexpr bool is_own = std::same_as<std::remove_cv_t<decltype(Entry)>, Enum>;
  static_assert(is_own, "rowe::names: list values of the enum (mode::off) or rowe::enumerator<...>");
  static consteval enumerator_description describe() noexcept {
    if constexpr (is_own) return describe_enumerator<Entry>();
    return {};
  }
};
template <class Enum, auto Value, auto Name, enumerator_spec<Value, Name> Entry>
struct enumerator_entry<Enum, Entry> {
  static_assert(std::same_as<std::remove_cv_t<decltype(Value)>, Enum>,
                "rowe::names: list values of the enum (mode::off) or rowe::enumerator<...>");
  static_assert(!Name.view().empty(),
                "rowe::enumerator: the second argument must be a name, not an empty one");
  static consteval enumerator_description describe() noexcept {
    return {Name.view(), static_cast<std::int64_t>(Value)};
  }
};

template <std::size_t N>
consteval bool differ(const std::array<enumerator_description, N>& all) noexcept {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool known = !all[i].name.empty() && !all[j].name.empty();
      if (known && (all[i].name == all[j].name || all[i].value == all[j].value)) return false;
    }
  }
  return true;
}

template <class Enum, class List>
struct names_of {
  static_assert(unsupported<Enum>, "rowe::names: names must read `= rowe::enumerators<E::value, ...>{}`");
  static constexpr std::array<enumerator_description, 0> list{};
};
template <class Enum>
struct names_of<Enum, no_names> {
  static constexpr std::array<enumerator_description, 0> list{};
};
template <class Enum, auto... Entries>
struct names_of<Enum, enumerators<Entries...>> {
  static constexpr std::array<enumerator_description, sizeof...(Entries)> list{
      enumerator_entry<Enum, Entries>::describe()...};
  static_assert(differ(list), "rowe::names: two values of the enum, or two of their names, are the same");
};

// ---- durations and times ----

template <class Duration>
consteval unit_description unit_of() noexcept {
  return {.numerator = Duration::period::num, .denominator = Duration::period::den};
}

template <class Duration>
consteval value_description describe_duration() noexcept {
  value_description d = describe_value<typename Duration::rep>();
  static_assert(sizeof(Duration) == sizeof(typename Duration::rep)); // so its count is where it is
  d.unit = unit_of<Duration>();
  return d;
}

template <class Time>
consteval value_description describe_time() noexcept {
  static_assert(!Time::clock::is_steady,
                "rowe::schema: a time of a steady clock means nothing to another program; use one of "
                "std::chrono::system_clock (std::chrono::sys_time), or a std::chrono::duration");
  value_description d = describe_duration<typename Time::duration>();
  static_assert(sizeof(Time) == sizeof(typename Time::duration));
  d.unit.since_1970 = requires(const Time& t) { Time::clock::to_time_t(t); }; // system_clock alone has it
  return d;
}

// ---- arrays ----

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
  if constexpr (!is_character<Element>) d.element = &value_description_of<Element>;
  d.is_bytes = std::same_as<Element, std::uint8_t> || std::same_as<Element, std::byte>;
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
      d.enumerators = names_of<T, std::remove_cv_t<decltype(names<T>)>>::list;
    } else if constexpr (described<T>) {
      d.kind = value_kind::object;
      d.object = &describe<T>();
    } else if constexpr (is_duration<T>) {
      d = describe_duration<T>();
    } else if constexpr (is_time_point<T>) {
      d = describe_time<T>();
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
    } else {
      static_assert(
          unsupported<T>,
          "rowe::schema: this type cannot be written as JSON. Members may be bool, integers, float, "
          "double, enums, std::chrono durations and times, types with a schema of their own (template <> "
          "inline constexpr auto "
          "rowe::schema<T> = rowe::fields<...>{}; at global scope, before the first use), std::array or C "
          "arrays, rowe::bounded_array, rowe::fixed_string and std::optional of these");
    }
    return d;
  }
}

} // namespace rowe::detail
