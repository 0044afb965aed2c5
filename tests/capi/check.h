// SPDX-License-Identifier: Apache-2.0
// What the C tests share: a check that goes on, and the two waits that no test may exceed.
#pragma once
#include <stdio.h>
#include <string.h>

#include <rowe/rowe.h>

static int failures;

#define CHECK(condition)                                                                                     \
  ((condition) ? (void)0                                                                                     \
               : (void)(++failures, fprintf(stderr, "%s:%d: %s (last error: %s)\n", __FILE__, __LINE__,      \
                                            #condition, rowe_last_error_text())))

// That an expression fails with this error, of a code or (NULL) of a pointer.
#define CHECK_CODE(expression, code) CHECK_EQUAL(expression, code)
#define CHECK_NULL(expression, code)                                                                         \
  do {                                                                                                       \
    CHECK((expression) == NULL);                                                                             \
    CHECK_EQUAL(rowe_last_error(), code);                                                                    \
  } while (0)

#define CHECK_EQUAL(left, right)                                                                             \
  do {                                                                                                       \
    const long long left_is = (long long)(left), right_is = (long long)(right);                              \
    if (left_is != right_is) {                                                                               \
      ++failures;                                                                                            \
      fprintf(stderr, "%s:%d: %s is %lld, not %lld (last error: %s)\n", __FILE__, __LINE__, #left, left_is,  \
              right_is, rowe_last_error_text());                                                             \
    }                                                                                                        \
  } while (0)

#define CHECK_TEXT(left, right) check_text(__FILE__, __LINE__, #left, (left), (right))

static inline void check_text(const char* file, int line, const char* what, const char* left,
                              const char* right) {
  if (left != NULL && strcmp(left, right) == 0) return;
  ++failures;
  fprintf(stderr, "%s:%d: %s is %s, not %s (last error: %s)\n", file, line, what, left ? left : "NULL", right,
          rowe_last_error_text());
}

enum { timeout_ms = 30000 }; // for what will happen; the test fails when it is over
