// SPDX-License-Identifier: Apache-2.0
// What loops call: lanes, publishers and subscribers; texts.c has JSON text in place, errors.c what full
// lanes say.
#include "pair.h"

#include <stdatomic.h>
#include <stdlib.h>

#include <rowe/loop.h>

static struct rowe_view receive(struct rowe_lane* lane) {
  struct rowe_view view = {0};
  SOON(rowe_lane_try_receive(lane, rowe_now_ns(), &view));
  return view;
}

static int try_send(struct rowe_lane* lane, const char* text) {
  return rowe_lane_try_send(lane, text, strlen(text), -1, rowe_now_ns());
}

static void lanes_talk_to_each_other(void) {
  const struct pair p = open_pair();
  struct rowe_lane* const ours = rowe_lane_open(p.server, NULL);
  struct rowe_lane* const theirs = rowe_lane_open(p.client, NULL);
  CHECK(ours != NULL && theirs != NULL);
  struct rowe_view view = {0};
  CHECK_CODE(rowe_lane_try_receive(ours, rowe_now_ns(), &view), rowe_error_empty);
  CHECK(view.text == NULL);

  const int64_t before = rowe_now_ns();
  CHECK_EQUAL(try_send(theirs, "{\"x\":1}"), rowe_ok);
  view = receive(ours);
  CHECK(says(&view, "{\"x\":1}"));
  CHECK(!view.wants_reply);
  CHECK(view.arrived_ns >= before && view.arrived_ns <= rowe_now_ns());
  CHECK(view.from.generation != 0);
  const struct rowe_peer peer = view.from;
  CHECK_CODE(rowe_lane_try_reply(ours, &view, "{}", 2, rowe_now_ns()), rowe_error_misuse);
  rowe_view_release(&view);
  rowe_view_release(&view);
  CHECK(view.text == NULL);

  CHECK_EQUAL(rowe_lane_try_send_to(ours, peer, "{\"x\":2}", 7, -1, rowe_now_ns()), rowe_ok);
  view = receive(theirs);
  CHECK(says(&view, "{\"x\":2}"));
  rowe_view_release(&view);

  rowe_lane_free(ours);
  rowe_lane_free(theirs);
  close_pair(p);
}

static void room_is_there_until_the_end(void) {
  const struct pair p = open_pair();
  struct rowe_lane* const theirs = rowe_lane_open(p.client, NULL);
  const struct rowe_peer everyone = {0, 0}, stranger = {0, 77};
  CHECK_CODE(rowe_lane_wait_room(theirs, everyone, 0), rowe_ok);
  CHECK_EQUAL(rowe_wait_room(p.client, everyone, 0), rowe_ok);
  CHECK_EQUAL(rowe_lane_wait_room(theirs, stranger, timeout_ms), rowe_error_peer_lost);
  CHECK_EQUAL(rowe_wait_room(p.client, stranger, timeout_ms), rowe_error_peer_lost);
  CHECK_EQUAL(rowe_close(p.client, 0), rowe_ok);
  CHECK_CODE(rowe_lane_wait_room(theirs, everyone, timeout_ms), rowe_error_closed);
  CHECK_EQUAL(rowe_wait_room(p.client, everyone, timeout_ms), rowe_error_closed);
  rowe_lane_free(theirs);
  close_pair(p);
}

static void a_loop_answers_calls(void) {
  const struct pair p = open_pair();
  struct rowe_lane* const robot = rowe_lane_open(p.server, NULL);
  struct rowe_lane* const page = rowe_lane_open(p.client, NULL);
  const char* const question = "{\"service\":\"add-two-numbers\",\"a\":38,\"b\":4}";
  struct rowe_call call = {0, 0};
  CHECK_EQUAL(rowe_lane_start(page, question, strlen(question), timeout_ms, rowe_now_ns(), &call), rowe_ok);
  CHECK(call.generation != 0);
  struct rowe_view asked = receive(robot);
  CHECK(asked.wants_reply);
  char service[32], reply[64];
  int64_t a = 0, b = 0;
  CHECK_EQUAL(rowe_read_string(asked.text, asked.bytes, "service", service, sizeof service), rowe_ok);
  CHECK_TEXT(service, "add-two-numbers");
  CHECK_EQUAL(rowe_read_int64(asked.text, asked.bytes, "a", &a), rowe_ok);
  CHECK_EQUAL(rowe_read_int64(asked.text, asked.bytes, "b", &b), rowe_ok);
  const size_t bytes = rowe_write(reply, sizeof reply, "result", rowe_type_int64, a + b, NULL);
  CHECK_EQUAL(rowe_lane_try_reply(robot, &asked, reply, bytes, rowe_now_ns()), rowe_ok);
  CHECK_CODE(rowe_lane_try_reply(robot, &asked, reply, bytes, rowe_now_ns()), rowe_error_misuse);
  CHECK_CODE(rowe_lane_try_refuse(robot, &asked, "no", rowe_now_ns()), rowe_error_misuse);
  rowe_view_release(&asked);

  struct rowe_call_end end;
  SOON(rowe_lane_try_finish(page, &end));
  CHECK_EQUAL(end.outcome, rowe_ok);
  CHECK(end.call.index == call.index && end.call.generation == call.generation);
  int64_t result = 0;
  CHECK_EQUAL(rowe_read_int64(end.reply.text, end.reply.bytes, "result", &result), rowe_ok);
  CHECK_EQUAL(result, 42);
  rowe_view_release(&end.reply);
  CHECK_CODE(rowe_lane_try_finish(page, &end), rowe_error_empty);

  // Refused, not wanted any more, and out of time.
  CHECK_EQUAL(rowe_lane_start(page, question, strlen(question), timeout_ms, rowe_now_ns(), &call), rowe_ok);
  asked = receive(robot);
  CHECK_EQUAL(rowe_lane_try_refuse(robot, &asked, "not now", rowe_now_ns()), rowe_ok);
  rowe_view_release(&asked);
  SOON(rowe_lane_try_finish(page, &end));
  CHECK_EQUAL(end.outcome, rowe_error_refused);
  rowe_view_release(&end.reply); // nothing is in it

  CHECK_EQUAL(rowe_lane_start(page, question, strlen(question), timeout_ms, rowe_now_ns(), &call), rowe_ok);
  rowe_lane_cancel(page, call);
  asked = receive(robot);
  CHECK_EQUAL(rowe_lane_try_reply(robot, &asked, "{}", 2, rowe_now_ns()), rowe_ok);
  rowe_view_release(&asked);
  CHECK_EQUAL(rowe_lane_start(page, question, strlen(question), timeout_ms, rowe_now_ns(), &call), rowe_ok);
  asked = receive(robot);
  CHECK_EQUAL(rowe_lane_try_reply(robot, &asked, "{\"last\":true}", 13, rowe_now_ns()), rowe_ok);
  rowe_view_release(&asked);
  SOON(rowe_lane_try_finish(page, &end));
  CHECK(end.call.index == call.index && end.call.generation == call.generation); // not the cancelled one
  rowe_view_release(&end.reply);

  CHECK_EQUAL(rowe_lane_start(page, question, strlen(question), 20, rowe_now_ns(), &call), rowe_ok);
  SOON(rowe_lane_try_finish(page, &end));
  CHECK_EQUAL(end.outcome, rowe_error_timed_out);
  rowe_lane_free(page);
  rowe_lane_free(robot);
  close_pair(p);
}

static void a_lane_has_its_limits(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  const struct rowe_lane_options small = {.bytes = sizeof small, .text_bytes_max = 256, .only_sends = true};
  struct rowe_lane* const lane = rowe_lane_open(on, &small);
  CHECK(lane != NULL);
  char big[300];
  memset(big, ' ', sizeof big);
  CHECK_CODE(rowe_lane_try_send(lane, big, sizeof big, -1, rowe_now_ns()), rowe_error_too_big);
  struct rowe_call call;
  CHECK_CODE(rowe_lane_start(lane, big, sizeof big, -1, rowe_now_ns(), &call), rowe_error_too_big);
  rowe_lane_free(lane);
  rowe_endpoint_free(on);
}

static void what_a_loop_publishes_arrives(void) {
  const struct pair p = open_pair();
  const struct rowe_topic_options latched = {.bytes = sizeof latched,
                                             .ttl_ms = timeout_ms,
                                             .newest = true,
                                             .latched = true,
                                             .type = "std_msgs/String",
                                             .priority = rowe_priority_urgent,
                                             .period_us = 1000};
  struct rowe_publisher* const lonely = rowe_publisher_open(p.server, "/nobody", NULL);
  CHECK(lonely != NULL);
  CHECK(!rowe_publisher_wanted(lonely));
  CHECK_CODE(rowe_publisher_publish(lonely, "{}", 2, rowe_now_ns()), rowe_error_no_peer);
  rowe_publisher_free(lonely);

  struct rowe_publisher* const out = rowe_publisher_open(p.server, "/chatter", &latched);
  struct rowe_subscriber* const in = rowe_subscriber_open(p.client, "/chatter", NULL);
  CHECK(out != NULL && in != NULL);
  struct rowe_view view = {0};
  CHECK_CODE(rowe_subscriber_try_take(in, &view), rowe_error_empty);
  for (int64_t until = deadline_ns(); !rowe_publisher_wanted(out) && rowe_now_ns() < until;) {
  }
  CHECK(rowe_publisher_wanted(out));
  CHECK_EQUAL(rowe_publisher_publish(out, "{\"data\":\"x\"}", 12, rowe_now_ns()), rowe_ok);
  SOON(rowe_subscriber_try_take(in, &view));
  CHECK(says(&view, "{\"data\":\"x\"}"));
  rowe_view_release(&view);
  CHECK_EQUAL(rowe_publisher_publish(out, "{\"data\":\"y\"}", 12, rowe_now_ns()), rowe_ok);
  SOON(rowe_subscriber_latest(in, &view));
  CHECK(says(&view, "{\"data\":\"y\"}"));
  rowe_view_release(&view);
  CHECK_CODE(rowe_subscriber_take(in, 0, &view), rowe_error_timed_out);
  CHECK_CODE(rowe_subscriber_take(NULL, 0, &view), rowe_error_misuse);
  CHECK_CODE(rowe_subscriber_take(in, 0, NULL), rowe_error_misuse);
  CHECK_EQUAL(rowe_publisher_publish(out, "{\"data\":\"z\"}", 12, rowe_now_ns()), rowe_ok);
  CHECK_EQUAL(rowe_subscriber_take(in, timeout_ms, &view), rowe_ok);
  CHECK(says(&view, "{\"data\":\"z\"}"));
  rowe_view_release(&view);
  rowe_subscriber_free(in);
  rowe_publisher_free(out);
  close_pair(p);
}

// Longer than message_bytes_max: the option raises the limit of both ends.
static void maps_of_three_megabytes_arrive(void) {
  const uint32_t most = 4 << 20;
  const struct rowe_options roomy = {
      .bytes = sizeof roomy, .handle_bytes = 16 << 20, .long_message_bytes_max = most, .long_slots = 4};
  const struct pair p = open_pair_with(&roomy, &roomy);
  const struct rowe_topic_options map = {
      .bytes = sizeof map, .depth = 1, .type = "nav_msgs/OccupancyGrid", .text_bytes_max = most};
  struct rowe_publisher* const out = rowe_publisher_open(p.server, "/map", &map);
  struct rowe_subscriber* const in = rowe_subscriber_open(p.client, "/map", &map);
  CHECK(out != NULL && in != NULL);
  for (int64_t until = deadline_ns(); !rowe_publisher_wanted(out) && rowe_now_ns() < until;) {
  }
  const size_t bytes = 3 << 20;
  char* const text = malloc(bytes + 1);
  memset(text, ' ', bytes);
  memcpy(text, "{\"data\":[0", 10);
  memcpy(text + bytes - 2, "]}", 3);
  CHECK_EQUAL(rowe_publisher_publish(out, text, bytes, rowe_now_ns()), rowe_ok);
  struct rowe_view view = {0};
  SOON(rowe_subscriber_try_take(in, &view));
  CHECK(says(&view, text));
  rowe_view_release(&view);
  free(text);
  rowe_subscriber_free(in);
  rowe_publisher_free(out);
  close_pair(p);
  const struct rowe_options vast = {.bytes = sizeof vast, .long_message_bytes_max = UINT32_MAX};
  CHECK(rowe_open_local_endpoint_with(0, &vast) == NULL);
  CHECK_EQUAL(rowe_last_error(), rowe_error_bad_argument);
  CHECK(strstr(rowe_last_error_text(), "long_message_bytes_max") != NULL);
}

static void handles_outlive_their_endpoint(void) {
  const struct rowe_options roomy = {.bytes = sizeof roomy, .handle_bytes = 4 << 20};
  const struct pair p = open_pair_with(NULL, &roomy);
  struct rowe_lane* const lane = rowe_lane_open(p.client, NULL);
  struct rowe_publisher* const out = rowe_publisher_open(p.client, "/a", NULL);
  struct rowe_subscriber* const in = rowe_subscriber_open(p.client, "/b", NULL);
  close_pair(p);
  struct rowe_view view = {0};
  struct rowe_call_end end;
  struct rowe_call call;
  CHECK_CODE(try_send(lane, "{}"), rowe_error_closed);
  CHECK_CODE(rowe_lane_try_receive(lane, rowe_now_ns(), &view), rowe_error_closed);
  CHECK_CODE(rowe_lane_start(lane, "{}", 2, -1, rowe_now_ns(), &call), rowe_error_closed);
  CHECK_CODE(rowe_lane_try_finish(lane, &end), rowe_error_closed);
  CHECK_CODE(rowe_publisher_publish(out, "{}", 2, rowe_now_ns()), rowe_error_closed);
  CHECK_CODE(rowe_subscriber_try_take(in, &view), rowe_error_closed);
  CHECK_CODE(rowe_subscriber_latest(in, &view), rowe_error_closed);
  rowe_lane_free(lane);
  rowe_publisher_free(out);
  rowe_subscriber_free(in);
}

static atomic_bool loop_is_over, loop_moves;

// A loop that acknowledges whatever engages it.
static void* obey(void* of) {
  struct rowe_stop_latch* const latch = of;
  while (!atomic_load(&loop_is_over)) {
    const int64_t now_ns = rowe_now_ns();
    const bool engaged = rowe_stop_engaged(latch, now_ns);
    if (engaged) rowe_stop_acknowledge(latch, now_ns);
    atomic_store(&loop_moves, !engaged);
  }
  return NULL;
}

static void loops_are_stopped_and_let_go_by_threads(void) {
  const struct rowe_options unguarded = {.bytes = sizeof unguarded,
                                         .stop_unguarded = true,
                                         .stop_service_timeout_ms = 10000,
                                         .stop_observe_timeout_ms = 10000};
  struct rowe_endpoint* const robot = rowe_open_local_endpoint_with(0, &unguarded);
  struct rowe_emergency_stop_result stopped = {0, 0};
  struct rowe_emergency_stop_reset_result moves = {0};
  CHECK_CODE(rowe_emergency_stop(robot, NULL, timeout_ms, &stopped), rowe_error_no_service);
  CHECK_CODE(rowe_reset_emergency_stop(robot, NULL, timeout_ms, &moves), rowe_error_no_service);

  const struct rowe_latch_options base = {.bytes = sizeof base, .loop_timeout_ms = 10000};
  struct rowe_stop_latch* const latch = rowe_stop_latch_open(robot, &base);
  pthread_t loop;
  // By the loop's own clock, which it may have read a moment before the stop reached it.
  const int64_t before_ns = rowe_now_ns();
  CHECK_EQUAL(pthread_create(&loop, NULL, obey, latch), 0);
  CHECK_EQUAL(rowe_reset_emergency_stop(robot, NULL, timeout_ms, &moves), rowe_ok);
  CHECK(moves.number != 0);

  const struct rowe_emergency_stop_request why = {.bytes = sizeof why, .source = "hand", .reason = "smoke"};
  CHECK_EQUAL(rowe_emergency_stop(robot, &why, timeout_ms, &stopped), rowe_ok);
  CHECK(stopped.number > moves.number);
  CHECK(stopped.acknowledged_ns >= before_ns);
  struct rowe_event told = {.kind = rowe_event_limit};
  while (rowe_try_event(robot, &told) == rowe_ok) {
  } // the last one
  CHECK_EQUAL(told.kind, rowe_event_stop);
  CHECK_TEXT(told.peer, "hand");
  CHECK_TEXT(told.what, "stopped: request, 'smoke'");

  struct rowe_emergency_stop_reset_request that = {.bytes = sizeof that, .number = moves.number};
  CHECK_CODE(rowe_reset_emergency_stop(robot, &that, timeout_ms, NULL), rowe_error_refused);
  that.number = stopped.number;
  CHECK_EQUAL(rowe_reset_emergency_stop(robot, &that, timeout_ms, NULL), rowe_ok);
  that.bytes = 1;
  CHECK_CODE(rowe_reset_emergency_stop(robot, &that, timeout_ms, NULL), rowe_error_bad_argument);

  // What cannot be read stops all the same.
  const struct rowe_emergency_stop_request newer = {.bytes = sizeof newer + 8};
  CHECK_CODE(rowe_emergency_stop(robot, &newer, timeout_ms, &stopped), rowe_error_bad_argument);
  CHECK(!atomic_load(&loop_moves));
  CHECK_EQUAL(rowe_close(robot, 0), rowe_ok);
  CHECK_CODE(rowe_emergency_stop(robot, NULL, timeout_ms, NULL), rowe_error_closed);
  CHECK_CODE(rowe_reset_emergency_stop(robot, NULL, timeout_ms, NULL), rowe_error_closed);
  atomic_store(&loop_is_over, true);
  join_thread(loop);
  rowe_stop_latch_free(latch);
  rowe_endpoint_free(robot);
}

int main(void) {
  lanes_talk_to_each_other();
  room_is_there_until_the_end();
  a_loop_answers_calls();
  a_lane_has_its_limits();
  what_a_loop_publishes_arrives();
  maps_of_three_megabytes_arrive();
  handles_outlive_their_endpoint();
  loops_are_stopped_and_let_go_by_threads();
  return failures != 0;
}
