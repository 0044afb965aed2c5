// SPDX-License-Identifier: Apache-2.0
// What loops call in C. The C++ handles behind it are exercised by files of their own, in all their states.
#include <cmath>

#include <rowe/loop.h>

#include "capi/handles.hpp"
#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr std::int64_t now_ns = rt::nanoseconds_of(now);
constexpr long ttl_ms = 20;

// A handle and its queue pair.
template <class Handle>
struct in_c {
  detail::queue_pair& on;
  Handle* handle;
};

in_c<rowe_lane> talk_in(real_time& rt) {
  detail::queue_pair& on = pair_for(
      rt,
      detail::talk_request({.depth = depth, .inbox_depth = depth, .calls = 8, .text_bytes_max = text_bytes}));
  return {on, &rt.make<rowe_lane>(rowe_lane{rowe::lane{handle_of(on)}})};
}

in_c<rowe_publisher> publisher_in(real_time& rt) {
  detail::queue_pair& on = pair_for(
      rt,
      {.kind = detail::pair_kind::publish_text, .name = "/x", .out_depth = depth, .out_bytes = text_bytes});
  return {on, &rt.make<rowe_publisher>(rowe_publisher{publisher<json_text>{handle_of(on)}})};
}

in_c<rowe_subscriber> subscriber_in(real_time& rt) {
  detail::queue_pair& on = pair_for(
      rt, detail::subscribe_request<json_text>("/x", {.depth = depth, .text_bytes_max = text_bytes}));
  return {on, &rt.make<rowe_subscriber>(rowe_subscriber{subscriber<json_text>{handle_of(on)}})};
}

// `take(handle, view)` when something is there, nothing is, and with NULLs.
template <class Handle, class Take>
void take_views(real_time& rt, in_c<Handle> from, Take take) {
  rt.calls([&](std::uint64_t i) {
    if (i % 3 == 0) arrive(from.on);
    rowe_view view{};
    use(take(i % 5 == 0 ? nullptr : from.handle, i % 7 == 0 ? nullptr : &view));
    rowe_view_release(&view);
  });
}

// `answer(lane, call)` to a call, to one that is answered, and to none.
template <class Answer>
void answer_calls(real_time& rt, Answer answer) {
  auto with = talk_in(rt);
  rt.calls([&](std::uint64_t i) {
    rowe_view call{};
    if (i % 3 != 0) ask(with.on);
    use(rowe_lane_try_receive(with.handle, now_ns, &call));
    use(answer(with.handle, call));
    use(answer(with.handle, call));
    rowe_view_release(&call);
    if (i % 100 == 0) serve(with.on); // full between
  });
}

constexpr std::string_view object =
    R"({"i":-9223372036854775808,"h":9223372036854775808,"d":1.7976931348623157e308,"t":true,)"
    R"("s":"\u00e9\/x","z":null,"a":[1,[2,{"i":3}]]})";
constexpr const char* keys[] = {"i", "h", "d", "t", "s", "z", "a", "none"};

// `read(key)` of members of every type, and of one that is missing.
template <class Read>
void read_members(real_time& rt, Read read) {
  rt.calls([&](std::uint64_t i) { use(read(keys[i % std::size(keys)])); });
}

constexpr exercise list[] = {
    {"rowe_now_ns", "", [](real_time& rt) { rt.calls([](std::uint64_t) { use(rowe_now_ns()); }); }, true},
    {"rowe_view_release", "of views, of views released, and of none",
     calls_on<subscriber_in>([](auto& from, auto i) {
       if (i % 3 == 0) arrive(from.on);
       rowe_view view{};
       use(rowe_subscriber_try_take(from.handle, &view));
       rowe_view_release(&view);
       rowe_view_release(&view);
       rowe_view_release(nullptr);
     })},

    {"rowe_lane_try_send", "each slot in turn until full, too big, and without a lane",
     [](real_time& rt) {
       auto with = talk_in(rt);
       const auto many = rt.array<char>(2 * text_bytes);
       rt.calls([&](std::uint64_t i) {
         use(rowe_lane_try_send(i % 5 == 0 ? nullptr : with.handle, many.data(), i % many.size(), ttl_ms,
                                now_ns));
         if (i % 200 == 0) serve(with.on);
       });
     }},
    {"rowe_lane_try_send_to", "one who is there, and one who is gone",
     calls_on<talk_in>([](auto& with, auto i) {
       const connection to = i % 2 == 0 ? somebody : somebody_gone;
       use(rowe_lane_try_send_to(with.handle, {to.index, to.generation}, text.data(), text.size(), -1,
                                 now_ns));
       serve(with.on);
     })},
    {"rowe_lane_try_receive", "what is there, and when nothing is",
     [](real_time& rt) {
       take_views(rt, talk_in(rt),
                  [](rowe_lane* l, rowe_view* view) { return rowe_lane_try_receive(l, now_ns, view); });
     }},
    {"rowe_lane_start", "until all calls are in flight", calls_on<talk_in>([](auto& with, auto i) {
       rowe_call call;
       use(rowe_lane_start(with.handle, text.data(), text.size(), ttl_ms, now_ns, &call));
       if (i % 32 != 0) return;
       serve(with.on);
       rowe_call_end end;
       while (rowe_lane_try_finish(with.handle, &end) == rowe_ok) rowe_view_release(&end.reply);
     })},
    {"rowe_lane_try_finish", "with replies, with errors, and when none has ended",
     calls_on<talk_in>([](auto& with, auto i) {
       rowe_call call;
       rowe_call_end end{};
       if (i % 3 != 0) use(rowe_lane_start(with.handle, text.data(), text.size(), ttl_ms, now_ns, &call));
       serve(with.on, i % 2 == 0 ? status{} : status{errc::refused});
       use(rowe_lane_try_finish(with.handle, &end));
       rowe_view_release(&end.reply);
     })},
    {"rowe_lane_cancel", "calls in flight, ended and unheard of, and without a lane",
     [](real_time& rt) {
       auto with = talk_in(rt);
       rowe_call call;
       use(rowe_lane_start(with.handle, text.data(), text.size(), ttl_ms, now_ns, &call));
       rt.calls([&](std::uint64_t i) {
         rowe_lane_cancel(i % 5 == 0 ? nullptr : with.handle,
                          {static_cast<std::uint32_t>(i % 32), static_cast<std::uint32_t>(i % 4)});
       });
     }},
    {"rowe_lane_try_reply", "to a call, to one that is answered, to none, and when full",
     [](real_time& rt) {
       answer_calls(rt, [](rowe_lane* l, rowe_view& call) {
         return rowe_lane_try_reply(l, &call, text.data(), text.size(), now_ns);
       });
     }},
    {"rowe_lane_try_refuse", "a call, one that is answered, none, and when full",
     [](real_time& rt) {
       answer_calls(
           rt, [](rowe_lane* l, rowe_view& call) { return rowe_lane_try_refuse(l, &call, "no", now_ns); });
     }},

    {"rowe_publisher_publish", "each slot in turn until full, too big, and without a publisher",
     [](real_time& rt) {
       auto to = publisher_in(rt);
       const auto many = rt.array<char>(2 * text_bytes);
       rt.calls([&](std::uint64_t i) {
         use(rowe_publisher_publish(i % 5 == 0 ? nullptr : to.handle, many.data(), i % many.size(), now_ns));
         if (i % 200 == 0) serve(to.on);
       });
     }},
    {"rowe_publisher_wanted", "with and without a publisher", calls_on<publisher_in>([](auto& to, auto i) {
       return rowe_publisher_wanted(i % 2 == 0 ? nullptr : to.handle);
     })},
    {"rowe_subscriber_try_take", "what is there, and when nothing is",
     [](real_time& rt) { take_views(rt, subscriber_in(rt), rowe_subscriber_try_take); }},
    {"rowe_subscriber_latest", "what is there, and when nothing is",
     [](real_time& rt) { take_views(rt, subscriber_in(rt), rowe_subscriber_latest); }},

    {"rowe_stop_engaged", "running, stopped and reset in turn",
     [](real_time& rt) {
       auto& permit = rt.make<detail::permit_word<>>();
       detail::queue_pair& on = pair_for(rt, detail::latch_request({}));
       on.granted = &permit;
       auto& latch = rt.make<rowe_stop_latch>(stop_latch{handle_of(on)});
       rt.calls([&](std::uint64_t i) {
         const auto number = static_cast<detail::latch_number>(1 + i / 2 % 1000);
         i % 2 == 0 ? permit.grant(number, rt::never) : permit.withdraw(number);
         use(rowe_stop_engaged(&latch, rt::nanoseconds_of(now)));
       });
     }},
    {"rowe_stop_acknowledge", "each stop anew, and no latch",
     [](real_time& rt) {
       auto& permit = rt.make<detail::permit_word<>>();
       detail::queue_pair& on = pair_for(rt, detail::latch_request({}));
       on.granted = &permit;
       auto& latch = rt.make<rowe_stop_latch>(stop_latch{handle_of(on)});
       rt.calls([&](std::uint64_t i) {
         permit.withdraw(static_cast<detail::latch_number>(1 + i % 1000));
         use(rowe_stop_engaged(&latch, rt::nanoseconds_of(now)));
         rowe_stop_acknowledge(&latch, rt::nanoseconds_of(now));
         rowe_stop_acknowledge(nullptr, rt::nanoseconds_of(now));
       });
     }},

    {"rowe_write", "members of all types, until the room is too small, and of none",
     [](real_time& rt) {
       rt.calls_on(rt.array<char>(256), [](const auto& buffer, auto i) {
         return rowe_write(buffer.data(), buffer.size() - i % buffer.size(), "i", rowe_type_int,
                           static_cast<int>(i), "l", rowe_type_int64, static_cast<std::int64_t>(i) << 40, "d",
                           rowe_type_double, 1 / static_cast<double>(i), "nan", rowe_type_double,
                           std::nan(""), "t", rowe_type_boolean, true, "z", rowe_type_null, "s",
                           rowe_type_string, "caf\xc3\xa9 \"\n", "o", rowe_type_object, "{}",
                           i % 3 == 0 ? nullptr : "odd", 99, nullptr);
       });
     }},
    {"rowe_read_int64", "members of every type",
     [](real_time& rt) {
       read_members(rt, [](const char* key) {
         std::int64_t into;
         return rowe_read_int64(object.data(), object.size(), key, &into);
       });
     }},
    {"rowe_read_double", "members of every type",
     [](real_time& rt) {
       read_members(rt, [](const char* key) {
         double into;
         return rowe_read_double(object.data(), object.size(), key, &into);
       });
     }},
    {"rowe_read_boolean", "members of every type",
     [](real_time& rt) {
       read_members(rt, [](const char* key) {
         bool into;
         return rowe_read_boolean(object.data(), object.size(), key, &into);
       });
     }},
    {"rowe_read_string", "members of every type, with room enough and without",
     [](real_time& rt) {
       read_members(rt, [](const char* key) {
         char enough[8], short_by_one[4];
         use(rowe_read_string(object.data(), object.size(), key, short_by_one, sizeof short_by_one));
         return rowe_read_string(object.data(), object.size(), key, enough, sizeof enough);
       });
     }},
};

} // namespace

std::span<const exercise> exercises_of_c() { return list; }

} // namespace rowe::contract
