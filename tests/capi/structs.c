// SPDX-License-Identifier: Apache-2.0
// Structs as messages, by tables: what loops publish and receive; misuse_structs.c has wrong tables.
#include "pair.h"

#include <stdlib.h>

#include <rowe/struct.h>

struct point {
  double x, y;
};
static const struct rowe_member point_members[] = {
    ROWE_MEMBER(struct point, x, rowe_member_double),
    ROWE_MEMBER(struct point, y, rowe_member_double),
};
static const struct rowe_struct point_type = {"Point", sizeof(struct point), point_members, 2};

static const struct rowe_name modes[] = {{"off", 0}, {"mapping", 1}, {"locating", 7}};

// A member of each type and form.
struct everything {
  bool on;
  int8_t i8;
  int16_t i16;
  int32_t i32;
  int64_t i64;
  uint8_t u8;
  uint16_t u16;
  uint32_t u32;
  uint64_t u64;
  float f;
  double d;
  char text[8];
  struct point at;
  int64_t stamp, age;
  double three[3];
  uint8_t bits[3];
  struct point path[4];
  int16_t path_count;
  float ranges[5];
  uint32_t range_count;
  char names[2][4];
  uint8_t mode;
  double missing;
};
static const struct rowe_member everything_members[] = {
    ROWE_MEMBER(struct everything, on, rowe_member_bool),
    ROWE_MEMBER(struct everything, i8, rowe_member_int8),
    ROWE_MEMBER(struct everything, i16, rowe_member_int16),
    ROWE_MEMBER(struct everything, i32, rowe_member_int32),
    ROWE_MEMBER(struct everything, i64, rowe_member_int64 | rowe_member_as_string),
    ROWE_MEMBER(struct everything, u8, rowe_member_uint8),
    ROWE_MEMBER(struct everything, u16, rowe_member_uint16),
    ROWE_MEMBER(struct everything, u32, rowe_member_uint32),
    ROWE_MEMBER(struct everything, u64, rowe_member_uint64),
    ROWE_MEMBER(struct everything, f, rowe_member_float),
    ROWE_MEMBER(struct everything, d, rowe_member_double | rowe_member_decimals_2),
    ROWE_MEMBER(struct everything, text, rowe_member_text),
    ROWE_INSIDE(struct everything, at, &point_type),
    ROWE_MEMBER(struct everything, stamp, rowe_member_time),
    ROWE_MEMBER(struct everything, age, rowe_member_duration | rowe_member_as_seconds),
    ROWE_ARRAY(struct everything, three, rowe_member_double, NULL),
    ROWE_ARRAY(struct everything, bits, rowe_member_uint8, NULL),
    ROWE_COUNTED(struct everything, path, rowe_member_struct, &point_type, path_count, rowe_member_int16),
    ROWE_COUNTED(struct everything, ranges, rowe_member_float, NULL, range_count, rowe_member_uint32),
    ROWE_MEMBER(struct everything, range_count, rowe_member_uint32),
    ROWE_ARRAY(struct everything, names, rowe_member_text, NULL),
    ROWE_NAMED(struct everything, mode, rowe_member_uint8, modes),
    ROWE_MEMBER(struct everything, missing, rowe_member_double | rowe_member_or_default),
};
static const struct rowe_struct everything_type = {"Everything", sizeof(struct everything),
                                                   everything_members,
                                                   sizeof everything_members / sizeof *everything_members};

static const struct everything some = {.on = true,
                                       .i8 = -128,
                                       .i16 = -32768,
                                       .i32 = INT32_MIN,
                                       .i64 = INT64_MIN,
                                       .u8 = 255,
                                       .u16 = 65535,
                                       .u32 = UINT32_MAX,
                                       .u64 = UINT64_MAX,
                                       .f = 0.5F,
                                       .d = 1.25,
                                       .text = "caf\xc3\xa9",
                                       .at = {1, 2},
                                       .stamp = 1500000000,
                                       .age = 12500000,
                                       .three = {1, 2, 3},
                                       .bits = {1, 2, 255},
                                       .path = {{3, 4}, {5, 6}},
                                       .path_count = 2,
                                       .ranges = {7, 8, 9},
                                       .range_count = 3,
                                       .names = {"abc", ""},
                                       .mode = 7,
                                       .missing = 10};
static const char some_text[] =
    "{\"on\":true,\"i8\":-128,\"i16\":-32768,\"i32\":-2147483648,\"i64\":\"-9223372036854775808\",\"u8\":255,"
    "\"u16\":65535,\"u32\":4294967295,\"u64\":18446744073709551615,\"f\":0.5,\"d\":1.25,"
    "\"text\":\"caf\xc3\xa9\",\"at\":{\"x\":1,\"y\":2},\"stamp\":1500000000,\"age\":0.0125,"
    "\"three\":[1,2,3],\"bits\":\"AQL/\",\"path\":[{\"x\":3,\"y\":4},{\"x\":5,\"y\":6}],"
    "\"ranges\":[7,8,9],\"range_count\":3,\"names\":[\"abc\",\"\"],\"mode\":\"locating\",\"missing\":10}";

static struct rowe_struct_publisher* publisher(const struct rowe_endpoint* by, const char* topic,
                                               const struct rowe_struct* type) {
  struct rowe_struct_publisher* const one = rowe_struct_publisher_open(by, topic, type, NULL);
  CHECK(one != NULL);
  return one;
}

static void wait_wanted(const struct rowe_struct_publisher* out) {
  for (int64_t until = deadline_ns(); !rowe_struct_publisher_wanted(out) && rowe_now_ns() < until;) {
  }
  CHECK(rowe_struct_publisher_wanted(out));
}

static void are_written_as_their_table_says(void) {
  const struct pair p = open_pair();
  struct rowe_struct_publisher* const out = publisher(p.server, "/some", &everything_type);
  CHECK(!rowe_struct_publisher_wanted(out));
  CHECK_CODE(rowe_struct_publisher_publish(out, &some, rowe_now_ns()), rowe_error_no_peer);
  struct rowe_subscriber* const in = rowe_subscriber_open(p.client, "/some", NULL);
  wait_wanted(out);
  CHECK_EQUAL(rowe_struct_publisher_publish(out, &some, rowe_now_ns()), rowe_ok);
  struct rowe_view view = {0};
  SOON(rowe_subscriber_try_take(in, &view));
  CHECK_EQUAL(view.bytes, sizeof some_text - 1);
  CHECK(view.bytes == sizeof some_text - 1 && memcmp(view.text, some_text, view.bytes) == 0);
  rowe_view_release(&view);

  // A text without an end, counts that are negative or too large, and a number that JSON does not have.
  struct everything odd = some;
  memset(odd.text, 'x', sizeof odd.text);
  odd.path_count = -1;
  odd.range_count = UINT32_MAX;
  odd.f = 1e30F * 1e30F;
  odd.mode = 3; // has no name
  CHECK_EQUAL(rowe_struct_publisher_publish(out, &odd, rowe_now_ns()), rowe_ok);
  SOON(rowe_subscriber_try_take(in, &view));
  char text[16];
  double number = 0;
  CHECK_EQUAL(rowe_read_string(view.text, view.bytes, "text", text, sizeof text), rowe_ok);
  CHECK_TEXT(text, "xxxxxxx");
  CHECK_CODE(rowe_read_double(view.text, view.bytes, "path[0].x", &number), rowe_error_missing_member);
  CHECK_EQUAL(rowe_read_double(view.text, view.bytes, "ranges[4]", &number), rowe_ok);
  CHECK_CODE(rowe_read_double(view.text, view.bytes, "ranges[5]", &number), rowe_error_missing_member);
  CHECK_CODE(rowe_read_double(view.text, view.bytes, "f", &number), rowe_error_wrong_type);
  CHECK_EQUAL(rowe_read_double(view.text, view.bytes, "mode", &number), rowe_ok);
  CHECK(number == 3);
  rowe_view_release(&view);
  CHECK_EQUAL(count_of(p.server, "nonfinite"), 1);
  rowe_subscriber_free(in);
  rowe_struct_publisher_free(out);
  close_pair(p);
}

static void expect_some(const struct everything* got) {
  CHECK(got->on);
  CHECK_EQUAL(got->i8, -128);
  CHECK_EQUAL(got->i16, -32768);
  CHECK_EQUAL(got->i32, INT32_MIN);
  CHECK_EQUAL(got->i64, INT64_MIN);
  CHECK_EQUAL(got->u8, 255);
  CHECK_EQUAL(got->u16, 65535);
  CHECK_EQUAL(got->u32, UINT32_MAX);
  CHECK(got->u64 == UINT64_MAX);
  CHECK(got->f == 0.5F);
  CHECK(got->d == 1.25);
  CHECK_TEXT(got->text, "caf\xc3\xa9");
  CHECK(got->at.x == 1 && got->at.y == 2);
  CHECK_EQUAL(got->stamp, 1500000000);
  CHECK_EQUAL(got->age, 12500000);
  CHECK(got->three[0] == 1 && got->three[1] == 2 && got->three[2] == 3);
  CHECK(got->bits[0] == 1 && got->bits[1] == 2 && got->bits[2] == 255);
  CHECK_EQUAL(got->path_count, 2);
  CHECK(got->path[0].x == 3 && got->path[0].y == 4 && got->path[1].x == 5 && got->path[1].y == 6);
  CHECK_EQUAL(got->range_count, 3);
  CHECK(got->ranges[0] == 7 && got->ranges[1] == 8 && got->ranges[2] == 9);
  CHECK_TEXT(got->names[0], "abc");
  CHECK_TEXT(got->names[1], "");
  CHECK_EQUAL(got->mode, 7);
}

// From a peer as text, from a peer as a struct, and from this process.
static void arrive_as_they_were_sent(void) {
  const int64_t opened_ns = rowe_now_ns(); // a cycle may have begun before what it takes was published
  const struct pair p = open_pair();
  struct rowe_struct_subscriber* const in =
      rowe_struct_subscriber_open(p.client, "/some", &everything_type, NULL);
  CHECK(in != NULL);
  struct rowe_publisher* const text = rowe_publisher_open(p.server, "/some", NULL);
  struct rowe_struct_publisher* const out = publisher(p.server, "/some", &everything_type);
  struct rowe_struct_publisher* const own = publisher(p.client, "/some", &everything_type);
  wait_wanted(out);
  wait_wanted(own);
  struct everything got = {.i8 = 1};
  struct rowe_arrival arrival = {0};
  CHECK_CODE(rowe_struct_subscriber_try_take(in, &got, &arrival), rowe_error_empty);
  CHECK_EQUAL(got.i8, 1);
  for (int by = 0; by < 3; ++by) {
    const int64_t now_ns = rowe_now_ns();
    const int sent = by == 0 ? rowe_publisher_publish(text, some_text, sizeof some_text - 1, now_ns)
                             : rowe_struct_publisher_publish(by == 1 ? out : own, &some, now_ns);
    CHECK_EQUAL(sent, rowe_ok);
    SOON(rowe_struct_subscriber_try_take(in, &got, &arrival));
    expect_some(&got);
    CHECK(got.missing == 10);
    CHECK(arrival.arrived_ns >= opened_ns && arrival.arrived_ns <= rowe_now_ns());
    CHECK_EQUAL(arrival.from.generation != 0, by != 2);
  }
  rowe_struct_publisher_free(own);
  rowe_struct_publisher_free(out);
  rowe_publisher_free(text);
  rowe_struct_subscriber_free(in);
  close_pair(p);
}

static void publish(struct rowe_publisher* by, const char* text) {
  for (int64_t until = deadline_ns(); !rowe_publisher_wanted(by) && rowe_now_ns() < until;) {
  }
  CHECK_EQUAL(rowe_publisher_publish(by, text, strlen(text), rowe_now_ns()), rowe_ok);
}

static void wait_count(const struct rowe_endpoint* of, const char* name, int64_t value) {
  const int64_t until = deadline_ns();
  while (count_of(of, name) < value && rowe_now_ns() < until) {
  }
  CHECK_EQUAL(count_of(of, name), value);
}

struct command {
  char mode[4];
  double speed[2];
  uint8_t speeds;
};

// A message that does not fit its struct never gets there.
static void are_refused_where_they_do_not_fit(void) {
  const struct rowe_member members[] = {
      {"mode", rowe_member_text | rowe_member_or_default, offsetof(struct command, mode), 4, 0, 0, 0, NULL,
       "state", NULL, 0},
      ROWE_COUNTED(struct command, speed, rowe_member_double, NULL, speeds, rowe_member_uint8)};
  const struct rowe_struct type = {NULL, sizeof(struct command), members, 2};
  const struct pair p = open_pair();
  const struct rowe_topic_options lenient = {.bytes = sizeof lenient, .fill_missing = 1};
  struct rowe_publisher* const out = rowe_publisher_open(p.server, "/command", NULL);
  struct rowe_struct_subscriber* const in = rowe_struct_subscriber_open(p.client, "/command", &type, NULL);
  struct rowe_struct_subscriber* const fills =
      rowe_struct_subscriber_open(p.client, "/command", &type, &lenient);
  struct command got;
  publish(out, "{\"mode\":\"four\",\"speed\":[]}");
  publish(out, "{\"mode\":\"\",\"speed\":[1,2,3]}");
  publish(out, "{\"mode\":1,\"speed\":[]}");
  publish(out, "{\"speed\":{}}");
  wait_count(p.client, "undecodable", 8);
  publish(out, "{\"mode\":\"hi\"}");
  wait_count(p.client, "undecodable", 9);
  SOON(rowe_struct_subscriber_try_take(fills, &got, NULL));
  CHECK_TEXT(got.mode, "hi");
  CHECK_EQUAL(got.speeds, 0);
  publish(out, "{\"speed\":[1,2],\"state\":\"abc\",\"more\":{}}");
  SOON(rowe_struct_subscriber_try_take(in, &got, NULL));
  CHECK_TEXT(got.mode, "abc");
  CHECK_EQUAL(got.speeds, 2);
  CHECK(got.speed[0] == 1 && got.speed[1] == 2);
  rowe_struct_subscriber_free(fills);
  rowe_struct_subscriber_free(in);
  rowe_publisher_free(out);
  close_pair(p);
}

// What people type for ROS's own types leaves out most of it.
static void of_types_of_ros_are_filled_in(void) {
  struct speeds {
    double linear, angular;
  };
  const struct rowe_member members[] = {ROWE_MEMBER(struct speeds, linear, rowe_member_double),
                                        ROWE_MEMBER(struct speeds, angular, rowe_member_double)};
  const struct rowe_struct type = {"geometry_msgs/Twist", sizeof(struct speeds), members, 2};
  const struct pair p = open_pair();
  const struct rowe_topic_options strict = {.bytes = sizeof strict, .fill_missing = -1};
  struct rowe_publisher* const out = rowe_publisher_open(p.server, "/cmd_vel", NULL);
  struct rowe_struct_subscriber* const in = rowe_struct_subscriber_open(p.client, "/cmd_vel", &type, NULL);
  struct rowe_struct_subscriber* const wants_all =
      rowe_struct_subscriber_open(p.client, "/cmd_vel", &type, &strict);
  struct speeds got = {0, 9};
  publish(out, "{\"linear\":0.5}");
  SOON(rowe_struct_subscriber_try_take(in, &got, NULL));
  CHECK(got.linear == 0.5 && got.angular == 0);
  wait_count(p.client, "undecodable", 1);
  rowe_struct_subscriber_free(wants_all);
  rowe_struct_subscriber_free(in);
  rowe_publisher_free(out);
  close_pair(p);
}

static void of_which_the_newest_counts(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  const struct rowe_topic_options newest = {.bytes = sizeof newest, .newest = true};
  struct rowe_struct_subscriber* const one = rowe_struct_subscriber_open(on, "/at", &point_type, &newest);
  struct rowe_struct_subscriber* const all = rowe_struct_subscriber_open(on, "/at", &point_type, NULL);
  struct rowe_struct_publisher* const out = publisher(on, "/at", &point_type);
  wait_wanted(out);
  struct point at = {0, 0};
  for (; at.x < 3; ++at.x) CHECK_EQUAL(rowe_struct_publisher_publish(out, &at, rowe_now_ns()), rowe_ok);
  for (struct point got = {0, 0}; got.x < 2 && failures == 0;)
    SOON(rowe_struct_subscriber_latest(all, &got, NULL));
  // One handle has a value a moment before the other.
  struct point got = {0, 0};
  while (got.x < 2 && failures == 0) SOON(rowe_struct_subscriber_try_take(one, &got, NULL));
  CHECK(got.x == 2);
  CHECK_CODE(rowe_struct_subscriber_try_take(one, &got, NULL), rowe_error_empty);
  CHECK_CODE(rowe_struct_subscriber_take(all, 0, &got, NULL), rowe_error_timed_out);
  CHECK_EQUAL(rowe_struct_publisher_publish(out, &at, rowe_now_ns()), rowe_ok);
  CHECK_EQUAL(rowe_struct_subscriber_take(all, timeout_ms, &got, NULL), rowe_ok);
  CHECK(got.x == 3);
  SOON(rowe_struct_subscriber_latest(one, &got, NULL));
  rowe_endpoint_free(on);
  CHECK_CODE(rowe_struct_subscriber_take(all, timeout_ms, &got, NULL), rowe_error_closed);
  CHECK_CODE(rowe_struct_publisher_publish(out, &at, rowe_now_ns()), rowe_error_closed);
  CHECK_CODE(rowe_struct_subscriber_try_take(all, &got, NULL), rowe_error_closed);
  CHECK_CODE(rowe_struct_subscriber_latest(one, &got, NULL), rowe_error_closed);
  rowe_struct_subscriber_free(one);
  rowe_struct_subscriber_free(all);
  rowe_struct_publisher_free(out);
}

// A command is in force until its lease is over, and is the same one meanwhile.
static void are_commands_for_as_long_as_their_lease(void) {
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  const struct rowe_topic_options leased = {.bytes = sizeof leased, .lease_ms = 10000};
  const struct rowe_topic_options brief = {.bytes = sizeof brief, .lease_ms = 19};
  CHECK_NULL(rowe_struct_subscriber_open(on, "/at", &point_type, &brief), rowe_error_bad_argument);
  struct rowe_struct_subscriber* const commands =
      rowe_struct_subscriber_open(on, "/at", &point_type, &leased);
  struct rowe_struct_publisher* const out = publisher(on, "/at", &point_type);
  wait_wanted(out);
  struct point got = {0, 0};
  CHECK_CODE(rowe_struct_subscriber_latest_within(commands, rowe_now_ns(), &got, NULL), rowe_error_empty);
  const struct point at = {3, 0};
  CHECK_EQUAL(rowe_struct_publisher_publish(out, &at, rowe_now_ns()), rowe_ok);
  const int64_t sent_ns = rowe_now_ns();
  SOON(rowe_struct_subscriber_latest_within(commands, sent_ns, &got, NULL));
  CHECK(got.x == 3);
  CHECK_EQUAL(rowe_struct_subscriber_latest_within(commands, sent_ns, &got, NULL), rowe_ok);
  CHECK_CODE(rowe_struct_subscriber_latest_within(commands, sent_ns + INT64_C(60000000000), &got, NULL),
             rowe_error_empty);
  CHECK_CODE(rowe_struct_subscriber_latest(commands, &got, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_try_take(commands, &got, NULL), rowe_error_misuse);
  rowe_endpoint_free(on);
  CHECK_CODE(rowe_struct_subscriber_latest_within(commands, sent_ns, &got, NULL), rowe_error_closed);
  rowe_struct_subscriber_free(commands);
  rowe_struct_publisher_free(out);
}

// What peers say on a topic of the program gets there only if that shares it.
static void are_published_by_peers_where_the_topic_is_shared(void) {
  const struct pair p = open_pair();
  const struct rowe_topic_options shared = {.bytes = sizeof shared, .shared = true};
  struct rowe_struct_publisher* const owner = publisher(p.server, "/own", &point_type);
  struct rowe_struct_publisher* const sharer =
      rowe_struct_publisher_open(p.server, "/shared", &point_type, &shared);
  struct rowe_publisher* const text = rowe_publisher_open(p.server, "/shared_text", &shared);
  struct rowe_struct_subscriber* const in[] = {
      rowe_struct_subscriber_open(p.server, "/own", &point_type, NULL),
      rowe_struct_subscriber_open(p.server, "/shared", &point_type, NULL),
      rowe_struct_subscriber_open(p.server, "/shared_text", &point_type, NULL)};
  struct rowe_struct_publisher* const theirs[] = {publisher(p.client, "/own", &point_type),
                                                  publisher(p.client, "/shared", &point_type),
                                                  publisher(p.client, "/shared_text", &point_type)};
  CHECK(sharer != NULL && text != NULL);
  const struct point at = {1, 2};
  for (int i = 0; i < 3; ++i) {
    wait_wanted(theirs[i]);
    CHECK_EQUAL(rowe_struct_publisher_publish(theirs[i], &at, rowe_now_ns()), rowe_ok);
  }
  struct point got = {0, 0};
  SOON(rowe_struct_subscriber_try_take(in[1], &got, NULL));
  SOON(rowe_struct_subscriber_try_take(in[2], &got, NULL));
  CHECK_CODE(rowe_struct_subscriber_try_take(in[0], &got, NULL), rowe_error_empty);
  for (int i = 0; i < 3; ++i) {
    rowe_struct_subscriber_free(in[i]);
    rowe_struct_publisher_free(theirs[i]);
  }
  rowe_publisher_free(text);
  rowe_struct_publisher_free(sharer);
  rowe_struct_publisher_free(owner);
  close_pair(p);
}

// Whether a page of /rowe/types has this text.
static bool types_say(const struct rowe_endpoint* by, const char* wanted) {
  bool found = false;
  for (int64_t from = 0, next = 1; next > 0 && !found; from = next) {
    char ask[64];
    snprintf(ask, sizeof ask, "{\"service\":\"/rowe/types\",\"from\":%lld}", (long long)from);
    struct rowe_object* const page = invoke_text(by, ask, timeout_ms);
    CHECK(page != NULL);
    char* const text = rowe_object_to_text(page);
    found = text != NULL && strstr(text, wanted) != NULL;
    if (rowe_object_get_int64(page, "next", &next) != rowe_ok) next = 0;
    free(text);
    rowe_object_free(page);
  }
  return found;
}

// A table may be gone when its handle is used; peers still learn of the type.
static void have_a_type_that_peers_can_ask_for(void) {
  const struct pair p = open_pair();
  char* const name = malloc(4);
  memcpy(name, "far", 4);
  struct rowe_member* const rows = malloc(sizeof *rows);
  *rows = (struct rowe_member)ROWE_MEMBER(struct point, x, rowe_member_double);
  rows->name = name;
  struct rowe_struct* const table = malloc(sizeof *table);
  *table = (struct rowe_struct){"my/Far", sizeof(struct point), rows, 1};
  struct rowe_struct_publisher* const out = publisher(p.server, "/far", table);
  memset(name, 'x', 3);
  free(name);
  memset(rows, 0, sizeof *rows);
  free(rows);
  free(table);
  CHECK(types_say(p.client, "{\"type\":\"my/Far\",\"members\":[{\"name\":\"far\",\"is\":\"float64\"}]}"));
  rowe_struct_publisher_free(out);

  // Another type on the same topic, and the same one.
  struct rowe_struct_publisher* const first = publisher(p.server, "/typed", &point_type);
  struct rowe_struct_publisher* const second = publisher(p.server, "/typed", &point_type);
  CHECK_NULL(rowe_struct_publisher_open(p.server, "/typed", &everything_type, NULL),
             rowe_error_type_conflict);
  const struct rowe_topic_options other = {.bytes = sizeof other, .type = "Other", .shared = true};
  CHECK_NULL(rowe_struct_publisher_open(p.server, "/typed", &point_type, &other), rowe_error_type_conflict);
  CHECK_NULL(rowe_struct_publisher_open(p.server, "", &point_type, NULL), rowe_error_bad_argument);
  rowe_struct_publisher_free(second);
  rowe_struct_publisher_free(first);
  close_pair(p);
}

// Nothing of a struct without rows is written; it is an object all the same.
static void may_have_no_members(void) {
  const struct rowe_struct none = {"None", sizeof(struct point), NULL, 0};
  struct rowe_endpoint* const on = rowe_open_local_endpoint(0);
  struct rowe_subscriber* const text = rowe_subscriber_open(on, "/none", NULL);
  struct rowe_struct_subscriber* const in = rowe_struct_subscriber_open(on, "/none", &none, NULL);
  struct rowe_struct_publisher* const out = publisher(on, "/none", &none);
  wait_wanted(out);
  struct point at = {1, 2};
  CHECK_EQUAL(rowe_struct_publisher_publish(out, &at, rowe_now_ns()), rowe_ok);
  struct rowe_view view = {0};
  SOON(rowe_subscriber_try_take(text, &view));
  CHECK(view.bytes == 2 && memcmp(view.text, "{}", 2) == 0);
  rowe_view_release(&view);
  SOON(rowe_struct_subscriber_try_take(in, &at, NULL));
  rowe_struct_publisher_free(out);
  rowe_struct_subscriber_free(in);
  rowe_subscriber_free(text);
  rowe_endpoint_free(on);
}

int main(void) {
  may_have_no_members();
  are_written_as_their_table_says();
  arrive_as_they_were_sent();
  are_refused_where_they_do_not_fit();
  of_types_of_ros_are_filled_in();
  of_which_the_newest_counts();
  are_commands_for_as_long_as_their_lease();
  are_published_by_peers_where_the_topic_is_shared();
  have_a_type_that_peers_can_ask_for();
  return failures != 0;
}
