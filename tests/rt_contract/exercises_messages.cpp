// SPDX-License-Identifier: Apache-2.0
// Messages, what is sent, connections and calls as values.
#include <rowe/call_id.hpp>
#include <rowe/connection.hpp>
#include <rowe/message.hpp>

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "contract.hpp"

namespace rowe::contract {
namespace {

constexpr std::string_view service = "add-two-numbers";

const message& sample(real_time& rt) { return rt.make<message>("service", service, "a", 38); }

constexpr exercise list[] = {
    {"connection::operator bool", "of none and of one",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) {
         use(static_cast<bool>(connection{0, static_cast<std::uint32_t>(i % 2)}));
       });
     }},
    {"connection::operator==", "of the same and of others",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(connection{0, static_cast<std::uint32_t>(i % 2)} == everyone); });
     }},
    {"call_id::operator==", "of the same and of others",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(call_id{0, static_cast<std::uint32_t>(i % 2)} == call_id{}); });
     }},

    {"message_of::message_of", "empty",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(message{}); }); }},
    {"message_of::message_of", "of the paper's example",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(message{"service", service, "a", i, "b", 4}); });
     }},
    {"message_of::message_of", "of every kind of value",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) {
         const double d = std::ldexp(static_cast<double>(i), static_cast<int>(i % 64) - 32);
         use(message{"d", d,
                     "f", static_cast<float>(d),
                     "n", std::nan(""),
                     "i", std::numeric_limits<std::int64_t>::min(),
                     "u", i,
                     "t", true,
                     "z", nullptr,
                     "o", std::optional<int>{},
                     "s", "line\n\xff",
                     "r", raw_json{"[1]"}});
       });
     }},
    {"message_of::message_of", "that does not fit, wherever its room ends",
     [](real_time& rt) {
       const auto letters = rt.array<char>(64);
       for (char& c : letters) c = 'x';
       rt.calls([&](std::uint64_t i) {
         use(message_of<32>{"name", std::string_view{letters.data(), i % letters.size()}, "b", 1.25});
       });
     }},
    {"object", "nested in a message",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(message{"goal", object("x", i, "at", object("y", 1.5))}); });
     }},
    {"array", "nested in a message",
     [](real_time& rt) {
       rt.calls([](std::uint64_t i) { use(message{"path", array(i, "two", nullptr, array())}); });
     }},
    {"message_of::add", "until it overflows", calls_on<made<message_of<200>>>([](auto& built, auto i) {
       if (built.overflowed()) built = {};
       use(built.add("member", i));
     })},
    {"message_of::text", "of one that fits and of one that overflowed",
     [](real_time& rt) {
       const auto& fits = sample(rt);
       auto& overflowed = rt.make<message_of<8>>("service", service);
       rt.calls([&](std::uint64_t i) { use((i % 2 == 0 ? fits.text() : overflowed.text()).size()); });
     }},
    {"message_of::overflowed", "of one that fits and of one that overflowed",
     [](real_time& rt) {
       const auto& fits = sample(rt);
       auto& overflowed = rt.make<message_of<8>>("service", service);
       rt.calls([&](std::uint64_t i) { use(i % 2 == 0 ? fits.overflowed() : overflowed.overflowed()); });
     }},
    {"message_of::capacity", "of any",
     [](real_time& rt) { rt.calls([](std::uint64_t) { use(message::capacity()); }); }},

    {"body::body", "of a text", [](real_time& rt) { rt.calls([](std::uint64_t) { use(body{service}); }); }},
    {"body::body", "of a literal", [](real_time& rt) { rt.calls([](std::uint64_t) { use(body{"{}"}); }); }},
    {"body::body", "of a string",
     [](real_time& rt) {
       const std::string long_text(500, ' ');
       rt.calls([&](std::uint64_t) { use(body{long_text}); });
     }},
    {"body::body", "of a message", calls_on<sample>([](const auto& built) { return body{built}; })},
    {"body::text", "of a message",
     calls_on<sample>([](const auto& built) { return body{built}.text().size(); })},
    {"body::outgrown", "of a message",
     calls_on<sample>([](const auto& built) { return body{built}.outgrown(); })},
};

} // namespace

std::span<const exercise> exercises_of_messages() { return list; }

} // namespace rowe::contract
