// SPDX-License-Identifier: Apache-2.0
// Lanes: sending, receiving, calling and replying without waiting.
#include <rowe/lane.hpp>

#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr auto ttl = 20ms;
constexpr std::uint32_t calls_max = 16;

using talking = offered<rowe::lane>;

talking talk_in(real_time& rt) {
  return offer<rowe::lane>(
      rt, detail::talk_request(
              {.depth = depth, .inbox_depth = depth, .calls = calls_max, .text_bytes_max = text_bytes}));
}

rowe::lane& empty_in(real_time& rt) { return rt.make<rowe::lane>(); }

// A call that was received and is held.
struct held_call {
  talking with;
  result<message_view> call;
};
held_call call_in(real_time& rt, rt::time_point expires, connection by) {
  talking with = talk_in(rt);
  ask(with.on, expires, by);
  return {with, with.handle.try_receive(now)};
}
held_call call_by_somebody(real_time& rt) { return call_in(rt, rt::never, somebody); }
held_call call_by_one_gone(real_time& rt) { return call_in(rt, rt::never, somebody_gone); }
held_call late_call(real_time& rt) { return call_in(rt, now + 1ns, somebody); }

template <class Read>
void read_from_lanes(real_time& rt, Read read) {
  auto& talk = talk_in(rt).handle;
  auto& empty = empty_in(rt);
  rt.calls([&](std::uint64_t i) { use(read(i % 2 == 0 ? talk : empty)); });
}

template <class Call>
void closed_and_empty(real_time& rt, Call call) {
  auto with = talk_in(rt);
  close(with.on);
  auto& empty = empty_in(rt);
  rt.calls([&](std::uint64_t i) { use(call(i % 2 == 0 ? with.handle : empty)); });
}

constexpr exercise list[] = {
    {"lane::try_send", "each slot in turn until full", calls_on<talk_in>([](auto& with, auto i) {
       use(with.handle.try_send(text, ttl, now));
       if (i % 100 == 0) serve(with.on);
     })},
    {"lane::try_send", "a message that is built for it", calls_on<talk_in>([](auto& with, auto i) {
       use(with.handle.try_send(message{"n", i}, ttl, now));
       serve(with.on);
     })},
    {"lane::try_send", "texts of every length up to too big",
     [](real_time& rt) {
       auto [on, talk] = talk_in(rt);
       const auto many = rt.array<char>(4 * text_bytes);
       rt.calls([&, &on = on, &talk = talk](std::uint64_t i) {
         use(talk.try_send(std::string_view{many.data(), i % many.size()}, ttl, now));
         serve(on);
       });
     }},
    {"lane::try_send", "to a connection, and to one that is gone", calls_on<talk_in>([](auto& with, auto i) {
       use(with.handle.try_send(text, ttl, now, i % 2 == 0 ? somebody : somebody_gone));
       serve(with.on);
     })},
    {"lane::try_send", "to a closed endpoint, and by an empty handle",
     [](real_time& rt) { closed_and_empty(rt, [](auto& one) { return one.try_send(text, ttl, now); }); }},
    {"lane::try_send", "when nobody is there to have it",
     [](real_time& rt) {
       auto [on, talk] = talk_in(rt);
       on.audience.set(audience::nobody);
       rt.calls([&, &on = on, &talk = talk](std::uint64_t i) {
         use(talk.try_send(text, ttl, now));
         if (i % (2 * depth) == 0) serve(on);
       });
     }},
    {"lane::try_send", "for no time, for ever, and too late",
     [](real_time& rt) {
       auto [on, talk] = talk_in(rt);
       constexpr duration times[] = {duration{0}, rt::for_ever, -1s};
       rt.calls([&, &on = on, &talk = talk](std::uint64_t i) {
         use(talk.try_send(text, times[i % std::size(times)], now));
         serve(on);
       });
     }},
    {"lane::try_send", "reading the time", calls_on<talk_in>([](auto& with) {
       use(with.handle.try_send(text, ttl));
       serve(with.on);
     }),
     true},

    {"lane::try_receive", "when nothing has arrived",
     calls_on<talk_in>([](auto& with) { return with.handle.try_receive(now); })},
    {"lane::try_receive", "when something has", calls_on<talk_in>([](auto& with) {
       arrive(with.on);
       use(with.handle.try_receive(now));
     })},
    {"lane::try_receive", "when its inbox is full of what is out of date", calls_on<talk_in>([](auto& with) {
       for (std::uint32_t i = 0; i < depth; ++i) arrive(with.on, now);
       use(with.handle.try_receive(now));
     })},
    {"lane::try_receive", "from a closed endpoint, and by an empty handle",
     [](real_time& rt) { closed_and_empty(rt, [](auto& one) { return one.try_receive(now); }); }},
    {"lane::try_receive", "reading the time", calls_on<talk_in>([](auto& with) {
       arrive(with.on);
       use(with.handle.try_receive());
     }),
     true},

    {"lane::start", "until all calls are in flight", calls_on<talk_in>([](auto& with, auto i) {
       use(with.handle.start(text, ttl, now));
       if (i % (2 * calls_max) != 0) return;
       serve(with.on);
       while (with.handle.try_finish()) {
       }
     })},
    {"lane::start", "to one that is gone, and too big",
     [](real_time& rt) {
       auto& talk = talk_in(rt).handle;
       const auto many = rt.array<char>(4 * text_bytes);
       rt.calls([&](std::uint64_t i) {
         i % 2 == 0 ? use(talk.start(text, ttl, now, somebody_gone))
                    : use(talk.start(std::string_view{many.data(), many.size()}, ttl, now));
       });
     }},
    {"lane::start", "on a closed endpoint, and by an empty handle",
     [](real_time& rt) { closed_and_empty(rt, [](auto& one) { return one.start(text, ttl, now); }); }},
    {"lane::start", "when its queue is full of messages",
     [](real_time& rt) {
       auto& talk = talk_in(rt).handle;
       while (talk.try_send(text, ttl, now)) continue;
       rt.calls([&](std::uint64_t) { use(talk.start(text, ttl, now)); });
     }},
    {"lane::try_finish", "when none has ended",
     [](real_time& rt) {
       auto& talk = talk_in(rt).handle;
       use(talk.start(text, ttl, now));
       rt.calls([&](std::uint64_t) { use(talk.try_finish()); });
     }},
    {"lane::try_finish", "with replies and with errors", calls_on<talk_in>([](auto& with, auto i) {
       use(with.handle.start(text, ttl, now));
       serve(with.on, i % 2 == 0 ? status{} : status{errc::refused});
       use(with.handle.try_finish());
     })},
    {"lane::try_finish", "when all calls were cancelled", calls_on<talk_in>([](auto& with) {
       for (std::uint32_t i = 0; i < calls_max; ++i) with.handle.cancel(*with.handle.start(text, ttl, now));
       serve(with.on);
       use(with.handle.try_finish());
     })},
    {"lane::try_finish", "when completions were parked, of cancelled calls among them",
     calls_on<talk_in>([](auto& with) {
       call_id last;
       for (std::uint32_t i = 0; i < calls_max; ++i) {
         last = *with.handle.start(text, ttl, now);
         if (i % 2 == 0) with.handle.cancel(last);
       }
       serve(with.on);
       // As a call that waits for the last one would.
       if (const auto end = detail::take_completion_of(with.on, {last.index, last.generation}))
         detail::release_completion(with.on, *end);
       while (with.handle.try_finish()) {
       }
     })},
    {"lane::try_finish", "on a closed endpoint, and by an empty handle",
     [](real_time& rt) { closed_and_empty(rt, [](auto& one) { return one.try_finish(); }); }},
    {"lane::cancel", "calls in flight, ended and unheard of, and by an empty handle",
     [](real_time& rt) {
       auto& talk = talk_in(rt).handle;
       auto& empty = empty_in(rt);
       use(talk.start(text, ttl, now));
       rt.calls([&](std::uint64_t i) {
         (i % 5 == 0 ? empty : talk)
             .cancel({static_cast<std::uint32_t>(i % (2 * calls_max)), static_cast<std::uint32_t>(i % 4)});
       });
     }},
    {"lane::refusal", "with and without a queue pair",
     [](real_time& rt) { read_from_lanes(rt, [](auto& l) { return l.refusal().size(); }); }},

    {"lane::try_reply", "to a call", calls_on<call_by_somebody>([](auto& held, auto i) {
       use(held.with.handle.try_reply(*held.call, text, now));
       if (i % 100 == 0) serve(held.with.on); // full between
     })},
    {"lane::try_reply", "to who is gone", calls_on<call_by_one_gone>([](auto& held) {
       return held.with.handle.try_reply(*held.call, text, now);
     })},
    {"lane::try_reply", "to who has given up",
     calls_on<late_call>([](auto& held) { return held.with.handle.try_reply(*held.call, text, now + 1ns); })},
    {"lane::try_reply", "too big, to what is no call, by an empty handle, and on a closed endpoint",
     [](real_time& rt) {
       auto held = call_by_somebody(rt);
       arrive(held.with.on);
       const auto no_call = held.with.handle.try_receive(now);
       auto& empty = empty_in(rt);
       const auto many = rt.array<char>(4 * text_bytes);
       rt.calls([&](std::uint64_t i) {
         use(held.with.handle.try_reply(*held.call, std::string_view{many.data(), many.size()}, now));
         use(held.with.handle.try_reply(*no_call, text, now));
         use(empty.try_reply(*held.call, text, now));
         if (i == 50) close(held.with.on);
       });
     }},
    {"lane::try_refuse", "to who is gone", calls_on<call_by_one_gone>([](auto& held) {
       return held.with.handle.try_refuse(*held.call, "no", now);
     })},
    {"lane::try_refuse", "to who has given up, and on a closed endpoint",
     [](real_time& rt) {
       auto late = late_call(rt);
       auto held = call_by_somebody(rt);
       close(held.with.on);
       rt.calls([&](std::uint64_t) {
         use(late.with.handle.try_refuse(*late.call, "no", now + 1ns));
         use(held.with.handle.try_refuse(*held.call, "no", now));
       });
     }},
    {"lane::try_refuse", "to a call", calls_on<call_by_somebody>([](auto& held) {
       use(held.with.handle.try_refuse(*held.call, "no", now));
       serve(held.with.on);
     })},
    {"lane::try_refuse", "by an empty handle",
     [](real_time& rt) {
       auto held = call_by_somebody(rt);
       auto& empty = empty_in(rt);
       rt.calls([&](std::uint64_t) { use(empty.try_refuse(*held.call, "no", now)); });
     }},
    {"message_view::wants_reply", "of a call",
     calls_on<call_by_somebody>([](auto& held) { return held.call->wants_reply(); })},
    {"message_view::~message_view", "of a reply, which frees its call's place too",
     calls_on<talk_in>([](auto& with) {
       use(with.handle.start(text, ttl, now));
       serve(with.on);
       const auto ended = with.handle.try_finish();
       use(ended->reply->value().size());
     })},

    {"lane::sent", "with and without a queue pair",
     [](real_time& rt) { read_from_lanes(rt, [](auto& l) { return l.sent(); }); }},
    {"lane::dropped_full", "with and without a queue pair",
     [](real_time& rt) { read_from_lanes(rt, [](auto& l) { return l.dropped_full(); }); }},
    {"lane::dropped_too_big", "with and without a queue pair",
     [](real_time& rt) { read_from_lanes(rt, [](auto& l) { return l.dropped_too_big(); }); }},
    {"lane::expired", "with and without a queue pair",
     [](real_time& rt) { read_from_lanes(rt, [](auto& l) { return l.expired(); }); }},
};
} // namespace

std::span<const exercise> exercises_of_lanes() { return list; }

} // namespace rowe::contract
