// SPDX-License-Identifier: Apache-2.0
// What loops call in C, when the endpoint is closed, when nobody is there, when what waits is out of date,
// and with the service thread at work in another thread.
#include <rowe/loop.h>

#include "capi/handles.hpp"
#include "pairs.hpp"

namespace rowe::contract {
namespace {

constexpr std::int64_t now_ns = rt::nanoseconds_of(now);
constexpr long ttl_ms = 20;

// All handles of C, each with its queue pair.
struct all_handles {
  detail::permit_word<>& permit;
  detail::queue_pair& talks;
  detail::queue_pair& publishes;
  detail::queue_pair& subscribes;
  detail::queue_pair& stops;
  rowe_lane& lane;
  rowe_publisher& publisher;
  rowe_subscriber& subscriber;
  rowe_stop_latch& latch;

  explicit all_handles(real_time& rt)
      : permit{rt.make<detail::permit_word<>>()},
        talks{pair_for(
            rt, detail::talk_request(
                    {.depth = depth, .inbox_depth = depth, .calls = 8, .text_bytes_max = text_bytes}))},
        publishes{pair_for(
            rt, detail::advertise_request<json_text>("/x", {.depth = depth, .text_bytes_max = text_bytes}))},
        subscribes{pair_for(
            rt, detail::subscribe_request<json_text>("/x", {.depth = depth, .text_bytes_max = text_bytes}))},
        stops{pair_for(rt, detail::latch_request({}))},
        lane{rt.make<rowe_lane>(rowe_lane{rowe::lane{handle_of(talks)}})},
        publisher{rt.make<rowe_publisher>(rowe_publisher{rowe::publisher<json_text>{handle_of(publishes)}})},
        subscriber{
            rt.make<rowe_subscriber>(rowe_subscriber{rowe::subscriber<json_text>{handle_of(subscribes)}})},
        latch{(stops.granted = &permit,
               rt.make<rowe_stop_latch>(rowe_stop_latch{stop_latch{handle_of(stops)}}))} {}

  void become(audience listening) {
    for (detail::queue_pair* on : {&talks, &publishes, &subscribes, &stops}) set_audience(*on, listening);
  }
};

// `call(handles)`: in a closed endpoint; without peers; when all that waits is out of date; and beside
// another thread that brings, takes, stops and resets.
template <class Call>
void when_closed(real_time& rt, Call call) {
  all_handles all{rt};
  ask(all.talks);
  arrive(all.subscribes);
  all.become(audience::closed);
  rt.calls([&](std::uint64_t) { call(all); });
}
template <class Call>
void without_peers(real_time& rt, Call call) {
  all_handles all{rt};
  all.become(audience::nobody);
  rt.calls([&](std::uint64_t i) {
    call(all);
    if (i % (2 * depth) == 0) serve(all.talks);
  });
}
template <class Call>
void out_of_date(real_time& rt, Call call) {
  all_handles all{rt};
  rt.calls([&](std::uint64_t i) {
    all.permit.grant(static_cast<detail::latch_number>(i), now - 1s);
    for (int waiting = 0; waiting < 4; ++waiting) ask(all.talks, now);
    call(all);
    serve(all.talks, errc::expired);
    serve(all.publishes);
  });
}
template <class Call>
void beside_another_thread(real_time& rt, Call call) {
  all_handles all{rt};
  rt.beside([&, turn = std::uint64_t{0}]() mutable {
    const auto number = static_cast<detail::latch_number>(++turn);
    turn % 2 == 0 ? all.permit.grant(number, rt::never) : all.permit.withdraw(number);
    turn % 3 == 0 ? ask(all.talks) : arrive(all.talks, turn % 3 == 1 ? now : rt::never);
    arrive(all.subscribes);
    serve(all.talks, turn % 5 == 0 ? status{errc::peer_lost} : status{});
    serve(all.publishes);
  });
  rt.calls([&](std::uint64_t) { call(all); });
}

void send(all_handles& all) { use(rowe_lane_try_send(&all.lane, text.data(), text.size(), ttl_ms, now_ns)); }
void send_to(all_handles& all) {
  use(rowe_lane_try_send_to(&all.lane, {somebody.index, somebody.generation}, text.data(), text.size(), 0,
                            now_ns));
}
void receive(all_handles& all) {
  rowe_view view{};
  use(rowe_lane_try_receive(&all.lane, now_ns, &view));
  rowe_view_release(&view);
}
void start(all_handles& all) {
  rowe_call call{};
  if (rowe_lane_start(&all.lane, text.data(), text.size(), ttl_ms, now_ns, &call) == rowe_ok)
    rowe_lane_cancel(&all.lane, call);
}
void finish(all_handles& all) {
  rowe_call call{};
  rowe_call_end end{};
  use(rowe_lane_start(&all.lane, text.data(), text.size(), ttl_ms, now_ns, &call));
  use(rowe_lane_try_finish(&all.lane, &end));
  rowe_view_release(&end.reply);
}
void reply(all_handles& all) {
  rowe_view call{};
  use(rowe_lane_try_receive(&all.lane, now_ns - 1, &call));
  use(rowe_lane_try_reply(&all.lane, &call, text.data(), text.size(), now_ns));
  rowe_view_release(&call);
}
void refuse(all_handles& all) {
  rowe_view call{};
  use(rowe_lane_try_receive(&all.lane, now_ns - 1, &call));
  use(rowe_lane_try_refuse(&all.lane, &call, "no", now_ns));
  rowe_view_release(&call);
}
void publish(all_handles& all) {
  use(rowe_publisher_publish(&all.publisher, text.data(), text.size(), now_ns));
}
void take(all_handles& all) {
  rowe_view view{};
  use(rowe_subscriber_try_take(&all.subscriber, &view));
  rowe_view_release(&view);
}
void take_latest(all_handles& all) {
  rowe_view view{};
  use(rowe_subscriber_latest(&all.subscriber, &view));
  rowe_view_release(&view);
}
void look(all_handles& all) { use(rowe_stop_engaged(&all.latch, now_ns)); }
void acknowledge(all_handles& all) {
  use(rowe_stop_engaged(&all.latch, now_ns));
  rowe_stop_acknowledge(&all.latch, now_ns);
}

template <void (*Call)(all_handles&)>
constexpr auto closed_state = [](real_time& rt) { when_closed(rt, Call); };
template <void (*Call)(all_handles&)>
constexpr auto peerless_state = [](real_time& rt) { without_peers(rt, Call); };
template <void (*Call)(all_handles&)>
constexpr auto expired_state = [](real_time& rt) { out_of_date(rt, Call); };
template <void (*Call)(all_handles&)>
constexpr auto contended_state = [](real_time& rt) { beside_another_thread(rt, Call); };

constexpr const char* closed_endpoint = "in a closed endpoint";
constexpr const char* peerless = "without peers";
constexpr const char* expired = "when what waits is out of date";
constexpr const char* contended = "beside a service thread";

constexpr exercise list[] = {
    {"rowe_lane_try_send", closed_endpoint, closed_state<send>},
    {"rowe_lane_try_send", peerless, peerless_state<send>},
    {"rowe_lane_try_send", contended, contended_state<send>},
    {"rowe_lane_try_send_to", closed_endpoint, closed_state<send_to>},
    {"rowe_lane_try_send_to", contended, contended_state<send_to>},
    {"rowe_lane_try_receive", closed_endpoint, closed_state<receive>},
    {"rowe_lane_try_receive", peerless, peerless_state<receive>},
    {"rowe_lane_try_receive", expired, expired_state<receive>},
    {"rowe_lane_try_receive", contended, contended_state<receive>},
    {"rowe_lane_start", closed_endpoint, closed_state<start>},
    {"rowe_lane_start", peerless, peerless_state<start>},
    {"rowe_lane_start", contended, contended_state<start>},
    {"rowe_lane_try_finish", closed_endpoint, closed_state<finish>},
    {"rowe_lane_try_finish", expired, expired_state<finish>},
    {"rowe_lane_try_finish", contended, contended_state<finish>},
    {"rowe_lane_try_reply", closed_endpoint, closed_state<reply>},
    {"rowe_lane_try_reply", expired, expired_state<reply>},
    {"rowe_lane_try_reply", contended, contended_state<reply>},
    {"rowe_lane_try_refuse", closed_endpoint, closed_state<refuse>},
    {"rowe_lane_try_refuse", expired, expired_state<refuse>},
    {"rowe_lane_try_refuse", contended, contended_state<refuse>},
    {"rowe_publisher_publish", closed_endpoint, closed_state<publish>},
    {"rowe_publisher_publish", peerless, peerless_state<publish>},
    {"rowe_publisher_publish", contended, contended_state<publish>},
    {"rowe_subscriber_try_take", closed_endpoint, closed_state<take>},
    {"rowe_subscriber_try_take", contended, contended_state<take>},
    {"rowe_subscriber_latest", closed_endpoint, closed_state<take_latest>},
    {"rowe_subscriber_latest", contended, contended_state<take_latest>},
    {"rowe_stop_engaged", expired, expired_state<look>},
    {"rowe_stop_engaged", contended, contended_state<look>},
    {"rowe_stop_acknowledge", contended, contended_state<acknowledge>},
};

} // namespace

std::span<const exercise> exercises_of_c_in_trouble() { return list; }

} // namespace rowe::contract
