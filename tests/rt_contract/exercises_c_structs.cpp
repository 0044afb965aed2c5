// SPDX-License-Identifier: Apache-2.0
// What loops call in C of structs, services and periods; the C++ handles behind it are exercised by files of
// their own.
#include <array>

#include <rowe/periodic.h>
#include <rowe/service.h>

#include "capi/handles.hpp"
#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr std::int64_t now_ns = rt::nanoseconds_of(now);
constexpr long ttl_ms = 20;
constexpr odometry value{1, 2, 3, 4, 5};

// A handle and its queue pair.
template <class Handle>
struct in_c {
  detail::queue_pair& on;
  Handle* handle;
};

in_c<rowe_struct_publisher> publisher_in(real_time& rt) {
  detail::queue_pair& on = pair_for(rt, detail::advertise_request<odometry>("/odom", {.depth = depth}));
  return {on, &rt.make<rowe_struct_publisher>(
                  rowe_struct_publisher{publisher<capi::raw_struct>{handle_of(on)}, sizeof(odometry)})};
}
in_c<rowe_struct_subscriber> subscriber_in(real_time& rt, keep kept = keep::all, rt::duration lease = {}) {
  detail::queue_pair& on = pair_for(
      rt, detail::subscribe_request<odometry>("/odom", {.keep = kept, .depth = depth, .lease = lease}));
  return {on, &rt.make<rowe_struct_subscriber>(
                  rowe_struct_subscriber{subscriber<capi::raw_struct>{handle_of(on)}, sizeof(odometry)})};
}
in_c<rowe_responder> text_responder_in(real_time& rt) {
  detail::queue_pair& on = pair_for(rt, detail::serve_request<json_text, json_text>("/add", service));
  return {on, &rt.make<rowe_responder>(rowe_responder{handle_of(on)})};
}
in_c<rowe_struct_responder> struct_responder_in(real_time& rt) {
  detail::queue_pair& on = pair_for(rt, detail::serve_request<odometry, odometry>("/add", service));
  return {on, &rt.make<rowe_struct_responder>(
                  rowe_struct_responder{handle_of(on), sizeof(odometry), sizeof(odometry)})};
}
in_c<rowe_caller> text_caller_in(real_time& rt) {
  detail::queue_pair& on = pair_for(rt, detail::client_request<json_text, json_text>("/add", service));
  return {on, &rt.make<rowe_caller>(rowe_caller{caller<json_text, json_text>{handle_of(on)}})};
}
in_c<rowe_struct_caller> struct_caller_in(real_time& rt) {
  detail::queue_pair& on = pair_for(rt, detail::client_request<odometry, odometry>("/add", service));
  return {on, &rt.make<rowe_struct_caller>(
                  rowe_struct_caller{handle_of(on), sizeof(odometry), sizeof(odometry)})};
}

// ---- topics

// `take(handle, into, arrival)` when something is there, nothing is, and with NULLs.
template <class Take>
void take_each(real_time& rt, in_c<rowe_struct_subscriber> from, Take take) {
  rt.calls([&](std::uint64_t i) {
    if (i % 3 != 0) decode(from.on);
    odometry into;
    rowe_arrival arrival;
    use(take(i % 5 == 0 ? nullptr : from.handle, i % 7 == 0 ? nullptr : &into,
             i % 2 == 0 ? nullptr : &arrival));
    if (i == 0) close(from.on);
    if (i % 100 == 50) set_audience(from.on, audience::somebody);
  });
}
template <class Take>
void take_by_the_clock(real_time& rt, Take take) {
  auto from = subscriber_in(rt);
  const rt::time_point far = rt::monotonic_clock::now() + std::chrono::hours{1};
  rt.calls([&](std::uint64_t) {
    decode(from.on, value, far);
    odometry into;
    use(take(from.handle, &into, nullptr));
  });
}

// ---- services

// `next(handle, request)`, `reply(handle, request)`: a request that is answered twice, refused by being
// released, or not there; from one who is there, gone, or has given up.
template <class Handle, class Next, class Reply>
void answer_each(real_time& rt, in_c<Handle> with, Next next, Reply reply) {
  rt.calls([&](std::uint64_t i) {
    if (i % 5 != 0) ask(with.on, i % 3 == 0 ? now + 1ns : rt::never, i % 3 == 1 ? somebody_gone : somebody);
    rowe_request request{};
    use(next(i % 11 == 0 ? nullptr : with.handle, request));
    if (i % 2 == 0) {
      use(reply(with.handle, request));
      use(reply(with.handle, request));
    }
    rowe_request_release(&request);
    rowe_request_release(&request);
    serve(with.on);
  });
}

int next_text(rowe_responder* of, rowe_request& into) { return rowe_responder_try_next(of, now_ns, &into); }
int reply_text(rowe_responder* of, rowe_request& to) {
  return rowe_responder_reply(of, &to, text.data(), text.size(), now_ns + 1);
}
int refuse_text(rowe_responder* of, rowe_request& to) {
  return rowe_responder_refuse(of, &to, "no", now_ns + 1);
}
int next_struct(rowe_struct_responder* of, rowe_request& into) {
  odometry asked;
  return rowe_struct_responder_try_next(of, now_ns, &asked, &into);
}
int reply_struct(rowe_struct_responder* of, rowe_request& to) {
  return rowe_struct_responder_reply(of, &to, &value, now_ns + 1);
}
int refuse_struct(rowe_struct_responder* of, rowe_request& to) {
  return rowe_struct_responder_refuse(of, &to, "no", now_ns + 1);
}

// The endpoint closes while a request is held.
template <class Handle, class Next, class Reply>
void answer_when_closed(real_time& rt, in_c<Handle> with, Next next, Reply reply) {
  rt.calls([&](std::uint64_t) {
    ask(with.on);
    rowe_request request{};
    use(next(with.handle, request));
    close(with.on);
    use(reply(with.handle, request));
    use(next(with.handle, request));
    rowe_request_release(&request);
    set_audience(with.on, audience::somebody);
    serve(with.on);
  });
}

void finish(rowe_caller* caller) {
  rowe_call_end end{};
  use(rowe_caller_try_finish(caller, &end));
  rowe_view_release(&end.reply);
}
void finish(rowe_struct_caller* caller) {
  odometry answer;
  rowe_struct_call_end end;
  use(rowe_struct_caller_try_finish(caller, &answer, &end));
}
int start(rowe_caller* caller, rowe_call& call) {
  return rowe_caller_start(caller, text.data(), text.size(), ttl_ms, now_ns, &call);
}
int start(rowe_struct_caller* caller, rowe_call& call) {
  return rowe_struct_caller_start(caller, &value, ttl_ms, now_ns, &call);
}

// Calls that end with an answer, with an error, or not yet; until all are in flight, and closed.
template <class Handle>
void call_each(real_time& rt, in_c<Handle> with) {
  rt.calls([&](std::uint64_t i) {
    rowe_call call{};
    use(start(i % 11 == 0 ? nullptr : with.handle, call));
    if (i % 3 == 0) serve(with.on, i % 2 == 0 ? status{} : status{errc::refused});
    if (i % 40 > 20) finish(with.handle);
    if (i % 40 > 20) finish(with.handle);
    if (i % 100 == 98) close(with.on);
    if (i % 100 == 99) set_audience(with.on, audience::somebody);
  });
}
template <class Handle, class Cancel>
void cancel_each(real_time& rt, in_c<Handle> with, Cancel cancel) {
  rt.calls([&](std::uint64_t i) {
    rowe_call call{};
    use(start(with.handle, call));
    if (i % 2 == 0) serve(with.on);
    cancel(i % 5 == 0 ? nullptr : with.handle, call);
    serve(with.on);
    finish(with.handle);
  });
}
template <class Handle, class Refusal>
void refusal_of(real_time& rt, in_c<Handle> with, Refusal refusal) {
  rt.calls([&](std::uint64_t) {
    rowe_call call{};
    use(start(with.handle, call));
    serve(with.on, errc::refused);
    finish(with.handle);
    use(refusal(with.handle));
  });
}

// ---- periods

rowe_periodic& loop_in(real_time& rt) { return rt.make<rowe_periodic>(1ms, rt::periodic_options{}); }

// Of each four commands one is in force, one is over, one is of a turn that is over, and one does not come.
void take_commands(real_time& rt) {
  auto from = subscriber_in(rt, keep::newest, std::chrono::milliseconds{300});
  rt.calls([&](std::uint64_t i) {
    if (i % 4 != 3) decode(from.on, {1, 2, 3, 4, 5}, i % 4 == 0 ? rt::never : rt::time_point{});
    from.on.turn.set(i % 4 == 2 ? 1 : 0);
    odometry into;
    use(rowe_struct_subscriber_latest_within(i % 9 == 0 ? nullptr : from.handle, now_ns, &into, nullptr));
  });
}

constexpr exercise list[] = {
    {"rowe_struct_subscriber_latest_within", "commands that are in force, and others", take_commands},
    {"rowe_struct_publisher_publish", "each slot in turn until full, without peers, closed, and NULLs",
     calls_on<publisher_in>([](auto& to, auto i) {
       use(rowe_struct_publisher_publish(i % 5 == 0 ? nullptr : to.handle, i % 7 == 0 ? nullptr : &value,
                                         now_ns));
       if (i % 200 == 0) serve(to.on);
       constexpr std::array states{audience::somebody, audience::nobody, audience::closed};
       if (i % 300 == 0) set_audience(to.on, states[i / 300 % 3]);
     })},
    {"rowe_struct_publisher_wanted", "with and without a publisher",
     calls_on<publisher_in>(
         [](auto& to, auto i) { return rowe_struct_publisher_wanted(i % 2 == 0 ? nullptr : to.handle); })},
    {"rowe_struct_subscriber_try_take", "every one",
     [](real_time& rt) { take_each(rt, subscriber_in(rt), rowe_struct_subscriber_try_take); }},
    {"rowe_struct_subscriber_try_take", "the newest",
     [](real_time& rt) { take_each(rt, subscriber_in(rt, keep::newest), rowe_struct_subscriber_try_take); }},
    {"rowe_struct_subscriber_try_take", "with times to live",
     [](real_time& rt) { take_by_the_clock(rt, rowe_struct_subscriber_try_take); }, true},
    {"rowe_struct_subscriber_latest", "every one",
     [](real_time& rt) { take_each(rt, subscriber_in(rt), rowe_struct_subscriber_latest); }},
    {"rowe_struct_subscriber_latest", "the newest",
     [](real_time& rt) { take_each(rt, subscriber_in(rt, keep::newest), rowe_struct_subscriber_latest); }},
    {"rowe_struct_subscriber_latest", "with times to live",
     [](real_time& rt) { take_by_the_clock(rt, rowe_struct_subscriber_latest); }, true},

    {"rowe_responder_try_next", "what is there, and when nothing is",
     [](real_time& rt) { answer_each(rt, text_responder_in(rt), next_text, reply_text); }},
    {"rowe_responder_try_next", "closed",
     [](real_time& rt) { answer_when_closed(rt, text_responder_in(rt), next_text, reply_text); }},
    {"rowe_responder_reply", "twice, to who is there, gone, or has given up",
     [](real_time& rt) { answer_each(rt, text_responder_in(rt), next_text, reply_text); }},
    {"rowe_responder_reply", "closed",
     [](real_time& rt) { answer_when_closed(rt, text_responder_in(rt), next_text, reply_text); }},
    {"rowe_responder_refuse", "twice, who is there, gone, or has given up",
     [](real_time& rt) { answer_each(rt, text_responder_in(rt), next_text, refuse_text); }},
    {"rowe_responder_refuse", "closed",
     [](real_time& rt) { answer_when_closed(rt, text_responder_in(rt), next_text, refuse_text); }},
    {"rowe_struct_responder_try_next", "what is there, and when nothing is",
     [](real_time& rt) { answer_each(rt, struct_responder_in(rt), next_struct, reply_struct); }},
    {"rowe_struct_responder_try_next", "closed",
     [](real_time& rt) { answer_when_closed(rt, struct_responder_in(rt), next_struct, reply_struct); }},
    {"rowe_struct_responder_reply", "twice, to who is there, gone, or has given up",
     [](real_time& rt) { answer_each(rt, struct_responder_in(rt), next_struct, reply_struct); }},
    {"rowe_struct_responder_refuse", "twice, who is there, gone, or has given up",
     [](real_time& rt) { answer_each(rt, struct_responder_in(rt), next_struct, refuse_struct); }},
    {"rowe_request_release", "of text: unanswered, answered, and none",
     [](real_time& rt) { answer_each(rt, text_responder_in(rt), next_text, reply_text); }},
    {"rowe_request_release", "of structs: unanswered, answered, and none",
     [](real_time& rt) { answer_each(rt, struct_responder_in(rt), next_struct, reply_struct); }},

    {"rowe_caller_start", "until all calls are in flight, and closed",
     [](real_time& rt) { call_each(rt, text_caller_in(rt)); }},
    {"rowe_caller_try_finish", "with answers, with errors, and when none has ended",
     [](real_time& rt) { call_each(rt, text_caller_in(rt)); }},
    {"rowe_caller_cancel", "calls in flight and ended",
     [](real_time& rt) { cancel_each(rt, text_caller_in(rt), rowe_caller_cancel); }},
    {"rowe_caller_refusal", "of each call",
     [](real_time& rt) { refusal_of(rt, text_caller_in(rt), rowe_caller_refusal); }},
    {"rowe_struct_caller_start", "until all calls are in flight, and closed",
     [](real_time& rt) { call_each(rt, struct_caller_in(rt)); }},
    {"rowe_struct_caller_try_finish", "with answers, with errors, and when none has ended",
     [](real_time& rt) { call_each(rt, struct_caller_in(rt)); }},
    {"rowe_struct_caller_cancel", "calls in flight and ended",
     [](real_time& rt) { cancel_each(rt, struct_caller_in(rt), rowe_struct_caller_cancel); }},
    {"rowe_struct_caller_refusal", "of each call",
     [](real_time& rt) { refusal_of(rt, struct_caller_in(rt), rowe_struct_caller_refusal); }},

    {"rowe_periodic_stop", "a loop, and none",
     calls_on<loop_in>([](auto& loop, auto i) { rowe_periodic_stop(i % 2 == 0 ? &loop : nullptr); })},
    {"rowe_periodic_cycles", "of a loop, and of none", calls_on<loop_in>([](auto& loop, auto i) {
       return rowe_periodic_cycles(i % 2 == 0 ? &loop : nullptr);
     })},
    {"rowe_periodic_overruns", "of a loop, and of none", calls_on<loop_in>([](auto& loop, auto i) {
       return rowe_periodic_overruns(i % 2 == 0 ? &loop : nullptr);
     })},
    {"rowe_periodic_next_ns", "of a loop, and of none", calls_on<loop_in>([](auto& loop, auto i) {
       return rowe_periodic_next_ns(i % 2 == 0 ? &loop : nullptr);
     })},
    {"rowe_periodic_lateness_ns", "of a loop that has waited, and of none",
     [](real_time& rt) {
       auto& loop = loop_in(rt);
       for (int i = 0; i < 3; ++i) use(rowe_periodic_wait(&loop, nullptr));
       rt.calls([&](std::uint64_t i) {
         use(rowe_periodic_lateness_ns(i % 9 == 0 ? nullptr : &loop, static_cast<double>(i % 103)));
       });
     }},
};

} // namespace

std::span<const exercise> exercises_of_structs_in_c() { return list; }

} // namespace rowe::contract
