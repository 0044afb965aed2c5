// SPDX-License-Identifier: Apache-2.0
// NULL where something must be: an error, never more.
#include "check.h"

#include <limits.h>
#include <stdint.h>

#include <rowe/loop.h>

static void endpoints(void) {
  struct rowe_object* const object = rowe_object_from_text("{}");
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_event event;
  const struct rowe_peer nobody = {0, 0};
  CHECK_NULL(rowe_open_remote_endpoint(NULL, 80), rowe_error_misuse);
  CHECK_EQUAL(rowe_endpoint_port(NULL), 0);
  CHECK_EQUAL(rowe_peers(NULL), 0);
  CHECK_CODE(rowe_wait_peer(NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_close(NULL, 0), rowe_error_misuse);
  rowe_endpoint_free(NULL);
  CHECK_CODE(rowe_send(NULL, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_send(endpoint, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_async_send(NULL, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_async_send(endpoint, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_send_to(NULL, nobody, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_wait_room(NULL, nobody, 0), rowe_error_misuse);
  CHECK_CODE(rowe_send_to(endpoint, nobody, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_async_send_to(NULL, nobody, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_async_send_to(endpoint, nobody, NULL, 0), rowe_error_misuse);
  CHECK_NULL(rowe_receive(NULL, 0), rowe_error_misuse);
  CHECK_EQUAL(rowe_object_sender(NULL).generation, 0);
  CHECK_NULL(rowe_invoke(NULL, object, 0), rowe_error_misuse);
  CHECK_NULL(rowe_invoke(endpoint, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_reply(NULL, object, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_reply(endpoint, NULL, object, 0), rowe_error_misuse);
  CHECK_CODE(rowe_reply(endpoint, object, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_async_reply(NULL, object, object), rowe_error_misuse);
  CHECK_CODE(rowe_async_reply(endpoint, NULL, object), rowe_error_misuse);
  CHECK_CODE(rowe_async_reply(endpoint, object, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_refuse(NULL, object, ""), rowe_error_misuse);
  CHECK_CODE(rowe_refuse(endpoint, NULL, ""), rowe_error_misuse);
  CHECK_CODE(rowe_refuse(endpoint, object, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_try_event(NULL, &event), rowe_error_misuse);
  CHECK_CODE(rowe_try_event(endpoint, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_stats(NULL), rowe_error_misuse);
  CHECK_CODE(rowe_emergency_stop(NULL, NULL, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_reset_emergency_stop(NULL, NULL, 0, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_lane_open(NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_publisher_open(NULL, "/x", NULL), rowe_error_misuse);
  CHECK_NULL(rowe_publisher_open(endpoint, NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_subscriber_open(NULL, "/x", NULL), rowe_error_misuse);
  CHECK_NULL(rowe_subscriber_open(endpoint, NULL, NULL), rowe_error_misuse);
  rowe_endpoint_free(endpoint);
  rowe_object_free(object);
}

static void objects(void) {
  struct rowe_object* const object = rowe_message("a", rowe_type_int, 1, "b", rowe_type_boolean, true, NULL);
  rowe_object_free(NULL);
  CHECK_NULL(rowe_object_from_text(NULL), rowe_error_misuse);
  CHECK_NULL(rowe_object_to_text(NULL), rowe_error_misuse);
  CHECK_CODE(rowe_object_append(NULL, rowe_type_int, 1), rowe_error_misuse);
  CHECK_CODE(rowe_object_set(NULL, "a", rowe_type_int, 1), rowe_error_misuse);
  CHECK_CODE(rowe_object_set(object, NULL, rowe_type_int, 1), rowe_error_misuse);
  CHECK_EQUAL(rowe_object_type_of(NULL), -1);
  CHECK_EQUAL(rowe_object_count(NULL), 0);
  CHECK_EQUAL(rowe_object_string_bytes(NULL), 0);
  CHECK_NULL(rowe_object_get(NULL, "a"), rowe_error_misuse);
  CHECK_NULL(rowe_object_get(object, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_object_at(NULL, 0), rowe_error_misuse);
  CHECK_NULL(rowe_object_key_at(NULL, 0), rowe_error_misuse);
  CHECK_NULL(rowe_object_get_string(NULL, "a"), rowe_error_misuse);
  CHECK_CODE(rowe_object_get_int(object, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_object_get_int64(object, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_object_get_double(object, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_object_get_boolean(object, "b", NULL), rowe_error_misuse);
  rowe_object_free(object);
}

// read() returns -1 for an error, and somebody hands it on as a size.
static void sizes_that_are_minus_one(void) {
  static char some[64] = "{\"a\":1}";
  const size_t wrong[] = {(size_t)-1, (size_t)-2, SIZE_MAX / 2 + 1, SIZE_MAX / 4 * 3};
  struct rowe_object* const object = rowe_object_from_text("{}");
  struct rowe_object* const array = rowe_object_from_text("[]");
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_lane* const lane = rowe_lane_open(endpoint, NULL);
  struct rowe_publisher* const publisher = rowe_publisher_open(endpoint, "/x", NULL);
  struct rowe_call call;
  int64_t number = 0;
  double real = 0;
  bool truth = false;
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    CHECK_NULL(rowe_message("data", rowe_type_bytes, some, wrong[i], NULL), rowe_error_out_of_range);
    CHECK_CODE(rowe_object_set(object, "a", rowe_type_bytes, some, wrong[i]), rowe_error_out_of_range);
    CHECK_CODE(rowe_object_append(array, rowe_type_bytes, some, wrong[i]), rowe_error_out_of_range);
    CHECK_CODE(rowe_lane_try_send(lane, some, wrong[i], 0, 0), rowe_error_too_big);
    CHECK_CODE(rowe_lane_start(lane, some, wrong[i], 0, 0, &call), rowe_error_too_big);
    CHECK(rowe_publisher_publish(publisher, some, wrong[i], 0) != rowe_ok); // nobody listens, too
    CHECK_CODE(rowe_read_int64(some, wrong[i], "a", &number), rowe_error_misuse);
    CHECK_CODE(rowe_read_double(some, wrong[i], "a", &real), rowe_error_misuse);
    CHECK_CODE(rowe_read_boolean(some, wrong[i], "a", &truth), rowe_error_misuse);
    CHECK_CODE(rowe_read_string(some, wrong[i], "a", some, 0), rowe_error_misuse);
    char written[64];
    CHECK_EQUAL(rowe_write(written, sizeof written, "a", rowe_type_bytes, some, wrong[i], NULL), 0);
  }
  CHECK_EQUAL(rowe_object_count(object), 0);
  CHECK_EQUAL(rowe_object_count(array), 0);
  rowe_publisher_free(publisher);
  rowe_lane_free(lane);
  rowe_endpoint_free(endpoint);
  rowe_object_free(array);
  rowe_object_free(object);
}

// Each time of an option, where what it stands for in nanoseconds has no room.
static void times_that_nothing_can_hold(void) {
  const long wrong[] = {LONG_MAX,     LONG_MIN, 18446744074209, -18446744074209, LONG_MAX / 1000 + 1,
                        9223372036855};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    const struct rowe_options each[] = {
        {.bytes = sizeof *each, .stop_guard_timeout_ms = wrong[i]},
        {.bytes = sizeof *each, .stop_tick_ms = wrong[i]},
        {.bytes = sizeof *each, .stop_service_timeout_ms = wrong[i]},
        {.bytes = sizeof *each, .stop_observe_timeout_ms = wrong[i]},
    };
    for (size_t k = 0; k < sizeof each / sizeof *each; ++k)
      CHECK_NULL(rowe_open_local_endpoint_with(0, &each[k]), rowe_error_bad_argument);
    struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
    const struct rowe_topic_options period = {.bytes = sizeof period, .period_us = wrong[i]};
    CHECK_NULL(rowe_publisher_open(endpoint, "/x", &period), rowe_error_bad_argument);
    const struct rowe_latch_options latch = {.bytes = sizeof latch, .loop_timeout_ms = wrong[i]};
    CHECK_NULL(rowe_stop_latch_open(endpoint, &latch), rowe_error_bad_argument);
    rowe_endpoint_free(endpoint);
  }
}

// A loop's time that no clock shows, for each call that takes one. What would overflow is found under the
// sanitizers.
static void times_of_no_clock(void) {
  const int64_t wrong[] = {INT64_MIN, INT64_MIN + 1, -1, INT64_MAX};
  const struct rowe_topic_options one_second = {.bytes = sizeof one_second, .ttl_ms = 1000};
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_lane* const lane = rowe_lane_open(endpoint, NULL);
  struct rowe_publisher* const publisher = rowe_publisher_open(endpoint, "/x", &one_second);
  struct rowe_stop_latch* const latch = rowe_stop_latch_open(endpoint, NULL);
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    const long ttl_ms[] = {LONG_MIN, 0, 1, LONG_MAX};
    struct rowe_view view = {0};
    struct rowe_call call;
    for (size_t k = 0; k < sizeof ttl_ms / sizeof *ttl_ms; ++k) {
      const int sent = rowe_lane_try_send(lane, "{}", 2, ttl_ms[k], wrong[i]);
      CHECK(sent == rowe_ok || sent == rowe_error_full);
      const int started = rowe_lane_start(lane, "{}", 2, ttl_ms[k], wrong[i], &call);
      CHECK(started == rowe_ok || started == rowe_error_full || started == rowe_error_too_many_calls);
    }
    CHECK_CODE(rowe_lane_try_receive(lane, wrong[i], &view), rowe_error_empty);
    CHECK_CODE(rowe_publisher_publish(publisher, "{}", 2, wrong[i]), rowe_error_no_peer);
    CHECK(rowe_stop_engaged(latch, wrong[i]));
    rowe_stop_acknowledge(latch, wrong[i]);
  }
  rowe_stop_latch_free(latch);
  rowe_publisher_free(publisher);
  rowe_lane_free(lane);
  rowe_endpoint_free(endpoint);
}

static void handles_of_loops(void) {
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_lane* const lane = rowe_lane_open(endpoint, NULL);
  struct rowe_publisher* const publisher = rowe_publisher_open(endpoint, "/x", NULL);
  struct rowe_subscriber* const subscriber = rowe_subscriber_open(endpoint, "/x", NULL);
  struct rowe_view view = {0};
  struct rowe_call call = {0, 0};
  struct rowe_call_end end;
  const struct rowe_peer nobody = {0, 0};
  rowe_view_release(NULL);
  rowe_view_release(&view);
  rowe_lane_free(NULL);
  rowe_publisher_free(NULL);
  rowe_subscriber_free(NULL);
  CHECK_CODE(rowe_lane_try_send(NULL, "{}", 2, 0, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_send(lane, NULL, 2, 0, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_send_to(NULL, nobody, "{}", 2, 0, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_wait_room(NULL, nobody, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_send_to(lane, nobody, NULL, 2, 0, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_receive(NULL, 0, &view), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_receive(lane, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_lane_start(NULL, "{}", 2, 0, 0, &call), rowe_error_misuse);
  CHECK_CODE(rowe_lane_start(lane, NULL, 2, 0, 0, &call), rowe_error_misuse);
  CHECK_CODE(rowe_lane_start(lane, "{}", 2, 0, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_finish(NULL, &end), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_finish(lane, NULL), rowe_error_misuse);
  rowe_lane_cancel(NULL, call);
  rowe_lane_cancel(lane, call);
  CHECK_CODE(rowe_lane_try_reply(NULL, &view, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_reply(lane, NULL, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_reply(lane, &view, "{}", 2, 0), rowe_error_misuse); // holds nothing
  CHECK_CODE(rowe_lane_try_reply(lane, &view, NULL, 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_refuse(NULL, &view, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_refuse(lane, NULL, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_refuse(lane, &view, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_publisher_publish(NULL, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_publisher_publish(publisher, NULL, 2, 0), rowe_error_misuse);
  CHECK(!rowe_publisher_wanted(NULL));
  CHECK_CODE(rowe_subscriber_try_take(NULL, &view), rowe_error_misuse);
  CHECK_CODE(rowe_subscriber_try_take(subscriber, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_subscriber_latest(NULL, &view), rowe_error_misuse);
  CHECK_CODE(rowe_subscriber_latest(subscriber, NULL), rowe_error_misuse);
  rowe_lane_free(lane);
  rowe_publisher_free(publisher);
  rowe_subscriber_free(subscriber);
  rowe_endpoint_free(endpoint);
}

static void text_in_place(void) {
  int64_t i;
  double d;
  bool b;
  char buffer[4];
  CHECK_CODE(rowe_read_int64(NULL, 2, "a", &i), rowe_error_misuse);
  CHECK_CODE(rowe_read_int64("{}", 2, NULL, &i), rowe_error_misuse);
  CHECK_CODE(rowe_read_int64("{}", 2, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_read_double(NULL, 2, "a", &d), rowe_error_misuse);
  CHECK_CODE(rowe_read_double("{}", 2, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_read_boolean(NULL, 2, "a", &b), rowe_error_misuse);
  CHECK_CODE(rowe_read_boolean("{}", 2, "a", NULL), rowe_error_misuse);
  CHECK_CODE(rowe_read_string(NULL, 2, "a", buffer, 4), rowe_error_misuse);
  CHECK_CODE(rowe_read_string("{}", 2, "a", NULL, 4), rowe_error_misuse);
}

int main(void) {
  endpoints();
  objects();
  sizes_that_are_minus_one();
  times_that_nothing_can_hold();
  times_of_no_clock();
  handles_of_loops();
  text_in_place();
  return failures != 0;
}
