// SPDX-License-Identifier: Apache-2.0
// What rowe/json_value.hpp is made of: how a path is followed, and a type read where it leads. The functions
// are in the library; what depends on the type is here.
#pragma once
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include <rowe/fixed_string.hpp>
#include <rowe/json_error.hpp>
#include <rowe/schema.hpp>

namespace rowe {
class json_value;
struct json_member;
} // namespace rowe

namespace rowe::detail {

enum class json_outcome : std::uint8_t { there, missing, wrong_type, out_of_range, too_long, bad_path };

// What is to be read.
enum class json_form : std::uint8_t {
  anything,
  object,
  array,
  boolean,
  whole,
  number,
  text,
  plain_text,
  name,
  bytes
};
struct json_bounds {
  json_form what{};
  std::int64_t least = 0;
  std::uint64_t most = 0;                          // text: bytes; 0: any number of them. bytes: their number,
  bool exact = false;                              // or exactly so many
  std::span<const enumerator_description> names{}; // name: of an enum
};

// Where a path leads, or where it ends.
struct json_place {
  std::string_view value; // as written; where it fails, the last value that is there
  json_outcome is = json_outcome::there;
  json_form next{};           // wrong_type: what had to be there, because the path goes on
  std::size_t path_bytes = 0; // of the path, up to what is missing or wrong; bad_path: where
  std::size_t count = 0;      // missing: elements of the array; too_long: bytes of the string
};

struct json_access {
  // The value of a text that is validated; it may stand among white space.
  static json_value value_of(std::string_view validated) noexcept;

  static json_place follow(std::string_view value, std::string_view path) noexcept;
  // Each reads the value of a place that is there, or records why it cannot.
  static bool read(json_place& at, bool& into) noexcept;
  static bool read(json_place& at, float& into) noexcept;
  static bool read(json_place& at, double& into) noexcept;
  static bool read(json_place& at, const json_bounds& of, std::uint64_t& bits) noexcept;
  static bool read(json_place& at, std::span<char> scratch, std::string_view& into) noexcept;
  static bool read_plain(json_place& at, std::string_view& into) noexcept;
  static bool read_bytes(json_place& at, const json_bounds& of, void* into, std::size_t& count) noexcept;
  static bool read_named(json_place& at, const json_bounds& of, std::int64_t& into) noexcept;
  [[gnu::cold]] static json_error failure(const json_place& at, std::string_view path,
                                          const json_bounds& wanted) noexcept;

  // Takes the next item off what is left of an object or array; false: there is none.
  static bool next(std::string_view& rest, json_member& into) noexcept;
  static bool next(std::string_view& rest, json_value& into) noexcept;
};

// How a T is read.
template <class T>
struct json_wanted {
  static constexpr bool readable = false;
};

template <class T>
struct json_wanted_once {
  static constexpr bool readable = true;
  static constexpr bool optional = false;
  using value_type = T;
};

template <>
struct json_wanted<bool> : json_wanted_once<bool> {
  static constexpr json_bounds bounds{.what = json_form::boolean};
  static bool read(json_place& at, bool& into) noexcept { return json_access::read(at, into); }
};

template <class T>
requires(std::same_as<T, float> || std::same_as<T, double>) struct json_wanted<T> : json_wanted_once<T> {
  static constexpr json_bounds bounds{.what = json_form::number};
  static bool read(json_place& at, T& into) noexcept { return json_access::read(at, into); }
};

template <std::integral T>
requires(!is_character<T> && !std::same_as<T, bool> && sizeof(T) <= 8) struct json_wanted<T>
    : json_wanted_once<T> {
  static constexpr json_bounds bounds{.what = json_form::whole,
                                      .least = static_cast<std::int64_t>((std::numeric_limits<T>::min)()),
                                      .most = static_cast<std::uint64_t>((std::numeric_limits<T>::max)())};
  static bool read(json_place& at, T& into) noexcept {
    std::uint64_t bits = 0;
    if (!json_access::read(at, bounds, bits)) return false;
    into = static_cast<T>(bits);
    return true;
  }
};

template <class T>
inline constexpr std::span<const enumerator_description> names_listed =
    names_of<T, std::remove_cv_t<decltype(names<T>)>>::list;

template <class T>
requires(std::is_enum_v<T>&& json_wanted<std::underlying_type_t<T>>::readable) struct json_wanted<T>
    : json_wanted_once<T> {
  using number = json_wanted<std::underlying_type_t<T>>;
  static constexpr json_bounds bounds = [] {
    json_bounds of = number::bounds;
    of.names = names_listed<T>;
    if (!of.names.empty()) of.what = json_form::name;
    return of;
  }();
  static bool read(json_place& at, T& into) noexcept {
    if constexpr (!names_listed<T>.empty()) {
      std::int64_t value = 0;
      if (!json_access::read_named(at, bounds, value)) return false;
      into = static_cast<T>(value);
    } else {
      std::underlying_type_t<T> value{};
      if (!number::read(at, value)) return false;
      into = static_cast<T>(value);
    }
    return true;
  }
};

template <class Rep, class Period>
requires(json_wanted<Rep>::readable&&
             std::is_arithmetic_v<Rep>) struct json_wanted<std::chrono::duration<Rep, Period>>
    : json_wanted_once<std::chrono::duration<Rep, Period>> {
  static constexpr json_bounds bounds = json_wanted<Rep>::bounds;
  static bool read(json_place& at, std::chrono::duration<Rep, Period>& into) noexcept {
    Rep count{};
    if (!json_wanted<Rep>::read(at, count)) return false;
    into = std::chrono::duration<Rep, Period>{count};
    return true;
  }
};

template <class Duration>
requires(json_wanted<Duration>::readable) struct json_wanted<std::chrono::sys_time<Duration>>
    : json_wanted_once<std::chrono::sys_time<Duration>> {
  static constexpr json_bounds bounds = json_wanted<Duration>::bounds;
  static bool read(json_place& at, std::chrono::sys_time<Duration>& into) noexcept {
    Duration since_1970{};
    if (!json_wanted<Duration>::read(at, since_1970)) return false;
    into = std::chrono::sys_time<Duration>{since_1970};
    return true;
  }
};

template <>
struct json_wanted<std::string_view> : json_wanted_once<std::string_view> {
  static constexpr json_bounds bounds{.what = json_form::plain_text};
  static bool read(json_place& at, std::string_view& into) noexcept {
    return json_access::read_plain(at, into);
  }
};

template <std::size_t N>
struct json_wanted<fixed_string<N>> : json_wanted_once<fixed_string<N>> {
  static constexpr json_bounds bounds{.what = json_form::text, .most = N};
  static bool read(json_place& at, fixed_string<N>& into) noexcept {
    std::string_view text;
    if (!json_access::read(at, std::span<char>{into.data(), N}, text)) return false;
    if (text.data() == into.data()) return into.resize(text.size());
    if (into.assign(text)) return true;
    at.is = json_outcome::too_long;
    at.count = text.size();
    return false;
  }
};

template <class T>
inline constexpr bool is_byte = std::same_as<T, std::uint8_t> || std::same_as<T, std::byte>;

template <class T, std::size_t N>
requires(is_byte<T>) struct json_wanted<bounded_array<T, N>> : json_wanted_once<bounded_array<T, N>> {
  static constexpr json_bounds bounds{.what = json_form::bytes, .most = N};
  static bool read(json_place& at, bounded_array<T, N>& into) noexcept {
    std::size_t count = 0;
    return json_access::read_bytes(at, bounds, into.data(), count) && into.resize(count);
  }
};

template <class T, std::size_t N>
requires(is_byte<T>&& N > 0) struct json_wanted<std::array<T, N>> : json_wanted_once<std::array<T, N>> {
  static constexpr json_bounds bounds{.what = json_form::bytes, .most = N, .exact = true};
  static bool read(json_place& at, std::array<T, N>& into) noexcept {
    std::size_t count = 0;
    return json_access::read_bytes(at, bounds, into.data(), count);
  }
};

template <>
struct json_wanted<json_value> : json_wanted_once<json_value> {
  static constexpr json_bounds bounds{.what = json_form::anything};
  static bool read(json_place& at, json_value& into) noexcept;
};

template <class T>
requires(json_wanted<T>::readable) struct json_wanted<std::optional<T>> : json_wanted<T> {
  static constexpr bool optional = true;
};

// A schema that is compiled for reading; see json_value::as().
class schema_decoder {
 public:
  explicit schema_decoder(const schema_description& schema) noexcept;
  schema_decoder(const schema_decoder&) = delete;
  schema_decoder& operator=(const schema_decoder&) = delete;

  // Reads the object, found at `path`, into `*into`; or says why not.
  std::optional<json_error> decode(std::string_view validated, std::string_view path,
                                   void* into) const noexcept;

 private:
  const void* compiled_; // a json::decoder, never destroyed: threads may read while the program ends
  error why_;
};

// Initialised when the program or library that uses it is loaded.
template <class T>
inline const schema_decoder decoder_of{describe<T>()};

} // namespace rowe::detail
