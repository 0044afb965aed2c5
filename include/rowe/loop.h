/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// rowe for C loops that must not wait: lanes, publishers and subscribers, made at set-up and used by one
// thread each, and JSON text read and written in place.
//
// - Functions marked ROWE_RT never wait, allocate, lock or enter the kernel, and end after a bounded number
//   of steps. They return rowe_ok or an error, and leave rowe_last_error() alone. Errors that all functions
//   of handles share: closed (the endpoint is), misuse (a NULL). The others are for set-up.
// - `now_ns` is the loop's time in nanoseconds, from rowe_now_ns(), best read once a cycle; a negative one is
//   0. Times to live and timeouts count from it; they are milliseconds, and a negative one is for ever.
// - Messages are JSON text: `text` of `bytes` bytes, which need not end in '\0'. They are copied.
// - Handles outlive their endpoint safely, and are freed by their own functions, after it or before.
#pragma once
#include <rowe/rowe.h>

#ifndef ROWE_RT
#define ROWE_RT // checked by tests/rt_contract
#endif

#ifdef __cplusplus
extern "C" {
#endif

// CLOCK_MONOTONIC.
ROWE_RT int64_t rowe_now_ns(void);

// ---- Arrivals

// A view of a message, call or reply in a slot of the handle that it was taken from. Release it with
// rowe_view_release(), on the handle's thread and before the handle is freed. Until then its slot is not free
// for what arrives. Do not copy it.
struct rowe_view {
  const char* text; // valid JSON: an object
  size_t bytes;
  int64_t arrived_ns;    // when its last byte was read
  struct rowe_peer from; // none: this process
  bool wants_reply;      // a call: answer it with rowe_lane_try_reply()
  void* reserved[4];
};

// Releases a view. A view that was released, or is all zeroes, is fine.
ROWE_RT void rowe_view_release(struct rowe_view* view);

// ---- Lanes: plain messages and calls

struct rowe_lane;

enum rowe_priority { rowe_priority_normal, rowe_priority_urgent, rowe_priority_bulk };

// Zeroes are the defaults; `bytes` as in rowe_options. Queues and texts of these sizes, 170 KiB with the
// defaults, are taken out of the option `handle_bytes` of rowe_options.
struct rowe_lane_options {
  size_t bytes;            // sizeof(struct rowe_lane_options)
  uint32_t depth;          // messages towards the service thread, 1 to 4096; 0: 16
  uint32_t inbox_depth;    // messages that wait to be taken, 1 to 4096; 0: 16
  uint32_t calls;          // in flight, 1 to 4096; 0: 8
  uint32_t text_bytes_max; // the longest message, either way; 0: 4096
  int priority;            // enum rowe_priority
  bool only_sends; // leave what arrives to others; else the oldest lane gets it, before rowe_receive()
};

// `options` may be NULL. Errors: bad_argument, too_many_handles, handle_memory, closed. Free with
// rowe_lane_free().
struct rowe_lane* rowe_lane_open(const struct rowe_endpoint* endpoint,
                                 const struct rowe_lane_options* options);
void rowe_lane_free(struct rowe_lane* lane); // NULL is fine

// Queues a message for every peer, or for one. Without a peer it waits for one until `ttl_ms` is over; 0 is
// now or never, negative for ever. The peer learns the rest from a member `ttl_ms`, which the text must
// not have. Errors: full, too_big; peer_lost (`peer` is gone).
ROWE_RT int rowe_lane_try_send(struct rowe_lane* lane, const char* text, size_t bytes, long ttl_ms,
                               int64_t now_ns);
ROWE_RT int rowe_lane_try_send_to(struct rowe_lane* lane, struct rowe_peer peer, const char* text,
                                  size_t bytes, long ttl_ms, int64_t now_ns);

// Waits until a message to `peer`, or to every peer for {0, 0}, would not be refused with `full`. Not for a
// loop: it enters the kernel. It leaves rowe_last_error() alone. Errors: timed_out, peer_lost.
int rowe_lane_wait_room(struct rowe_lane* lane, struct rowe_peer peer, long timeout_ms);

// Takes the oldest message or call that has not expired. Errors: empty, and then `into` is left alone. `into`
// must have no view that is not released yet.
ROWE_RT int rowe_lane_try_receive(struct rowe_lane* lane, int64_t now_ns, struct rowe_view* into);

// A call in flight. {0, 0} is none.
struct rowe_call {
  uint32_t index;
  uint32_t generation;
};

// How a call ended.
struct rowe_call_end {
  struct rowe_call call;
  int outcome;            // rowe_ok, or why there is no reply: as rowe_invoke()
  struct rowe_view reply; // where the outcome is rowe_ok: to be released
};

// Sends an invocation; rowe_lane_try_finish() takes its end. Errors: full, too_big, too_many_calls.
ROWE_RT int rowe_lane_start(struct rowe_lane* lane, const char* text, size_t bytes, long timeout_ms,
                            int64_t now_ns, struct rowe_call* started);

// The next call that has ended; each ends once. Errors: empty; `into` as in rowe_lane_try_receive().
ROWE_RT int rowe_lane_try_finish(struct rowe_lane* lane, struct rowe_call_end* into);

// Gives the call up: its end is not reported. Nothing happens to a call that has ended.
ROWE_RT void rowe_lane_cancel(struct rowe_lane* lane, struct rowe_call call);

// Answers a call that this lane received, once; `call` must still be released. Errors: full, too_big,
// peer_lost (the caller is gone), expired (the caller does not wait any more), misuse (no call of this lane,
// or answered already).
ROWE_RT int rowe_lane_try_reply(struct rowe_lane* lane, struct rowe_view* call, const char* text,
                                size_t bytes, int64_t now_ns);
// Refuses it, with a diagnostic of at most 192 bytes. Errors: the same.
ROWE_RT int rowe_lane_try_refuse(struct rowe_lane* lane, struct rowe_view* call, const char* diagnostic,
                                 int64_t now_ns);

// ---- Topics: what a page, roslib or `rowe echo` subscribes to and publishes

struct rowe_publisher;
struct rowe_subscriber;

// Zeroes are the defaults; `bytes` as in rowe_options.
struct rowe_topic_options {
  size_t bytes;            // sizeof(struct rowe_topic_options)
  long ttl_ms;             // what is older is neither sent nor taken; 0: no such limit
  bool newest;             // keep only the newest message, not `depth` of them
  uint32_t depth;          // messages between the two threads, 1 to 4096; 0: as many of `text_bytes_max` as
                           // 64 KiB hold, but 16 to 64
  int priority;            // enum rowe_priority
  bool latched;            // a late subscriber gets the last message
  const char* type;        // the type's name on the wire, such as "nav_msgs/Odometry"; NULL: none
  uint32_t text_bytes_max; // the longest message; 0: 4096
  long period_us;          // how often it is published, for rowe_idle_phase; 100 to 1 h; 0: not known
  bool shared;             // publishers: peers may publish on the topic, too. Else only those whose role
                           // spells its name (docs/network.md)
  int fill_missing;        // subscribers of rowe/struct.h: 1: what a message leaves out is 0. -1: a message
                           // that lacks what is not rowe_member_or_default is dropped. 0: as 1 where the
                           // topic's type is one of ROS's own, such as geometry_msgs/Twist, else as -1
  long lease_ms;           // subscribers of rowe/struct.h: how long a command is in force, for
                           // rowe_struct_subscriber_latest_within(); 20 to 10 000; 0: they are no commands
};

// `options` may be NULL. Errors: bad_argument (a topic's name that is empty or too long; an option out of its
// range), reserved_topic, too_many_handles, handle_memory, too_many_topics, type_conflict, closed.
struct rowe_publisher* rowe_publisher_open(const struct rowe_endpoint* endpoint, const char* topic,
                                           const struct rowe_topic_options* options);
void rowe_publisher_free(struct rowe_publisher* publisher); // NULL is fine

// Publishes one JSON object. Errors: no_peer (nobody listens: nothing was queued), full, too_big. Each is
// counted, so a loop may ignore them. What is no JSON is dropped by the service thread and counted.
ROWE_RT int rowe_publisher_publish(struct rowe_publisher* publisher, const char* text, size_t bytes,
                                   int64_t now_ns);
// Whether somebody listens at the moment.
ROWE_RT bool rowe_publisher_wanted(const struct rowe_publisher* publisher);

// A subscriber to what peers publish, and what this process publishes on the same endpoint. Errors: as
// rowe_publisher_open().
struct rowe_subscriber* rowe_subscriber_open(const struct rowe_endpoint* endpoint, const char* topic,
                                             const struct rowe_topic_options* options);
void rowe_subscriber_free(struct rowe_subscriber* subscriber); // NULL is fine

// Takes the oldest message whose time to live is not over, or the newest one; then older messages are
// released unread. Reads the clock if a message has a time to live. Errors: empty; `into` as in
// rowe_lane_try_receive().
ROWE_RT int rowe_subscriber_try_take(struct rowe_subscriber* subscriber, struct rowe_view* into);
ROWE_RT int rowe_subscriber_latest(struct rowe_subscriber* subscriber, struct rowe_view* into);

// Waits for the next message, at most `timeout_ms`. Not for a loop: it enters the kernel. It leaves
// rowe_last_error() alone. Errors: timed_out in place of empty.
int rowe_subscriber_take(struct rowe_subscriber* subscriber, long timeout_ms, struct rowe_view* into);

// ---- The stop: see docs/stop.md

struct rowe_stop_latch;

// Zeroes are the defaults; `bytes` as in rowe_options.
struct rowe_latch_options {
  size_t bytes;         // sizeof(struct rowe_latch_options)
  const char* name;     // reported; letters, digits and . _ : / -, at most 31; NULL: "loop"
  long loop_timeout_ms; // a loop that does not look for this long stops all loops, 1 to 10 000; 0: 100 if the
                        // thread that opens the latch has a real-time priority, else 500
};

// A latch for one loop: the endpoint has a stop from the first one on, and is stopped. `options` may be NULL.
// Errors: bad_argument, too_many_latches, too_many_handles, too_many_topics, closed.
struct rowe_stop_latch* rowe_stop_latch_open(const struct rowe_endpoint* endpoint,
                                             const struct rowe_latch_options* options);
// While loops may move it stops them all. NULL is fine.
void rowe_stop_latch_free(struct rowe_stop_latch* latch);

// True if the loop must not move: command the brake, then acknowledge. Call it once in each cycle. Also true
// for NULL, and after the endpoint was closed.
ROWE_RT bool rowe_stop_engaged(struct rowe_stop_latch* latch, int64_t now_ns);
// Says that the brake was commanded. Call it in each cycle that is engaged.
ROWE_RT void rowe_stop_acknowledge(struct rowe_stop_latch* latch, int64_t now_ns);

// Who stops, and why; zeroes are fine, `bytes` as in rowe_options. UTF-8; what is longer is cut between two
// characters.
struct rowe_emergency_stop_request {
  size_t bytes;       // sizeof(struct rowe_emergency_stop_request)
  const char* source; // reported to everyone; at most 63 bytes; NULL: "this process"
  const char* reason; // for the event; at most 192 bytes; NULL: none
};

// The stop that every loop has acknowledged.
struct rowe_emergency_stop_result {
  uint64_t number;         // as peers know it, above 0
  int64_t acknowledged_ns; // when the last loop did, as rowe_now_ns()
};

// For threads without a loop, any of them at the same time: stops all loops of this endpoint, as a peer does
// that calls /rowe/stop, and waits until they have acknowledged, at most `timeout_ms` and the option
// stop_observe_timeout_ms. Needs no free queue or call. `request` may be NULL, and so may `into`, which an
// error leaves alone. Not for a loop: it enters the kernel. Errors: no_service (there is no latch) and misuse
// (no endpoint), with which nothing is stopped; with all others the loops stand: timed_out (it is not known
// whether they have acknowledged), bad_argument (of `request->bytes`: its texts were not read), closed.
int rowe_emergency_stop(const struct rowe_endpoint* endpoint,
                        const struct rowe_emergency_stop_request* request, long timeout_ms,
                        struct rowe_emergency_stop_result* into);

// Which stop is to end; `bytes` as in rowe_options.
struct rowe_emergency_stop_reset_request {
  size_t bytes;    // sizeof(struct rowe_emergency_stop_reset_request)
  uint64_t number; // of rowe_emergency_stop_result, or as peers get it; 0: whichever there is
};

struct rowe_emergency_stop_reset_result {
  uint64_t number; // reported to peers while the loops may move
};

// Lets the loops go again, as a person at the robot would. Returns at once if they may move already, else
// waits until they have acknowledged, at most `timeout_ms`. `request` and `into` as above. Not for a loop.
// Errors: refused (a guard is missing, the stop is another one, or a stop was asked for meanwhile), timed_out
// (a loop does not look, or has not acknowledged), no_service (there is no latch), closed, bad_argument,
// misuse. With each the loops stand.
int rowe_reset_emergency_stop(const struct rowe_endpoint* endpoint,
                              const struct rowe_emergency_stop_reset_request* request, long timeout_ms,
                              struct rowe_emergency_stop_reset_result* into);

// ---- JSON text in place

// Writes an object with the given members into `buffer`. Members are given as in rowe_message(), but objects
// and arrays as `const char*`, their JSON text. A double that is not finite becomes null. Returns the text's
// bytes, without the '\0' that ends it; 0 if `buffer_bytes` are too few, or a type or a size is none.
ROWE_RT size_t rowe_write(char* buffer, size_t buffer_bytes, const char* key, ...);

// What stands at `path` in text that has arrived: "a", "pose.x", "ranges[3]". Names with '.' or '[' are
// written ['a.b']. Of members with the same name the first counts. Integers are exact; 3.0 is one. Errors:
// missing_member, wrong_type, out_of_range, bad_argument (the path is wrong), misuse; `into` and `buffer` are
// then left alone. too_long: a string and its '\0' need more than `buffer_bytes`; buffer then holds "".
ROWE_RT int rowe_read_int64(const char* text, size_t bytes, const char* path, int64_t* into);
ROWE_RT int rowe_read_double(const char* text, size_t bytes, const char* path, double* into);
ROWE_RT int rowe_read_boolean(const char* text, size_t bytes, const char* path, bool* into);
ROWE_RT int rowe_read_string(const char* text, size_t bytes, const char* path, char* buffer,
                             size_t buffer_bytes);

#ifdef __cplusplus
}
#endif
