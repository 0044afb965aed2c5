// SPDX-License-Identifier: Apache-2.0
// Schemas that must not compile. Each case is compiled by a test of its own (refused_test.py), which looks
// for the sentence that tells the user what is wrong; with nothing wrong the file compiles, which a test
// checks too.
#include "refused.hpp"

struct sound {
  double x = 0;
};
template <>
inline constexpr auto rowe::schema<sound> = rowe::fields<&sound::x>{};

struct other {
  double y = 0;
};

enum class gear : std::int8_t { reverse = -1, neutral, first, forward = 1 };
enum class mode { off, on };
#if defined(NAMES_ALIAS)
template <>
inline constexpr auto rowe::names<gear> = rowe::enumerators<gear::first, gear::forward>{};
#elif defined(NAMES_TWICE)
template <>
inline constexpr auto rowe::names<gear> =
    rowe::enumerators<gear::first, rowe::enumerator<gear::neutral, "first">>{};
#elif defined(NAMES_OF_ANOTHER)
template <>
inline constexpr auto rowe::names<gear> = rowe::enumerators<gear::first, mode::on>{};
#elif defined(NAMES_OF_NO_ENUM)
template <>
inline constexpr auto rowe::names<gear> = rowe::enumerators<gear::first, 7>{};
#elif defined(NAMES_OF_A_NUMBER)
template <>
inline constexpr auto rowe::names<gear> = rowe::enumerators<gear::first, static_cast<gear>(7)>{};
#elif defined(NAME_IS_EMPTY)
template <>
inline constexpr auto rowe::names<gear> = rowe::enumerators<rowe::enumerator<gear::first, "">>{};
#elif defined(NO_ENUMERATORS)
template <>
inline constexpr auto rowe::names<gear> = gear::first;
#endif

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
  ::gear gear{};
  ::mode mode{};
  std::chrono::milliseconds age{};
  std::chrono::duration<double> wait{};
  std::chrono::minutes minutes{};
  std::chrono::steady_clock::time_point when{};
  void function() {}
};

struct heap {
  std::string text;
};
struct heap_list {
  std::vector<double> list;
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
#elif defined(COUNT_OF_ANOTHER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::counted<&subject::ranges, &sound::x>>{};
#elif defined(COUNT_IS_NO_MEMBER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::counted<&subject::ranges, 4>>{};
#elif defined(NO_MEMBER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::x, 4>{};
#elif defined(FIELD_OF_NO_MEMBER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<4>>{};
#elif defined(BY_NAME_OF_INTEGER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::count>.by_name()>{};
#elif defined(BY_NAME_WITHOUT_NAMES)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::mode>.by_name()>{};
#elif defined(SECONDS_OF_INTEGER)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::count>.as_seconds()>{};
#elif defined(SECONDS_OF_REAL)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::wait>.as_seconds()>{};
#elif defined(SECONDS_OF_MINUTES)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::minutes>.as_seconds()>{};
#elif defined(NUMBERS_OF_INTEGERS)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::count>.as_numbers()>{};
#elif defined(TWO_FORMS)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<rowe::field<&subject::age>.as_seconds().as_string()>{};
#elif defined(STEADY_TIME)
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::when>{};
#elif defined(STRING)
template <> inline constexpr auto rowe::schema<heap> = rowe::fields<&heap::text>{};
#elif defined(VECTOR)
template <> inline constexpr auto rowe::schema<heap_list> = rowe::fields<&heap_list::list>{};
#elif defined(NOT_TRIVIALLY_COPYABLE)
template <> inline constexpr auto rowe::schema<heap> = rowe::fields<>{};
#else
template <> inline constexpr auto rowe::schema<subject> = rowe::fields<&subject::gear>{};
#endif
// clang-format on

int main() {
#if defined(UNREADABLE)
  return rowe::json_value{}.get<subject>("a") ? 1 : 0;
#elif defined(NOTHING_WRONG)
  return static_cast<int>(rowe::describe<sound>().members.size()) - 1;
#elif defined(NOT_TRIVIALLY_COPYABLE) || defined(STRING)
  return static_cast<int>(rowe::describe<heap>().members.size());
#elif defined(VECTOR)
  return static_cast<int>(rowe::describe<heap_list>().members.size());
#else
  return static_cast<int>(rowe::describe<subject>().members.size());
#endif
}
