// SPDX-License-Identifier: Apache-2.0
// Schemas that must not compile. Each case is compiled by a test of its own, which looks for the sentence
// that tells the user what is wrong; without a case the file compiles, which a test checks too.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <rowe/schema.hpp>

struct sound {
  double x = 0;
};
template <>
inline constexpr auto rowe::schema<sound> = rowe::fields<&sound::x>{};

struct other {
  double y = 0;
};

struct subject {
  double x = 0, x2 = 0;
  int count = 0;
  float ranges[4]{};
  rowe::bounded_array<int, 4> list;
  rowe::fixed_string<4> name;
  other unknown;
  char text[8]{};
  char letter = 0;
  long double wide = 0;
  const char* pointer = nullptr;
  std::array<other, 2> unknowns{};
  std::optional<const char*> maybe;
  void function() {}
};

struct heap {
  std::string text;
};

// clang-format off
#if defined(NOTHING_WRONG)
#elif defined(NO_SCHEMA)
#elif defined(MEMBER_WITHOUT_SCHEMA)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::unknown>{};
#elif defined(ELEMENT_WITHOUT_SCHEMA)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::unknowns>{};
#elif defined(POINTER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::pointer>{};
#elif defined(OPTIONAL_POINTER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::maybe>{};
#elif defined(LONG_DOUBLE)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::wide>{};
#elif defined(CHARACTER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::letter>{};
#elif defined(CHARACTER_ARRAY)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::text>{};
#elif defined(SAME_NAME)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::x, rowe::field<&subject::x2, "x">>{};
#elif defined(FOREIGN_MEMBER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::x, &other::y>{};
#elif defined(MEMBER_FUNCTION)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::function>{};
#elif defined(NO_FIELDS)
template <> inline constexpr auto rowe::schema<subject> = &subject::x;
#elif defined(STRING_FORM)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::x>.as_string()>{};
#elif defined(DECIMALS_OF_INTEGER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::count>.decimals(3)>{};
#elif defined(DECIMALS_RANGE)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::x>.decimals(10)>{};
#elif defined(COUNTED_SCALAR)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::counted<&subject::x, &subject::count>>{};
#elif defined(COUNTED_TWICE)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::counted<&subject::list, &subject::count>>{};
#elif defined(COUNT_IS_REAL)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::counted<&subject::ranges, &subject::x>>{};
#elif defined(NOT_TRIVIALLY_COPYABLE)
template <> inline constexpr auto rowe::schema<heap> = rowe::fields<>{};
#endif
// clang-format on

int main() {
#if defined(NOTHING_WRONG)
  return static_cast<int>(rowe::describe<sound>().members.size()) - 1;
#elif defined(NOT_TRIVIALLY_COPYABLE)
  return static_cast<int>(rowe::describe<heap>().members.size());
#else
  return static_cast<int>(rowe::describe<subject>().members.size());
#endif
}
