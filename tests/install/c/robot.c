/* SPDX-License-Identifier: Apache-2.0 */
/* A robot that listens on any free port, and a peer that connects and reads what it says over a socket. */
#include <stdio.h>
#include <stdlib.h>

#include <rowe/loop.h>
#include <rowe/rowe.h>

int main(void) {
  struct rowe_endpoint* robot = rowe_open_local_endpoint(0);
  struct rowe_endpoint* peer = rowe_open_remote_endpoint("127.0.0.1", rowe_endpoint_port(robot));
  struct rowe_object* pose = rowe_message("x", rowe_type_double, 1.5, "y", rowe_type_double, -2.0, NULL);
  int sent = rowe_send(robot, pose, 60000);
  struct rowe_object* seen = rowe_receive(peer, 60000);
  char* text = rowe_object_to_text(seen);
  if (sent != rowe_ok || text == NULL) {
    fprintf(stderr, "%s\n", rowe_last_error_text());
    return 1;
  }
  printf("%s\n", text);
  free(text);
  rowe_object_free(seen);
  rowe_object_free(pose);
  rowe_endpoint_free(peer);
  rowe_endpoint_free(robot);
  return 0;
}
