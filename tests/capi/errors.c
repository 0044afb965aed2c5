// SPDX-License-Identifier: Apache-2.0
// Every error that a C program can meet, provoked; and what is told of it.
#define _POSIX_C_SOURCE 200809L
#include "pair.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <rowe/loop.h>
#include <rowe/parameter.h>
#include <rowe/service.h>
#include <rowe/struct.h>

static bool met[256];

#define MEET(expression, code)                                                                               \
  do {                                                                                                       \
    CHECK_CODE(expression, code);                                                                            \
    met[code] = true;                                                                                        \
  } while (0)
#define MEET_NULL(expression, code)                                                                          \
  do {                                                                                                       \
    CHECK_NULL(expression, code);                                                                            \
    met[code] = true;                                                                                        \
  } while (0)

struct command {
  double speed;
};

static void errors_of_opening(void) {
  struct rowe_endpoint* const first = rowe_open_local_endpoint(0);
  MEET_NULL(rowe_open_local_endpoint(rowe_endpoint_port(first)), rowe_error_address_in_use);
  rowe_endpoint_free(first);
  MEET_NULL(rowe_open_local_endpoint(65536), rowe_error_bad_argument);
  CHECK(strstr(rowe_last_error_text(), "65536 (limit 65535)") != NULL);
  MEET_NULL(rowe_open_local_endpoint(-1), rowe_error_bad_argument);
  MEET_NULL(rowe_open_remote_endpoint("localhost", 0), rowe_error_bad_argument);
  MEET_NULL(rowe_open_remote_endpoint("localhost", 65536), rowe_error_bad_argument);
  const char* const no_hosts[] = {"", "a/b", "ws://a", "a:80", "a b", "user@a", "a?b", "a#b"};
  for (size_t i = 0; i < sizeof no_hosts / sizeof *no_hosts; ++i) {
    MEET_NULL(rowe_open_remote_endpoint(no_hosts[i], 80), rowe_error_bad_url);
    CHECK(strstr(rowe_last_error_text(), "from byte ") != NULL); // and ws:// is not missing
  }
  const struct rowe_options odd_path = {.bytes = sizeof odd_path, .path = "hop"};
  MEET_NULL(rowe_open_remote_endpoint_with("localhost", 80, &odd_path), rowe_error_bad_url);
  const struct rowe_options odd_address = {.bytes = sizeof odd_address, .address = "no address"};
  MEET_NULL(rowe_open_local_endpoint_with(0, &odd_address), rowe_error_bad_address);
  const struct rowe_options wide = {.bytes = sizeof wide, .address = "0.0.0.0"};
  MEET_NULL(rowe_open_local_endpoint_with(0, &wide), rowe_error_not_loopback);
  const struct rowe_options odd_idle = {.bytes = sizeof odd_idle, .idle = 99};
  MEET_NULL(rowe_open_local_endpoint_with(0, &odd_idle), rowe_error_bad_argument);
  for (int idle = rowe_idle_poll; idle <= rowe_idle_phase; ++idle) {
    const struct rowe_options waits = {.bytes = sizeof waits, .idle = idle};
    struct rowe_endpoint* const opened = rowe_open_local_endpoint_with(0, &waits);
    CHECK(opened != NULL);
    rowe_endpoint_free(opened);
  }
  const struct rowe_options odd_profile = {.bytes = sizeof odd_profile, .profile = 99};
  MEET_NULL(rowe_open_local_endpoint_with(0, &odd_profile), rowe_error_bad_argument);
  const struct rowe_options unversioned = {.bytes = 0};
  MEET_NULL(rowe_open_local_endpoint_with(0, &unversioned), rowe_error_bad_argument);
  MEET_NULL(rowe_open_remote_endpoint_with("localhost", 80, &unversioned), rowe_error_bad_argument);
  const struct rowe_options of_the_future = {.bytes = sizeof of_the_future + 8};
  MEET_NULL(rowe_open_local_endpoint_with(0, &of_the_future), rowe_error_bad_argument);
  struct rowe_options of_the_past = {.bytes = 2 * sizeof(void*), .name = "old", .profile = 99}; // not read
  struct rowe_endpoint* const old = rowe_open_local_endpoint_with(0, &of_the_past);
  CHECK(old != NULL);
  rowe_endpoint_free(old);
}

// A file of this text, as rowe_open_configured_endpoint() takes it.
static struct rowe_endpoint* configured(const char* text) {
  char path[] = "/tmp/rowe_errors_XXXXXX";
  const int file = mkstemp(path);
  CHECK(file >= 0);
  CHECK(write(file, text, strlen(text)) == (ssize_t)strlen(text));
  close(file);
  struct rowe_endpoint* const opened = rowe_open_configured_endpoint(path);
  unlink(path);
  return opened;
}

static void errors_of_files(void) {
  MEET_NULL(rowe_open_configured_endpoint("/nowhere/rowe.toml"), rowe_error_bad_config);
  MEET_NULL(rowe_open_configured_endpoint(NULL), rowe_error_misuse);
  MEET_NULL(configured("[endpoint]\nport = 70000\nprot = 1\n"), rowe_error_bad_config);
  CHECK(strstr(rowe_last_error_text(), ":2: endpoint.port is out of range: 70000 (0 to 65535)") != NULL);
  CHECK(strstr(rowe_last_error_text(), "prot") == NULL); // the first mistake only
  MEET_NULL(configured("[endpoint]\naddress = \"0.0.0.0\"\n"), rowe_error_bad_config);
  struct rowe_endpoint* const opened = configured("[endpoint]\nport = 0\nname = \"from a file\"\n");
  CHECK(opened != NULL);
  CHECK(rowe_endpoint_port(opened) != 0);
  rowe_endpoint_free(opened);
}

static void errors_of_handles(void) {
  const struct rowe_options roomy = {.bytes = sizeof roomy, .handle_bytes = 4 << 20};
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint_with(0, &roomy);
  const struct rowe_lane_options odd = {.bytes = sizeof odd, .priority = 99};
  MEET_NULL(rowe_lane_open(endpoint, &odd), rowe_error_bad_argument);
  const struct rowe_lane_options deep = {.bytes = sizeof deep, .depth = 1000000};
  MEET_NULL(rowe_lane_open(endpoint, &deep), rowe_error_bad_argument);
  const struct rowe_lane_options vast = {.bytes = sizeof vast, .depth = 4096, .text_bytes_max = 60000};
  MEET_NULL(rowe_lane_open(endpoint, &vast), rowe_error_handle_memory);
  const struct rowe_topic_options odd_topic = {.bytes = sizeof odd_topic, .priority = 99};
  MEET_NULL(rowe_publisher_open(endpoint, "/x", &odd_topic), rowe_error_bad_argument);
  const struct rowe_topic_options hasty = {.bytes = sizeof hasty, .period_us = 99};
  MEET_NULL(rowe_publisher_open(endpoint, "/x", &hasty), rowe_error_bad_argument);
  MEET_NULL(rowe_subscriber_open(endpoint, "", NULL), rowe_error_bad_argument);
  MEET_NULL(rowe_publisher_open(endpoint, "/rowe/stats", NULL), rowe_error_reserved_topic);
  MEET_NULL(rowe_publisher_open(endpoint, "/a\xff", NULL), rowe_error_not_utf8);
  CHECK(strstr(rowe_last_error_text(), "the argument name is not UTF-8 (at byte 2)") != NULL);
  MEET_NULL(rowe_subscriber_open(endpoint, "/a\n", NULL), rowe_error_control_character);
  const struct rowe_topic_options text = {
      .bytes = sizeof text, .type = "std_msgs/String", .depth = 1, .text_bytes_max = 64};
  const struct rowe_topic_options pose = {
      .bytes = sizeof pose, .type = "geometry_msgs/Pose", .depth = 1, .text_bytes_max = 64};
  struct rowe_publisher* publishers[64];
  publishers[0] = rowe_publisher_open(endpoint, "/typed", &text);
  CHECK(publishers[0] != NULL);
  MEET_NULL(rowe_publisher_open(endpoint, "/typed", &pose), rowe_error_type_conflict);
  MEET(rowe_publisher_publish(publishers[0], "{}", 2, rowe_now_ns()), rowe_error_no_peer);
  int count = 1;
  while (count < 64 && (publishers[count] = rowe_publisher_open(endpoint, "/typed", &text)) != NULL) ++count;
  MEET_NULL(rowe_lane_open(endpoint, NULL), rowe_error_too_many_handles);
  for (int i = 0; i < count; ++i) rowe_publisher_free(publishers[i]);

  struct rowe_stop_latch* latches[64];
  int held = 0;
  while (held < 64 && (latches[held] = rowe_stop_latch_open(endpoint, NULL)) != NULL) ++held;
  CHECK_EQUAL(held, 8);
  MEET_NULL(rowe_stop_latch_open(endpoint, NULL), rowe_error_too_many_latches);
  for (int i = 0; i < held; ++i) rowe_stop_latch_free(latches[i]);

  const struct rowe_member speed = ROWE_MEMBER(struct command, speed, rowe_member_double);
  const struct rowe_struct command = {"Command", sizeof(struct command), &speed, 1};
  const struct rowe_topic_options leased = {.bytes = sizeof leased, .lease_ms = 300};
  const char* const topics[9] = {"/c0", "/c1", "/c2", "/c3", "/c4", "/c5", "/c6", "/c7", "/c8"};
  struct rowe_struct_subscriber* drives[8];
  for (int i = 0; i < 8; ++i) {
    drives[i] = rowe_struct_subscriber_open(endpoint, topics[i], &command, &leased);
    CHECK(drives[i] != NULL);
  }
  MEET_NULL(rowe_struct_subscriber_open(endpoint, topics[8], &command, &leased), rowe_error_too_many_leases);
  for (int i = 0; i < 8; ++i) rowe_struct_subscriber_free(drives[i]);

  rowe_endpoint_free(endpoint);
}

static void errors_of_loops(void) {
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_lane* const lane = rowe_lane_open(endpoint, NULL);
  struct rowe_view view = {0};
  MEET(rowe_lane_try_receive(lane, rowe_now_ns(), &view), rowe_error_empty);
  rowe_lane_free(lane);

  const struct rowe_lane_options small = {.bytes = sizeof small, .depth = 1, .calls = 1};
  struct rowe_lane* const narrow = rowe_lane_open(endpoint, &small);
  int code;
  while ((code = rowe_lane_try_send(narrow, "{}", 2, -1, rowe_now_ns())) == rowe_ok) {
  }
  MEET(code, rowe_error_full);
  rowe_lane_free(narrow);
  char buffer[2];
  MEET(rowe_read_string("{\"a\":\"bc\"}", 10, "a", buffer, sizeof buffer), rowe_error_too_long);
  rowe_endpoint_free(endpoint);
}

static void* refuse_one(void* of) {
  struct rowe_object* const asked = rowe_receive(of, timeout_ms);
  CHECK_EQUAL(rowe_refuse(of, asked, "for a reason"), rowe_ok);
  rowe_object_free(asked);
  return NULL;
}

static void errors_of_messages_and_calls(void) {
  const struct pair p = open_pair();
  MEET_NULL(rowe_receive(p.server, 0), rowe_error_timed_out);
  struct rowe_object* const long_one = long_object();
  MEET(rowe_send(p.client, long_one, 0), rowe_error_too_big);
  CHECK(strstr(rowe_last_error_text(), "5011 bytes exceed the limit of 4096 bytes") != NULL);
  CHECK_CODE(rowe_async_send(p.client, long_one, 0), rowe_error_too_big);
  rowe_object_free(long_one);
  MEET(send_text(p.client, "[]", 0), rowe_error_not_an_object);
  MEET(send_text(p.client, "{\"op\":1}", 0), rowe_error_reserved_member);
  struct rowe_object* const reserved = rowe_message("op", rowe_type_int, 1, NULL);
  struct rowe_object* const none = rowe_object_new_array();
  CHECK_CODE(rowe_async_send(p.client, reserved, -1), rowe_error_reserved_member);
  CHECK_CODE(rowe_async_send(p.client, none, -1), rowe_error_not_an_object);
  rowe_object_free(reserved);
  rowe_object_free(none);

  const pthread_t refusing = start_thread(refuse_one, p.server);
  MEET_NULL(invoke_text(p.client, "{\"service\":\"x\"}", timeout_ms), rowe_error_refused);
  CHECK_TEXT(rowe_last_error_text(), "the service answered with an error: for a reason");
  join_thread(refusing);

  const struct rowe_lane_options one_call = {.bytes = sizeof one_call, .depth = 4, .calls = 1};
  struct rowe_lane* const lane = rowe_lane_open(p.client, &one_call);
  struct rowe_call call;
  CHECK_EQUAL(rowe_lane_start(lane, "{}", 2, -1, rowe_now_ns(), &call), rowe_ok);
  MEET(rowe_lane_start(lane, "{}", 2, -1, rowe_now_ns(), &call), rowe_error_too_many_calls);
  rowe_lane_free(lane);

  const struct rowe_peer stranger = {0, 12345};
  struct rowe_object* const object = rowe_object_from_text("{}");
  MEET(rowe_send_to(p.server, stranger, object, -1), rowe_error_peer_lost);
  CHECK_EQUAL(rowe_close(p.client, 0), rowe_ok);
  MEET(rowe_send(p.client, object, -1), rowe_error_closed);
  rowe_object_free(object);
  close_pair(p);

  struct rowe_endpoint* const alone = rowe_open_local_endpoint(0);
  MEET(send_text(alone, "{}", 0), rowe_error_expired);
  MEET(rowe_wait_peer(alone, 0), rowe_error_timed_out);
  struct rowe_object* const nothing = invoke_text(alone, "{\"service\":\"x\"}", 1000);
  CHECK(nothing == NULL);
  CHECK(rowe_last_error() == rowe_error_no_service || rowe_last_error() == rowe_error_no_peer ||
        rowe_last_error() == rowe_error_timed_out);
  met[rowe_last_error()] = true;
  rowe_endpoint_free(alone);
}

static void errors_of_values(void) {
  int i;
  MEET_NULL(rowe_object_from_text("{"), rowe_error_malformed);
  char deep[131];
  memset(deep, '[', 65);
  memset(deep + 65, ']', 65);
  deep[130] = '\0';
  MEET_NULL(rowe_object_from_text(deep), rowe_error_too_deep);
  CHECK(strstr(rowe_last_error_text(), "64 levels") != NULL);
  struct rowe_object* const object = rowe_object_from_text("{\"s\":\"x\",\"n\":1e400000}");
  MEET_NULL(object, rowe_error_malformed); // a number that no double can hold
  struct rowe_object* const large = rowe_object_from_text("{\"s\":\"x\",\"n\":2147483648}");
  MEET_NULL(rowe_object_get(large, "none"), rowe_error_missing_member);
  MEET_NULL(rowe_message("a", rowe_type_null, "a", rowe_type_null, NULL), rowe_error_duplicate_member);
  MEET(rowe_object_get_int(large, "s", &i), rowe_error_wrong_type);
  MEET(rowe_object_get_int(large, "n", &i), rowe_error_out_of_range);
  MEET_NULL(rowe_object_from_text(NULL), rowe_error_misuse);
  rowe_object_free(large);
}

static void errors_of_parameters(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  struct rowe_parameter* all[33] = {NULL};
  int opened = 0;
  for (; opened < 32; ++opened) {
    char name[16];
    snprintf(name, sizeof name, "/p%d", opened);
    all[opened] = rowe_parameter_bool(on, name, true);
    CHECK(all[opened] != NULL);
  }
  MEET_NULL(rowe_parameter_bool(on, "p0", true), rowe_error_parameter_taken);
  MEET_NULL(rowe_parameter_bool(on, "/more", true), rowe_error_too_many_parameters);
  MEET_NULL(rowe_parameter_integer(on, "/rowe/x", 1, 0, 2), rowe_error_reserved_topic);
  MEET_NULL(rowe_parameter_integer(on, "/x", 3, 0, 2), rowe_error_out_of_range);
  while (opened > 0) rowe_parameter_free(all[--opened]);
  rowe_endpoint_free(on);
}

// What a child of fork() meets, whose parent has opened the endpoint.
static void errors_of_children(void) {
  struct rowe_endpoint* const endpoint = rowe_open_local_endpoint(0);
  struct rowe_lane* const lane = rowe_lane_open(endpoint, NULL);
  const pid_t child = fork();
  if (child == 0) {
    const int code = rowe_lane_try_send(lane, "{}", 2, -1, rowe_now_ns());
    rowe_lane_free(lane);
    rowe_endpoint_free(endpoint);
    _exit(code);
  }
  int outcome = 0;
  CHECK(child > 0 && waitpid(child, &outcome, 0) == child && WIFEXITED(outcome));
  CHECK_EQUAL(WEXITSTATUS(outcome), rowe_error_forked);
  met[rowe_error_forked] = true;
  rowe_lane_free(lane);
  rowe_endpoint_free(endpoint);
}

static void errors_of_services(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  struct rowe_responder* const first = rowe_responder_open(on, "/x", NULL);
  MEET_NULL(rowe_responder_open(on, "x", NULL), rowe_error_service_taken);
  MEET_NULL(rowe_responder_open(on, "/rowe/stop", NULL), rowe_error_reserved_topic);
  rowe_responder_free(first);
  rowe_endpoint_free(on);
}

// Those a C program cannot meet: its endpoints have more topics and services than handles; memory and threads
// run out where the machine says so; and it has no recordings, and no messages of ROS.
static bool out_of_reach(int code) {
  return code == rowe_error_too_many_topics || code == rowe_error_too_many_services ||
         code == rowe_error_bad_access || code == rowe_error_bad_certificate || code == rowe_error_bad_web ||
         code == rowe_error_no_memory || code == rowe_error_no_thread || code == rowe_error_no_service ||
         code == rowe_error_no_peer || code == rowe_error_bad_recording ||
         code == rowe_error_too_many_recordings || code == rowe_error_bad_definition ||
         code == rowe_error_bad_message;
}

static void each_error_has_its_diagnostic(void) {
  static const int codes[] = {
#define ROWE_CODE(number, name) rowe_error_##name,
      ROWE_ERROR_CODES(ROWE_CODE)
#undef ROWE_CODE
  };
  for (size_t i = 0; i < sizeof codes / sizeof *codes; ++i) {
    const char* const diagnostic = rowe_strerror(codes[i]);
    CHECK_EQUAL(codes[i], i + 1);
    CHECK(strlen(diagnostic) > 10);
    CHECK(strchr(diagnostic, '%') == NULL);
    for (size_t j = 0; j < i; ++j) CHECK(strcmp(diagnostic, rowe_strerror(codes[j])) != 0);
    if (!met[codes[i]] && !out_of_reach(codes[i])) {
      ++failures;
      fprintf(stderr, "nothing here met error %d: %s\n", codes[i], diagnostic);
    }
  }
  CHECK_TEXT(rowe_strerror(rowe_ok), "no error");
  CHECK_TEXT(rowe_strerror(-1), rowe_strerror(1000));
  CHECK(strstr(rowe_strerror(rowe_error_too_big), "N bytes exceed the limit of MAX bytes") != NULL);
}

static void* first_error(void* nothing) {
  CHECK_EQUAL(rowe_last_error(), rowe_ok);
  CHECK_TEXT(rowe_last_error_text(), "");
  CHECK_NULL(rowe_object_from_text("{"), rowe_error_malformed);
  return nothing;
}

static void each_thread_has_its_own_last_error(void) {
  CHECK_NULL(rowe_object_get(NULL, "a"), rowe_error_misuse);
  const pthread_t other = start_thread(first_error, NULL);
  join_thread(other);
  CHECK_EQUAL(rowe_last_error(), rowe_error_misuse);
  struct rowe_object* const fine = rowe_object_from_text("{}"); // success leaves it alone
  CHECK_EQUAL(rowe_last_error(), rowe_error_misuse);
  rowe_object_free(fine);
}

int main(void) {
  CHECK_EQUAL(rowe_abi_version(), ROWE_ABI_VERSION);
  errors_of_opening();
  errors_of_parameters();
  errors_of_files();
  errors_of_handles();
  errors_of_loops();
  errors_of_messages_and_calls();
  errors_of_values();
  errors_of_children();
  errors_of_services();
  each_error_has_its_diagnostic();
  each_thread_has_its_own_last_error();
  return failures != 0;
}
