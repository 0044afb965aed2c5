// SPDX-License-Identifier: Apache-2.0
// A server on a free port and a client that is connected to it.
#pragma once
#include "check.h"

#include <pthread.h>
#include <stdlib.h>

#include <rowe/loop.h>

static inline int64_t deadline_ns(void) { return rowe_now_ns() + timeout_ms * INT64_C(1000000); }

// Asks until something is there, or the time is over.
#define UNTIL_THERE(code, call)                                                                              \
  do {                                                                                                       \
    const int64_t until = deadline_ns();                                                                     \
    while (((code) = (call)) == rowe_error_empty && rowe_now_ns() < until) {                                 \
    }                                                                                                        \
  } while (0)

// What is to come: it must, in time.
#define SOON(call)                                                                                           \
  do {                                                                                                       \
    int came;                                                                                                \
    UNTIL_THERE(came, call);                                                                                 \
    CHECK_EQUAL(came, rowe_ok);                                                                              \
  } while (0)

static inline pthread_t start_thread(void* (*body)(void*), void* of) {
  pthread_t thread;
  CHECK(pthread_create(&thread, NULL, body, of) == 0);
  return thread;
}
static inline void join_thread(pthread_t thread) { CHECK(pthread_join(thread, NULL) == 0); }

static inline bool says(const struct rowe_view* view, const char* text) {
  return view->bytes == strlen(text) && memcmp(view->text, text, view->bytes) == 0;
}

struct pair {
  struct rowe_endpoint* server;
  struct rowe_endpoint* client;
};

static inline struct pair open_pair_with(const struct rowe_options* server_options,
                                         const struct rowe_options* client_options) {
  struct pair of;
  of.server = rowe_open_local_endpoint_with(0, server_options);
  CHECK(of.server != NULL);
  of.client = rowe_open_remote_endpoint_with("127.0.0.1", rowe_endpoint_port(of.server), client_options);
  CHECK(of.client != NULL);
  CHECK_EQUAL(rowe_wait_peer(of.client, timeout_ms), rowe_ok);
  CHECK_EQUAL(rowe_wait_peer(of.server, timeout_ms), rowe_ok);
  return of;
}
static inline struct pair open_pair(void) { return open_pair_with(NULL, NULL); }

static inline void close_pair(struct pair of) {
  rowe_endpoint_free(of.client);
  rowe_endpoint_free(of.server);
}

// One that is longer than messages may be: 5011 bytes as text.
static inline struct rowe_object* long_object(void) {
  char* const text = malloc(5001);
  memset(text, 'x', 5000);
  text[5000] = '\0';
  struct rowe_object* const object = rowe_message("text", rowe_type_string, text, NULL);
  free(text);
  return object;
}

static inline int64_t count_of(const struct rowe_endpoint* of, const char* name) {
  struct rowe_object* const counters = rowe_stats(of);
  int64_t value = -1;
  CHECK_EQUAL(rowe_object_get_int64(counters, name, &value), rowe_ok);
  rowe_object_free(counters);
  return value;
}

// Sends what the JSON text says.
static inline int send_text(const struct rowe_endpoint* by, const char* text, long ttl_ms) {
  struct rowe_object* const object = rowe_object_from_text(text);
  CHECK(object != NULL);
  const int code = rowe_send(by, object, ttl_ms);
  rowe_object_free(object);
  return code;
}
static inline struct rowe_object* invoke_text(const struct rowe_endpoint* by, const char* text,
                                              long timeout_ms) {
  struct rowe_object* const object = rowe_object_from_text(text);
  CHECK(object != NULL);
  struct rowe_object* const reply = rowe_invoke(by, object, timeout_ms);
  rowe_object_free(object);
  return reply;
}
