// SPDX-License-Identifier: Apache-2.0
// JSON text in place, as loops write and read it.
#include "check.h"

#include <math.h>

#include <rowe/loop.h>

static void text_is_written_in_place(void) {
  char buffer[256];
  const char* const written =
      "{\"caf\xc3\xa9\":\"a\\\"b\",\"i\":-1,\"l\":9223372036854775807,\"d\":0.1,\"t\":true,"
      "\"n\":null,\"nan\":null,\"o\":{\"x\":1},\"a\":[1,2]}";
  const size_t bytes =
      rowe_write(buffer, sizeof buffer, "caf\xc3\xa9", rowe_type_string, "a\"b", "i", rowe_type_int, -1, "l",
                 rowe_type_int64, INT64_MAX, "d", rowe_type_double, 0.1, "t", rowe_type_boolean, true, "n",
                 rowe_type_null, "nan", rowe_type_double, (double)NAN, "o", rowe_type_object, "{\"x\":1}",
                 "a", rowe_type_array, "[1,2]", NULL);
  CHECK_TEXT(buffer, written);
  CHECK_EQUAL(bytes, strlen(written));
  for (size_t small = 0; small <= bytes; ++small)
    CHECK_EQUAL(rowe_write(buffer, small, "o", rowe_type_object, written, NULL), 0);
  const char* const none = NULL;
  CHECK_EQUAL(rowe_write(buffer, 9, "x", rowe_type_int, 1, NULL), 7);
  CHECK_EQUAL(rowe_write(buffer, 8, "x", rowe_type_int, 1, NULL), 7);
  CHECK_EQUAL(rowe_write(buffer, 7, "x", rowe_type_int, 1, NULL), 0);
  CHECK_TEXT(buffer, "");
  CHECK_EQUAL(rowe_write(buffer, sizeof buffer, "x", 99, 1, NULL), 0);
  CHECK_EQUAL(rowe_write(buffer, sizeof buffer, "x", rowe_type_string, none, NULL), 0);
  CHECK_EQUAL(rowe_write(buffer, sizeof buffer, "x", rowe_type_array, none, NULL), 0);
  CHECK_EQUAL(rowe_write(NULL, 1, "x", rowe_type_int, 1, NULL), 0);
}

static void text_is_read_in_place(void) {
  const char* const text = "{\"i\":-9223372036854775808,\"h\":9223372036854775808,\"d\":0.5,\"t\":true,"
                           "\"s\":\"\\u00e9\\/x\",\"z\":null}";
  const size_t bytes = strlen(text);
  int64_t i = 7;
  double d = 7;
  bool t = false;
  char buffer[5] = "?";
  CHECK_EQUAL(rowe_read_int64(text, bytes, "i", &i), rowe_ok);
  CHECK(i == INT64_MIN);
  CHECK_EQUAL(rowe_read_double(text, bytes, "h", &d), rowe_ok);
  CHECK(d == 9223372036854775808.0);
  CHECK_EQUAL(rowe_read_boolean(text, bytes, "t", &t), rowe_ok);
  CHECK(t);
  CHECK_EQUAL(rowe_read_string(text, bytes, "s", buffer, 5), rowe_ok);
  CHECK_TEXT(buffer, "\xc3\xa9/x");
  CHECK_CODE(rowe_read_string(text, bytes, "s", buffer, 4), rowe_error_too_long);
  CHECK_TEXT(buffer, "");
  CHECK_CODE(rowe_read_string(text, bytes, "s", buffer, 0), rowe_error_too_long);
  CHECK_CODE(rowe_read_int64(text, bytes, "h", &i), rowe_error_out_of_range);
  CHECK_CODE(rowe_read_int64(text, bytes, "d", &i), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_int64(text, bytes, "s", &i), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_double(text, bytes, "s", &d), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_boolean(text, bytes, "z", &t), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_string(text, bytes, "d", buffer, 5), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_double("[1]", 3, "d", &d), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_int64(text, bytes, "none", &i), rowe_error_missing_member);
  CHECK_CODE(rowe_read_double(text, bytes, "none", &d), rowe_error_missing_member);
  CHECK_CODE(rowe_read_boolean(text, bytes, "none", &t), rowe_error_missing_member);
  CHECK_CODE(rowe_read_string(text, bytes, "none", buffer, 5), rowe_error_missing_member);
  CHECK(i == INT64_MIN);
}

static void text_is_read_by_paths(void) {
  const char* const text = " {\"a\":[{\"b\":1},{\"b\":3.0,\"c.d\":\"x\"}],\"a\":0} ";
  const size_t bytes = strlen(text);
  int64_t i = 7;
  double d = 7;
  char buffer[5] = "?";
  CHECK_EQUAL(rowe_read_int64(text, bytes, "a[1].b", &i), rowe_ok);
  CHECK(i == 3);
  CHECK_EQUAL(rowe_read_string(text, bytes, "a[1]['c.d']", buffer, 5), rowe_ok);
  CHECK_TEXT(buffer, "x");
  CHECK_CODE(rowe_read_double(text, bytes, "a[2].b", &d), rowe_error_missing_member);
  CHECK_CODE(rowe_read_double(text, bytes, "a.b", &d), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_double(text, bytes, "a[1]..b", &d), rowe_error_bad_argument);
  CHECK_CODE(rowe_read_double("", 0, "a", &d), rowe_error_wrong_type);
  CHECK_CODE(rowe_read_double("{\"a\"", 4, "a", &d), rowe_error_missing_member);
  CHECK(d == 7);
}

int main(void) {
  text_is_written_in_place();
  text_is_read_in_place();
  text_is_read_by_paths();
  return failures != 0;
}
