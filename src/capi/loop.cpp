// SPDX-License-Identifier: Apache-2.0
// The handles of C loops: opened, they lie on the heap, as C++ handles in C's structs.
#include <rowe/loop.h>

#include <utility>

#include "capi/endpoint.hpp"
#include "capi/error.hpp"
#include "capi/handle_options.hpp"
#include "capi/handles.hpp"
#include "capi/outside.hpp"
#include "capi/views.hpp"

using namespace rowe::capi;
using rowe::errc;

int64_t rowe_now_ns(void) { return rowe::rt::nanoseconds_of(rowe::rt::monotonic_clock::now()); }

void rowe_view_release(struct rowe_view* view) {
  if (!holds(view)) return;
  held(*view).~message_view();
  *view = {};
}

// ---- lanes

struct rowe_lane* rowe_lane_open(const struct rowe_endpoint* endpoint,
                                 const struct rowe_lane_options* options) {
  if (endpoint == nullptr) return no(errc::misuse);
  return opened<rowe_lane>(endpoint, options,
                           [](rowe::endpoint& on, const rowe::lane_options& o) { return on.open_lane(o); });
}
void rowe_lane_free(struct rowe_lane* lane) { delete lane; }

int rowe_lane_try_send(struct rowe_lane* lane, const char* text, size_t bytes, long ttl_ms, int64_t now_ns) {
  return rowe_lane_try_send_to(lane, {0, 0}, text, bytes, ttl_ms, now_ns);
}

int rowe_lane_try_send_to(struct rowe_lane* lane, struct rowe_peer peer, const char* text, size_t bytes,
                          long ttl_ms, int64_t now_ns) {
  if (lane == nullptr || text == nullptr) return rowe_error_misuse;
  return number_of(lane->inside.try_send(std::string_view{text, bytes}, duration_of(ttl_ms), time_of(now_ns),
                                         {peer.index, peer.generation}));
}

int rowe_lane_wait_room(struct rowe_lane* lane, struct rowe_peer peer, long timeout_ms) {
  if (lane == nullptr) return rowe_error_misuse;
  return number_of(lane->inside.wait_room(duration_of(timeout_ms), {peer.index, peer.generation}));
}

int rowe_lane_try_receive(struct rowe_lane* lane, int64_t now_ns, struct rowe_view* into) {
  if (lane == nullptr || into == nullptr) return rowe_error_misuse;
  return give(lane->inside.try_receive(time_of(now_ns)), into);
}

int rowe_lane_start(struct rowe_lane* lane, const char* text, size_t bytes, long timeout_ms, int64_t now_ns,
                    struct rowe_call* started) {
  if (lane == nullptr || text == nullptr || started == nullptr) return rowe_error_misuse;
  const auto call =
      lane->inside.start(std::string_view{text, bytes}, duration_of(timeout_ms), time_of(now_ns));
  if (!call) return number_of(call.code());
  *started = {call->index, call->generation};
  return rowe_ok;
}

int rowe_lane_try_finish(struct rowe_lane* lane, struct rowe_call_end* into) {
  if (lane == nullptr || into == nullptr) return rowe_error_misuse;
  auto end = lane->inside.try_finish();
  if (!end) return number_of(end.code());
  into->call = {end->id.index, end->id.generation};
  into->reply = {};
  into->outcome = give(std::move(end->reply), &into->reply);
  return rowe_ok;
}

void rowe_lane_cancel(struct rowe_lane* lane, struct rowe_call call) {
  if (lane != nullptr) lane->inside.cancel({call.index, call.generation});
}

int rowe_lane_try_reply(struct rowe_lane* lane, struct rowe_view* call, const char* text, size_t bytes,
                        int64_t now_ns) {
  if (lane == nullptr || text == nullptr || !holds(call) || !call->wants_reply) return rowe_error_misuse;
  const int code =
      number_of(lane->inside.try_reply(held(*call), std::string_view{text, bytes}, time_of(now_ns)));
  if (code == rowe_ok) call->wants_reply = false;
  return code;
}

int rowe_lane_try_refuse(struct rowe_lane* lane, struct rowe_view* call, const char* diagnostic,
                         int64_t now_ns) {
  if (lane == nullptr || diagnostic == nullptr || !holds(call) || !call->wants_reply)
    return rowe_error_misuse;
  const int code = number_of(lane->inside.try_refuse(held(*call), diagnostic, time_of(now_ns)));
  if (code == rowe_ok) call->wants_reply = false;
  return code;
}

// ---- topics

struct rowe_publisher* rowe_publisher_open(const struct rowe_endpoint* endpoint, const char* topic,
                                           const struct rowe_topic_options* options) {
  if (endpoint == nullptr || topic == nullptr) return no(errc::misuse);
  return opened<rowe_publisher>(endpoint, options, [&](rowe::endpoint& on, const rowe::topic_options& o) {
    return on.advertise<rowe::json_text>(topic, o);
  });
}
void rowe_publisher_free(struct rowe_publisher* publisher) { delete publisher; }

int rowe_publisher_publish(struct rowe_publisher* publisher, const char* text, size_t bytes, int64_t now_ns) {
  if (publisher == nullptr || text == nullptr) return rowe_error_misuse;
  return number_of(publisher->inside.publish(std::string_view{text, bytes}, time_of(now_ns)));
}

bool rowe_publisher_wanted(const struct rowe_publisher* publisher) {
  return publisher != nullptr && publisher->inside.wanted();
}

struct rowe_subscriber* rowe_subscriber_open(const struct rowe_endpoint* endpoint, const char* topic,
                                             const struct rowe_topic_options* options) {
  if (endpoint == nullptr || topic == nullptr) return no(errc::misuse);
  return opened<rowe_subscriber>(endpoint, options, [&](rowe::endpoint& on, const rowe::topic_options& o) {
    return on.subscribe<rowe::json_text>(topic, o);
  });
}
void rowe_subscriber_free(struct rowe_subscriber* subscriber) { delete subscriber; }

int rowe_subscriber_try_take(struct rowe_subscriber* subscriber, struct rowe_view* into) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.try_take(), into);
}

int rowe_subscriber_latest(struct rowe_subscriber* subscriber, struct rowe_view* into) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.latest(), into);
}

int rowe_subscriber_take(struct rowe_subscriber* subscriber, long timeout_ms, struct rowe_view* into) {
  if (subscriber == nullptr || into == nullptr) return rowe_error_misuse;
  return give(subscriber->inside.take(duration_of(timeout_ms)), into);
}

// ---- stop

struct rowe_stop_latch* rowe_stop_latch_open(const struct rowe_endpoint* endpoint,
                                             const struct rowe_latch_options* options) {
  if (endpoint == nullptr) return no(errc::misuse);
  return opened<rowe_stop_latch>(
      endpoint, options, [](rowe::endpoint& on, const rowe::latch_options& o) { return on.stop_latch(o); });
}
void rowe_stop_latch_free(struct rowe_stop_latch* latch) { delete latch; }

bool rowe_stop_engaged(struct rowe_stop_latch* latch, int64_t now_ns) {
  return latch == nullptr || latch->inside.engaged(time_of(now_ns));
}
void rowe_stop_acknowledge(struct rowe_stop_latch* latch, int64_t now_ns) {
  if (latch != nullptr) latch->inside.acknowledge(time_of(now_ns));
}

int rowe_emergency_stop(const struct rowe_endpoint* endpoint,
                        const struct rowe_emergency_stop_request* request, long timeout_ms,
                        struct rowe_emergency_stop_result* into) {
  if (endpoint == nullptr) return fail(errc::misuse);
  const auto given = whole(request);
  rowe::emergency_stop_request what; // still a stop if `given` cannot be read
  if (given && given->source != nullptr) what.source = given->source;
  if (given && given->reason != nullptr) what.reason = given->reason;
  const auto stopped = endpoint->inside->emergency_stop(what, duration_of(timeout_ms));
  if (!given) return fail(given.error());
  if (!stopped) return fail(stopped.error());
  if (into != nullptr) *into = {stopped->number, rowe::rt::nanoseconds_of(stopped->acknowledged)};
  return rowe_ok;
}

int rowe_reset_emergency_stop(const struct rowe_endpoint* endpoint,
                              const struct rowe_emergency_stop_reset_request* request, long timeout_ms,
                              struct rowe_emergency_stop_reset_result* into) {
  if (endpoint == nullptr) return fail(errc::misuse);
  const auto given = whole(request);
  if (!given) return fail(given.error());
  const auto moves =
      endpoint->inside->reset_emergency_stop({.number = given->number}, duration_of(timeout_ms));
  if (!moves) return fail(moves.error());
  if (into != nullptr) *into = {moves->number};
  return rowe_ok;
}
