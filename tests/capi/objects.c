// SPDX-License-Identifier: Apache-2.0
// JSON values: built, read, written, and every wrong use of them.
#include "check.h"

#include <rowe/loop.h>

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The value's text, checked and freed.
static void check_json(const char* file, int line, const struct rowe_object* value, const char* expected) {
  char* const text = rowe_object_to_text(value);
  check_text(file, line, "the value", text, expected);
  free(text);
}
#define CHECK_JSON(value, expected) check_json(__FILE__, __LINE__, (value), (expected))

// A text that comes back as it went in.
static void check_round_trip(const char* file, int line, const char* text) {
  struct rowe_object* const value = rowe_object_from_text(text);
  check_json(file, line, value, text);
  rowe_object_free(value);
}
#define CHECK_ROUND_TRIP(text) check_round_trip(__FILE__, __LINE__, (text))

static void a_message_holds_what_it_was_given_in_order(void) {
  struct rowe_object* const message =
      rowe_message("service", rowe_type_string, "add-two-numbers", "a", rowe_type_int, 38, "b", rowe_type_int,
                   4, "exact", rowe_type_boolean, true, "nothing", rowe_type_null, "half", rowe_type_double,
                   0.5, "big", rowe_type_int64, INT64_MIN, NULL);
  CHECK_JSON(message, "{\"service\":\"add-two-numbers\",\"a\":38,\"b\":4,\"exact\":true,\"nothing\":null,"
                      "\"half\":0.5,\"big\":-9223372036854775808}");
  int a = 0;
  int64_t big = 0;
  double half = 0;
  bool exact = false;
  CHECK_EQUAL(rowe_object_get_int(message, "a", &a), rowe_ok);
  CHECK_EQUAL(a, 38);
  CHECK_EQUAL(rowe_object_get_int64(message, "big", &big), rowe_ok);
  CHECK(big == INT64_MIN);
  CHECK_EQUAL(rowe_object_get_double(message, "half", &half), rowe_ok);
  CHECK(half == 0.5);
  CHECK_EQUAL(rowe_object_get_double(message, "a", &half), rowe_ok);
  CHECK(half == 38);
  CHECK_EQUAL(rowe_object_get_boolean(message, "exact", &exact), rowe_ok);
  CHECK(exact);
  CHECK_TEXT(rowe_object_get_string(message, "service"), "add-two-numbers");
  CHECK_EQUAL(rowe_object_type_of(rowe_object_get(message, "nothing")), rowe_type_null);
  CHECK_EQUAL(rowe_object_count(message), 7);
  CHECK_TEXT(rowe_object_key_at(message, 6), "big");
  CHECK(rowe_object_at(message, 6) == rowe_object_get(message, "big"));
  rowe_object_free(message);
}

static void values_nest_as_copies(void) {
  struct rowe_object* const pose =
      rowe_message("x", rowe_type_double, 1.5, "y", rowe_type_double, -2.0, NULL);
  struct rowe_object* const path = rowe_object_new_array();
  CHECK_EQUAL(rowe_object_append(path, rowe_type_object, pose), rowe_ok);
  CHECK_EQUAL(rowe_object_set(pose, "x", rowe_type_int, 3), rowe_ok); // the copy does not see it
  CHECK_EQUAL(rowe_object_append(path, rowe_type_object, pose), rowe_ok);
  CHECK_EQUAL(rowe_object_append(path, rowe_type_null), rowe_ok);
  struct rowe_object* const goal =
      rowe_message("pose", rowe_type_object, pose, "path", rowe_type_array, path, NULL);
  rowe_object_free(pose);
  rowe_object_free(path);
  CHECK_JSON(goal, "{\"pose\":{\"x\":3,\"y\":-2},\"path\":[{\"x\":1.5,\"y\":-2},{\"x\":3,\"y\":-2},null]}");
  double x = 0;
  CHECK_EQUAL(rowe_object_get_double(rowe_object_at(rowe_object_get(goal, "path"), 0), "x", &x), rowe_ok);
  CHECK(x == 1.5);
  CHECK_EQUAL(rowe_object_count(rowe_object_get(goal, "path")), 3);
  CHECK_EQUAL(rowe_object_set(goal, "path", rowe_type_boolean, false), rowe_ok);
  CHECK_EQUAL(rowe_object_set(goal, "new", rowe_type_string, "member"), rowe_ok);
  CHECK_JSON(goal, "{\"pose\":{\"x\":3,\"y\":-2},\"path\":false,\"new\":\"member\"}");
  rowe_object_free(goal);
}

static void an_array_of_many_holds_them_all(void) {
  struct rowe_object* const array = rowe_object_new_array();
  for (int i = 0; i < 1000; ++i) CHECK_EQUAL(rowe_object_append(array, rowe_type_int, i), rowe_ok);
  CHECK_EQUAL(rowe_object_count(array), 1000);
  int last = 0;
  CHECK_EQUAL(rowe_object_as_int(rowe_object_at(array, 999), &last), rowe_ok);
  CHECK_EQUAL(last, 999);
  rowe_object_free(array);
}

static void text_goes_through_unharmed(void) {
  CHECK_ROUND_TRIP("{}");
  CHECK_ROUND_TRIP("[]");
  CHECK_ROUND_TRIP("[[],{},[{\"a\":[1,2,{\"b\":null}]}]]");
  CHECK_ROUND_TRIP("\"caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\xa4\x96\"");
  CHECK_ROUND_TRIP("\"quote \\\" backslash \\\\ tab \\t line \\n bell \\u0007\"");
}

static void bytes_are_base64_or_numbers(void) {
  const unsigned char some[] = {0, 255, 128, 7};
  struct rowe_object* const made = rowe_message("data", rowe_type_bytes, some, sizeof some, "none",
                                                rowe_type_bytes, NULL, (size_t)0, NULL);
  char* const text = rowe_object_to_text(made);
  CHECK_TEXT(text, "{\"data\":\"AP+ABw==\",\"none\":\"\"}");
  char written[64];
  CHECK(rowe_write(written, sizeof written, "data", rowe_type_bytes, some, sizeof some, "none",
                   rowe_type_bytes, NULL, (size_t)0, NULL) == strlen(text));
  CHECK_TEXT(written, text);
  free(text);
  struct rowe_object* const read = rowe_object_from_text(
      "{\"text\":\"AP+ABw==\",\"list\":[0,255,128,7],\"odd\":\"AP+AB\",\"digit\":\"AP-ABw==\","
      "\"back\":\"\\\\/AAA\",\"large\":[256],\"n\":7}");
  const char* const good[] = {"text", "list"};
  for (size_t i = 0; i < 2; ++i) {
    unsigned char into[4] = {0};
    size_t count = 0;
    CHECK_EQUAL(rowe_object_get_bytes(read, good[i], into, sizeof into, &count), rowe_ok);
    CHECK_EQUAL(count, sizeof some);
    CHECK(memcmp(into, some, sizeof some) == 0);
    CHECK_EQUAL(rowe_object_as_bytes(rowe_object_get(read, good[i]), into, sizeof into, NULL), rowe_ok);
    CHECK_CODE(rowe_object_get_bytes(read, good[i], into, 3, &count), rowe_error_too_long);
  }
  unsigned char into[16];
  const char* const wrong[] = {"odd", "digit", "back", "large", "n"};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i)
    CHECK_CODE(rowe_object_get_bytes(read, wrong[i], into, sizeof into, NULL), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_get_bytes(read, "missing", into, sizeof into, NULL), rowe_error_missing_member);
  CHECK_CODE(rowe_object_get_bytes(read, "text", NULL, 4, NULL), rowe_error_misuse);
  CHECK(rowe_message("data", rowe_type_bytes, NULL, (size_t)1, NULL) == NULL);
  rowe_object_free(made);
  rowe_object_free(read);
}

static void numbers_keep_every_digit(void) {
  CHECK_ROUND_TRIP("[9223372036854775807,-9223372036854775808,18446744073709551615]");
  CHECK_ROUND_TRIP("[123456789012345678901234567890,0.1000,1E2,-0.0,3.14159265358979323846]");
  struct rowe_object* const numbers =
      rowe_object_from_text("[2147483647,2147483648,-2147483649,9223372036854775808,1e2,2.0,-0.0]");
  const int types[] = {rowe_type_int,    rowe_type_int64,  rowe_type_int64, rowe_type_double,
                       rowe_type_double, rowe_type_double, rowe_type_double};
  for (size_t i = 0; i < rowe_object_count(numbers); ++i)
    CHECK_EQUAL(rowe_object_type_of(rowe_object_at(numbers, i)), types[i]);
  int narrow = 7;
  int64_t wide = 7;
  double real = 7;
  CHECK_CODE(rowe_object_as_int(rowe_object_at(numbers, 1), &narrow), rowe_error_out_of_range);
  CHECK_EQUAL(narrow, 7);
  CHECK_EQUAL(rowe_object_as_int64(rowe_object_at(numbers, 1), &wide), rowe_ok);
  CHECK_EQUAL(wide, 2147483648LL);
  CHECK_CODE(rowe_object_as_int64(rowe_object_at(numbers, 3), &wide), rowe_error_out_of_range);
  CHECK_EQUAL(rowe_object_as_double(rowe_object_at(numbers, 3), &real), rowe_ok);
  CHECK(real == 9223372036854775808.0);
  CHECK_CODE(rowe_object_as_int64(rowe_object_at(numbers, 4), &wide), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_as_int64(rowe_object_at(numbers, 5), &wide), rowe_error_wrong_type);
  CHECK_EQUAL(rowe_object_as_double(rowe_object_at(numbers, 6), &real), rowe_ok);
  CHECK(real == 0 && signbit(real));
  rowe_object_free(numbers);

  const double doubles[] = {0.1, DBL_MAX, DBL_MIN, DBL_TRUE_MIN, -1e-7, 9007199254740993.0, 1.0 / 3};
  for (size_t i = 0; i < sizeof doubles / sizeof *doubles; ++i) {
    struct rowe_object* const made = rowe_message("x", rowe_type_double, doubles[i], NULL);
    char* const text = rowe_object_to_text(made);
    struct rowe_object* const read = rowe_object_from_text(text);
    CHECK_EQUAL(rowe_object_get_double(read, "x", &real), rowe_ok);
    CHECK(real == doubles[i]);
    free(text);
    rowe_object_free(made);
    rowe_object_free(read);
  }
}

static void escapes_are_resolved(void) {
  struct rowe_object* const read =
      rowe_object_from_text(" { \"\\u0061\\/\" : \"\\ud83e\\udd16 \\u20ac\\n\" , \"nul\" : \"a\\u0000b\" } ");
  CHECK_TEXT(rowe_object_get_string(read, "a/"), "\xf0\x9f\xa4\x96 \xe2\x82\xac\n");
  CHECK_EQUAL(rowe_object_string_bytes(rowe_object_get(read, "nul")), 3);
  CHECK(memcmp(rowe_object_get_string(read, "nul"), "a\0b", 4) == 0);
  CHECK_JSON(read, "{\"a/\":\"\xf0\x9f\xa4\x96 \xe2\x82\xac\\n\",\"nul\":\"a\\u0000b\"}");
  rowe_object_free(read);
}

static void of_two_members_with_one_name_the_first_is_found(void) {
  struct rowe_object* const read = rowe_object_from_text("{\"a\":1,\"a\":2}");
  int a = 0;
  CHECK_EQUAL(rowe_object_get_int(read, "a", &a), rowe_ok);
  CHECK_EQUAL(a, 1);
  CHECK_JSON(read, "{\"a\":1,\"a\":2}");
  rowe_object_free(read);
}

static void what_is_no_json_is_malformed(void) {
  const char* const texts[] = {"", "nul", "1 2", "\"\xff\"", "{\"a\" 1}"}; // tests/json has all others
  for (size_t i = 0; i < sizeof texts / sizeof *texts; ++i)
    CHECK_NULL(rowe_object_from_text(texts[i]), rowe_error_malformed);
  CHECK(strstr(rowe_last_error_text(), "byte 5") != NULL);
}

static void values_nest_only_so_deep(void) {
  char text[2 * 65 + 1];
  memset(text, '[', 65);
  memset(text + 65, ']', 65);
  text[130] = '\0';
  CHECK_NULL(rowe_object_from_text(text), rowe_error_too_deep);
  text[129] = '\0'; // 64 levels, from the second bracket on
  struct rowe_object* const deepest = rowe_object_from_text(text + 1);
  CHECK_JSON(deepest, text + 1);
  CHECK_NULL(rowe_message("a", rowe_type_array, deepest, NULL), rowe_error_too_deep);
  struct rowe_object* const array = rowe_object_new_array();
  CHECK_CODE(rowe_object_append(array, rowe_type_array, deepest), rowe_error_too_deep);
  struct rowe_object* const object = rowe_message("a", rowe_type_int, 1, NULL);
  CHECK_CODE(rowe_object_set(object, "a", rowe_type_array, deepest), rowe_error_too_deep);
  CHECK_CODE(rowe_object_set(object, "b", rowe_type_array, deepest), rowe_error_too_deep);
  CHECK_JSON(object, "{\"a\":1}");
  CHECK_EQUAL(rowe_object_count(array), 0);
  rowe_object_free(deepest);
  rowe_object_free(array);
  rowe_object_free(object);
}

static void a_message_with_an_odd_argument_is_none(void) {
  struct rowe_object* const array = rowe_object_new_array();
  const char* const none = NULL;
  CHECK_NULL(rowe_message("a", 99, 1, NULL), rowe_error_wrong_type);
  CHECK_NULL(rowe_message("a", -1, 1, NULL), rowe_error_wrong_type);
  CHECK_NULL(rowe_message("a", rowe_type_int, 1, "b", 1000, NULL), rowe_error_wrong_type);
  CHECK_NULL(rowe_message("a", rowe_type_object, array, NULL), rowe_error_wrong_type);
  CHECK_NULL(rowe_message("a", rowe_type_string, none, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_message("a", rowe_type_array, (struct rowe_object*)NULL, NULL), rowe_error_misuse);
  CHECK_NULL(rowe_message("a", rowe_type_int, 1, "a", rowe_type_int, 2, NULL), rowe_error_duplicate_member);
  CHECK_NULL(rowe_message("a", rowe_type_string, "\xff", NULL), rowe_error_malformed);
  CHECK_NULL(rowe_message("\xff", rowe_type_int, 1, NULL), rowe_error_malformed);
  CHECK_NULL(rowe_message("a", rowe_type_double, (double)INFINITY, NULL), rowe_error_out_of_range);
  CHECK_NULL(rowe_message("a", rowe_type_double, (double)NAN, NULL), rowe_error_out_of_range);
  CHECK_CODE(rowe_object_append(array, 99, 1), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_set(array, "a", rowe_type_int, 1), rowe_error_wrong_type);
  struct rowe_object* const object = rowe_object_from_text("{}");
  CHECK_CODE(rowe_object_append(object, rowe_type_int, 1), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_set(object, "\xff", rowe_type_int, 1), rowe_error_malformed);
  CHECK_CODE(rowe_object_set(object, "a", 99, 1), rowe_error_wrong_type);
  CHECK_JSON(object, "{}");
  rowe_object_free(object);
  rowe_object_free(array);
}

static void a_value_of_another_type_is_an_error_of_its_own(void) {
  struct rowe_object* const read =
      rowe_object_from_text("{\"s\":\"x\",\"n\":1,\"b\":true,\"z\":null,\"a\":[1]}");
  int i;
  int64_t l;
  double d;
  bool b;
  CHECK_NULL(rowe_object_get_string(read, "n"), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_get_int(read, "s", &i), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_get_int64(read, "b", &l), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_get_double(read, "z", &d), rowe_error_wrong_type);
  CHECK_CODE(rowe_object_get_boolean(read, "n", &b), rowe_error_wrong_type);
  CHECK_NULL(rowe_object_get(rowe_object_get(read, "a"), "x"), rowe_error_wrong_type);
  CHECK_NULL(rowe_object_at(rowe_object_get(read, "s"), 0), rowe_error_wrong_type);
  CHECK_NULL(rowe_object_key_at(rowe_object_get(read, "a"), 0), rowe_error_wrong_type);
  CHECK_NULL(rowe_object_get(read, "missing"), rowe_error_missing_member);
  CHECK_NULL(rowe_object_get_string(read, "missing"), rowe_error_missing_member);
  CHECK_CODE(rowe_object_get_int(read, "missing", &i), rowe_error_missing_member);
  CHECK_CODE(rowe_object_get_int64(read, "missing", &l), rowe_error_missing_member);
  CHECK_CODE(rowe_object_get_double(read, "missing", &d), rowe_error_missing_member);
  CHECK_CODE(rowe_object_get_boolean(read, "missing", &b), rowe_error_missing_member);
  CHECK_CODE(rowe_object_as_int(rowe_object_get(read, "missing"), &i), rowe_error_missing_member);

  // The texts name the member, what was wanted and what is there.
  CHECK_CODE(rowe_object_get_int(read, "missing", &i), rowe_error_missing_member);
  CHECK_TEXT(rowe_last_error_text(), "a member or element that is wanted is missing: the member \"missing\": "
                                     "the object has none of this name");
  CHECK_CODE(rowe_object_get_int(read, "s", &i), rowe_error_wrong_type);
  CHECK_TEXT(rowe_last_error_text(), "a value is of another type than is wanted: the member \"s\": "
                                     "a whole number is wanted, it is a string");
  CHECK_NULL(rowe_object_at(rowe_object_get(read, "a"), 9), rowe_error_missing_member);
  CHECK(strstr(rowe_last_error_text(), "the index is 9, and there are ") != NULL);
  CHECK_NULL(rowe_object_get(rowe_object_get(read, "a"), "x"), rowe_error_wrong_type);
  CHECK(strstr(rowe_last_error_text(), "an object is wanted, it is an array") != NULL);
  CHECK_NULL(rowe_object_as_string(rowe_object_get(read, "missing")), rowe_error_missing_member);
  CHECK_NULL(rowe_object_at(rowe_object_get(read, "a"), 1), rowe_error_missing_member);
  CHECK_NULL(rowe_object_key_at(read, 5), rowe_error_missing_member);
  CHECK_EQUAL(rowe_object_count(rowe_object_get(read, "s")), 0);
  CHECK_EQUAL(rowe_object_string_bytes(rowe_object_get(read, "n")), 0);
  CHECK_EQUAL(rowe_object_type_of(rowe_object_get(read, "s")), rowe_type_string);
  CHECK_EQUAL(rowe_object_type_of(rowe_object_get(read, "b")), rowe_type_boolean);
  CHECK_EQUAL(rowe_object_type_of(rowe_object_get(read, "a")), rowe_type_array);
  CHECK_EQUAL(rowe_object_type_of(read), rowe_type_object);
  rowe_object_free(read);
}

int main(void) {
  a_message_holds_what_it_was_given_in_order();
  values_nest_as_copies();
  an_array_of_many_holds_them_all();
  text_goes_through_unharmed();
  bytes_are_base64_or_numbers();
  numbers_keep_every_digit();
  escapes_are_resolved();
  of_two_members_with_one_name_the_first_is_found();
  what_is_no_json_is_malformed();
  values_nest_only_so_deep();
  a_message_with_an_odd_argument_is_none();
  a_value_of_another_type_is_an_error_of_its_own();
  return failures != 0;
}
