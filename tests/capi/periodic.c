// SPDX-License-Identifier: Apache-2.0
// Loops with a period: their grid, their end, and what is wrong.
#include "check.h"

#include <math.h>
#include <pthread.h>
#include <stdint.h>

#include <rowe/periodic.h>

enum { period_ns = 1000000 };

static void deadlines_lie_on_a_grid(void) {
  struct rowe_periodic* const loop = rowe_periodic_open(period_ns, NULL);
  CHECK(loop != NULL);
  CHECK_EQUAL(rowe_periodic_next_ns(loop), INT64_MAX);
  CHECK_EQUAL(rowe_periodic_lateness_ns(loop, 100), 0);
  int64_t first_ns = 0, now_ns = 0;
  const int64_t before_ns = rowe_now_ns();
  CHECK(rowe_periodic_wait(loop, &first_ns));
  CHECK(first_ns >= before_ns && first_ns <= rowe_now_ns());
  CHECK_EQUAL(rowe_periodic_next_ns(loop), first_ns + period_ns);
  for (int i = 0; i < 20; ++i) {
    const int64_t due_ns = rowe_periodic_next_ns(loop);
    CHECK(rowe_periodic_wait(loop, i % 2 == 0 ? &now_ns : NULL));
    if (i % 2 == 0) CHECK(now_ns >= due_ns);
    CHECK_EQUAL((rowe_periodic_next_ns(loop) - first_ns) % period_ns, 0);
  }
  CHECK_EQUAL(rowe_periodic_cycles(loop), 21);
  const int64_t latest_ns = rowe_periodic_lateness_ns(loop, 100);
  CHECK(latest_ns >= 0 && rowe_periodic_lateness_ns(loop, 50) <= latest_ns);
  CHECK_EQUAL(rowe_periodic_lateness_ns(loop, 1000), latest_ns);
  CHECK_EQUAL(rowe_periodic_lateness_ns(loop, -1), 0);
  CHECK_EQUAL(rowe_periodic_lateness_ns(loop, (double)NAN), 0);
  rowe_periodic_free(loop);
}

static void what_is_late_skips_periods_and_counts_them(void) {
  struct rowe_periodic* const loop = rowe_periodic_open(period_ns, NULL);
  int64_t now_ns = 0, first_ns = 0;
  CHECK(rowe_periodic_wait(loop, &first_ns));
  while (rowe_now_ns() < first_ns + 5 * period_ns) { // a long cycle
  }
  CHECK(rowe_periodic_wait(loop, &now_ns));
  CHECK(rowe_periodic_overruns(loop) >= 4);
  CHECK(rowe_periodic_next_ns(loop) > now_ns);
  CHECK_EQUAL((rowe_periodic_next_ns(loop) - first_ns) % period_ns, 0);
  CHECK(rowe_periodic_lateness_ns(loop, 100) >= 4 * period_ns);
  rowe_periodic_free(loop);
}

static void* stop_it(void* loop) {
  rowe_periodic_stop(loop);
  return NULL;
}

static void loops_end(void) {
  const struct rowe_periodic_options three = {.bytes = sizeof three, .cycles_max = 3, .name = "three"};
  struct rowe_periodic* const counted = rowe_periodic_open(1, &three);
  int64_t now_ns = 0;
  int cycles = 0;
  while (rowe_periodic_wait(counted, &now_ns)) ++cycles;
  CHECK_EQUAL(cycles, 3);
  now_ns = 7;
  CHECK(!rowe_periodic_wait(counted, &now_ns));
  CHECK_EQUAL(now_ns, 7);
  rowe_periodic_free(counted);

  struct rowe_periodic* const stopped = rowe_periodic_open(period_ns, NULL);
  CHECK(rowe_periodic_wait(stopped, &now_ns));
  pthread_t other;
  CHECK_EQUAL(pthread_create(&other, NULL, stop_it, stopped), 0);
  while (rowe_periodic_wait(stopped, &now_ns)) {
  }
  CHECK_EQUAL(pthread_join(other, NULL), 0);
  rowe_periodic_free(stopped);
}

// What the machine has not is said, and the loop runs all the same.
static void what_is_not_granted_is_told(void) {
  const struct rowe_periodic_options nowhere = {
      .bytes = sizeof nowhere, .pin = true, .cpu = 100000, .cycles_max = 1};
  struct rowe_periodic* const loop = rowe_periodic_open(period_ns, &nowhere);
  CHECK(loop != NULL);
  CHECK(!rowe_periodic_granted(loop));
  CHECK(strstr(rowe_periodic_granted_text(loop), "100000") != NULL);
  CHECK(rowe_periodic_wait(loop, NULL));
  rowe_periodic_free(loop);
}

static void wrong_arguments(void) {
  const int64_t wrong[] = {0, -1, INT64_MIN, INT64_MAX, INT64_C(3600000000001)};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i)
    CHECK_NULL(rowe_periodic_open(wrong[i], NULL), rowe_error_bad_argument);
  const struct rowe_periodic_options newer = {.bytes = sizeof newer + 8};
  CHECK_NULL(rowe_periodic_open(period_ns, &newer), rowe_error_bad_argument);
  rowe_periodic_free(NULL);
  rowe_periodic_stop(NULL);
  CHECK(!rowe_periodic_wait(NULL, NULL));
  CHECK(!rowe_periodic_granted(NULL));
  CHECK_TEXT(rowe_periodic_granted_text(NULL), "");
  CHECK_EQUAL(rowe_periodic_cycles(NULL), 0);
  CHECK_EQUAL(rowe_periodic_overruns(NULL), 0);
  CHECK_EQUAL(rowe_periodic_next_ns(NULL), 0);
  CHECK_EQUAL(rowe_periodic_lateness_ns(NULL, 50), 0);
}

int main(void) {
  deadlines_lie_on_a_grid();
  what_is_late_skips_periods_and_counts_them();
  loops_end();
  what_is_not_granted_is_told();
  wrong_arguments();
  return failures != 0;
}
