// SPDX-License-Identifier: Apache-2.0
// Calls between endpoints: answered, refused, timed out, several at a time, and every wrong use.
#include "pair.h"

#include <stdlib.h>

// Answers invocations of add-two-numbers, refuses others, until "stop" arrives or the endpoint is closed.
static void* answer(void* of) {
  const struct rowe_endpoint* const by = of;
  struct rowe_object* request;
  bool waiting = true; // replies wait and do not, in turn
  while ((request = rowe_receive(by, -1)) != NULL) {
    const char* const service = rowe_object_get_string(request, "service");
    int a = 0, b = 0;
    if (service == NULL) {
      rowe_object_free(request);
      break;
    }
    if (strcmp(service, "add-two-numbers") != 0) {
      CHECK_EQUAL(rowe_refuse(by, request, "I only add"), rowe_ok);
    } else {
      CHECK_EQUAL(rowe_object_get_int(request, "a", &a), rowe_ok);
      CHECK_EQUAL(rowe_object_get_int(request, "b", &b), rowe_ok);
      struct rowe_object* const reply = rowe_message("result", rowe_type_int, a + b, NULL);
      CHECK_EQUAL(waiting ? rowe_reply(by, request, reply, timeout_ms) : rowe_async_reply(by, request, reply),
                  rowe_ok);
      waiting = !waiting;
      rowe_object_free(reply);
    }
    rowe_object_free(request);
  }
  return NULL;
}

static void expect_sum(const struct rowe_endpoint* by, int a, int b) {
  struct rowe_object* const question = rowe_message("service", rowe_type_string, "add-two-numbers", "a",
                                                    rowe_type_int, a, "b", rowe_type_int, b, NULL);
  struct rowe_object* const reply = rowe_invoke(by, question, timeout_ms);
  int result = 0;
  CHECK_EQUAL(rowe_object_get_int(reply, "result", &result), rowe_ok);
  CHECK_EQUAL(result, a + b);
  rowe_object_free(reply);
  rowe_object_free(question);
}

static void a_client_asks_its_server(void) {
  const struct pair p = open_pair();
  const pthread_t answering = start_thread(answer, p.server);
  expect_sum(p.client, 38, 4);
  expect_sum(p.client, -1, 1);
  CHECK_NULL(invoke_text(p.client, "{\"service\":\"divide\"}", timeout_ms), rowe_error_refused);
  CHECK(strstr(rowe_last_error_text(), "I only add") != NULL);
  CHECK_EQUAL(send_text(p.client, "{}", timeout_ms), rowe_ok);
  join_thread(answering);
  close_pair(p);
}

static void a_server_asks_its_client(void) {
  const struct pair p = open_pair();
  const pthread_t answering = start_thread(answer, p.client);
  expect_sum(p.server, 38, 4);
  CHECK_EQUAL(send_text(p.server, "{}", timeout_ms), rowe_ok);
  join_thread(answering);
  close_pair(p);
}

static void* ask_often(void* of) {
  for (int i = 0; i < 100; ++i) expect_sum(of, i, 1000);
  return NULL;
}

static void several_threads_ask_and_several_answer(void) {
  enum { askers = 4, answerers = 2 };
  const struct pair p = open_pair();
  pthread_t asking[askers], answering[answerers];
  for (int i = 0; i < answerers; ++i) answering[i] = start_thread(answer, p.server);
  for (int i = 0; i < askers; ++i) asking[i] = start_thread(ask_often, p.client);
  for (int i = 0; i < askers; ++i) join_thread(asking[i]);
  CHECK_EQUAL(rowe_close(p.server, 0), rowe_ok);
  for (int i = 0; i < answerers; ++i) join_thread(answering[i]);
  close_pair(p);
}

// The invocation that the client's other thread makes of `text`.
struct question {
  const struct rowe_endpoint* by;
  const char* text;
  long timeout_ms;
  struct rowe_object* reply;
  int error;
};
static void* ask(void* of) {
  struct question* const q = of;
  q->reply = invoke_text(q->by, q->text, q->timeout_ms);
  q->error = rowe_last_error();
  return NULL;
}

static void an_invocation_shows_its_id_and_is_answered_once(void) {
  const struct pair p = open_pair();
  struct question q = {
      .by = p.client, .text = "{\"service\":\"x\",\"deep\":{\"op\":1}}", .timeout_ms = timeout_ms};
  const pthread_t asking = start_thread(ask, &q);
  struct rowe_object* const invocation = rowe_receive(p.server, timeout_ms);
  CHECK(rowe_object_get_string(invocation, "message_id") != NULL);
  CHECK_TEXT(rowe_object_get_string(invocation, "service"), "x");
  CHECK(rowe_object_sender(invocation).generation != 0);

  struct rowe_object* const reply = rowe_message("done", rowe_type_boolean, true, NULL);
  struct rowe_object* const big = long_object();
  CHECK_CODE(rowe_reply(p.client, invocation, reply, timeout_ms), rowe_error_misuse); // not of this endpoint
  CHECK_CODE(rowe_reply(p.server, invocation, big, timeout_ms), rowe_error_too_big);
  CHECK_EQUAL(rowe_reply(p.server, invocation, reply, timeout_ms), rowe_ok);
  CHECK_CODE(rowe_reply(p.server, invocation, reply, timeout_ms), rowe_error_misuse);
  CHECK_CODE(rowe_async_reply(p.server, invocation, reply), rowe_error_misuse);
  CHECK_CODE(rowe_refuse(p.server, invocation, "no"), rowe_error_misuse);
  CHECK_CODE(rowe_reply(p.server, reply, reply, timeout_ms), rowe_error_misuse); // it was never received
  join_thread(asking);
  bool done = false;
  CHECK_EQUAL(rowe_object_get_boolean(q.reply, "done", &done), rowe_ok);
  CHECK(done);
  rowe_object_free(q.reply);
  rowe_object_free(invocation);
  rowe_object_free(reply);
  rowe_object_free(big);
  close_pair(p);
}

static void what_can_be_no_reply_refuses_the_call(void) {
  const struct pair p = open_pair();
  const char* const replies[] = {"[]", "{\"in_reply_to\":1}", "{\"op\":1}"};
  const int codes[] = {rowe_error_not_an_object, rowe_error_reserved_member, rowe_error_reserved_member};
  for (size_t i = 0; i < sizeof replies / sizeof *replies; ++i) {
    struct question q = {.by = p.client, .text = "{\"service\":\"x\"}", .timeout_ms = timeout_ms};
    const pthread_t asking = start_thread(ask, &q);
    struct rowe_object* const invocation = rowe_receive(p.server, timeout_ms);
    struct rowe_object* const reply = rowe_object_from_text(replies[i]);
    CHECK_CODE(rowe_reply(p.server, invocation, reply, timeout_ms), codes[i]);
    CHECK_CODE(rowe_reply(p.server, invocation, reply, timeout_ms), rowe_error_misuse);
    join_thread(asking);
    CHECK(q.reply == NULL);
    CHECK_EQUAL(q.error, rowe_error_refused);
    rowe_object_free(invocation);
    rowe_object_free(reply);
  }
  close_pair(p);
}

static void a_plain_message_cannot_be_answered(void) {
  const struct pair p = open_pair();
  CHECK_EQUAL(send_text(p.client, "{}", timeout_ms), rowe_ok);
  struct rowe_object* const message = rowe_receive(p.server, timeout_ms);
  CHECK_CODE(rowe_reply(p.server, message, message, timeout_ms), rowe_error_misuse);
  CHECK_CODE(rowe_refuse(p.server, message, "no"), rowe_error_misuse);
  rowe_object_free(message);
  close_pair(p);
}

static void who_waits_no_longer_hears_of_the_time(void) {
  const struct pair p = open_pair();
  time_out(p.client, "{\"service\":\"slow\"}", 30);
  struct rowe_object* const invocation = rowe_receive(p.server, timeout_ms);
  CHECK(invocation != NULL);
  struct rowe_object* const late = rowe_message("late", rowe_type_boolean, true, NULL);
  // The server cannot know that nobody waits: the reply goes, and is dropped where it arrives.
  CHECK_EQUAL(rowe_reply(p.server, invocation, late, timeout_ms), rowe_ok);
  CHECK_EQUAL(send_text(p.server, "{\"after\":1}", timeout_ms), rowe_ok);
  struct rowe_object* const next = rowe_receive(p.client, timeout_ms);
  int after = 0;
  CHECK_EQUAL(rowe_object_get_int(next, "after", &after), rowe_ok);
  rowe_object_free(next);
  rowe_object_free(late);
  rowe_object_free(invocation);
  close_pair(p);
}

static void who_asked_and_left_is_lost(void) {
  const struct pair p = open_pair();
  struct question q = {.by = p.client, .text = "{\"service\":\"x\"}", .timeout_ms = -1};
  const pthread_t asking = start_thread(ask, &q);
  struct rowe_object* const invocation = rowe_receive(p.server, timeout_ms);
  const int closed = rowe_close(p.client, 0); // with a call open, which is not drained
  CHECK(closed == rowe_ok || closed == rowe_error_timed_out);
  join_thread(asking);
  CHECK(q.reply == NULL);
  CHECK_EQUAL(q.error, rowe_error_closed);
  struct rowe_event event; // until the server has seen it go
  do {
    while (rowe_try_event(p.server, &event) != rowe_ok) {
    }
  } while (event.kind != rowe_event_peer_left);
  struct rowe_object* const reply = rowe_object_from_text("{}");
  CHECK_CODE(rowe_reply(p.server, invocation, reply, timeout_ms), rowe_error_peer_lost);
  rowe_object_free(reply);
  rowe_object_free(invocation);
  close_pair(p);
}

static void a_lost_peer_is_told_from_a_timeout(void) {
  const struct pair p = open_pair();
  struct question q = {.by = p.client, .text = "{\"service\":\"x\"}", .timeout_ms = timeout_ms};
  const pthread_t asking = start_thread(ask, &q);
  struct rowe_object* const invocation = rowe_receive(p.server, timeout_ms);
  CHECK(invocation != NULL);
  const int closed = rowe_close(p.server, 0); // with a call open, which is not drained
  CHECK(closed == rowe_ok || closed == rowe_error_timed_out);
  join_thread(asking);
  CHECK(q.reply == NULL);
  CHECK_EQUAL(q.error, rowe_error_peer_lost);
  struct rowe_object* const reply = rowe_object_from_text("{}");
  CHECK_CODE(rowe_reply(p.server, invocation, reply, 0), rowe_error_closed);
  rowe_object_free(reply);
  close_pair(p);
  rowe_object_free(invocation); // outlives its endpoint
}

static void only_objects_without_reserved_members_are_sent(void) {
  const struct pair p = open_pair();
  CHECK_CODE(send_text(p.client, "[]", timeout_ms), rowe_error_not_an_object);
  CHECK_CODE(send_text(p.client, "1", timeout_ms), rowe_error_not_an_object);
  CHECK_CODE(send_text(p.client, "{\"op\":\"x\"}", timeout_ms), rowe_error_reserved_member);
  CHECK_CODE(send_text(p.client, "{\"message_id\":1}", timeout_ms), rowe_error_reserved_member);
  CHECK_CODE(send_text(p.client, "{\"in_reply_to\":1}", timeout_ms), rowe_error_reserved_member);
  CHECK_NULL(invoke_text(p.client, "[]", timeout_ms), rowe_error_not_an_object);
  CHECK_NULL(invoke_text(p.client, "{\"message_id\":1}", timeout_ms), rowe_error_reserved_member);
  close_pair(p);
}

int main(void) {
  a_client_asks_its_server();
  a_server_asks_its_client();
  several_threads_ask_and_several_answer();
  an_invocation_shows_its_id_and_is_answered_once();
  what_can_be_no_reply_refuses_the_call();
  a_plain_message_cannot_be_answered();
  who_waits_no_longer_hears_of_the_time();
  who_asked_and_left_is_lost();
  a_lost_peer_is_told_from_a_timeout();
  only_objects_without_reserved_members_are_sent();
  return failures != 0;
}
