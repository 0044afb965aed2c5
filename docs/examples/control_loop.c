// SPDX-License-Identifier: Apache-2.0
// control_loop.cpp in C: a loop of 1 kHz that obeys the stop, says where the robot is, and takes its speed
// from a topic and from a service: control_loop_in_c PORT. No call in the loop waits, but for the next
// period.
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include <rowe/loop.h>
#include <rowe/periodic.h>
#include <rowe/service.h>
#include <rowe/struct.h>

struct odometry {
  double stamp, x, y, heading, speed; // seconds, metres, radians, m/s
  float wheels[2];                    // rad/s
};
static const struct rowe_member odometry_members[] = {
    ROWE_MEMBER(struct odometry, stamp, rowe_member_double),
    ROWE_MEMBER(struct odometry, x, rowe_member_double),
    ROWE_MEMBER(struct odometry, y, rowe_member_double),
    ROWE_MEMBER(struct odometry, heading, rowe_member_double | rowe_member_decimals_4),
    ROWE_MEMBER(struct odometry, speed, rowe_member_double),
    ROWE_ARRAY(struct odometry, wheels, rowe_member_float, NULL),
};
static const struct rowe_struct odometry_type = {"my_robot/Odometry", sizeof(struct odometry),
                                                 odometry_members, 6};

struct command {
  double speed; // m/s
};
static const struct rowe_member command_members[] = {ROWE_MEMBER(struct command, speed, rowe_member_double)};
static const struct rowe_struct command_type = {"my_robot/Command", sizeof(struct command), command_members,
                                                1};

struct answer {
  bool taken;
};
static const struct rowe_member answer_members[] = {ROWE_MEMBER(struct answer, taken, rowe_member_bool)};
static const struct rowe_struct answer_type = {NULL, sizeof(struct answer), answer_members, 1};

static const double speed_max = 2;
static const int64_t command_ns = 500000000; // a pilot who lost his network must not drive on

static struct rowe_periodic* loop;
static void end(int number) {
  (void)number;
  rowe_periodic_stop(loop);
}

int main(int count, char** arguments) {
  if (count != 2) return fputs("usage: control_loop_in_c PORT\n", stderr), 2;
  char* behind = NULL;
  const long port = strtol(arguments[1], &behind, 10);
  if (behind == arguments[1] || *behind != '\0' || port < 0 || port > 65535)
    return fprintf(stderr, "a port is a number from 0 to 65535, not '%s'\n", arguments[1]), 2;
  const struct rowe_options options = {.bytes = sizeof options, .stop_unguarded = true};
  struct rowe_endpoint* robot = rowe_open_local_endpoint_with((int)port, &options);
  if (robot == NULL) return fprintf(stderr, "%s\n", rowe_last_error_text()), 1;
  printf("listening on port %d\n", rowe_endpoint_port(robot));
  fflush(stdout);

  const struct rowe_topic_options newest = {.bytes = sizeof newest, .ttl_ms = 20, .newest = true};
  const struct rowe_topic_options last = {.bytes = sizeof last, .newest = true};
  struct rowe_struct_publisher* odom = rowe_struct_publisher_open(robot, "/odom", &odometry_type, &newest);
  struct rowe_struct_subscriber* commands =
      rowe_struct_subscriber_open(robot, "/command", &command_type, &last);
  struct rowe_struct_responder* set_speed =
      rowe_struct_responder_open(robot, "/set_speed", &command_type, &answer_type, NULL);
  struct rowe_stop_latch* stop = rowe_stop_latch_open(robot, NULL);
  const struct rowe_periodic_options at = {.bytes = sizeof at, .priority = 80};
  loop = rowe_periodic_open(1000000, &at);
  if (odom == NULL || commands == NULL || set_speed == NULL || stop == NULL || loop == NULL)
    return fprintf(stderr, "%s\n", rowe_last_error_text()), 1;
  fprintf(stderr, "control loop: %s\n", rowe_periodic_granted_text(loop));
  signal(SIGINT, end); // Ctrl-C
  signal(SIGTERM, end);

  struct odometry now = {.stamp = 0};
  struct command wanted = {0}, asked;
  int64_t until_ns = 0; // so long the last command holds
  for (int64_t now_ns; rowe_periodic_wait(loop, &now_ns);) {
    struct rowe_request request;
    if (rowe_struct_subscriber_try_take(commands, &wanted, NULL) == rowe_ok) until_ns = now_ns + command_ns;
    if (rowe_struct_responder_try_next(set_speed, now_ns, &asked, &request) == rowe_ok) {
      const struct answer given = {fabs(asked.speed) <= speed_max};
      if (given.taken) wanted = asked, until_ns = now_ns + command_ns;
      (void)rowe_struct_responder_reply(set_speed, &request, &given, now_ns);
    }
    const bool stopped = rowe_stop_engaged(stop, now_ns);
    if (stopped || now_ns >= until_ns) wanted.speed = 0; // yours: command the brake
    if (stopped) rowe_stop_acknowledge(stop, now_ns);

    now.stamp = 1e-9 * (double)now_ns; // yours: measure
    now.speed = wanted.speed;
    now.x += 1e-3 * now.speed;
    now.wheels[0] = now.wheels[1] = (float)(now.speed / 0.05);
    (void)rowe_struct_publisher_publish(odom, &now, now_ns); // losing one sample is fine, and counted
  }
  rowe_periodic_free(loop);
  rowe_stop_latch_free(stop);
  rowe_struct_responder_free(set_speed);
  rowe_struct_subscriber_free(commands);
  rowe_struct_publisher_free(odom);
  rowe_endpoint_free(robot);
  return 0;
}
