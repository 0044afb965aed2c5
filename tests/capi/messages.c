// SPDX-License-Identifier: Apache-2.0
// Plain messages and calls between endpoints: what each function hands out, and each code that it can end
// with. What waits for what, and who hears of whose end, is tests/api.
#include "pair.h"

#include <stdlib.h>

static void expect_text(const struct rowe_endpoint* on, const char* text) {
  struct rowe_object* const arrived = rowe_receive(on, timeout_ms);
  char* const arrived_text = rowe_object_to_text(arrived);
  CHECK_TEXT(arrived_text, text);
  free(arrived_text);
  rowe_object_free(arrived);
}

static void the_server_may_speak_first(void) {
  const struct pair p = open_pair();
  const char* const text =
      "{\"caf\xc3\xa9\":\"\xe2\x82\xac \xf0\x9f\xa4\x96\",\"deep\":{\"b\":[1,[2,{\"c\":null}],true]},"
      "\"n\":[18446744073709551615,0.1,-0.0,1E2],\"s\":\"\\\" \\\\ \\t \\u0000 \\u0007\"}";
  CHECK_EQUAL(rowe_endpoint_port(p.client), 0);
  CHECK_EQUAL(rowe_peers(p.server), 1);
  CHECK_EQUAL(send_text(p.server, text, timeout_ms), rowe_ok);
  expect_text(p.client, text);
  CHECK_EQUAL(send_text(p.client, text, -1), rowe_ok);
  expect_text(p.server, text);
  CHECK(count_of(p.server, "messages_in") >= 1);
  close_pair(p);
}

static void a_message_can_go_to_the_one_who_wrote(void) {
  const struct pair p = open_pair();
  struct rowe_endpoint* const other = rowe_open_remote_endpoint("localhost", rowe_endpoint_port(p.server));
  CHECK_EQUAL(send_text(other, "{\"who\":\"other\"}", timeout_ms), rowe_ok);
  struct rowe_object* const message = rowe_receive(p.server, timeout_ms);
  CHECK_TEXT(rowe_object_get_string(message, "who"), "other");
  const struct rowe_peer peer = rowe_object_sender(message);
  CHECK(peer.generation != 0);
  struct rowe_object* const mine = rowe_message("n", rowe_type_int, 1, NULL);
  CHECK_EQUAL(rowe_object_sender(mine).generation, 0);
  CHECK_EQUAL(rowe_send_to(p.server, peer, mine, timeout_ms), rowe_ok);
  CHECK_EQUAL(rowe_async_send_to(p.server, peer, mine, timeout_ms), rowe_ok);
  expect_text(other, "{\"n\":1}");
  expect_text(other, "{\"n\":1}");
  CHECK_EQUAL(send_text(p.server, "{\"to\":\"all\"}", timeout_ms), rowe_ok);
  expect_text(other, "{\"to\":\"all\"}");
  expect_text(p.client, "{\"to\":\"all\"}"); // the first thing that reaches it
  rowe_endpoint_free(other);
  rowe_object_free(message);
  rowe_object_free(mine);
  close_pair(p);
}

static void everything_says_closed_after_closing(void) {
  const struct pair p = open_pair();
  struct rowe_object* const object = rowe_object_from_text("{}");
  CHECK_EQUAL(rowe_async_send(p.client, object, -1), rowe_ok);
  CHECK_EQUAL(rowe_close(p.client, timeout_ms), rowe_ok); // once it is written
  CHECK_EQUAL(rowe_close(p.client, timeout_ms), rowe_ok);
  expect_text(p.server, "{}");
  CHECK_CODE(rowe_send(p.client, object, -1), rowe_error_closed);
  CHECK_CODE(rowe_async_send(p.client, object, -1), rowe_error_closed);
  CHECK_CODE(rowe_wait_peer(p.client, -1), rowe_error_closed);
  CHECK_NULL(rowe_receive(p.client, -1), rowe_error_closed);
  CHECK_NULL(rowe_invoke(p.client, object, -1), rowe_error_closed);
  rowe_object_free(object);
  close_pair(p);
}

static void events_tell_what_happened(void) {
  const struct pair p = open_pair();
  CHECK_EQUAL(rowe_close(p.client, 0), rowe_ok);
  const int kinds[] = {rowe_event_peer_joined, rowe_event_peer_left};
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; ++i) {
    struct rowe_event event = {.kind = rowe_event_warning};
    for (const int64_t until = deadline_ns(); (int)event.kind != kinds[i] && rowe_now_ns() < until;) {
      const int code = rowe_try_event(p.server, &event);
      CHECK(code == rowe_ok || code == rowe_error_empty);
    }
    CHECK_EQUAL(event.kind, kinds[i]);
    CHECK(strncmp(event.peer, "127.0.0.1:", 10) == 0);
    CHECK(event.what[0] != '\0');
  }
  close_pair(p);
}

static void a_message_out_of_date_is_not_received(void) {
  const struct rowe_options hasty = {.bytes = sizeof hasty, .inbound_ttl_ms = 1};
  const struct pair p = open_pair_with(&hasty, NULL);
  CHECK_EQUAL(send_text(p.client, "{\"old\":true}", timeout_ms), rowe_ok);
  // Received within the millisecond or never: both are right, waiting for it for ever is not.
  struct rowe_object* const maybe = rowe_receive(p.server, 50);
  if (maybe == NULL) CHECK_EQUAL(rowe_last_error(), rowe_error_timed_out);
  rowe_object_free(maybe);
  close_pair(p);
}

// The call that another thread makes of `text`.
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

static void a_call_shows_its_id_and_is_answered_once(void) {
  const struct pair p = open_pair();
  const struct rowe_endpoint* const ends[] = {p.server, p.client};
  struct rowe_object* const reply = rowe_message("done", rowe_type_boolean, true, NULL);
  struct rowe_object* const big = long_object();
  for (int i = 0; i < 2; ++i) { // either end asks; replies wait and do not
    const struct rowe_endpoint *const answers = ends[i], *const asks = ends[1 - i];
    struct question q = {
        .by = asks, .text = "{\"service\":\"x\",\"deep\":{\"op\":1}}", .timeout_ms = timeout_ms};
    const pthread_t asking = start_thread(ask, &q);
    struct rowe_object* const call = rowe_receive(answers, timeout_ms);
    CHECK(rowe_object_get_string(call, "message_id") != NULL);
    CHECK_TEXT(rowe_object_get_string(call, "service"), "x");
    CHECK(rowe_object_sender(call).generation != 0);
    CHECK_CODE(rowe_reply(asks, call, reply, timeout_ms), rowe_error_misuse); // not of this endpoint
    CHECK_CODE(rowe_reply(answers, call, big, timeout_ms), rowe_error_too_big);
    CHECK_EQUAL(i == 0 ? rowe_reply(answers, call, reply, timeout_ms)
                       : rowe_async_reply(answers, call, reply),
                rowe_ok);
    CHECK_CODE(rowe_reply(answers, call, reply, timeout_ms), rowe_error_misuse);
    CHECK_CODE(rowe_async_reply(answers, call, reply), rowe_error_misuse);
    CHECK_CODE(rowe_refuse(answers, call, "no"), rowe_error_misuse);
    join_thread(asking);
    bool done = false;
    CHECK_EQUAL(rowe_object_get_boolean(q.reply, "done", &done), rowe_ok);
    CHECK(done);
    rowe_object_free(q.reply);
    rowe_object_free(call);
  }
  CHECK_EQUAL(send_text(p.client, "{}", timeout_ms), rowe_ok);
  struct rowe_object* const plain = rowe_receive(p.server, timeout_ms);
  const struct rowe_object* const no_calls[] = {plain, reply}; // of which one was never received
  for (size_t i = 0; i < sizeof no_calls / sizeof *no_calls; ++i) {
    CHECK_CODE(rowe_reply(p.server, no_calls[i], reply, timeout_ms), rowe_error_misuse);
    CHECK_CODE(rowe_refuse(p.server, no_calls[i], "no"), rowe_error_misuse);
  }
  rowe_object_free(plain);
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
    struct rowe_object* const call = rowe_receive(p.server, timeout_ms);
    struct rowe_object* const reply = rowe_object_from_text(replies[i]);
    CHECK_CODE(rowe_reply(p.server, call, reply, timeout_ms), codes[i]);
    CHECK_CODE(rowe_reply(p.server, call, reply, timeout_ms), rowe_error_misuse);
    join_thread(asking);
    CHECK(q.reply == NULL);
    CHECK_EQUAL(q.error, rowe_error_refused);
    rowe_object_free(call);
    rowe_object_free(reply);
  }
  close_pair(p);
}

static void a_call_outlives_its_endpoint(void) {
  const struct pair p = open_pair();
  struct question q = {.by = p.client, .text = "{\"service\":\"x\"}", .timeout_ms = -1};
  const pthread_t asking = start_thread(ask, &q);
  struct rowe_object* const call = rowe_receive(p.server, timeout_ms);
  CHECK(call != NULL);
  const int closed = rowe_close(p.client, 0); // with a call open, not drained
  CHECK(closed == rowe_ok || closed == rowe_error_timed_out);
  join_thread(asking);
  close_pair(p);
  CHECK(q.reply == NULL);
  CHECK_EQUAL(q.error, rowe_error_closed);
  rowe_object_free(call);
}

int main(void) {
  the_server_may_speak_first();
  a_message_can_go_to_the_one_who_wrote();
  everything_says_closed_after_closing();
  events_tell_what_happened();
  a_message_out_of_date_is_not_received();
  a_call_shows_its_id_and_is_answered_once();
  what_can_be_no_reply_refuses_the_call();
  a_call_outlives_its_endpoint();
  return failures != 0;
}
