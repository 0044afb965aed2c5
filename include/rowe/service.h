/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// Services by name in C: a responder answers the calls of one service, in a loop, whoever calls and by
// whatever codec; a caller calls one. Both are for JSON text, one object each way, or for structs by tables
// (rowe/struct.h).
//
//   struct rowe_request request = {0};
//   if (rowe_responder_try_next(mode, now_ns, &request) == rowe_ok)
//     rowe_responder_reply(mode, &request, "{}", 2, now_ns);
//
// Functions marked ROWE_RT and handles are as in rowe/loop.h. All functions on an open handle leave
// rowe_last_error() alone. Those that wait enter the kernel, and are not for a loop.
#pragma once
#include <rowe/struct.h>

#ifdef __cplusplus
extern "C" {
#endif

// Zeroes are the defaults; `bytes` as in rowe_options.
struct rowe_service_options {
  size_t bytes;   // sizeof(struct rowe_service_options)
  uint32_t depth; // responders: calls that wait to be taken; callers: in flight; 1 to 4096; 0: as many
                  // as 32 KiB hold, but 8 to 16
  uint32_t text_bytes_max; // of text: the longest request or answer; 0: 4096
  const char* type;        // the service's type on the wire; NULL: none
  bool replaces_own;       // responders: answer in place of the endpoint, which has a service of this name
                           // below /rosapi/ (docs/wire.md). Else such a name is refused
};

// ---- Responders

struct rowe_responder;
struct rowe_struct_responder;

// A call that waits for its answer. Answer it, refuse it, or release it, which refuses it too; on its
// responder's thread and before that is freed. Do not copy it.
struct rowe_request {
  const char* text; // the request: valid JSON, an object; until it is answered. NULL: of structs
  size_t bytes;
  int64_t arrived_ns;    // when the call's last byte was read
  int64_t expires_ns;    // when the caller gives up; INT64_MAX if it did not say
  struct rowe_peer from; // none: this process
  uint64_t reserved[24]; // all zeroes: there is no call
};

// Provides the service `name`; "x" and "/x" are the same. `options` may be NULL. For structs: a request that
// is not as the table says never comes here, but is refused with a diagnostic that says why. Errors:
// bad_argument (a name that is empty or too long; a depth; a table), reserved_topic, service_taken,
// too_many_services, too_many_handles, handle_memory, closed. Free with rowe_responder_free() or
// rowe_struct_responder_free(); NULL is fine there.
struct rowe_responder* rowe_responder_open(const struct rowe_endpoint* endpoint, const char* name,
                                           const struct rowe_service_options* options);
struct rowe_struct_responder* rowe_struct_responder_open(const struct rowe_endpoint* endpoint,
                                                         const char* name, const struct rowe_struct* request,
                                                         const struct rowe_struct* answer,
                                                         const struct rowe_service_options* options);
void rowe_responder_free(struct rowe_responder* responder);
void rowe_struct_responder_free(struct rowe_struct_responder* responder);

// Takes the oldest call whose caller has not given up; of structs, it copies the request into `value`.
// Errors: empty, full (no slot for its answer: more than `depth` requests are unanswered); `into` and `value`
// are then left alone. `into` must have no call that is not answered or released yet.
ROWE_RT int rowe_responder_try_next(struct rowe_responder* responder, int64_t now_ns,
                                    struct rowe_request* into);
ROWE_RT int rowe_struct_responder_try_next(struct rowe_struct_responder* responder, int64_t now_ns,
                                           void* value, struct rowe_request* into);
// The same; waits for a call, at most `timeout_ms`. Errors: timed_out in place of empty.
int rowe_responder_next(struct rowe_responder* responder, long timeout_ms, struct rowe_request* into);
int rowe_struct_responder_next(struct rowe_struct_responder* responder, long timeout_ms, void* value,
                               struct rowe_request* into);

// Answers it, with an object or a struct. Errors: peer_lost (the caller is gone), expired (it does not wait
// any more): there is nobody to answer, and the request has ended; misuse (there is no call, or it is another
// responder's), too_big (text): it can still be answered. Text that is no object is counted as `malformed`,
// and the call refused.
ROWE_RT int rowe_responder_reply(struct rowe_responder* responder, struct rowe_request* request,
                                 const char* text, size_t bytes, int64_t now_ns);
ROWE_RT int rowe_struct_responder_reply(struct rowe_struct_responder* responder, struct rowe_request* request,
                                        const void* answer, int64_t now_ns);
// Refuses it, with a diagnostic that is cut at 192 bytes. Errors: the same, but for too_big.
ROWE_RT int rowe_responder_refuse(struct rowe_responder* responder, struct rowe_request* request,
                                  const char* diagnostic, int64_t now_ns);
ROWE_RT int rowe_struct_responder_refuse(struct rowe_struct_responder* responder,
                                         struct rowe_request* request, const char* diagnostic,
                                         int64_t now_ns);

// Gives a request up. One that is not answered is refused: "the service did not answer". One that is, is all
// zeroes, or is NULL, is fine.
ROWE_RT void rowe_request_release(struct rowe_request* request);

// ---- Callers

struct rowe_caller;
struct rowe_struct_caller;

// A caller of the service `name`. Nobody needs to provide it yet: each call looks for the provider. `options`
// may be NULL. Errors: as rowe_responder_open(), but for service_taken and too_many_services. Free with
// rowe_caller_free() or rowe_struct_caller_free(); NULL is fine there.
struct rowe_caller* rowe_caller_open(const struct rowe_endpoint* endpoint, const char* name,
                                     const struct rowe_service_options* options);
struct rowe_struct_caller* rowe_struct_caller_open(const struct rowe_endpoint* endpoint, const char* name,
                                                   const struct rowe_struct* request,
                                                   const struct rowe_struct* answer,
                                                   const struct rowe_service_options* options);
void rowe_caller_free(struct rowe_caller* caller);
void rowe_struct_caller_free(struct rowe_struct_caller* caller);

// Calls without waiting: ..._try_finish() takes the end. Errors: full, too_many_calls (both: the option
// `depth`); too_big (text).
ROWE_RT int rowe_caller_start(struct rowe_caller* caller, const char* text, size_t bytes, long timeout_ms,
                              int64_t now_ns, struct rowe_call* started);
ROWE_RT int rowe_struct_caller_start(struct rowe_struct_caller* caller, const void* request, long timeout_ms,
                                     int64_t now_ns, struct rowe_call* started);

// How a call with structs ended.
struct rowe_struct_call_end {
  struct rowe_call call;
  int outcome; // rowe_ok: the answer was copied
};

// The next call that has ended; each ends once. Where its outcome is rowe_ok, the answer is `into->reply`, to
// be released, or was copied into `answer`. Other outcomes: timed_out; peer_lost (it left before it
// answered); no_service (nobody provides it; a program in C lets such calls wait for its rowe_receive()
// instead); refused (by the provider); too_big (the answer); malformed, not_an_object (the request, a text);
// missing_member, duplicate_member, wrong_type, out_of_range, too_long (the answer is not as its table says);
// closed. Errors: empty; `into` and `answer` are then left alone.
ROWE_RT int rowe_caller_try_finish(struct rowe_caller* caller, struct rowe_call_end* into);
ROWE_RT int rowe_struct_caller_try_finish(struct rowe_struct_caller* caller, void* answer,
                                          struct rowe_struct_call_end* into);

// Gives the call up: its end is not reported. Nothing happens to a call that has ended.
ROWE_RT void rowe_caller_cancel(struct rowe_caller* caller, struct rowe_call call);
ROWE_RT void rowe_struct_caller_cancel(struct rowe_struct_caller* caller, struct rowe_call call);

// Calls and waits for the answer, at most `timeout_ms`. A view is to be released. Errors: the outcomes above,
// and those of starting; `reply` and `answer` are then left alone.
int rowe_caller_call(struct rowe_caller* caller, const char* text, size_t bytes, long timeout_ms,
                     struct rowe_view* reply);
int rowe_struct_caller_call(struct rowe_struct_caller* caller, const void* request, long timeout_ms,
                            void* answer);

// The diagnostic of the last call that failed: the provider's own, or which member of the answer is wrong,
// and how. At most 192 bytes and '\0'; "" if there is none, and for NULL. Valid until the next one that
// fails.
ROWE_RT const char* rowe_caller_refusal(struct rowe_caller* caller);
ROWE_RT const char* rowe_struct_caller_refusal(struct rowe_struct_caller* caller);

#ifdef __cplusplus
}
#endif
