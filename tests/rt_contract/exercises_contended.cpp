// SPDX-License-Identifier: Apache-2.0
// What two threads share, while the other side is at work on it at the same time. In the other exercises one
// thread plays both sides, which reaches every state, but none between two steps of the other.
#include <rowe/caller.hpp>
#include <rowe/lane.hpp>
#include <rowe/publisher.hpp>
#include <rowe/responder.hpp>
#include <rowe/rt/free_ring.hpp>
#include <rowe/rt/spsc_ring.hpp>
#include <rowe/rt/window.hpp>
#include <rowe/stop_latch.hpp>
#include <rowe/subscriber.hpp>

#include "capi/handles.hpp"
#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr std::size_t places = 64;

// ---- Rings and windows

using number_ring = rt::spsc_ring<std::uint64_t>;
using odometry_window = rt::window<odometry>;

number_ring& ring_in(real_time& rt) { return rt.make<number_ring>(rt.array<number_ring::entry>(places)); }
rt::free_ring<>& free_in(real_time& rt) {
  return rt.make<rt::free_ring<>>(rt.array<rt::free_ring<>::entry>(places),
                                  static_cast<std::uint32_t>(places));
}

template <class Take>
void take_from_a_ring(real_time& rt, Take take) {
  number_ring& ring = ring_in(rt);
  auto& in = *ring.take_producer();
  auto& out = *ring.take_consumer();
  rt.beside([&, next = std::uint64_t{0}]() mutable {
    while (in.try_push(next)) ++next;
  });
  rt.calls([&](std::uint64_t) { use(take(out)); });
}

// ---- Lanes, whose service thread is the other thread

constexpr lane_options talking{
    .depth = depth, .inbox_depth = depth, .calls = 16, .text_bytes_max = text_bytes};

// Whether anybody listens changes all the time, and in the end it closes.
struct changing_audience {
  detail::queue_pair& on;
  std::uint32_t turn = 0;

  void operator()() noexcept {
    constexpr audience all[] = {audience::somebody, audience::somebody, audience::nobody, audience::closed};
    set_audience(on, all[turn++ % std::size(all)]);
  }
};

void publish_beside(real_time& rt, keep kept, bool to_a_changing_audience) {
  auto [on, odom] = offer<publisher<odometry>>(
      rt, detail::advertise_request<odometry>("/odom", {.keep = kept, .depth = depth}));
  rt.beside([&on = on, change = changing_audience{on}, to_a_changing_audience]() mutable {
    serve(on);
    if (to_a_changing_audience) change();
  });
  rt.calls([&odom = odom](std::uint64_t i) { use(odom.publish({static_cast<double>(i), 1, 2, 3, 4}, now)); });
}

template <class Take>
void take_values_beside(real_time& rt, keep kept, Take take) {
  auto [on, seen] = offer<subscriber<odometry>>(
      rt, detail::subscribe_request<odometry>("/odom", {.keep = kept, .depth = depth}));
  rt.beside([&on = on, stamp = 0.0]() mutable {
    ++stamp;
    decode(on, {stamp, stamp, stamp, stamp, stamp});
  });
  rt.calls([&seen = seen, take](std::uint64_t) {
    if (const auto taken = take(seen)) use(taken->value().x);
  });
}

template <class Take>
void take_texts_beside(real_time& rt, Take take) {
  auto [on, seen] = offer<subscriber<json_text>>(
      rt, detail::subscribe_request<json_text>("/said", {.depth = depth, .text_bytes_max = text_bytes}));
  rt.beside([&on = on] { arrive(on); });
  rt.calls([&seen = seen, take](std::uint64_t) {
    if (const auto taken = take(seen)) use(taken->value().front());
  });
}

// The other thread asks, brings messages and ends calls; some of it is out of date.
template <class Cycle>
void talk_beside(real_time& rt, Cycle cycle) {
  auto with = offer<rowe::lane>(rt, detail::talk_request(talking));
  rt.beside([&on = with.on, turn = 0]() mutable {
    switch (turn++ % 4) {
    case 0: return arrive(on);
    case 1: return arrive(on, now);
    case 2: return ask(on);
    default: return serve(on, turn % 8 == 0 ? status{} : status{errc::peer_lost});
    }
  });
  rt.calls([&talk = with.handle, cycle](std::uint64_t i) { cycle(talk, i); });
}

void call_beside(real_time& rt) {
  auto with =
      offer<caller<odometry, odometry>>(rt, detail::client_request<odometry, odometry>("/add", service));
  rt.beside([&on = with.on, turn = 0]() mutable {
    serve(on, turn++ % 2 == 0 ? status{} : status{errc::timed_out});
  });
  rt.calls([&calls = with.handle](std::uint64_t i) {
    if (const auto begun = calls.start({1, 2, 3, 4, 5}, 50ms, now); begun && i % 3 == 0) calls.cancel(*begun);
    use(calls.try_finish());
  });
}

void answer_beside(real_time& rt, bool refused) {
  auto with =
      offer<responder<odometry, odometry>>(rt, detail::serve_request<odometry, odometry>("/add", service));
  rt.beside([&on = with.on, turn = 0]() mutable {
    ask(on, turn % 3 == 0 ? now : rt::never, turn % 5 == 0 ? somebody_gone : somebody);
    if (++turn % 4 == 0) serve(on);
  });
  rt.calls([&answers = with.handle, refused](std::uint64_t i) {
    auto asked = answers.try_next(now);
    if (!asked || i % 7 == 0) return; // dropped
    use(refused ? answers.refuse(*asked, "no", now) : answers.reply(*asked, asked->value(), now));
  });
}

// The other thread stops and resets, lets permits run out, and reads what the loop says.
template <class Look>
void stop_beside(real_time& rt, Look look) {
  auto& permit = rt.make<detail::permit_word<>>();
  auto with = offer<stop_latch>(rt, detail::latch_request({}));
  with.on.granted = &permit;
  rt.beside([&permit, &on = with.on, number = detail::latch_number{1}]() mutable {
    switch (number % 3) {
    case 0: permit.grant(number, rt::never); break;
    case 1: permit.grant(number, now - 1s); break; // a permit that has run out
    default: permit.withdraw(number); break;
    }
    use(on.latch.tripped());
    use(on.latch.acknowledged(now));
    ++number;
  });
  rt.calls([&latch = with.handle, look](std::uint64_t) { look(latch); });
}

constexpr exercise list[] = {
    {"ring_producer::try_push", "beside a consumer",
     [](real_time& rt) {
       number_ring& ring = ring_in(rt);
       auto& in = *ring.take_producer();
       auto& out = *ring.take_consumer();
       rt.beside([&] { use(out.try_pop()); });
       rt.calls([&](std::uint64_t i) { use(in.try_push(i)); });
     }},
    {"ring_consumer::try_pop", "beside a producer",
     [](real_time& rt) { take_from_a_ring(rt, [](auto& out) { return out.try_pop(); }); }},
    {"ring_consumer::drain", "beside a producer",
     [](real_time& rt) {
       take_from_a_ring(rt, [](auto& out) { return out.drain([](auto item) { use(item); }, places); });
     }},
    {"free_producer::release", "beside the owner",
     [](real_time& rt) {
       auto& numbers = free_in(rt);
       auto& out = rt.make<number_ring>(rt.array<number_ring::entry>(places));
       auto& owner = *numbers.take_consumer();
       auto& borrower = *numbers.take_producer();
       auto& lent = *out.take_producer();
       auto& borrowed = *out.take_consumer();
       rt.beside([&] {
         if (const auto number = owner.try_take()) use(lent.try_push(*number));
       });
       rt.calls([&](std::uint64_t) {
         if (const auto number = borrowed.try_pop()) borrower.release(static_cast<std::uint32_t>(*number));
       });
     }},
    {"free_consumer::try_take", "beside the borrower",
     [](real_time& rt) {
       auto& numbers = free_in(rt);
       auto& out = rt.make<number_ring>(rt.array<number_ring::entry>(places));
       auto& owner = *numbers.take_consumer();
       auto& borrower = *numbers.take_producer();
       auto& lent = *out.take_producer();
       auto& borrowed = *out.take_consumer();
       rt.beside([&] {
         if (const auto number = borrowed.try_pop()) borrower.release(static_cast<std::uint32_t>(*number));
       });
       rt.calls([&](std::uint64_t) {
         if (const auto number = owner.try_take()) use(lent.try_push(*number));
       });
     }},
    {"window_writer::write", "beside a reader",
     [](real_time& rt) {
       auto& window = rt.make<odometry_window>();
       auto& writer = *window.take_writer();
       auto& reader = *window.take_reader();
       rt.beside([&] {
         odometry value;
         use(reader.read(value));
       });
       rt.calls([&](std::uint64_t i) { writer.write({static_cast<double>(i), 1, 2, 3, 4}); });
     }},
    {"window_reader::read", "beside a writer",
     [](real_time& rt) {
       auto& window = rt.make<odometry_window>();
       auto& writer = *window.take_writer();
       auto& reader = *window.take_reader();
       rt.beside([&, stamp = 0.0]() mutable {
         ++stamp;
         writer.write({stamp, stamp, stamp, stamp, stamp});
       });
       rt.calls([&](std::uint64_t) {
         odometry value;
         use(reader.read(value));
       });
     }},
    {"core_writer::begin_write", "beside a reader",
     [](real_time& rt) {
       auto& core = rt.make<rt::window_core<>>();
       auto& writer = *core.take_writer();
       auto& reader = *core.take_reader();
       rt.beside([&] { use(reader.begin_read()); });
       rt.calls([&](std::uint64_t) { writer.end_write(writer.begin_write()); });
     }},
    {"core_reader::begin_read", "beside a writer",
     [](real_time& rt) {
       auto& core = rt.make<rt::window_core<>>();
       auto& writer = *core.take_writer();
       auto& reader = *core.take_reader();
       rt.beside([&] { writer.end_write(writer.begin_write()); });
       rt.calls([&](std::uint64_t) { use(reader.begin_read()); });
     }},

    {"publisher::publish", "beside a service thread that takes all",
     [](real_time& rt) { publish_beside(rt, keep::all, false); }},
    {"publisher::publish", "beside a service thread that takes the newest",
     [](real_time& rt) { publish_beside(rt, keep::newest, false); }},
    {"publisher::publish", "while listeners come and go, and it closes",
     [](real_time& rt) { publish_beside(rt, keep::all, true); }},
    {"publisher::publish", "the newest, while listeners come and go, and it closes",
     [](real_time& rt) { publish_beside(rt, keep::newest, true); }},
    {"subscriber::try_take", "of structs, beside a service thread that brings all",
     [](real_time& rt) { take_values_beside(rt, keep::all, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::try_take", "of structs, beside a service thread that brings the newest",
     [](real_time& rt) { take_values_beside(rt, keep::newest, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::latest", "of structs, beside a service thread",
     [](real_time& rt) { take_values_beside(rt, keep::all, [](auto& s) { return s.latest(); }); }},
    {"subscriber::try_take", "of texts, beside a service thread",
     [](real_time& rt) { take_texts_beside(rt, [](auto& s) { return s.try_take(); }); }},
    {"subscriber::latest", "of texts, beside a service thread",
     [](real_time& rt) { take_texts_beside(rt, [](auto& s) { return s.latest(); }); }},

    {"lane::try_send", "beside a service thread",
     [](real_time& rt) { talk_beside(rt, [](auto& talk, auto) { use(talk.try_send(text, 20ms, now)); }); }},
    {"lane::try_receive", "beside a service thread",
     [](real_time& rt) { talk_beside(rt, [](auto& talk, auto) { use(talk.try_receive(now)); }); }},
    {"lane::start", "and finish and cancel, beside a service thread",
     [](real_time& rt) {
       talk_beside(rt, [](auto& talk, auto i) {
         if (const auto begun = talk.start(text, 20ms, now); begun && i % 3 == 0) talk.cancel(*begun);
         use(talk.try_finish());
       });
     }},
    {"lane::try_reply", "and refuse, beside a service thread",
     [](real_time& rt) {
       talk_beside(rt, [](auto& talk, auto i) {
         auto call = talk.try_receive(now);
         if (!call) return;
         use(i % 2 == 0 ? talk.try_reply(*call, text, now) : talk.try_refuse(*call, "no", now));
       });
     }},
    {"caller::start", "and finish and cancel, beside a service thread", call_beside},
    {"responder::reply", "beside a service thread", [](real_time& rt) { answer_beside(rt, false); }},
    {"responder::refuse", "beside a service thread", [](real_time& rt) { answer_beside(rt, true); }},

    {"stop_latch::engaged", "beside a service thread that stops, resets and lets permits run out",
     [](real_time& rt) { stop_beside(rt, [](auto& latch) { use(latch.engaged(now)); }); }},
    {"stop_latch::acknowledge", "beside a service thread that stops, resets and lets permits run out",
     [](real_time& rt) {
       stop_beside(rt, [](auto& latch) {
         if (latch.engaged(now)) latch.acknowledge(now);
       });
     }},
};

} // namespace

std::span<const exercise> exercises_between_two_threads() { return list; }

} // namespace rowe::contract
