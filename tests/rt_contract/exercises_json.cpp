// SPDX-License-Identifier: Apache-2.0
// Reading JSON in place: what was received, and other texts.
#include <rowe/json_value.hpp>
#include <rowe/subscriber.hpp>

#include <array>
#include <optional>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr std::string_view pose =
    R"({"stamp":1.5,"name":"a\tb","plain":"odom","at":[{"x":0.1234567890123456789,"n":9007199254740993}],)"
    R"("odom":{"stamp":1,"x":2,"y":3,"heading":4,"speed":5},"off":{"stamp":1,"x":"far"}})";

// What is there, and what is not.
constexpr std::array<std::string_view, 8> paths{"stamp",    "at[0].n", "at[7].x", "plain",
                                                "name.far", "a..b",    "off",     "['name']"};

constexpr std::string_view nth(std::uint64_t i) { return paths[i % paths.size()]; }

json_value sample(real_time&) { return json_value::parse(pose).value(); }

json_result<double> read(const char* name) { return json_value::parse(pose)->get<double>(name); }
json_result<double>& a_value(real_time& rt) { return rt.make<json_result<double>>(read("stamp")); }
json_result<double>& an_error(real_time& rt) { return rt.make<json_result<double>>(read("plain")); }

template <class Call>
void with_results(real_time& rt, Call call) {
  auto& there = a_value(rt);
  auto& failed = an_error(rt);
  rt.calls([&](std::uint64_t i) { use(call(i % 2 == 0 ? there : failed)); });
}

template <class Call>
void with_message(real_time& rt, Call call) {
  auto with = offer<subscriber<json_text>>(
      rt, detail::subscribe_request<json_text>("/chatter", {.depth = depth, .text_bytes_max = text_bytes}));
  rt.calls([&](std::uint64_t i) {
    arrive(with.on);
    if (const auto taken = with.handle.try_take()) use(call(*taken, i));
  });
}

using members = json_range<json_member>;

constexpr exercise list[] = {
    {"json_value::json_value", "null",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(json_value{}); }); }},
    {"json_value::parse", "of texts that are valid and not",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(json_value::parse(pose.substr(0, i % 250))); });
     }},
    {"json_value::kind", "of each",
     calls_on<sample>([](json_value v, auto i) { return v.find(nth(i)).value_or(v).kind(); })},
    {"json_value::text", "of an object", calls_on<sample>([](json_value v) { return v.text().size(); })},
    {"json_value::says", "of a string and of others",
     calls_on<sample>([](json_value v, auto i) { return v.find(nth(i)).value_or(v).says("a\tb"); })},
    {"json_value::find", "by paths that are right and wrong",
     calls_on<sample>([](json_value v, auto i) { return v.find(nth(i)); })},
    {"json_value::get", "of each type that may be read, there and not",
     calls_on<sample>([](json_value v, auto i) {
       use(v.get<bool>(nth(i)));
       use(v.get<std::int64_t>(nth(i)));
       use(v.get<float>(nth(i)));
       use(v.get<double>(nth(i)));
       use(v.get<std::string_view>(nth(i)));
       use(v.get<fixed_string<3>>(nth(i)));
       use(v.get<json_value>(nth(i)));
       return v.get<std::optional<double>>(nth(i));
     })},
    {"json_value::get", "of strings, into what is large enough and not",
     calls_on<sample>([](json_value v, auto i) {
       std::array<char, 4> scratch;
       return v.get<std::string_view>(nth(i), std::span{scratch}.first(i / 8 % 5));
     })},
    {"json_value::as", "of one that matches the schema, of others, of none",
     calls_on<sample>([](json_value v, auto i) { return v.as<odometry>(i % 2 == 0 ? "odom" : nth(i / 2)); })},
    {"json_value::members", "of an object", calls_on<sample>([](json_value v) { return v.members(); })},
    {"json_value::elements", "of an array and of others",
     calls_on<sample>([](json_value v, auto i) { return v.find(nth(i)).value_or(v).elements(); })},

    {"json_range::begin", "of members", calls_on<sample>([](json_value v) { return v.members().begin(); })},
    {"json_range::end", "of members", calls_on<sample>([](json_value v) { return v.members().end(); })},
    {"json_range::iterator::iterator", "of nothing",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(members::iterator{}); }); }},
    {"json_range::iterator::operator*", "of the first",
     calls_on<sample>([](json_value v) { return (*v.members().begin()).name; })},
    {"json_range::iterator::operator++", "through all", calls_on<sample>([](json_value v) {
       std::size_t bytes = 0;
       for (const auto [name, value] : v.members()) bytes += name.text().size() + value.text().size();
       return bytes;
     })},
    {"json_range::iterator::operator++", "behind", calls_on<sample>([](json_value v) {
       auto at = v.members().begin();
       return at++;
     })},
    {"json_range::iterator::operator==", "with the end",
     calls_on<sample>([](json_value v) { return v.members().begin() == v.members().end(); })},
    {"json_range::iterator::operator==", "with another",
     calls_on<sample>([](json_value v) { return v.members().begin() == v.members().begin(); })},

    {"json_result::operator bool", "of a value and of an error",
     [](real_time& rt) { with_results(rt, [](auto& r) { return static_cast<bool>(r); }); }},
    {"json_result::has_value", "of a value and of an error",
     [](real_time& rt) { with_results(rt, [](auto& r) { return r.has_value(); }); }},
    {"json_result::code", "of a value and of an error",
     [](real_time& rt) { with_results(rt, [](auto& r) { return r.code(); }); }},
    {"json_result::error", "of an error", calls_on<an_error>([](auto& failed) {
       std::array<char, 100> buffer;
       use(failed.error().message(buffer));
     })},
    {"json_result::operator*", "of a value", calls_on<a_value>([](auto& r) { return *r; })},
    {"json_result::operator*", "of a constant one", calls_on<a_value>([](const auto& r) { return *r; })},
    {"json_result::operator*", "of a temporary",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(*read("stamp")); }); }},
    {"json_result::operator->", "of a value", calls_on<a_value>([](auto& r) { return r.operator->(); })},
    {"json_result::operator->", "of a constant one",
     calls_on<a_value>([](const auto& r) { return r.operator->(); })},

    {"detail::reads_json::json", "of what was received",
     [](real_time& rt) { with_message(rt, [](auto& m, std::uint64_t) { return m.json(); }); }},
    {"detail::reads_json::get", "of what was received",
     [](real_time& rt) {
       with_message(rt, [](auto& m, std::uint64_t) { return m.template get<bool>("data"); });
     }},
    {"detail::reads_json::get", "a string of what was received",
     [](real_time& rt) {
       with_message(rt, [](auto& m, std::uint64_t) {
         std::array<char, 8> scratch;
         return m.template get<std::string_view>("data", scratch).has_value();
       });
     }},
    {"detail::reads_json::find", "in what was received",
     [](real_time& rt) { with_message(rt, [](auto& m, std::uint64_t) { return m.find("data"); }); }},
    {"detail::reads_json::as", "of what was received, which does not match",
     [](real_time& rt) {
       with_message(rt, [](auto& m, std::uint64_t) { return m.template as<odometry>(); });
     }},
    {"detail::reads_json::members", "of what was received",
     [](real_time& rt) { with_message(rt, [](auto& m, std::uint64_t) { return m.members(); }); }},
    {"detail::reads_json::elements", "of what was received",
     [](real_time& rt) { with_message(rt, [](auto& m, std::uint64_t) { return m.elements(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_json() { return list; }

} // namespace rowe::contract
