// SPDX-License-Identifier: Apache-2.0
// Subscribers of structs, and their views.
#include <rowe/subscriber.hpp>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

using subscribing = offered<subscriber<odometry>>;

subscribing subscriber_in(real_time& rt, keep kept = keep::all) {
  return offer<subscriber<odometry>>(
      rt, detail::subscribe_request<odometry>("/odom", {.keep = kept, .depth = depth}));
}

subscribing all_in(real_time& rt) { return subscriber_in(rt); }

template <class Take>
void take_each(real_time& rt, keep kept, Take take) {
  auto with = subscriber_in(rt, kept);
  rt.calls([&](std::uint64_t i) {
    if (i % 3 != 0) decode(with.on);
    use(take(with.handle));
  });
}

// Of each three values two have a time to live, and that of one is over.
template <class Take>
void take_in_time(real_time& rt, keep kept, Take take) {
  auto with = subscriber_in(rt, kept);
  const rt::time_point far = rt::monotonic_clock::now() + std::chrono::hours{1};
  rt.calls([&](std::uint64_t i) {
    decode(with.on, {1, 2, 3, 4, 5}, i % 3 == 0 ? rt::time_point{} : i % 3 == 1 ? far : rt::never);
    use(take(with.handle));
    use(with.handle.expired());
  });
}

template <class Take>
void take_by_the_clock(real_time& rt, keep kept, Take take) {
  auto with = subscriber_in(rt, kept);
  const rt::time_point far = rt::monotonic_clock::now() + std::chrono::hours{1};
  rt.calls([&](std::uint64_t) {
    decode(with.on, {1, 2, 3, 4, 5}, far);
    use(take(with.handle));
  });
}

template <class Take>
void take_where_there_is_none(real_time& rt, Take take) {
  auto with = subscriber_in(rt);
  close(with.on);
  auto& empty = rt.make<subscriber<odometry>>();
  rt.calls([&](std::uint64_t i) { use(take(i % 2 == 0 ? with.handle : empty)); });
}

template <class Read>
void read_a_view(real_time& rt, Read read) {
  auto with = subscriber_in(rt);
  rt.calls([&](std::uint64_t) {
    decode(with.on);
    const auto taken = with.handle.try_take();
    use(read(*taken));
  });
}

// Of each four commands one is in force, one is over, one is of a turn that is over, and one does not come.
void take_commands(real_time& rt) {
  auto with = offer<subscriber<odometry>>(
      rt, detail::subscribe_request<odometry>("/odom", {.lease = std::chrono::milliseconds{300}}));
  const rt::time_point now = rt::monotonic_clock::now();
  rt.calls([&](std::uint64_t i) {
    if (i % 4 != 3) decode(with.on, {1, 2, 3, 4, 5}, i % 4 == 0 ? rt::never : rt::time_point{});
    with.on.turn.set(i % 4 == 2 ? 1 : 0);
    use(with.handle.latest_within(now));
  });
}

constexpr exercise list[] = {
    {"detail::command_turn::is", "the turn that lasts, and another one",
     [](real_time& rt) {
       auto& turn = rt.make<detail::command_turn<>>();
       rt.calls([&](std::uint64_t i) {
         turn.set(i % 2 == 0 ? 1 : 0);
         use(turn.is(1));
       });
     }},
    {"subscriber::latest_within", "commands that are in force, and others", take_commands},
    {"subscriber::latest_within", "where there is no command, or no handle",
     [](real_time& rt) {
       take_where_there_is_none(rt, [](auto& s) { return s.latest_within(rt::time_point{}); });
     }},
    {"subscriber::try_take", "of structs, every one",
     [](real_time& rt) { take_each(rt, keep::all, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::try_take", "of structs, the newest",
     [](real_time& rt) { take_each(rt, keep::newest, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::try_take", "of structs, closed and empty",
     [](real_time& rt) { take_where_there_is_none(rt, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::try_take", "of structs with times to live, by the clock",
     [](real_time& rt) { take_by_the_clock(rt, keep::all, [](auto& s) { return s.try_take(); }); }, true},
    {"subscriber::try_take", "of structs with times to live",
     [](real_time& rt) { take_in_time(rt, keep::newest, [](auto& s) { return s.try_take(now); }); }},
    {"subscriber::latest", "of structs with times to live, by the clock",
     [](real_time& rt) { take_by_the_clock(rt, keep::newest, [](auto& s) { return s.latest(); }); }, true},
    {"subscriber::latest", "of structs with times to live",
     [](real_time& rt) { take_in_time(rt, keep::all, [](auto& s) { return s.latest(now); }); }},
    {"subscriber::expired", "while times pass",
     [](real_time& rt) { take_in_time(rt, keep::all, [](auto& s) { return s.try_take(now); }); }},
    {"subscriber::latest", "of structs, when its queue is full", calls_on<all_in>([](auto& with) {
       for (std::uint32_t i = 0; i < depth; ++i) decode(with.on);
       use(with.handle.latest());
     })},
    {"subscriber::latest", "of structs, the newest",
     [](real_time& rt) { take_each(rt, keep::newest, [](auto& s) { return s.latest(); }); }},
    {"subscriber::latest", "of structs, closed and empty",
     [](real_time& rt) { take_where_there_is_none(rt, [](auto& s) { return s.latest(); }); }},

    {"value_view::value_view", "moved from another", calls_on<all_in>([](auto& with) {
       decode(with.on);
       auto taken = with.handle.try_take();
       const value_view<odometry> moved{std::move(*taken)};
       use(moved);
     })},
    {"value_view::operator=", "of two",
     [](real_time& rt) {
       auto with = subscriber_in(rt);
       decode(with.on);
       auto kept = with.handle.try_take();
       rt.calls([&](std::uint64_t) {
         decode(with.on);
         auto next = with.handle.try_take();
         *kept = std::move(*next);
       });
     }},
    {"value_view::~value_view", "with and without a slot to give back",
     [](real_time& rt) {
       auto every = subscriber_in(rt);
       auto newest = subscriber_in(rt, keep::newest);
       rt.calls([&](std::uint64_t i) {
         subscribing& with = i % 2 == 0 ? every : newest;
         decode(with.on);
         use(with.handle.try_take());
       });
     }},
    {"value_view::value", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](const auto& v) { return v.value().x; }); }},
    {"value_view::operator*", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](const auto& v) { return (*v).x; }); }},
    {"value_view::operator->", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](const auto& v) { return v->x; }); }},
    {"value_view::arrived", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](const auto& v) { return v.arrived(); }); }},
    {"value_view::from", "of each slot in turn",
     [](real_time& rt) { read_a_view(rt, [](const auto& v) { return v.from(); }); }},
};

} // namespace

std::span<const exercise> exercises_of_typed_subscribers() { return list; }

} // namespace rowe::contract
