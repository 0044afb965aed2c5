// SPDX-License-Identifier: Apache-2.0
// Services by name: responders and callers, of text and of structs.
#include "pair.h"

#include <limits.h>

#include <rowe/service.h>

struct numbers {
  int32_t a, b;
};
static const struct rowe_member numbers_members[] = {
    ROWE_MEMBER(struct numbers, a, rowe_member_int32),
    ROWE_MEMBER(struct numbers, b, rowe_member_int32),
};
static const struct rowe_struct numbers_type = {NULL, sizeof(struct numbers), numbers_members, 2};
struct sum {
  int64_t sum;
};
static const struct rowe_member sum_members[] = {ROWE_MEMBER(struct sum, sum, rowe_member_int64)};
static const struct rowe_struct sum_type = {NULL, sizeof(struct sum), sum_members, 1};

static struct rowe_request next(struct rowe_responder* of) {
  struct rowe_request request = {0};
  SOON(rowe_responder_try_next(of, rowe_now_ns(), &request));
  return request;
}

static struct rowe_call start(struct rowe_caller* by, const char* text) {
  struct rowe_call call = {0, 0};
  CHECK_EQUAL(rowe_caller_start(by, text, strlen(text), timeout_ms, rowe_now_ns(), &call), rowe_ok);
  return call;
}

static void of_text_are_answered_in_a_loop(void) {
  const int64_t before_ns = rowe_now_ns();
  const struct pair p = open_pair();
  const struct rowe_service_options options = {.bytes = sizeof options, .depth = 4, .text_bytes_max = 200};
  struct rowe_responder* const mode = rowe_responder_open(p.server, "mode", &options);
  struct rowe_caller* const caller = rowe_caller_open(p.client, "/mode", &options);
  CHECK(mode != NULL && caller != NULL);
  CHECK_NULL(rowe_responder_open(p.server, "", NULL), rowe_error_bad_argument);
  struct rowe_request request = {0};
  struct rowe_call_end end;
  CHECK_CODE(rowe_responder_try_next(mode, rowe_now_ns(), &request), rowe_error_empty);
  CHECK_CODE(rowe_caller_try_finish(caller, &end), rowe_error_empty);
  CHECK_TEXT(rowe_caller_refusal(caller), "");

  const struct rowe_call first = start(caller, "{\"to\":\"drive\"}");
  request = next(mode);
  char to[8];
  CHECK_EQUAL(rowe_read_string(request.text, request.bytes, "to", to, sizeof to), rowe_ok);
  CHECK_TEXT(to, "drive");
  CHECK(request.arrived_ns >= before_ns && request.arrived_ns <= rowe_now_ns());
  CHECK(request.expires_ns > before_ns);
  CHECK(request.from.generation != 0);
  char many[300];
  memset(many, ' ', sizeof many);
  CHECK_CODE(rowe_responder_reply(mode, &request, many, sizeof many, rowe_now_ns()), rowe_error_too_big);
  CHECK_EQUAL(rowe_responder_reply(mode, &request, "{\"was\":1}", 9, rowe_now_ns()), rowe_ok);
  CHECK(request.text == NULL);
  CHECK_CODE(rowe_responder_reply(mode, &request, "{}", 2, rowe_now_ns()), rowe_error_misuse);
  rowe_request_release(&request);
  SOON(rowe_caller_try_finish(caller, &end));
  CHECK_EQUAL(end.outcome, rowe_ok);
  CHECK(end.call.index == first.index && end.call.generation == first.generation);
  CHECK(says(&end.reply, "{\"was\":1}"));
  rowe_view_release(&end.reply);

  // Refused with a reason, released without an answer, given up, and unheard of.
  (void)start(caller, "{}");
  request = next(mode);
  CHECK_EQUAL(rowe_responder_refuse(mode, &request, "the brake is on", rowe_now_ns()), rowe_ok);
  SOON(rowe_caller_try_finish(caller, &end));
  CHECK_EQUAL(end.outcome, rowe_error_refused);
  CHECK_TEXT(rowe_caller_refusal(caller), "the brake is on");
  (void)start(caller, "{}");
  request = next(mode);
  rowe_request_release(&request);
  SOON(rowe_caller_try_finish(caller, &end));
  CHECK_EQUAL(end.outcome, rowe_error_refused);
  CHECK_TEXT(rowe_caller_refusal(caller), "the service did not answer");
  rowe_caller_cancel(caller, start(caller, "{}"));
  request = next(mode);
  CHECK_EQUAL(rowe_responder_reply(mode, &request, "{}", 2, rowe_now_ns()), rowe_ok);
  CHECK_CODE(rowe_caller_try_finish(caller, &end), rowe_error_empty);
  struct rowe_view reply = {0};
  CHECK_CODE(rowe_caller_call(caller, many, sizeof many, timeout_ms, &reply), rowe_error_too_big);
  struct rowe_caller* const nobody = rowe_caller_open(p.client, "/nobody", NULL);
  CHECK_CODE(rowe_caller_call(nobody, "{}", 2, 1, &reply), rowe_error_timed_out); // waits for rowe_receive()
  CHECK(reply.text == NULL);
  rowe_caller_free(nobody);
  CHECK_CODE(rowe_responder_next(mode, 0, &request), rowe_error_timed_out);

  close_pair(p);
  CHECK_CODE(rowe_responder_try_next(mode, rowe_now_ns(), &request), rowe_error_closed);
  CHECK_CODE(rowe_caller_try_finish(caller, &end), rowe_error_closed);
  CHECK_CODE(rowe_caller_call(caller, "{}", 2, timeout_ms, &reply), rowe_error_closed);
  rowe_responder_free(mode);
  rowe_caller_free(caller);
}

static void of_structs_are_answered_in_a_loop(void) {
  const struct pair p = open_pair();
  struct rowe_struct_responder* const add =
      rowe_struct_responder_open(p.server, "/add", &numbers_type, &sum_type, NULL);
  struct rowe_struct_caller* const caller =
      rowe_struct_caller_open(p.client, "/add", &numbers_type, &sum_type, NULL);
  CHECK(add != NULL && caller != NULL);
  struct numbers asked = {0, 0};
  struct sum answer = {-1};
  struct rowe_request request = {0};
  struct rowe_struct_call_end end;
  CHECK_CODE(rowe_struct_responder_try_next(add, rowe_now_ns(), &asked, &request), rowe_error_empty);
  CHECK_CODE(rowe_struct_caller_try_finish(caller, &answer, &end), rowe_error_empty);
  struct rowe_call call;
  const struct numbers question = {38, 4};
  CHECK_EQUAL(rowe_struct_caller_start(caller, &question, timeout_ms, rowe_now_ns(), &call), rowe_ok);
  CHECK_EQUAL(rowe_struct_responder_next(add, timeout_ms, &asked, &request), rowe_ok);
  CHECK_EQUAL(asked.a, 38);
  CHECK_EQUAL(asked.b, 4);
  CHECK(request.text == NULL && request.from.generation != 0);
  const struct sum sum = {(int64_t)asked.a + asked.b};
  CHECK_EQUAL(rowe_struct_responder_reply(add, &request, &sum, rowe_now_ns()), rowe_ok);
  CHECK_CODE(rowe_struct_responder_reply(add, &request, &sum, rowe_now_ns()), rowe_error_misuse);
  SOON(rowe_struct_caller_try_finish(caller, &answer, &end));
  CHECK_EQUAL(end.outcome, rowe_ok);
  CHECK(end.call.index == call.index && end.call.generation == call.generation);
  CHECK_EQUAL(answer.sum, 42);

  CHECK_EQUAL(rowe_struct_caller_start(caller, &question, timeout_ms, rowe_now_ns(), &call), rowe_ok);
  SOON(rowe_struct_responder_try_next(add, rowe_now_ns(), &asked, &request));
  CHECK_EQUAL(rowe_struct_responder_refuse(add, &request, "no", rowe_now_ns()), rowe_ok);
  answer.sum = -1;
  SOON(rowe_struct_caller_try_finish(caller, &answer, &end));
  CHECK_EQUAL(end.outcome, rowe_error_refused);
  CHECK_TEXT(rowe_struct_caller_refusal(caller), "no");
  CHECK_EQUAL(answer.sum, -1);

  CHECK_CODE(rowe_struct_caller_call(caller, &question, 1, &answer), rowe_error_timed_out);
  CHECK_EQUAL(rowe_struct_caller_start(caller, &question, timeout_ms, rowe_now_ns(), &call), rowe_ok);
  rowe_struct_caller_cancel(caller, call);

  rowe_struct_responder_free(add);
  rowe_struct_caller_free(caller);
  close_pair(p);
}

// A request that is no such struct is refused before it gets there, and so is an answer.
static void structs_that_do_not_fit_are_refused(void) {
  const struct pair p = open_pair();
  struct rowe_struct_responder* const add =
      rowe_struct_responder_open(p.server, "/add", &numbers_type, &sum_type, NULL);
  CHECK(invoke_text(p.client, "{\"service\":\"/add\",\"a\":1}", timeout_ms) == NULL);
  CHECK_EQUAL(rowe_last_error(), rowe_error_refused);
  CHECK(strstr(rowe_last_error_text(), "\"b\"") != NULL);
  struct rowe_struct_caller* const other =
      rowe_struct_caller_open(p.client, "/add", &numbers_type, &numbers_type, NULL);
  const struct numbers question = {1, 2};
  struct rowe_call call;
  CHECK_EQUAL(rowe_struct_caller_start(other, &question, timeout_ms, rowe_now_ns(), &call), rowe_ok);
  struct numbers asked;
  struct rowe_request request = {0};
  CHECK_EQUAL(rowe_struct_responder_next(add, timeout_ms, &asked, &request), rowe_ok);
  const struct sum sum = {3};
  CHECK_EQUAL(rowe_struct_responder_reply(add, &request, &sum, rowe_now_ns()), rowe_ok);
  struct rowe_struct_call_end end;
  SOON(rowe_struct_caller_try_finish(other, &asked, &end));
  CHECK_EQUAL(end.outcome, rowe_error_missing_member);
  CHECK(strstr(rowe_struct_caller_refusal(other), "the member \"a\" is missing") != NULL);
  rowe_struct_caller_free(other);
  rowe_struct_responder_free(add);
  close_pair(p);
}

// Tables of both sides are checked.
static void wrong_tables_and_nulls(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  const struct rowe_struct wrong = {"Wrong", 0, NULL, 0};
  CHECK_NULL(rowe_struct_responder_open(on, "/x", &wrong, &sum_type, NULL), rowe_error_bad_argument);
  CHECK(strstr(rowe_last_error_text(), "\"Wrong\": its size is 0") != NULL);
  CHECK_NULL(rowe_struct_responder_open(on, "/x", &sum_type, &wrong, NULL), rowe_error_bad_argument);
  CHECK_NULL(rowe_struct_caller_open(on, "/x", &wrong, &sum_type, NULL), rowe_error_bad_argument);
  CHECK_NULL(rowe_struct_caller_open(on, "/x", &sum_type, &wrong, NULL), rowe_error_bad_argument);
  CHECK_NULL(rowe_struct_responder_open(NULL, "/x", &sum_type, &sum_type, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_responder_open(on, NULL, &sum_type, &sum_type, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_responder_open(on, "/x", NULL, &sum_type, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_responder_open(on, "/x", &sum_type, NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_caller_open(on, "/x", NULL, &sum_type, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_responder_open(NULL, "/x", NULL), rowe_error_misuse);
  CHECK_NULL(rowe_responder_open(on, NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_caller_open(NULL, "/x", NULL), rowe_error_misuse);
  CHECK_NULL(rowe_caller_open(on, NULL, NULL), rowe_error_misuse);
  const struct rowe_service_options deep = {.bytes = sizeof deep, .depth = 5000};
  CHECK_NULL(rowe_responder_open(on, "/x", &deep), rowe_error_bad_argument);
  CHECK_NULL(rowe_caller_open(on, "/x", &deep), rowe_error_bad_argument);

  struct rowe_responder* const texts = rowe_responder_open(on, "/texts", NULL);
  struct rowe_responder* const others = rowe_responder_open(on, "/others", NULL);
  struct rowe_struct_responder* const structs =
      rowe_struct_responder_open(on, "/structs", &numbers_type, &sum_type, NULL);
  struct rowe_caller* const caller = rowe_caller_open(on, "/texts", NULL);
  struct rowe_struct_caller* const struct_caller =
      rowe_struct_caller_open(on, "/structs", &numbers_type, &sum_type, NULL);
  struct rowe_request none = {0};
  struct rowe_call call = {0, 0};
  struct rowe_call_end end;
  struct rowe_struct_call_end struct_end;
  struct rowe_view view = {0};
  struct numbers value = {0, 0};
  CHECK_CODE(rowe_responder_try_next(NULL, 0, &none), rowe_error_misuse);
  CHECK_CODE(rowe_responder_try_next(texts, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_responder_next(NULL, 0, &none), rowe_error_misuse);
  CHECK_CODE(rowe_responder_reply(NULL, &none, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_reply(texts, NULL, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_reply(texts, &none, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_refuse(NULL, &none, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_refuse(texts, &none, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_try_next(NULL, 0, &value, &none), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_try_next(structs, 0, NULL, &none), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_try_next(structs, 0, &value, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_next(structs, 0, NULL, &none), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_reply(structs, &none, &value, 0), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_refuse(NULL, &none, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_caller_start(NULL, "{}", 2, 0, 0, &call), rowe_error_misuse);
  CHECK_CODE(rowe_caller_start(caller, NULL, 2, 0, 0, &call), rowe_error_misuse);
  CHECK_CODE(rowe_caller_start(caller, "{}", 2, 0, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_caller_start(caller, "{}", SIZE_MAX, 0, 0, &call), rowe_error_too_big);
  CHECK_CODE(rowe_caller_try_finish(NULL, &end), rowe_error_misuse);
  CHECK_CODE(rowe_caller_try_finish(caller, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_caller_call(NULL, "{}", 2, 0, &view), rowe_error_misuse);
  CHECK_CODE(rowe_caller_call(caller, "{}", 2, 0, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_caller_start(struct_caller, NULL, 0, 0, &call), rowe_error_misuse);
  CHECK_CODE(rowe_struct_caller_try_finish(struct_caller, NULL, &struct_end), rowe_error_misuse);
  CHECK_CODE(rowe_struct_caller_call(struct_caller, &value, 0, NULL), rowe_error_misuse);
  rowe_caller_cancel(NULL, call);
  rowe_caller_cancel(caller, call);
  rowe_struct_caller_cancel(NULL, call);
  rowe_struct_caller_cancel(struct_caller, call);
  CHECK_TEXT(rowe_caller_refusal(NULL), "");
  CHECK_TEXT(rowe_struct_caller_refusal(NULL), "");
  rowe_request_release(NULL);
  rowe_request_release(&none);
  rowe_responder_free(NULL);
  rowe_struct_responder_free(NULL);
  rowe_caller_free(NULL);
  rowe_struct_caller_free(NULL);

  // A call is its responder's, whose answer it still gets; and times that no clock shows.
  (void)start(caller, "{}");
  struct rowe_request request = next(texts);
  CHECK_CODE(rowe_responder_reply(others, &request, "{}", 2, 0), rowe_error_misuse);
  CHECK_CODE(rowe_struct_responder_refuse(structs, &request, "", 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_refuse(texts, &request, NULL, 0), rowe_error_misuse);
  CHECK_CODE(rowe_responder_reply(texts, &request, "{}", 2, INT64_MAX), rowe_error_expired);
  CHECK_CODE(rowe_responder_reply(texts, &request, "{}", 2, 0), rowe_error_misuse);
  CHECK_EQUAL(rowe_caller_start(caller, "{}", 2, LONG_MAX, INT64_MAX, &call), rowe_ok);
  CHECK_EQUAL(rowe_caller_start(caller, "{}", 2, LONG_MIN, INT64_MIN, &call), rowe_ok);
  rowe_struct_caller_free(struct_caller);
  rowe_caller_free(caller);
  rowe_struct_responder_free(structs);
  rowe_responder_free(others);
  rowe_responder_free(texts);
  rowe_endpoint_free(on);
}

static void may_take_the_endpoints_own_place(void) {
  const struct pair p = open_pair();
  const struct rowe_service_options instead = {.bytes = sizeof instead, .replaces_own = true};
  CHECK_NULL(rowe_responder_open(p.server, "/rosapi/topics", NULL), rowe_error_reserved_topic);
  struct rowe_responder* const topics = rowe_responder_open(p.server, "/rosapi/topics", &instead);
  struct rowe_caller* const caller = rowe_caller_open(p.client, "/rosapi/topics", NULL);
  CHECK(topics != NULL && caller != NULL);
  (void)start(caller, "{}");
  struct rowe_request request = next(topics);
  CHECK_EQUAL(rowe_responder_reply(topics, &request, "{\"ours\":1}", 10, rowe_now_ns()), rowe_ok);
  struct rowe_call_end end;
  SOON(rowe_caller_try_finish(caller, &end));
  CHECK(says(&end.reply, "{\"ours\":1}"));
  rowe_view_release(&end.reply);
  rowe_caller_free(caller);
  rowe_responder_free(topics);
  close_pair(p);
}

int main(void) {
  of_text_are_answered_in_a_loop();
  of_structs_are_answered_in_a_loop();
  structs_that_do_not_fit_are_refused();
  wrong_tables_and_nulls();
  may_take_the_endpoints_own_place();
  return failures != 0;
}
