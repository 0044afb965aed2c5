// SPDX-License-Identifier: Apache-2.0
// The paper's listings, as they are printed down to their tabs, compiled and run: a server and a client of
// it in one program. What is replaced to run them is the host, by the macro below.
#include "check.h"

#include <pthread.h>
#include <stdlib.h>

#include <rowe/paper.h>

static const char* here(const char* host) {
  CHECK_TEXT(host, "hop.inria.fr");
  return "127.0.0.1";
}
#define rowe_open_remote_endpoint(host, port) rowe_open_remote_endpoint(here(host), port)

// clang-format off
extern int rowe_send (const struct rowe_endpoint *endpoint,
		      const struct json_object *obj,
		      long ttl);

extern struct json_object *
rowe_invoke (const struct rowe_endpoint *endpoint,
	     struct json_object *obj, long timeout);

static const char printed_invocation[] = ""
"{"
"  \"service\": \"add-two-numbers\","
"  \"a\": 38,"
"  \"b\": 4"
"}";
// clang-format on

// The other side: adds numbers until it hears "enough".
static void* serve(void* of) {
  const struct rowe_endpoint* const endpoint = of;
  struct json_object* request;
  while ((request = rowe_receive(endpoint, timeout_ms)) != NULL) {
    const char* const service = rowe_object_get_string(request, "service");
    if (service == NULL) {
      CHECK_TEXT(rowe_object_get_string(request, "say"), "enough");
      json_object_put(request);
      break;
    }
    int a = 0, b = 0;
    CHECK_TEXT(service, "add-two-numbers");
    CHECK_EQUAL(rowe_object_get_int(request, "a", &a), rowe_ok);
    CHECK_EQUAL(rowe_object_get_int(request, "b", &b), rowe_ok);
    CHECK(rowe_object_get_string(request, "message_id") != NULL);
    struct json_object* const status = rowe_message("x", json_type_double, 0.5, NULL);
    CHECK_EQUAL(rowe_async_send(endpoint, status, timeout_ms), rowe_ok); // unrelated, before the reply
    struct json_object* const reply = rowe_message("result", json_type_int, a + b, NULL);
    CHECK_EQUAL(rowe_reply(endpoint, request, reply, timeout_ms), rowe_ok);
    json_object_put(status);
    json_object_put(reply);
    json_object_put(request);
  }
  return NULL;
}

int main(void) {
  // clang-format off
struct rowe_enpoint *endpoint;
endpoint = rowe_open_local_endpoint (8080);
  // clang-format on
  if (endpoint == NULL && rowe_last_error() == rowe_error_address_in_use) {
    fprintf(stderr, "port 8080 is in use by another program\n");
    return 77;
  }
  CHECK(endpoint != NULL);
  struct rowe_enpoint* const server = endpoint;
  // clang-format off
endpoint = rowe_open_remote_endpoint ("hop.inria.fr", 8080);
  // clang-format on
  CHECK(endpoint != NULL);
  pthread_t serving;
  CHECK(pthread_create(&serving, NULL, serve, server) == 0);

  // clang-format off
struct json_object *invocation;

invocation = rowe_message ("service",
			   json_type_string, "add-two-numbers",
			   "a", json_type_int, 38,
			   "b", json_type_int, 4, NULL);
  // clang-format on

  char* const built = rowe_object_to_text(invocation);
  struct json_object* const printed = rowe_object_from_text(printed_invocation);
  char* const shown = rowe_object_to_text(printed);
  CHECK_TEXT(built, shown);
  free(built);
  free(shown);

  struct json_object* const reply = rowe_invoke(endpoint, invocation, timeout_ms);
  int result = 0;
  CHECK_EQUAL(rowe_object_get_int(reply, "result", &result), rowe_ok);
  CHECK_EQUAL(result, 42);

  double x = 0;
  struct json_object* const status = rowe_receive(endpoint, timeout_ms); // it came before, and is still here
  CHECK_EQUAL(rowe_object_get_double(status, "x", &x), rowe_ok);
  CHECK(x == 0.5);

  struct json_object* const enough = rowe_message("say", json_type_string, "enough", NULL);
  CHECK_EQUAL(rowe_send(endpoint, enough, timeout_ms), rowe_ok);
  CHECK(pthread_join(serving, NULL) == 0);

  json_object_put(enough);
  json_object_put(status);
  json_object_put(reply);
  json_object_put(printed);
  json_object_put(invocation);
  rowe_endpoint_free(endpoint);
  rowe_endpoint_free(server);
  return failures != 0;
}
