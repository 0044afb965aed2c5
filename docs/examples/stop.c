// SPDX-License-Identifier: Apache-2.0
// stop.cpp in C: a loop of 1 kHz that obeys the stop, and may move without a guard: stop_in_c PORT
#define _POSIX_C_SOURCE 200809L
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <rowe/loop.h>
#include <rowe/rowe.h>

// Yours: here, words for whoever watches.
static void set_brake(bool on) {
  static int is_on = -1;
  if (is_on == on) return;
  is_on = on;
  puts(on ? "braking" : "driving");
  fflush(stdout);
}

int main(int count, char** arguments) {
  if (count != 2) return fputs("usage: stop_in_c PORT\n", stderr), 2;
  char* behind = NULL;
  const long port = strtol(arguments[1], &behind, 10);
  if (behind == arguments[1] || *behind != '\0' || port < 0 || port > 65535)
    return fprintf(stderr, "a port is a number from 0 to 65535, not '%s'\n", arguments[1]), 2;
  struct rowe_options options = {.bytes = sizeof options, .stop_unguarded = true};
  struct rowe_endpoint* robot = rowe_open_local_endpoint_with((int)port, &options);
  if (robot == NULL) return fprintf(stderr, "%s\n", rowe_last_error_text()), 1;
  printf("listening on port %d\n", rowe_endpoint_port(robot));

  struct rowe_latch_options base = {.bytes = sizeof base, .name = "base"};
  struct rowe_stop_latch* latch = rowe_stop_latch_open(robot, &base);
  const struct timespec period = {.tv_nsec = 1000000};
  for (;; nanosleep(&period, NULL)) {
    const int64_t now_ns = rowe_now_ns();
    const bool stopped = rowe_stop_engaged(latch, now_ns);
    set_brake(stopped);
    if (stopped) rowe_stop_acknowledge(latch, now_ns);
  }
}
