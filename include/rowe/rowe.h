/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// rowe for C: endpoints, messages and calls, for ordinary threads; what a real-time loop calls is in
// rowe/loop.h, rowe/struct.h, rowe/service.h and rowe/periodic.h. C11; nothing of C++ is included or needed
// to link (docs/c-api.md). The names and the order of arguments are the paper's; with rowe/paper.h its
// listings compile as they are printed.
//
// - Ownership has one rule: what a function is given stays the caller's, and what it returns without `const`
//   is the caller's, to be freed. Nothing that is sent, nested or replied to is consumed.
// - Functions that take an endpoint may be called by any thread, several at a time. An object belongs to one
//   thread at a time, or to many that only read it.
// - Times are milliseconds where a name ends in _ms. A negative time is for ever; 0 waits for nothing.
// - A function that returns int returns rowe_ok, which is 0, or an error. A function that returns a pointer
//   returns NULL for an error; rowe_last_error() says which. A NULL where none is allowed is
//   rowe_error_misuse.
// - Every function here may allocate and enter the kernel. Those that wait say for what.
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// ---- Errors

// number, name. The numbers stay; rowe/result.hpp has the diagnostics.
// clang-format off
#define ROWE_ERROR_CODES(X)                                                                                  \
  X(1, full)               /* the queue is full */                                                           \
  X(2, empty)              /* nothing has arrived yet */                                                     \
  X(3, no_peer)            /* nobody is listening */                                                         \
  X(4, closed)             /* the endpoint is closed */                                                      \
  X(5, timed_out)          /* nothing happened in time */                                                    \
  X(6, too_big)            /* longer than a limit */                                                         \
  X(7, malformed)          /* no JSON */                                                                     \
  X(8, too_deep)           /* JSON that nests deeper than a limit */                                         \
  X(9, bad_argument)       /* an argument out of its range */                                                \
  X(10, bad_url)           /* a host or path that makes no URL */                                            \
  X(11, bad_address)       /* an address on which it cannot listen */                                       \
  X(12, address_in_use)    /* a port that another program has */                                             \
  X(13, not_loopback)      /* listening beyond loopback needs `insecure` */                                  \
  X(14, too_many_handles)  /* handles_max are open */                                                        \
  X(15, too_many_topics)                                                                                     \
  X(16, handle_memory)     /* no memory left for the handle */                                               \
  X(17, reserved_topic)    /* the name is one of the endpoint's own */                                       \
  X(18, type_conflict)     /* the topic exists with another type */                                          \
  X(19, no_memory)                                                                                           \
  X(20, no_thread)         /* the service thread cannot be started */                                        \
  X(21, expired)           /* the time to live passed before it was sent */                                  \
  X(22, peer_lost)         /* the peer went away */                                                          \
  X(23, no_service)        /* nobody provides the service */                                                 \
  X(24, refused)           /* the service answered with an error */                                          \
  X(25, too_many_calls)                                                                                      \
  X(26, too_many_services)                                                                                   \
  X(27, service_taken)     /* the service is provided already */                                             \
  X(28, not_an_object)     /* a message must be one JSON object */                                           \
  X(29, reserved_member)   /* op, message_id and in_reply_to are rowe's */                                   \
  X(30, missing_member)    /* no member has this name, no element this index */                              \
  X(31, duplicate_member)  /* a name occurs twice */                                                         \
  X(32, wrong_type)        /* the value is of another type */                                                \
  X(33, out_of_range)      /* the number does not fit */                                                     \
  X(34, too_long)          /* the text does not fit its place */                                             \
  X(35, misuse)            /* a use that the function's comment forbids */                                   \
  X(36, too_many_latches)                                                                                    \
  X(37, bad_access)        /* roles that make no sense: of a file, bad_config */                             \
  X(38, bad_certificate)   /* a file that [tls] names is wrong */                                            \
  X(39, bad_config)        /* a file that makes no sense; the text says where */                             \
  X(40, bad_web)           /* a folder that cannot be served: of a file, bad_config */                       \
  X(41, parameter_taken)   /* a parameter of that name exists */                                             \
  X(42, too_many_parameters)                                                                                 \
  X(43, forked)            /* the endpoint is of the process that this one was forked from */                \
  X(44, not_utf8)          /* a name that is not UTF-8 */                                                    \
  X(45, control_character) /* a name with one of them */                                                     \
  X(46, too_many_leases)   /* topics with a lease_ms */                                                      \
  X(47, bad_recording)     /* a file that cannot be written or read */                                       \
  X(48, too_many_recordings)                                                                                 \
  X(49, bad_definition)    /* a type of ROS that cannot be read */                                           \
  X(50, bad_message)       /* bytes that are no message of ROS */
// clang-format on

enum rowe_error {
  rowe_ok = 0,
#define ROWE_ERROR_CODE(number, name) rowe_error_##name = number,
  ROWE_ERROR_CODES(ROWE_ERROR_CODE)
#undef ROWE_ERROR_CODE
};

// The diagnostic for an error, with N for the value and MAX for the limit it is about (TOTAL: what MAX is
// left of); static. Any number is fine: one that is no error says so.
const char* rowe_strerror(int error);

// The error of this thread's last failed call, and its diagnostic with the numbers filled in, which stays
// until the next failure. Success leaves both alone. Before the first failure: rowe_ok and "".
int rowe_last_error(void);
const char* rowe_last_error_text(void);

// The version of this interface. A program that was compiled with this header runs with every library that
// returns the same number.
#define ROWE_ABI_VERSION 0
int rowe_abi_version(void);

// ---- Endpoints: where we are reachable, or whom we try to reach

struct rowe_endpoint;
struct rowe_object; // a JSON value; see below

// What kind of peers an endpoint meets.
enum rowe_profile {
  rowe_profile_standard, // exactly RFC 6455
  rowe_profile_hop,      // Hop of 2015 and later
  rowe_profile_hop_2014, // Hop of May 2014
};

// How the library's thread waits for the next thing to do; docs/real-time.md compares the costs.
enum rowe_idle {
  rowe_idle_poll, // for sockets, but looks at handles every 250 us
  rowe_idle_spin, // never
  rowe_idle_wake, // until a handle wakes it, by a system call
  rowe_idle_phase // for sockets, and until topics with a `period_us` are due
};

// Zeroes are the defaults, so set `bytes` and what differs: {.bytes = sizeof(struct rowe_options), .name =
// "ang-01"}. Members are only ever added at the end; `bytes` says which ones the program knows.
struct rowe_options {
  size_t bytes;               // sizeof(struct rowe_options)
  const char* name;           // reported to peers; NULL: the host's name
  int profile;                // enum rowe_profile: what kind of WebSocket peers speak
  const char* address;        // to listen on, numeric; NULL: 127.0.0.1. Beyond loopback only with `insecure`
  bool insecure;              // whoever reaches the address may send, publish and call
  bool no_page;               // do not serve the page at /
  const char* path;           // of a remote endpoint's URL; NULL: "/". Hop's begin with /hop/
  bool only_when_spoken_to;   // send messages only to peers that spoke first, not to all unasked
  bool relay;                 // a hub: what one peer publishes reaches every peer that subscribed
  bool pin_service;           // pin the service thread to the core `service_cpu`
  int service_cpu;            // read only with `pin_service`, since 0 is a core, too
  int service_priority;       // its SCHED_FIFO priority; 0: an ordinary thread
  long inbound_ttl_ms;        // what arrived and was not received or answered in this time ends; 0: never
  uint32_t connections_max;   // peers at a time, the last two for the stop alone; 0: 40
  uint32_t message_bytes_max; // the longest message a peer may send, but for long ones of topics; 0: 60 KiB
  uint32_t door_slots;        // messages under way each way; 0: 32
  uint32_t door_slot_bytes;   // the longest message of this program, as text; 0: 4096
  size_t handle_bytes;        // memory of the handles of rowe/loop.h; 0: 8 MiB
  // Of the stop (rowe/loop.h):
  bool stop_unguarded;          // the robot may move without any guard; reported to everyone
  long stop_guard_timeout_ms;   // a guard that is silent for this long stops; 0: 500
  long stop_tick_ms;            // how often guards get the state; 0: 20
  long stop_service_timeout_ms; // loops stop when the service thread is silent for this long; 0: 50 if it was
                                // granted SCHED_FIFO, else 250
  long stop_observe_timeout_ms; // who asks for a stop is answered within it; 0: 50
  int idle;                     // enum rowe_idle
  // Of long messages (docs/long-messages.md): those of topics that are longer than `message_bytes_max`.
  uint32_t long_message_bytes_max; // the longest; 0: 1 MiB; no more than `message_bytes_max`: none is long
  uint32_t long_slots;             // of them on their way out at once, 4 or more; 0: 8
};

// Listens on `port` (0 to 65535; 0: any free one) of 127.0.0.1. Does not wait for peers. Errors:
// address_in_use, bad_address, not_loopback, bad_argument, no_memory, no_thread. End with
// rowe_endpoint_free().
struct rowe_endpoint* rowe_open_local_endpoint(int port);
struct rowe_endpoint* rowe_open_local_endpoint_with(int port, const struct rowe_options* options);

// Listens as a file of TOML says (docs/config.md), which also has roles and identities. What it does not say
// is as with zeroes in struct rowe_options. Errors: bad_config, with the first mistake, its file and line in
// rowe_last_error_text(); address_in_use, bad_address, no_memory, no_thread. End with rowe_endpoint_free().
struct rowe_endpoint* rowe_open_configured_endpoint(const char* path);

// Connects to `host` (a name or an address) and `port` (1 to 65535), and again whenever the connection is
// lost. Returns at once: messages that are sent earlier wait for the connection. Errors: bad_url,
// bad_argument, no_memory, no_thread. End with rowe_endpoint_free().
struct rowe_endpoint* rowe_open_remote_endpoint(const char* host, int port);
struct rowe_endpoint* rowe_open_remote_endpoint_with(const char* host, int port,
                                                     const struct rowe_options* options);

// The port listened on; 0 for a remote endpoint.
int rowe_endpoint_port(const struct rowe_endpoint* endpoint);

// How many peers are connected.
unsigned rowe_peers(const struct rowe_endpoint* endpoint);

// Waits until at least one peer is connected. Errors: timed_out, closed.
int rowe_wait_peer(const struct rowe_endpoint* endpoint, long timeout_ms);

// Waits until everything that was sent so far is written, at most `drain_ms`. Then closes the connections and
// stops the service thread. Other calls on this endpoint that wait, and all later ones, return
// rowe_error_closed. Errors: timed_out (something was not written in time; the endpoint is closed
// nevertheless).
int rowe_close(const struct rowe_endpoint* endpoint, long drain_ms);

// Closes without waiting, if that was not done, and frees. No other call on this endpoint may be under way or
// follow; objects and handles that came from it may live on, and must be freed as always. NULL is fine.
void rowe_endpoint_free(struct rowe_endpoint* endpoint);

// ---- Messages

// Sends `object`, a JSON object, to every peer, and waits until it was sent or discarded. If there is no
// peer, it waits `ttl_ms` for one; with 0 it is sent now or never, with a negative number it waits for ever.
// The peer learns what is left from a member `ttl_ms`, which the object must not have; Hop's programs get
// none. Errors: expired (it was discarded), closed, full, too_big, not_an_object, reserved_member.
int rowe_send(const struct rowe_endpoint* endpoint, const struct rowe_object* object, long ttl_ms);

// The same without waiting: counters (rowe_stats) say what became of the message. Errors: closed, full,
// too_big, not_an_object, reserved_member.
int rowe_async_send(const struct rowe_endpoint* endpoint, const struct rowe_object* object, long ttl_ms);

// Waits for the next message or invocation. An invocation is an object with a member "message_id"; answer it
// with rowe_reply(), or refuse it with rowe_refuse(). Errors: timed_out, closed. Free the object with
// rowe_object_free(). If an invocation is freed without an answer, its caller waits in vain.
struct rowe_object* rowe_receive(const struct rowe_endpoint* endpoint, long timeout_ms);

// One of the peers, as long as it stays connected; after a reconnection it is another one. {0, 0} is none.
// rowe_object_sender() says who sent a received object.
struct rowe_peer {
  uint32_t index;
  uint32_t generation;
};

// As rowe_send() and rowe_async_send(), to one peer. Also: peer_lost.
int rowe_send_to(const struct rowe_endpoint* endpoint, struct rowe_peer peer,
                 const struct rowe_object* object, long ttl_ms);
int rowe_async_send_to(const struct rowe_endpoint* endpoint, struct rowe_peer peer,
                       const struct rowe_object* object, long ttl_ms);

// Waits until a message to `peer`, or to every peer for {0, 0}, would not be refused with rowe_error_full;
// other threads may be faster. Errors: timed_out, peer_lost, closed.
int rowe_wait_room(const struct rowe_endpoint* endpoint, struct rowe_peer peer, long timeout_ms);

// ---- Calls

// Sends `object`, which names a service in its member "service", and waits for the reply, which is returned;
// other messages that arrive meanwhile are left for rowe_receive(). rowe adds the member "message_id" on the
// way; `object` itself stays as it is (it is not const because the paper's is not). Errors: timed_out,
// peer_lost (it went away before it replied), refused, no_service or no_peer (nobody to ask), closed, full,
// too_many_calls, too_big, not_an_object, reserved_member. Free the reply with rowe_object_free().
struct rowe_object* rowe_invoke(const struct rowe_endpoint* endpoint, struct rowe_object* object,
                                long timeout_ms);

// Answers `invocation`, which rowe_receive() returned, with `object`, to which rowe adds "in_reply_to"; waits
// until that was handed to the connection, at most `ttl_ms`. An invocation is answered once, and must also be
// freed; until either, it takes one of the options' `door_slots`. Errors: misuse (no invocation of this
// endpoint, or answered already), full, too_big: it can still be answered; peer_lost (the caller is gone),
// expired (the caller does not wait any more, or `ttl_ms` is over), closed, not_an_object, reserved_member:
// it cannot, and the caller got this error.
int rowe_reply(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
               const struct rowe_object* object, long ttl_ms);

// The same without waiting. If the value is no object, or has a reserved member, that is found later: it is
// counted, and the call is refused.
int rowe_async_reply(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
                     const struct rowe_object* object);

// Answers with an error instead: the caller's rowe_invoke() fails with rowe_error_refused, and its
// rowe_last_error_text() has `diagnostic` (cut at 192 bytes). Does not wait. Errors: as rowe_async_reply().
int rowe_refuse(const struct rowe_endpoint* endpoint, const struct rowe_object* invocation,
                const char* diagnostic);

// ---- Events

enum rowe_event_kind {
  rowe_event_peer_joined,
  rowe_event_peer_left,         // `what` says why
  rowe_event_refused_handshake, // a peer was refused before it became one; `remedy` says what would let it in
  rowe_event_cannot_connect,    // an attempt failed; it is repeated
  rowe_event_refused_request,   // a peer asked for something that was answered with an error
  rowe_event_status_from_peer,
  rowe_event_limit,   // something did not fit; `remedy` names the limit
  rowe_event_warning, // the endpoint works, but not as promised
  rowe_event_stop,    // loops were stopped, or let go by a reset
  rowe_event_denied,  // a peer asked for something that its role does not allow
};

// Texts end in '\0' and are cut at what fits.
struct rowe_event {
  enum rowe_event_kind kind;
  char peer[65];     // its address and port; "" where there is none
  char what[225];    // a diagnostic
  char remedy[193];  // what to change; "" where nothing can be
  char identity[65]; // as whom the peer came in; "" where it has no identity, or nobody knows
  bool lasting;      // cannot_connect: it fails the same way until somebody changes something, a token say
};

// The oldest event that was not taken yet. Never waits. Errors: empty.
int rowe_try_event(const struct rowe_endpoint* endpoint, struct rowe_event* into);

// All counters since the endpoint was opened (docs/limits.md), as an object of integers. Free it with
// rowe_object_free().
struct rowe_object* rowe_stats(const struct rowe_endpoint* endpoint);

// ---- Objects: JSON values. None of these functions waits. They do not concern endpoints, and so work before
// ---- one is opened and after it is closed.

enum rowe_type {
  rowe_type_null,
  rowe_type_boolean, // bool
  rowe_type_int,     // int
  rowe_type_int64,   // int64_t
  rowe_type_double,  // double
  rowe_type_string,  // const char*: UTF-8, ends in '\0'
  rowe_type_object,  // const struct rowe_object*: copied
  rowe_type_array,   // const struct rowe_object*: copied
  rowe_type_bytes,   // const void*, size_t: bytes, as a string in base64. No value is of this type
};

// An object with the given members, in this order. Each has a name, a type, and a value of the C type that is
// beside the type above (none for rowe_type_null). NULL ends the list. The name of the function is the
// paper's.
//
//   rowe_message("service", rowe_type_string, "add-two-numbers", "a", rowe_type_int, 38, NULL)
//
// A 64-bit value needs a cast or a variable of that type, as with printf. Errors: wrong_type (no type: often
// a name or value that was left out; or an object where an array was announced), misuse (a NULL value),
// duplicate_member, malformed (text that is no UTF-8), out_of_range (a double that is not finite), no_memory.
struct rowe_object* rowe_message(const char* key, ...);

// An empty array, to be filled with rowe_object_append(). Errors: no_memory.
struct rowe_object* rowe_object_new_array(void);
// Appends a value, given as in rowe_message(), to an array. Errors: as there; wrong_type also if `array` is
// none.
int rowe_object_append(struct rowe_object* array, int type, ...);
// Adds a member, given as in rowe_message(), to an object, or replaces the value of the member of that name.
// Errors: as there, except duplicate_member; wrong_type also if `object` is none.
int rowe_object_set(struct rowe_object* object, const char* key, int type, ...);

// A value from its JSON text. Of members with one name, the first is found. Errors: malformed, too_deep (more
// than 64 levels), no_memory.
struct rowe_object* rowe_object_from_text(const char* text);
// The value's JSON text, without white space; free it with free(). Numbers that were read are written as they
// were, doubles with the fewest digits that read back to the same value. Errors: no_memory.
char* rowe_object_to_text(const struct rowe_object* value);

// Frees an object that is the caller's. NULL is fine.
void rowe_object_free(struct rowe_object* object);

// The sender of an object that rowe_receive() returned; none for other objects, and for NULL.
struct rowe_peer rowe_object_sender(const struct rowe_object* received);

// The type of a value: one of enum rowe_type, or -1 for NULL. A number is rowe_type_int if it fits into an
// int, else rowe_type_int64 if it fits into that, else rowe_type_double.
int rowe_object_type_of(const struct rowe_object* value);

// The member of an object; the element of an array, or the member with this index, and its name; how many
// there are (0 for other values, and for NULL). The result is a part of `object`, valid until that is changed
// or freed. Errors: missing_member, wrong_type.
const struct rowe_object* rowe_object_get(const struct rowe_object* object, const char* key);
const struct rowe_object* rowe_object_at(const struct rowe_object* object, size_t index);
const char* rowe_object_key_at(const struct rowe_object* object, size_t index);
size_t rowe_object_count(const struct rowe_object* object);

// A value as what it is. Errors: wrong_type; out_of_range (an integer too large); `into` is then left alone.
// An integer is never made of a number with a fraction or an exponent; rowe_object_as_double() takes every
// number. The string is a part of the value. rowe_object_string_bytes() is its length, which matters if it
// contains '\0'; it is 0 for other values. A NULL value, as rowe_object_get() returns it, is missing_member.
const char* rowe_object_as_string(const struct rowe_object* value);
size_t rowe_object_string_bytes(const struct rowe_object* value);
int rowe_object_as_int(const struct rowe_object* value, int* into);
int rowe_object_as_int64(const struct rowe_object* value, int64_t* into);
int rowe_object_as_double(const struct rowe_object* value, double* into);
int rowe_object_as_boolean(const struct rowe_object* value, bool* into);
// Bytes: of a string in base64 with padding, or of an array of numbers from 0 to 255. Copies them to `into`,
// where there is room for `size`, and writes their number to `count` (which may be NULL). Errors:
// wrong_type; too_long; `into` may then have some of them.
int rowe_object_as_bytes(const struct rowe_object* value, void* into, size_t size, size_t* count);

// The same for an object's member. Errors: those of rowe_object_get(), too.
const char* rowe_object_get_string(const struct rowe_object* object, const char* key);
int rowe_object_get_int(const struct rowe_object* object, const char* key, int* into);
int rowe_object_get_int64(const struct rowe_object* object, const char* key, int64_t* into);
int rowe_object_get_double(const struct rowe_object* object, const char* key, double* into);
int rowe_object_get_boolean(const struct rowe_object* object, const char* key, bool* into);
int rowe_object_get_bytes(const struct rowe_object* object, const char* key, void* into, size_t size,
                          size_t* count);

#ifdef __cplusplus
}
#endif
