// SPDX-License-Identifier: Apache-2.0
#include "contract.hpp"

#include <rowe/bounded_array.hpp>
#include <rowe/fixed_string.hpp>
#include <rowe/result.hpp>

namespace rowe::contract {
namespace {

using string = fixed_string<15>;
using array = bounded_array<double, 600>; // spans two pages

using number = result<std::uint64_t>;

struct vector {
  double x, y;
};

array& array_with(real_time& rt, std::size_t count) {
  auto& a = rt.make<array>();
  use(a.resize(count));
  return a;
}

string& string_with(real_time& rt, std::string_view text) {
  auto& s = rt.make<string>();
  use(s.assign(text));
  return s;
}

constexpr exercise list[] = {
    {"error::name", "of every code",
     [](real_time& rt) {
       constexpr auto codes = static_cast<std::uint64_t>(errc::misuse) + 1;
       rt.calls([](std::uint64_t i) { use(error{static_cast<errc>(i % codes)}.name()); });
     }},
    {"result::operator bool", "of a value and of an error",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(static_cast<bool>(i % 2 == 0 ? number{i} : number{errc::full})); });
     }},
    {"result::operator bool", "of a status, good and bad",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(static_cast<bool>(i % 2 == 0 ? status{} : status{errc::full})); });
     }},
    {"result::has_value", "of a value and of an error",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use((i % 2 == 0 ? number{i} : number{errc::full}).has_value()); });
     }},
    {"result::has_value", "of a status, good and bad",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use((i % 2 == 0 ? status{} : status{errc::full}).has_value()); });
     }},
    {"result::operator*", "of a value",
     [](real_time& rt) {
       number n{1};
       rt.calls([&](std::uint64_t i) { *n = i; });
     }},
    {"result::operator*", "of a constant value",
     [](real_time& rt) {
       const number n{1};
       rt.calls([&](std::uint64_t) { use(*n); });
     }},
    {"result::operator*", "of a temporary",
     [](real_time& rt) { rt.calls([](std::uint64_t i) { use(*number{i}); }); }},
    {"result::operator*", "of a status", [](real_time& rt) { rt.calls([](std::uint64_t) { *status{}; }); }},
    {"result::operator->", "of a value",
     [](real_time& rt) {
       result<vector> v{{1, 2}};
       rt.calls([&](std::uint64_t i) { v->x = static_cast<double>(i); });
     }},
    {"result::operator->", "of a constant value",
     [](real_time& rt) {
       const result<vector> v{{1, 2}};
       rt.calls([&](std::uint64_t) { use(v->x); });
     }},
    {"result::error", "of an error",
     [](real_time& rt) { rt.calls([](std::uint64_t) {
                           use(number{error{errc::too_big, 5, 4}}.error());
                         }); }},
    {"result::error", "of a bad status",
     [](real_time& rt) { rt.calls([](std::uint64_t) {
                           use(status{error{errc::too_big, 5, 4}}.error());
                         }); }},
    {"result::code", "of an error",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(number{errc::full}.code()); }); }},
    {"result::code", "of a bad status",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(status{errc::full}.code()); }); }},

    {"fixed_string::fixed_string", "from a literal",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(string{"base_link"}); }); }},
    {"fixed_string::assign", "a text that fits, and one that does not",
     [](real_time& rt) {
       auto& s = string_with(rt, "map");
       constexpr std::string_view text = "a text that is too long";
       rt.calls([&](std::uint64_t i) { use(s.assign(text.substr(0, i % text.size()))); });
     }},
    {"fixed_string::resize", "within and beyond its capacity",
     [](real_time& rt) {
       rt.calls_on(string_with(rt, "map"), [](auto& s, auto i) { return s.resize(i % 20); });
     }},
    {"fixed_string::data", "written to",
     [](real_time& rt) {
       rt.calls_on(string_with(rt, "map"), [](auto& s, auto i) { s.data()[i % 3] = 'a'; });
     }},
    {"fixed_string::clear", "always",
     [](real_time& rt) { rt.calls_on(string_with(rt, "map"), [](auto& s, auto) { s.clear(); }); }},
    {"fixed_string::view", "always",
     [](real_time& rt) { rt.calls_on(string_with(rt, "map"), [](auto& s, auto) { return s.view(); }); }},
    {"fixed_string::operator std::string_view", "always",
     [](real_time& rt) {
       rt.calls_on(string_with(rt, "map"), [](auto& s, auto) { return static_cast<std::string_view>(s); });
     }},
    {"fixed_string::size", "always",
     [](real_time& rt) { rt.calls_on(string_with(rt, "map"), [](auto& s, auto) { return s.size(); }); }},
    {"fixed_string::empty", "always",
     [](real_time& rt) { rt.calls_on(string_with(rt, ""), [](auto& s, auto) { return s.empty(); }); }},
    {"fixed_string::capacity", "always",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(string::capacity()); }); }},
    {"fixed_string::operator==", "with a text",
     [](real_time& rt) {
       rt.calls_on(string_with(rt, "base_link"),
                   [](auto& s, auto i) { return s == std::string_view{i % 2 == 0 ? "base_link" : "map"}; });
     }},
    {"fixed_string::operator==", "with another",
     [](real_time& rt) {
       auto& s = string_with(rt, "base_link");
       auto& other = string_with(rt, "base_lift");
       rt.calls([&](std::uint64_t) { use(s == other); });
     }},

    {"bounded_array::push_back", "until it is full, and again",
     [](real_time& rt) {
       rt.calls_on(array_with(rt, 0), [](auto& a, auto i) {
         if (!a.push_back(static_cast<double>(i)) && i % 100 == 0) a.clear();
       });
     }},
    {"bounded_array::resize", "within and beyond its capacity",
     [](real_time& rt) {
       rt.calls_on(array_with(rt, 0), [](auto& a, auto i) { return a.resize(i % 700); });
     }},
    {"bounded_array::clear", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](auto& a, auto) { a.clear(); }); }},
    {"bounded_array::operator[]", "written to",
     [](real_time& rt) {
       rt.calls_on(array_with(rt, array::capacity()),
                   [](auto& a, auto i) { a[i % array::capacity()] = static_cast<double>(i); });
     }},
    {"bounded_array::operator[]", "of a constant one",
     [](real_time& rt) {
       rt.calls_on(array_with(rt, array::capacity()),
                   [](const auto& a, auto i) { return a[i % array::capacity()]; });
     }},
    {"bounded_array::size", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](auto& a, auto) { return a.size(); }); }},
    {"bounded_array::empty", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 0), [](auto& a, auto) { return a.empty(); }); }},
    {"bounded_array::full", "always",
     [](real_time& rt) {
       rt.calls_on(array_with(rt, array::capacity()), [](auto& a, auto) { return a.full(); });
     }},
    {"bounded_array::capacity", "always",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(array::capacity()); }); }},
    {"bounded_array::data", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](auto& a, auto) { return a.data(); }); }},
    {"bounded_array::data", "of a constant one",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](const auto& a, auto) { return a.data(); }); }},
    {"bounded_array::begin", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](auto& a, auto) { return a.begin(); }); }},
    {"bounded_array::begin", "of a constant one",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](const auto& a, auto) { return a.begin(); }); }},
    {"bounded_array::end", "always",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](auto& a, auto) { return a.end(); }); }},
    {"bounded_array::end", "of a constant one",
     [](real_time& rt) { rt.calls_on(array_with(rt, 5), [](const auto& a, auto) { return a.end(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_values() { return list; }

} // namespace rowe::contract
