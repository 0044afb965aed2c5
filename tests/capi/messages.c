// SPDX-License-Identifier: Apache-2.0
// Plain messages between endpoints, both ways, from several threads, waiting and not.
#include "pair.h"

#include <pthread.h>
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
  CHECK_EQUAL(send_text(p.server, "{\"say\":\"hello\"}", timeout_ms), rowe_ok);
  expect_text(p.client, "{\"say\":\"hello\"}");
  CHECK_EQUAL(send_text(p.client, "{\"say\":\"and back\"}", timeout_ms), rowe_ok);
  expect_text(p.server, "{\"say\":\"and back\"}");
  close_pair(p);
}

static void one_that_speaks_only_when_spoken_to_waits(void) {
  const struct rowe_options shy = {.bytes = sizeof shy, .only_when_spoken_to = true};
  const struct rowe_options plain = {.bytes = sizeof plain};
  const struct pair p = open_pair_with(&shy, &plain);
  CHECK_EQUAL(send_text(p.client, "{\"say\":\"hello\"}", timeout_ms), rowe_ok);
  expect_text(p.server, "{\"say\":\"hello\"}");
  CHECK_EQUAL(send_text(p.server, "{\"say\":\"hello yourself\"}", timeout_ms), rowe_ok);
  expect_text(p.client, "{\"say\":\"hello yourself\"}");
  close_pair(p);
}

static void values_of_all_kinds_arrive_as_they_were_sent(void) {
  const struct pair p = open_pair();
  const char* const texts[] = {
      "{}",
      "{\"caf\xc3\xa9\":\"\xe2\x82\xac \xf0\x9f\xa4\x96\"}",
      "{\"a\":{\"b\":[1,[2,{\"c\":null}],true,false]}}",
      "{\"n\":[9223372036854775807,-9223372036854775808,18446744073709551615,0.1,-0.0,1E2]}",
      "{\"s\":\"quote \\\" backslash \\\\ tab \\t nul \\u0000 bell \\u0007\"}",
  };
  for (size_t i = 0; i < sizeof texts / sizeof *texts; ++i) {
    CHECK_EQUAL(send_text(p.client, texts[i], timeout_ms), rowe_ok);
    expect_text(p.server, texts[i]);
    CHECK_EQUAL(send_text(p.server, texts[i], timeout_ms), rowe_ok);
    expect_text(p.client, texts[i]);
  }
  close_pair(p);
}

static void a_message_can_go_to_the_one_who_wrote(void) {
  const struct pair p = open_pair();
  struct rowe_endpoint* const other = rowe_open_remote_endpoint("localhost", rowe_endpoint_port(p.server));
  CHECK_EQUAL(rowe_wait_peer(other, timeout_ms), rowe_ok);
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
  // Its connection ends some time after, and then for good.
  int code;
  while ((code = rowe_send_to(p.server, peer, mine, 0)) != rowe_error_peer_lost) {
    CHECK(code == rowe_ok || code == rowe_error_expired);
    if (code != rowe_ok && code != rowe_error_expired) break;
  }
  // Which who does not wait for the service thread's word hears a moment later.
  while ((code = rowe_async_send_to(p.server, peer, mine, 0)) == rowe_ok) {
  }
  CHECK_EQUAL(code, rowe_error_peer_lost);
  rowe_object_free(message);
  rowe_object_free(mine);
  close_pair(p);
}

static void a_message_waits_for_a_peer_as_long_as_it_lives(void) {
  struct rowe_endpoint* const server = rowe_open_local_endpoint(0);
  struct rowe_object* const status = rowe_message("x", rowe_type_int, 1, NULL);
  const struct rowe_object* const brief = rowe_message("x", rowe_type_int, 2, NULL);
  CHECK_CODE(rowe_send(server, brief, 0), rowe_error_expired);
  CHECK_CODE(rowe_send(server, brief, 20), rowe_error_expired);
  CHECK_EQUAL(rowe_async_send(server, brief, 0), rowe_ok); // expires, and only the counters tell
  CHECK_EQUAL(rowe_async_send(server, status, -1), rowe_ok);
  struct rowe_endpoint* const client = rowe_open_remote_endpoint("127.0.0.1", rowe_endpoint_port(server));
  expect_text(client, "{\"x\":1}");
  rowe_object_free(status);
  rowe_object_free((struct rowe_object*)brief);
  rowe_endpoint_free(client);
  rowe_endpoint_free(server);
}

static void what_a_remote_endpoint_sends_waits_for_the_connection(void) {
  struct rowe_endpoint* const server = rowe_open_local_endpoint(0);
  struct rowe_endpoint* const client = rowe_open_remote_endpoint("127.0.0.1", rowe_endpoint_port(server));
  CHECK_EQUAL(rowe_endpoint_port(client), 0);
  CHECK_EQUAL(send_text(client, "{\"first\":true}", -1), rowe_ok);
  expect_text(server, "{\"first\":true}");
  rowe_endpoint_free(client);
  rowe_endpoint_free(server);
}

enum { senders = 4, receivers = 2, messages_each = 200 };

static void* send_numbers(void* of) {
  const struct rowe_endpoint* const by = ((void**)of)[0];
  const int which = *(const int*)((void**)of)[1];
  for (int i = 0; i < messages_each; ++i) {
    struct rowe_object* const numbered =
        rowe_message("sender", rowe_type_int, which, "number", rowe_type_int, i, NULL);
    int code;
    while ((code = rowe_send(by, numbered, timeout_ms)) == rowe_error_full) {
    } // more senders than slots
    CHECK_EQUAL(code, rowe_ok);
    rowe_object_free(numbered);
  }
  return NULL;
}

static pthread_mutex_t counting = PTHREAD_MUTEX_INITIALIZER;
static int arrived[senders][messages_each];
static int arrived_count;

static void* receive_numbers(void* of) {
  for (;;) {
    struct rowe_object* const numbered = rowe_receive(of, timeout_ms);
    if (numbered == NULL) {
      CHECK_EQUAL(rowe_last_error(), rowe_error_closed); // the main thread has seen them all
      return NULL;
    }
    int sender = 0, number = 0;
    CHECK_EQUAL(rowe_object_get_int(numbered, "sender", &sender), rowe_ok);
    CHECK_EQUAL(rowe_object_get_int(numbered, "number", &number), rowe_ok);
    rowe_object_free(numbered);
    CHECK(pthread_mutex_lock(&counting) == 0);
    ++arrived[sender][number];
    ++arrived_count;
    CHECK(pthread_mutex_unlock(&counting) == 0);
  }
}

static bool all_arrived(void) {
  CHECK(pthread_mutex_lock(&counting) == 0);
  const bool all = arrived_count == senders * messages_each;
  CHECK(pthread_mutex_unlock(&counting) == 0);
  return all;
}

static void each_message_of_many_threads_arrives_once(void) {
  const struct rowe_options roomy = {.bytes = sizeof roomy, .door_slots = 1024};
  const struct pair p = open_pair_with(&roomy, &roomy);
  pthread_t sending[senders], receiving[receivers];
  int which[senders];
  void* arguments[senders][2];
  for (int i = 0; i < receivers; ++i) {
    receiving[i] = start_thread(receive_numbers, p.server);
  }
  for (int i = 0; i < senders; ++i) {
    which[i] = i;
    arguments[i][0] = p.client;
    arguments[i][1] = &which[i];
    sending[i] = start_thread(send_numbers, arguments[i]);
  }
  for (int i = 0; i < senders; ++i) join_thread(sending[i]);
  while (!all_arrived() && failures == 0) {
  }
  CHECK_EQUAL(rowe_close(p.server, 0), rowe_ok); // the receivers wake up, and hear that it is closed
  for (int i = 0; i < receivers; ++i) join_thread(receiving[i]);
  for (int s = 0; s < senders; ++s) {
    for (int n = 0; n < messages_each; ++n) CHECK_EQUAL(arrived[s][n], 1);
  }
  close_pair(p);
}

static void everything_says_closed_after_closing(void) {
  const struct pair p = open_pair();
  CHECK_EQUAL(rowe_close(p.client, timeout_ms), rowe_ok);
  CHECK_EQUAL(rowe_close(p.client, timeout_ms), rowe_ok);
  struct rowe_object* const object = rowe_object_from_text("{}");
  CHECK_CODE(rowe_send(p.client, object, -1), rowe_error_closed);
  CHECK_CODE(rowe_async_send(p.client, object, -1), rowe_error_closed);
  CHECK_NULL(rowe_receive(p.client, -1), rowe_error_closed);
  CHECK_NULL(rowe_invoke(p.client, object, -1), rowe_error_closed);
  rowe_object_free(object);
  close_pair(p);
}

static void* wait_for_a_peer(void* of) {
  CHECK_CODE(rowe_wait_peer(of, -1), rowe_error_closed);
  return NULL;
}

static void who_waits_for_a_peer_hears_of_closing(void) {
  struct rowe_endpoint* const alone = rowe_open_local_endpoint(0);
  const pthread_t waiting = start_thread(wait_for_a_peer, alone);
  CHECK_EQUAL(rowe_close(alone, 0), rowe_ok);
  join_thread(waiting);
  rowe_endpoint_free(alone);
}

static void what_was_sent_is_written_before_closing(void) {
  const struct pair p = open_pair();
  struct rowe_object* const last = rowe_message("last", rowe_type_boolean, true, NULL);
  CHECK_EQUAL(rowe_async_send(p.client, last, -1), rowe_ok);
  CHECK_EQUAL(rowe_close(p.client, timeout_ms), rowe_ok);
  expect_text(p.server, "{\"last\":true}");
  rowe_object_free(last);
  close_pair(p);
}

static void events_and_counters_tell_what_happened(void) {
  const struct pair p = open_pair();
  struct rowe_event event;
  int code;
  while ((code = rowe_try_event(p.server, &event)) == rowe_ok && event.kind != rowe_event_peer_joined) {
  }
  CHECK_EQUAL(code, rowe_ok);
  CHECK(strncmp(event.peer, "127.0.0.1:", 10) == 0);
  CHECK(event.what[0] != '\0');
  while ((code = rowe_try_event(p.server, &event)) == rowe_ok) {
  }
  CHECK_EQUAL(code, rowe_error_empty);
  CHECK_EQUAL(rowe_peers(p.server), 1);
  CHECK_EQUAL(send_text(p.client, "{}", timeout_ms), rowe_ok);
  expect_text(p.server, "{}");
  struct rowe_object* const counters = rowe_stats(p.server);
  int64_t in = 0;
  CHECK_EQUAL(rowe_object_get_int64(counters, "messages_in", &in), rowe_ok);
  CHECK(in >= 1);
  CHECK(rowe_object_count(counters) > 10);
  rowe_object_free(counters);
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

int main(void) {
  the_server_may_speak_first();
  one_that_speaks_only_when_spoken_to_waits();
  values_of_all_kinds_arrive_as_they_were_sent();
  a_message_can_go_to_the_one_who_wrote();
  a_message_waits_for_a_peer_as_long_as_it_lives();
  what_a_remote_endpoint_sends_waits_for_the_connection();
  each_message_of_many_threads_arrives_once();
  everything_says_closed_after_closing();
  who_waits_for_a_peer_hears_of_closing();
  what_was_sent_is_written_before_closing();
  events_and_counters_tell_what_happened();
  a_message_out_of_date_is_not_received();
  return failures != 0;
}
