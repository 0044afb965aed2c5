// SPDX-License-Identifier: Apache-2.0
// A peer in another process that is killed in the middle of a call, and comes back. The peer is this program
// again, with a port as its argument.
#define _POSIX_C_SOURCE 200809L
#include "pair.h"

#include <signal.h>
#include <stdlib.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

// Prints its port, then says what is asked of it, but for "nothing", until it is killed.
static int be_a_peer(int port) {
  struct rowe_endpoint* endpoint;
  do { // another program may have been given the port for a moment
    endpoint = rowe_open_local_endpoint(port);
  } while (endpoint == NULL && rowe_last_error() == rowe_error_address_in_use);
  if (endpoint == NULL) return 1;
  printf("%d\n", rowe_endpoint_port(endpoint));
  fflush(stdout);
  struct rowe_object* request;
  while ((request = rowe_receive(endpoint, timeout_ms)) != NULL) {
    const char* const say = rowe_object_get_string(request, "say");
    if (say != NULL && strcmp(say, "nothing") == 0) {
      CHECK_EQUAL(send_text(endpoint, "{\"heard\":true}", timeout_ms), rowe_ok);
    } else {
      CHECK_EQUAL(rowe_reply(endpoint, request, rowe_object_get(request, "with"), timeout_ms), rowe_ok);
    }
    rowe_object_free(request);
  }
  return 1; // nobody came to kill it
}

struct peer {
  pid_t process;
  int port;
};

static struct peer start_peer(int port) {
  struct peer started = {.process = -1, .port = -1};
  int ends[2];
  if (pipe(ends) != 0) return started;
  char argument[16];
  snprintf(argument, sizeof argument, "%d", port);
  started.process = fork();
  if (started.process == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    execl(ROWE_PEER, ROWE_PEER, argument, (char*)NULL); // this program
    _exit(127);
  }
  close(ends[1]);
  char said[16] = "";
  ssize_t bytes = 0, more;
  while (bytes < (ssize_t)sizeof said - 1 && (more = read(ends[0], said + bytes, 1)) == 1) {
    if (said[bytes++] == '\n') break;
  }
  close(ends[0]);
  started.port = atoi(said);
  return started;
}

static void kill_peer(struct peer gone) {
  CHECK(kill(gone.process, SIGKILL) == 0);
  int ended;
  CHECK(waitpid(gone.process, &ended, 0) == gone.process);
  CHECK(WIFSIGNALED(ended));
}

static void expect_answer(const struct rowe_endpoint* by, int number) {
  struct rowe_object* const with = rowe_message("n", rowe_type_int, number, NULL);
  struct rowe_object* const ask =
      rowe_message("service", rowe_type_string, "echo", "with", rowe_type_object, with, NULL);
  struct rowe_object* const reply = rowe_invoke(by, ask, timeout_ms);
  int n = 0;
  CHECK_EQUAL(rowe_object_get_int(reply, "n", &n), rowe_ok);
  CHECK_EQUAL(n, number);
  rowe_object_free(reply);
  rowe_object_free(ask);
  rowe_object_free(with);
}

int main(int count, char** arguments) {
  if (count == 2) return be_a_peer(atoi(arguments[1]));

  struct peer peer = start_peer(0);
  CHECK(peer.port > 0);
  if (failures != 0) return 1;
  struct rowe_endpoint* const client = rowe_open_remote_endpoint("127.0.0.1", peer.port);
  expect_answer(client, 1); // waits for the connection, too

  // Three times: killed while a call is open, which fails; back on the same port, where all goes on.
  for (int round = 2; round < 5; ++round) {
    time_out(client, "{\"service\":\"echo\",\"say\":\"nothing\"}", 50);
    struct rowe_object* const heard = rowe_receive(client, timeout_ms); // so it has the call, unanswered
    const struct rowe_peer before = rowe_object_sender(heard);
    CHECK(before.generation != 0);

    kill_peer(peer);
    struct rowe_object* const message = rowe_object_from_text("{\"to\":\"the dead\"}");
    struct rowe_event event = {.kind = rowe_event_warning};
    while (event.kind != rowe_event_peer_left) {
      if (rowe_try_event(client, &event) != rowe_ok) CHECK_EQUAL(rowe_last_error(), rowe_error_empty);
      if (failures != 0) return 1;
    }
    CHECK_CODE(rowe_send_to(client, before, message, -1), rowe_error_peer_lost);

    peer = start_peer(peer.port);
    expect_answer(client, round);
    CHECK_CODE(rowe_send_to(client, before, message, -1), rowe_error_peer_lost); // it is another one now
    rowe_object_free(message);
    rowe_object_free(heard);
  }
  kill_peer(peer);
  rowe_endpoint_free(client);
  return failures != 0;
}
