// SPDX-License-Identifier: Apache-2.0
// A robot in C, one thread and no callbacks: it says where it is ten times a second, adds two numbers for
// whoever asks, and, as a client, asks the same of its server: robot PORT | robot HOST PORT
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <rowe/loop.h>
#include <rowe/rowe.h>

static void answer(const struct rowe_endpoint* endpoint, const struct rowe_object* call) {
  const char* service = rowe_object_get_string(call, "service");
  int a, b;
  if (service == NULL || strcmp(service, "add-two-numbers") != 0) {
    rowe_refuse(endpoint, call, "this robot only adds two numbers");
  } else if (rowe_object_get_int(call, "a", &a) != rowe_ok || rowe_object_get_int(call, "b", &b) != rowe_ok) {
    rowe_refuse(endpoint, call, "a and b must be integers");
  } else {
    struct rowe_object* sum = rowe_message("result", rowe_type_int64, (int64_t)a + b, NULL);
    rowe_reply(endpoint, call, sum, 100); // within 100 ms, or whoever asked does without
    rowe_object_free(sum);
  }
}

static void ask(const struct rowe_endpoint* endpoint) {
  struct rowe_object* question = rowe_message("service", rowe_type_string, "add-two-numbers", //
                                              "a", rowe_type_int, 38, "b", rowe_type_int, 4, NULL);
  struct rowe_object* reply = rowe_invoke(endpoint, question, 1000);
  int sum = 0;
  if (reply == NULL || rowe_object_get_int(reply, "result", &sum) != rowe_ok) puts(rowe_last_error_text());
  if (sum != 0) printf("38 + 4 = %d\n", sum);
  rowe_object_free(reply);
  rowe_object_free(question);
}

int main(int count, char** arguments) {
  if (count != 2 && count != 3) return fputs("usage: robot PORT | robot HOST PORT\n", stderr), 2;
  struct rowe_endpoint* endpoint = count == 2 ? rowe_open_local_endpoint(atoi(arguments[1]))
                                              : rowe_open_remote_endpoint(arguments[1], atoi(arguments[2]));
  if (endpoint == NULL) return fprintf(stderr, "%s\n", rowe_last_error_text()), 1;
  if (count == 2) printf("listening on port %d\n", rowe_endpoint_port(endpoint));

  int64_t next_ns = rowe_now_ns();
  for (int step = 0;; ++step, next_ns += 100000000, fflush(stdout)) {
    struct rowe_object* status = rowe_message("x", rowe_type_double, 0.1 * step, NULL);
    rowe_async_send(endpoint, status, 100); // after 100 ms there is a newer one
    rowe_object_free(status);
    if (count == 3 && step % 10 == 0) ask(endpoint);
    for (int64_t left_ns; (left_ns = next_ns - rowe_now_ns()) > 0;) {
      struct rowe_object* message = rowe_receive(endpoint, (long)(left_ns / 1000000) + 1);
      double x;
      if (message == NULL) continue;
      if (rowe_object_get(message, "message_id") != NULL)
        answer(endpoint, message);
      else if (rowe_object_get_double(message, "x", &x) == rowe_ok)
        printf("the other one is at %.1f\n", x);
      rowe_object_free(message);
    }
  }
}
