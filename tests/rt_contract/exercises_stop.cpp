// SPDX-License-Identifier: Apache-2.0
#include "pairs.hpp"

#include <rowe/stop_latch.hpp>

namespace rowe::contract {
namespace {

struct stop_harness {
  detail::permit_word<>& permit;
  stop_latch latch;

  explicit stop_harness(real_time& rt, audience listening = audience::somebody)
      : permit{rt.make<detail::permit_word<>>()} {
    detail::queue_pair& on = pair_for(rt, detail::latch_request({}), listening);
    on.granted = &permit;
    latch = stop_latch{handle_of(on)};
  }
};

constexpr exercise list[] = {
    {"stop_latch::engaged", "running, at a time",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.grant(1, rt::never);
       rt.calls([&](std::uint64_t) { use(on.latch.engaged(now)); });
     }},
    {"stop_latch::engaged", "running, after times of every length",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.grant(1, rt::never);
       time_point then = now;
       rt.calls([&](std::uint64_t i) { use(on.latch.engaged(then += duration{1 << i % 31})); });
     }},
    {"stop_latch::engaged", "running, reading the time",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.grant(1, rt::never);
       rt.calls([&](std::uint64_t) { use(on.latch.engaged()); });
     },
     true},
    {"stop_latch::engaged", "stopped, at a time",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.withdraw(1);
       rt.calls([&](std::uint64_t) { use(on.latch.engaged(now)); });
     }},
    {"stop_latch::engaged", "stopped and reset in turn, at a time",
     [](real_time& rt) {
       stop_harness on{rt};
       rt.calls([&](std::uint64_t i) {
         const auto number = static_cast<detail::latch_number>(1 + i / 2 % 1000);
         i % 2 == 0 ? on.permit.grant(number, rt::never) : on.permit.withdraw(number);
         use(on.latch.engaged(now));
       });
     }},
    {"stop_latch::engaged", "when its permit has run out",
     [](real_time& rt) {
       stop_harness on{rt};
       rt.calls([&](std::uint64_t i) {
         on.permit.grant(static_cast<detail::latch_number>(1 + i / 2 % 1000),
                         i % 2 == 0 ? now + 1s : now - 1s);
         use(on.latch.engaged(now));
       });
     }},
    {"stop_latch::engaged", "when the endpoint is closed, which withdraws for ever",
     [](real_time& rt) {
       stop_harness on{rt, audience::closed};
       on.permit.withdraw(1);
       rt.calls([&](std::uint64_t) {
         use(on.latch.engaged(now));
         on.latch.acknowledge(now);
       });
     }},
    {"stop_latch::acknowledge", "before any stop, and by an empty handle",
     [](real_time& rt) {
       stop_harness on{rt};
       stop_latch empty;
       rt.calls([&](std::uint64_t i) { (i % 2 == 0 ? on.latch : empty).acknowledge(now); });
     }},
    {"stop_latch::engaged", "of an empty handle",
     [](real_time& rt) {
       stop_latch empty;
       rt.calls([&](std::uint64_t) { use(empty.engaged(now)); });
     }},
    {"stop_latch::acknowledge", "each stop anew, at a time",
     [](real_time& rt) {
       stop_harness on{rt};
       rt.calls([&](std::uint64_t i) {
         on.permit.withdraw(static_cast<detail::latch_number>(1 + i % 1000));
         use(on.latch.engaged(now));
         on.latch.acknowledge(now);
       });
     }},
    {"stop_latch::acknowledge", "the same stop, reading the time",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.withdraw(1);
       use(on.latch.engaged(now));
       rt.calls([&](std::uint64_t) { on.latch.acknowledge(); });
     },
     true},

    {"detail::permit::units_of", "any time",
     [](real_time& rt) { rt.calls([&](std::uint64_t) { use(detail::permit::units_of(now)); }); }},
    {"detail::permit::number_of", "any word",
     [](real_time& rt) { rt.calls([&](std::uint64_t i) { use(detail::permit::number_of(i)); }); }},
    {"detail::permit::time_of", "any word",
     [](real_time& rt) { rt.calls([&](std::uint64_t i) { use(detail::permit::time_of(i)); }); }},
    {"detail::permit_word::read", "granted",
     [](real_time& rt) {
       stop_harness on{rt};
       on.permit.grant(1, now);
       rt.calls([&](std::uint64_t) { use(on.permit.read()); });
     }},
    {"detail::latch_words::check_in", "always",
     calls_on<made<detail::latch_words<>>>([](auto& words) { words.check_in(now); })},
    {"detail::latch_words::checked_in", "always",
     calls_on<made<detail::latch_words<>>>([](auto& words) { return words.checked_in(); })},
    {"detail::loop_timing::note", "times of every length, and backwards",
     calls_on<made<detail::loop_timing>>(
         [](auto& timing, auto i) { timing.note(now, now + duration{std::int64_t{1} << i % 40} - 1ms); })},
    {"detail::latch_words::trip", "always",
     calls_on<made<detail::latch_words<>>>([](auto& words) { words.trip(1); })},
    {"detail::latch_words::acknowledge", "always",
     calls_on<made<detail::latch_words<>>>([](auto& words) { words.acknowledge(1, now); })},
    {"detail::latch_engaged", "tripped",
     [](real_time& rt) {
       auto& permit = rt.make<detail::permit_word<>>();
       auto& words = rt.make<detail::latch_words<>>();
       detail::latch_memory own;
       rt.calls([&](std::uint64_t) { use(detail::latch_engaged(permit, words, own, now)); });
     }},
    {"detail::latch_acknowledge", "tripped at another number each time",
     [](real_time& rt) {
       auto& words = rt.make<detail::latch_words<>>();
       detail::latch_memory own;
       rt.calls([&](std::uint64_t i) {
         own.tripped = static_cast<detail::latch_number>(i);
         detail::latch_acknowledge(words, own, now);
       });
     }},
};

} // namespace

std::span<const exercise> exercises_of_the_stop() { return list; }

} // namespace rowe::contract
