/* SPDX-License-Identifier: Apache-2.0 */
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#pragma GCC system_header /* C90 has comments as below in such headers only */
#endif
// A loop with a period in C. Deadlines are absolute and lie on a grid that never moves, so neither late
// wake-ups nor long cycles add up; a loop that is late by whole periods skips them and counts them.
//
//   struct rowe_periodic* loop = rowe_periodic_open(1000000, NULL);
//   for (int64_t now_ns; rowe_periodic_wait(loop, &now_ns);) { ... }
//
// One thread opens the loop, waits in it and frees it; rowe_periodic_stop() and the counters are for every
// thread. It needs no endpoint.
#pragma once
#include <rowe/loop.h>

#ifdef __cplusplus
extern "C" {
#endif

struct rowe_periodic;

// Of the thread that opens the loop. Zeroes are the defaults; `bytes` as in rowe_options.
struct rowe_periodic_options {
  size_t bytes;        // sizeof(struct rowe_periodic_options)
  bool pin;            // to the core `cpu`
  int cpu;             // read only with `pin`, since 0 is a core, too
  int priority;        // 1 to 99: SCHED_FIFO with it; 0: as it is
  const char* name;    // as `ps -L` shows it; the kernel keeps 15 bytes. NULL: as it is
  uint64_t cycles_max; // rowe_periodic_wait() ends after so many; 0: it does not
};

// A loop with a period of 1 to 3 600 000 000 000 ns, an hour. Applies the options to the calling thread; what
// the machine does not permit is no error: rowe_periodic_granted() says so. The grid begins with the first
// wait, so set-up may follow. `options` may be NULL. For set-up. Errors: bad_argument, no_memory. Free with
// rowe_periodic_free().
struct rowe_periodic* rowe_periodic_open(int64_t period_ns, const struct rowe_periodic_options* options);
void rowe_periodic_free(struct rowe_periodic* loop); // NULL is fine

// Whether all that was asked for was granted; and what was, or what was refused, why, and what helps:
// "SCHED_FIFO 80 not permitted (rtprio limit 0): raise `ulimit -r` or run as root". The text is valid until
// the loop is freed; "" for NULL.
bool rowe_periodic_granted(const struct rowe_periodic* loop);
const char* rowe_periodic_granted_text(const struct rowe_periodic* loop);

// Waits for the next deadline, and sets `now_ns` (which may be NULL) to the time then, as rowe_now_ns(); the
// first call returns at once. False, and `now_ns` is left alone, after rowe_periodic_stop(), which is seen
// one period later at the latest, after `cycles_max` cycles, and for NULL. Enters the kernel, but never
// allocates.
bool rowe_periodic_wait(struct rowe_periodic* loop, int64_t* now_ns);

// Ends the loop. Any thread, or a signal handler. Nothing happens for NULL.
ROWE_RT void rowe_periodic_stop(struct rowe_periodic* loop);

// Any thread; 0 for NULL. Cycles are counted as they begin; overruns are the periods that were skipped
// because the loop was late.
ROWE_RT uint64_t rowe_periodic_cycles(const struct rowe_periodic* loop);
ROWE_RT uint64_t rowe_periodic_overruns(const struct rowe_periodic* loop);
// When the next cycle is due; INT64_MAX before the first wait.
ROWE_RT int64_t rowe_periodic_next_ns(const struct rowe_periodic* loop);
// How late `percent` (0 to 100) of the cycles began at most, against the deadline that each waited for: with
// 100 the latest one, exactly, else up to 1/32 too much. 0 if none has waited. Looks at 1016 counters.
ROWE_RT int64_t rowe_periodic_lateness_ns(const struct rowe_periodic* loop, double percent);

#ifdef __cplusplus
}
#endif
