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
array& empty_array(real_time& rt) { return array_with(rt, 0); }
array& short_array(real_time& rt) { return array_with(rt, 5); }
array& full_array(real_time& rt) { return array_with(rt, array::capacity()); }

string& short_string(real_time& rt) { return rt.make<string>("map"); }
string& long_string(real_time& rt) { return rt.make<string>("base_link"); }

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
       auto& s = short_string(rt);
       constexpr std::string_view text = "a text that is too long";
       rt.calls([&](std::uint64_t i) { use(s.assign(text.substr(0, i % text.size()))); });
     }},
    {"fixed_string::resize", "within and beyond its capacity",
     calls_on<short_string>([](auto& s, auto i) { return s.resize(i % 20); })},
    {"fixed_string::data", "written to",
     calls_on<short_string>([](auto& s, auto i) { s.data()[i % 3] = 'a'; })},
    {"fixed_string::clear", "always", calls_on<short_string>([](auto& s) { s.clear(); })},
    {"fixed_string::view", "always", calls_on<short_string>([](auto& s) { return s.view(); })},
    {"fixed_string::operator std::string_view", "always",
     calls_on<short_string>([](auto& s) { return static_cast<std::string_view>(s); })},
    {"fixed_string::size", "always", calls_on<short_string>([](auto& s) { return s.size(); })},
    {"fixed_string::empty", "always", calls_on<made<string>>([](auto& s) { return s.empty(); })},
    {"fixed_string::capacity", "always",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(string::capacity()); }); }},
    {"fixed_string::operator==", "with a text", calls_on<long_string>([](auto& s, auto i) {
       return s == std::string_view{i % 2 == 0 ? "base_link" : "map"};
     })},
    {"fixed_string::operator==", "with another",
     [](real_time& rt) {
       auto& s = long_string(rt);
       auto& other = rt.make<string>("base_lift");
       rt.calls([&](std::uint64_t) { use(s == other); });
     }},

    {"bounded_array::push_back", "until it is full, and again", calls_on<empty_array>([](auto& a, auto i) {
       if (!a.push_back(static_cast<double>(i)) && i % 100 == 0) a.clear();
     })},
    {"bounded_array::resize", "within and beyond its capacity",
     calls_on<empty_array>([](auto& a, auto i) { return a.resize(i % 700); })},
    {"bounded_array::clear", "always", calls_on<short_array>([](auto& a) { a.clear(); })},
    {"bounded_array::operator[]", "written to",
     calls_on<full_array>([](auto& a, auto i) { a[i % array::capacity()] = static_cast<double>(i); })},
    {"bounded_array::operator[]", "of a constant one",
     calls_on<full_array>([](const auto& a, auto i) { return a[i % array::capacity()]; })},
    {"bounded_array::size", "always", calls_on<short_array>([](auto& a) { return a.size(); })},
    {"bounded_array::empty", "always", calls_on<empty_array>([](auto& a) { return a.empty(); })},
    {"bounded_array::full", "always", calls_on<full_array>([](auto& a) { return a.full(); })},
    {"bounded_array::capacity", "always",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(array::capacity()); }); }},
    {"bounded_array::data", "always", calls_on<short_array>([](auto& a) { return a.data(); })},
    {"bounded_array::data", "of a constant one",
     calls_on<short_array>([](const auto& a) { return a.data(); })},
    {"bounded_array::begin", "always", calls_on<short_array>([](auto& a) { return a.begin(); })},
    {"bounded_array::begin", "of a constant one",
     calls_on<short_array>([](const auto& a) { return a.begin(); })},
    {"bounded_array::end", "always", calls_on<short_array>([](auto& a) { return a.end(); })},
    {"bounded_array::end", "of a constant one", calls_on<short_array>([](const auto& a) { return a.end(); })},
};

} // namespace

std::span<const exercise> exercises_of_values() { return list; }

} // namespace rowe::contract
