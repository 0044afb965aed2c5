// SPDX-License-Identifier: Apache-2.0
// Tables that are wrong: each is refused at set-up, and the text names the member and the limit.
#include "check.h"

#include <stdlib.h>

#include <rowe/struct.h>

struct odd {
  int32_t a;
  double b;
  uint16_t n;
  char text[4];
  int32_t list[3];
};

static struct rowe_endpoint* endpoint;

static void expect_refused(int line, const struct rowe_struct* table, const char* says) {
  for (int subscribes = 0; subscribes < 2; ++subscribes) {
    const void* const made = subscribes ? (void*)rowe_struct_subscriber_open(endpoint, "/x", table, NULL)
                                        : (void*)rowe_struct_publisher_open(endpoint, "/x", table, NULL);
    const bool right = made == NULL && rowe_last_error() == rowe_error_bad_argument &&
                       strstr(rowe_last_error_text(), says) != NULL;
    if (right) continue;
    ++failures;
    fprintf(stderr, "%s:%d: %s is not in: %s\n", __FILE__, line, says, rowe_last_error_text());
  }
}
#define REFUSED(table, says) expect_refused(__LINE__, table, says)

// A table of one row.
#define ROW_REFUSED(says, ...)                                                                               \
  do {                                                                                                       \
    const struct rowe_member row = {__VA_ARGS__};                                                            \
    const struct rowe_struct table = {"Odd", sizeof(struct odd), &row, 1};                                   \
    REFUSED(&table, says);                                                                                   \
  } while (0)

#define A_ROW .type = rowe_member_int32, .offset = offsetof(struct odd, a), .bytes = 4
#define A_LIST .type = rowe_member_int32, .offset = offsetof(struct odd, list), .bytes = 4

static void names(void) {
  ROW_REFUSED("member 0 of the struct \"Odd\": its name is NULL", A_ROW);
  ROW_REFUSED("its name is empty", .name = "", A_ROW);
  ROW_REFUSED("no UTF-8", .name = "caf\xe9", A_ROW);
  char* const many = malloc(1000);
  memset(many, 'x', 999);
  many[999] = '\0';
  ROW_REFUSED("longer than 128 bytes", .name = many, A_ROW);
  ROW_REFUSED("longer than 128 bytes", .name = "a", A_ROW, .other_name = many);
  ROW_REFUSED("no UTF-8", .name = "a", A_ROW, .other_name = "\xff");
  ROW_REFUSED("another member has the same name", .name = "a", A_ROW, .other_name = "a");
  const struct rowe_member twice[] = {ROWE_MEMBER(struct odd, a, rowe_member_int32),
                                      ROWE_MEMBER(struct odd, b, rowe_member_double),
                                      {.name = "b", A_LIST}};
  const struct rowe_struct same = {"Odd", sizeof(struct odd), twice, 3};
  REFUSED(&same, "member 2 \"b\" of the struct \"Odd\": another member has the same name");
  const struct rowe_struct wrong_type = {"\xff", sizeof(struct odd), twice, 2};
  REFUSED(&wrong_type, "a struct: its name is no UTF-8");
  const struct rowe_struct long_type = {many, sizeof(struct odd), twice, 2};
  REFUSED(&long_type, "longer than 128 bytes");
  many[128] = '\0';
  const struct rowe_struct longest = {many, sizeof(struct odd), twice, 2};
  struct rowe_struct_publisher* const fits = rowe_struct_publisher_open(endpoint, "/longest", &longest, NULL);
  CHECK(fits != NULL);
  rowe_struct_publisher_free(fits);
  free(many);
}

static void types_and_forms(void) {
  ROW_REFUSED("member 0 \"a\" of the struct \"Odd\": its type is none", .name = "a", .bytes = 4);
  ROW_REFUSED("its type is none", .name = "a", .type = rowe_member_duration + 1, .bytes = 4);
  ROW_REFUSED("its form is none", .name = "a", .type = -1, .bytes = 4);
  ROW_REFUSED("its form is none", .name = "a", .type = INT32_MIN, .bytes = 4);
  ROW_REFUSED("its form is none", .name = "a", .type = INT32_MAX, .bytes = 4);
  ROW_REFUSED("its form is none", .name = "b", .type = rowe_member_double | 0xb000, .bytes = 8);
  ROW_REFUSED("its type has no such form", .name = "b", .type = rowe_member_double | rowe_member_as_string,
              .bytes = 8);
  ROW_REFUSED("its type has no such form", .name = "a", .type = rowe_member_int32 | rowe_member_as_seconds,
              .bytes = 4);
  ROW_REFUSED("its type has no such form", .name = "a", .type = rowe_member_int32 | rowe_member_decimals_0,
              .bytes = 4);
  ROW_REFUSED("its type has no such form", .name = "a", .type = rowe_member_uint8 | rowe_member_as_numbers,
              .bytes = 1);
  ROW_REFUSED("it has two forms", .name = "b",
              .type = rowe_member_time | rowe_member_as_seconds | rowe_member_as_string, .bytes = 8);
  ROW_REFUSED("8 (limit 4): member 0 \"a\" of the struct \"Odd\": its size is not that of its type",
              .name = "a", .type = rowe_member_int32, .bytes = 8);
  ROW_REFUSED("its size is not that of its type", .name = "a", .type = rowe_member_int32);
  ROW_REFUSED("a text needs 2 bytes at least", .name = "text", .type = rowe_member_text, .bytes = 1);
  ROW_REFUSED("a text needs 2 bytes", .name = "text", .type = rowe_member_text, .bytes = SIZE_MAX);
  ROW_REFUSED("the table of its struct is NULL", .name = "a", .type = rowe_member_struct, .bytes = 4);
}

static void names_of_values(void) {
  const struct rowe_name none = {NULL, 0}, empty = {"", 0}, latin = {"caf\xe9", 0};
  const struct rowe_name large = {"a", INT64_C(1) << 31}, small = {"a", -1 - (INT64_C(1) << 31)};
  const struct rowe_name same[] = {{"a", 0}, {"b", 1}, {"a", 2}}, alike[] = {{"a", 0}, {"b", 0}};
  ROW_REFUSED("it is written by name, and has no names", .name = "a",
              .type = rowe_member_int32 | rowe_member_by_name, .bytes = 4);
  ROW_REFUSED("its type has no such form", .name = "b", .type = rowe_member_double | rowe_member_by_name,
              .bytes = 8);
  ROW_REFUSED("its type has no such form", .name = "b", .type = rowe_member_double, .bytes = 8, .names = same,
              .name_count = 1);
  ROW_REFUSED("its type has no such form", .name = "text", .type = rowe_member_text | rowe_member_by_name,
              .bytes = 4);
  ROW_REFUSED("it has two forms", .name = "a",
              .type = rowe_member_int32 | rowe_member_by_name | rowe_member_as_string, .bytes = 4);
  ROW_REFUSED("its names are NULL", .name = "a", A_ROW, .name_count = 1);
  ROW_REFUSED("more than 1024 names", .name = "a", A_ROW, .names = same, .name_count = 1025);
  ROW_REFUSED("more than 1024 names", .name = "a", A_ROW, .names = same, .name_count = SIZE_MAX);
  ROW_REFUSED("one of its names is missing", .name = "a", A_ROW, .names = &none, .name_count = 1);
  ROW_REFUSED("one of its names is missing", .name = "a", A_ROW, .names = &empty, .name_count = 1);
  ROW_REFUSED("no UTF-8", .name = "a", A_ROW, .names = &latin, .name_count = 1);
  ROW_REFUSED("does not have the value", .name = "a", A_ROW, .names = &large, .name_count = 1);
  ROW_REFUSED("does not have the value", .name = "a", A_ROW, .names = &small, .name_count = 1);
  ROW_REFUSED("does not have the value", .name = "n", .type = rowe_member_uint16, .offset = 16, .bytes = 2,
              .names = &small, .name_count = 1);
  ROW_REFUSED("two of its names", .name = "a", A_ROW, .names = same, .name_count = 3);
  ROW_REFUSED("two of its names", .name = "a", A_ROW, .names = alike, .name_count = 2);
}

static void places(void) {
  ROW_REFUSED("2 (limit 4): member 0 \"a\" of the struct \"Odd\": its offset is misaligned", .name = "a",
              .type = rowe_member_int32, .offset = 2, .bytes = 4);
  const size_t beyond[] = {sizeof(struct odd), sizeof(struct odd) + 4, SIZE_MAX - 3, SIZE_MAX / 4 * 4 - 4};
  for (size_t i = 0; i < sizeof beyond / sizeof *beyond; ++i)
    ROW_REFUSED("member 0 \"a\" of the struct \"Odd\": it lies beyond the end of the struct", .name = "a",
                .type = rowe_member_int32, .offset = beyond[i], .bytes = 4);
  ROW_REFUSED("it lies beyond the end", .name = "text", .type = rowe_member_text, .offset = 1,
              .bytes = sizeof(struct odd));
  const size_t counts[] = {5, 6, UINT32_MAX};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i)
    ROW_REFUSED("it lies beyond the end", .name = "list", A_LIST, .count = counts[i]);
  ROW_REFUSED("too many elements", .name = "list", A_LIST, .count = SIZE_MAX);
  ROW_REFUSED("too many elements", .name = "list", A_LIST, .count = SIZE_MAX / 4 + 2);
  const struct rowe_member both[] = {ROWE_MEMBER(struct odd, b, rowe_member_double),
                                     {.name = "half", .type = rowe_member_int32, .offset = 12, .bytes = 4}};
  const struct rowe_struct shared = {"Odd", sizeof(struct odd), both, 2};
  REFUSED(&shared, "member 1 \"half\" of the struct \"Odd\": it lies on another member");
  const struct rowe_struct odd_size = {"Odd", sizeof(struct odd) - 4, both, 1};
  REFUSED(&odd_size, "its size is no multiple");
}

static void counts(void) {
#define COUNTED A_LIST, .count = 3
  ROW_REFUSED("its counting member is of no type of integer", .name = "list", COUNTED,
              .count_type = rowe_member_double);
  ROW_REFUSED("its counting member is of no type of integer", .name = "list", COUNTED, .count_type = -1);
  ROW_REFUSED("its counting member is misaligned", .name = "list", COUNTED, .count_type = rowe_member_uint16,
              .count_offset = 17);
  ROW_REFUSED("its counting member lies beyond", .name = "list", COUNTED, .count_type = rowe_member_uint16,
              .count_offset = SIZE_MAX - 1);
  ROW_REFUSED("its counting member lies beyond", .name = "list", COUNTED, .count_type = rowe_member_uint64,
              .count_offset = sizeof(struct odd));
  ROW_REFUSED("it is counted, and no array", .name = "a", A_ROW, .count_type = rowe_member_uint16);
  ROW_REFUSED("its counting member lies on a member", .name = "list", COUNTED,
              .count_type = rowe_member_uint32, .count_offset = offsetof(struct odd, list));
  // One that a struct inside begins with: what is read there would be longer than a number.
  const struct rowe_member inner[] = {ROWE_MEMBER(struct odd, a, rowe_member_int32),
                                      ROWE_MEMBER(struct odd, b, rowe_member_double)};
  const struct rowe_struct inside = {"Inside", 16, inner, 2};
  const struct rowe_member rows[] = {
      {.name = "inside", .type = rowe_member_struct, .bytes = 16, .inside = &inside},
      {.name = "list", COUNTED, .count_type = rowe_member_int32}};
  const struct rowe_struct table = {"Odd", sizeof(struct odd), rows, 2};
  REFUSED(&table, "member 1 \"list\" of the struct \"Odd\": its counting member lies on a member of another");
  const struct rowe_member two[] = {{.name = "one",
                                     .type = rowe_member_int32,
                                     .offset = 24,
                                     .bytes = 4,
                                     .count = 1,
                                     .count_type = rowe_member_uint16,
                                     .count_offset = 2},
                                    {.name = "two",
                                     .type = rowe_member_int32,
                                     .offset = 28,
                                     .bytes = 4,
                                     .count = 1,
                                     .count_type = rowe_member_uint32}};
  const struct rowe_struct crossed = {"Odd", sizeof(struct odd), two, 2};
  REFUSED(&crossed, "its counting member lies on another one");
}

static void sizes(void) {
  const struct rowe_member row = ROWE_MEMBER(struct odd, a, rowe_member_int32);
  const struct rowe_struct empty = {"Odd", 0, &row, 1};
  REFUSED(&empty, "its size is 0");
  const struct rowe_struct vast = {"Odd", SIZE_MAX, &row, 1};
  REFUSED(&vast, "beyond 2 GiB");
  const struct rowe_struct no_rows = {"Odd", 4, NULL, 1};
  REFUSED(&no_rows, "its rows are NULL");
  const struct rowe_struct many = {"Odd", 4, &row, 1025};
  REFUSED(&many, "1025 (limit 1024): the struct \"Odd\": it has more than 1024 members");
  const struct rowe_struct most = {"Odd", 4, &row, SIZE_MAX};
  REFUSED(&most, "more than 1024 members");
  // One that the memory of handles does not hold.
  const struct rowe_struct large = {"Odd", 1U << 30, &row, 1};
  CHECK_NULL(rowe_struct_publisher_open(endpoint, "/x", &large, NULL), rowe_error_handle_memory);
  CHECK_NULL(rowe_struct_subscriber_open(endpoint, "/x", &large, NULL), rowe_error_handle_memory);
}

// Each table in the next one, `levels` of them, as a member or as an array.
static const char* nested(size_t levels, size_t count) {
  enum { most = 64 };
  static struct rowe_member rows[most];
  static struct rowe_struct tables[most];
  rows[0] = (struct rowe_member){.name = "a", .type = rowe_member_int32, .bytes = 4};
  tables[0] = (struct rowe_struct){NULL, 4, rows, 1};
  for (size_t i = 1; i < levels; ++i) {
    rows[i] = (struct rowe_member){
        .name = "in", .type = rowe_member_struct, .bytes = 4, .count = count, .inside = &tables[i - 1]};
    tables[i] = (struct rowe_struct){NULL, 4, &rows[i], 1};
  }
  struct rowe_struct_publisher* const out =
      rowe_struct_publisher_open(endpoint, "/nested", &tables[levels - 1], NULL);
  struct rowe_struct_subscriber* const in =
      rowe_struct_subscriber_open(endpoint, "/nested", &tables[levels - 1], NULL);
  CHECK((out == NULL) == (in == NULL));
  const bool opened = out != NULL;
  rowe_struct_publisher_free(out);
  rowe_struct_subscriber_free(in);
  return opened ? "" : rowe_last_error_text();
}

static void depths(void) {
  CHECK_TEXT(nested(32, 0), "");
  CHECK(strstr(nested(33, 0), "nests deeper than the limit of 32 levels") != NULL);
  CHECK(strstr(nested(64, 0), "nests deeper than the limit of 32 levels") != NULL);
  CHECK_TEXT(nested(16, 1), "");
  CHECK(strstr(nested(17, 1), "33 (limit 32)") != NULL);

  struct rowe_member row = {.name = "again", .type = rowe_member_struct, .bytes = 8};
  const struct rowe_struct itself = {"Itself", 8, &row, 1};
  row.inside = &itself;
  REFUSED(&itself, "member 0 \"again\" of the struct \"Itself\": its table contains itself");
  struct rowe_member other_row = {.name = "other", .type = rowe_member_struct, .bytes = 8, .inside = &itself};
  const struct rowe_struct other = {"Other", 8, &other_row, 1};
  row.inside = &other;
  REFUSED(&itself, "contains itself");
}

// Each table has many of the one before, so what a walk would visit grows without end.
static void members_in_all(void) {
  enum { wide = 256, tables_max = 4 };
  static struct rowe_member rows[tables_max][wide];
  static char many_names[wide][8];
  static struct rowe_struct tables[tables_max];
  const struct rowe_member least = {.name = "a", .type = rowe_member_int8, .bytes = 1};
  const struct rowe_struct leaf = {NULL, 1, &least, 1};
  for (size_t level = 0; level < tables_max; ++level) {
    const struct rowe_struct* const inside = level == 0 ? &leaf : &tables[level - 1];
    for (size_t i = 0; i < wide; ++i) {
      snprintf(many_names[i], sizeof many_names[i], "m%zu", i);
      rows[level][i] = (struct rowe_member){.name = many_names[i],
                                            .type = rowe_member_struct,
                                            .offset = i * inside->bytes,
                                            .bytes = inside->bytes,
                                            .inside = inside};
    }
    tables[level] = (struct rowe_struct){NULL, wide * inside->bytes, rows[level], wide};
  }
  struct rowe_struct_publisher* const fits = rowe_struct_publisher_open(endpoint, "/x", &tables[0], NULL);
  CHECK(fits != NULL);
  rowe_struct_publisher_free(fits);
  REFUSED(&tables[1], "more than 16384 members");
  REFUSED(&tables[2], "more than 16384 members");
}

static void nulls(void) {
  const struct rowe_member row = ROWE_MEMBER(struct odd, a, rowe_member_int32);
  const struct rowe_struct table = {"Odd", sizeof(struct odd), &row, 1};
  struct odd value = {0};
  CHECK_NULL(rowe_struct_publisher_open(NULL, "/x", &table, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_publisher_open(endpoint, NULL, &table, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_publisher_open(endpoint, "/x", NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_subscriber_open(NULL, "/x", &table, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_subscriber_open(endpoint, NULL, &table, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_struct_subscriber_open(endpoint, "/x", NULL, NULL), rowe_error_misuse);
  const struct rowe_topic_options odd = {.bytes = sizeof odd, .priority = 9};
  CHECK_NULL(rowe_struct_publisher_open(endpoint, "/x", &table, &odd), rowe_error_bad_argument);
  struct rowe_struct_publisher* const out = rowe_struct_publisher_open(endpoint, "/x", &table, NULL);
  struct rowe_struct_subscriber* const in = rowe_struct_subscriber_open(endpoint, "/x", &table, NULL);
  CHECK_CODE(rowe_struct_publisher_publish(NULL, &value, 0), rowe_error_misuse);
  CHECK_CODE(rowe_struct_publisher_publish(out, NULL, 0), rowe_error_misuse);
  CHECK(!rowe_struct_publisher_wanted(NULL));
  CHECK_CODE(rowe_struct_subscriber_try_take(NULL, &value, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_try_take(in, NULL, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_latest(NULL, &value, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_latest(in, NULL, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_latest_within(NULL, 0, &value, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_latest_within(in, 0, NULL, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_latest_within(in, 0, &value, NULL), rowe_error_misuse); // no lease
  CHECK_CODE(rowe_struct_subscriber_take(NULL, 0, &value, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_take(in, 0, NULL, NULL), rowe_error_misuse);
  CHECK_CODE(rowe_struct_subscriber_take(in, 0, &value, NULL), rowe_error_timed_out);
  rowe_struct_publisher_free(NULL);
  rowe_struct_subscriber_free(NULL);
  rowe_struct_publisher_free(out);
  rowe_struct_subscriber_free(in);
}

static uint64_t chance; // of xorshift

static size_t below(size_t n) {
  chance ^= chance << 13;
  chance ^= chance >> 7;
  chance ^= chance << 17;
  return (size_t)(chance % n);
}
// Mostly small, sometimes what overflows.
static size_t any_size(size_t usual) {
  const size_t odd[] = {SIZE_MAX, SIZE_MAX / 2 + 1, UINT32_MAX, (size_t)UINT32_MAX + 1, SIZE_MAX - 7};
  return below(20) == 0 ? odd[below(5)] : below(usual + 1);
}

// Tables of chance: they are refused, or messages go through them, whatever the struct's bytes are.
static void of_chance(void) {
  enum { rows_max = 6, tables = 3000, struct_bytes = 64 };
  static const size_t sizes[] = {0, 1, 1, 2, 4, 8, 1, 2, 4, 8, 4, 8, 5, 16, 8, 8, 3};
  static const char* const names[] = {"a", "b", "c", "d", "e", "f", "\xff", "", NULL};
  const struct rowe_member inner[] = {{.name = "x", .type = rowe_member_double, .bytes = 8},
                                      {.name = "n", .type = rowe_member_uint8, .offset = 8, .bytes = 1}};
  const struct rowe_struct inside = {"Inside", 16, inner, 2};
  const struct rowe_name values[] = {{"zero", 0}, {"one", 1}};
  const uint64_t seed = (uint64_t)rowe_now_ns() | 1;
  chance = seed;
  int taken = 0;
  for (int i = 0; i < tables; ++i) {
    struct rowe_member rows[rows_max];
    const size_t count = 1 + below(rows_max);
    for (size_t k = 0; k < count; ++k) {
      const size_t type = below(17);
      rows[k] = (struct rowe_member){.name = below(12) == 0 ? names[below(9)] : names[k],
                                     .type = (int)type,
                                     .offset = below(3) == 0 ? any_size(struct_bytes) : 8 * k + 8 * below(2),
                                     .bytes = below(20) == 0 ? any_size(16) : sizes[type],
                                     .count = below(3) == 0 ? any_size(8) : 0};
      if (below(6) == 0) rows[k].type |= 0x100 << below(9);
      if (rows[k].count != 0 && below(2) == 0) {
        rows[k].count_type = (int)below(17);
        rows[k].count_offset = any_size(struct_bytes);
      }
      if (below(8) != 0) rows[k].inside = &inside;
      if (below(8) == 0) rows[k].names = values;
      if (below(8) == 0) rows[k].name_count = any_size(2);
    }
    const struct rowe_struct table = {"Chance", struct_bytes, rows, count};
    struct rowe_struct_subscriber* const in = rowe_struct_subscriber_open(endpoint, "/chance", &table, NULL);
    struct rowe_struct_publisher* const out = rowe_struct_publisher_open(endpoint, "/chance", &table, NULL);
    CHECK_EQUAL(in == NULL, out == NULL);
    if (in != NULL && ++taken < 200) {
      unsigned char bytes[struct_bytes], got[struct_bytes + 1];
      for (size_t k = 0; k < sizeof bytes; ++k) bytes[k] = (unsigned char)below(256);
      got[struct_bytes] = 0xa5;
      while (!rowe_struct_publisher_wanted(out)) {
      }
      CHECK_EQUAL(rowe_struct_publisher_publish(out, bytes, rowe_now_ns()), rowe_ok);
      const int code = rowe_struct_subscriber_take(in, 20, got, NULL); // a float may be null, an enum no name
      CHECK(code == rowe_ok || code == rowe_error_timed_out);
      CHECK_EQUAL(got[struct_bytes], 0xa5);
    }
    rowe_struct_publisher_free(out);
    rowe_struct_subscriber_free(in);
  }
  CHECK(taken > 0);
  if (failures != 0) fprintf(stderr, "seed %llu, %d tables taken\n", (unsigned long long)seed, taken);
}

int main(void) {
  endpoint = rowe_open_local_endpoint(0);
  names();
  types_and_forms();
  names_of_values();
  places();
  counts();
  sizes();
  depths();
  members_in_all();
  nulls();
  of_chance();
  rowe_endpoint_free(endpoint);
  return failures != 0;
}
