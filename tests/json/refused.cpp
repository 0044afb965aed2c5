// SPDX-License-Identifier: Apache-2.0
// Schemas that must not compile: refused_test.py says what is listed in one (SCHEMA, NAMES), of which type
// (TYPE) and what is done with it (USED), and looks for the sentence that tells the user what is wrong. With
// nothing said it compiles.
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rowe/json_value.hpp>
#include <rowe/schema.hpp>

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
#ifdef NAMES
template <>
inline constexpr auto rowe::names<gear> = NAMES;
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

#ifdef SCHEMA
template <>
inline constexpr auto rowe::schema<TYPE> = SCHEMA;
#endif

#ifndef TYPE
#define TYPE sound
#endif
#ifndef USED
#define USED rowe::describe<TYPE>().members.size()
#endif

int main() { return static_cast<int>(USED); }
