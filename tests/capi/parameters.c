// SPDX-License-Identifier: Apache-2.0
// Parameters in C: what a loop reads, and what a peer writes.
#include "pair.h"

#include <rowe/parameter.h>

static void a_parameter_is_set_by_its_program_and_by_a_peer(void) {
  const struct pair p = open_pair();
  struct rowe_parameter* const gain = rowe_parameter_double(p.server, "/gain", 0.5, 0, 2);
  struct rowe_parameter* const count = rowe_parameter_integer(p.server, "/count", 3, -4, 4);
  struct rowe_parameter* const on = rowe_parameter_bool(p.server, "/on", true);
  struct rowe_parameter* const frame = rowe_parameter_text(p.server, "/frame", "map");
  CHECK(gain != NULL && count != NULL && on != NULL && frame != NULL);
  CHECK(rowe_parameter_get_double(gain) == 0.5);
  CHECK_EQUAL(rowe_parameter_get_integer(count), 3);
  CHECK(rowe_parameter_get_bool(on));
  CHECK_TEXT(rowe_parameter_get_text(frame), "map");

  CHECK_CODE(rowe_parameter_set_double(gain, 2.5), rowe_error_out_of_range);
  CHECK_CODE(rowe_parameter_set_integer(count, 5), rowe_error_out_of_range);
  CHECK_CODE(rowe_parameter_set_double(count, 1), rowe_error_misuse);
  CHECK_CODE(rowe_parameter_set_bool(NULL, true), rowe_error_misuse);
  CHECK_EQUAL(rowe_parameter_set_integer(count, -4), rowe_ok);
  CHECK_EQUAL(rowe_parameter_set_bool(on, false), rowe_ok);
  CHECK_EQUAL(rowe_parameter_set_text(frame, "odom"), rowe_ok);
  CHECK_EQUAL(rowe_parameter_get_integer(count), -4);
  CHECK(!rowe_parameter_get_bool(on));
  CHECK_TEXT(rowe_parameter_get_text(frame), "odom");
  CHECK(rowe_parameter_get_double(count) == 0);
  CHECK_TEXT(rowe_parameter_get_text(NULL), "");

  struct rowe_object* const asks =
      rowe_object_from_text("{\"service\":\"/rosapi/set_param\",\"name\":\"/gain\",\"value\":\"1.25\"}");
  struct rowe_object* const reply = rowe_invoke(p.client, asks, timeout_ms);
  CHECK(reply != NULL);
  CHECK(rowe_parameter_get_double(gain) == 1.25);
  rowe_object_free(reply);
  rowe_object_free(asks);

  rowe_parameter_free(gain);
  rowe_parameter_free(count);
  rowe_parameter_free(on);
  close_pair(p);
  CHECK_CODE(rowe_parameter_set_text(frame, "base"), rowe_error_closed);
  CHECK_TEXT(rowe_parameter_get_text(frame), "odom");
  rowe_parameter_free(frame);
  rowe_parameter_free(NULL);
}

int main(void) {
  a_parameter_is_set_by_its_program_and_by_a_peer();
  return failures != 0;
}
