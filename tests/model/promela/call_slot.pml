/* SPDX-License-Identifier: Apache-2.0
 * A call from its start in a handle to its completion there (rowe/detail/calls.hpp,
 * src/service/state/call_table.hpp): the queue pair's table of pending calls, the service thread's table of
 * calls, a peer that replies at any time, perhaps twice, and a user who waits, cancels, or gives up. Both
 * tables have one place, so every late thing meets the next call in its predecessor's place, and generations
 * are all that tells them apart.
 *
 * Only the service thread decides how a call ends. A user's own time-out and cancel mark the place; the
 * completion is dropped when it comes, and only then the place is free.
 *
 * What must hold: each call ends once, with its own reply or without one; the ring of completions always
 * has room; at rest every place is free.
 *
 * mutants: REPLY_BY_PLACE_ONLY CANCEL_FREES_THE_PLACE TIME_OUT_LEAVES_IT_OPEN
 */
#define CALLS 3

mtype = { replied, timed_out, peer_lost };

chan out = [1] of { byte, byte };            /* generation of the place, the request */
chan asked = [CALLS] of { byte, byte };      /* to the peer: generation of the call, the request */
chan replies = [2 * CALLS] of { byte, byte };           /* from the peer: generation of the call, the reply */
chan ends = [1] of { mtype, byte, byte };    /* how, generation of the place, the reply */

byte ended[CALLS + 1];                       /* how often each call has */
bool user_done = false;

/* The user's side: place.generation is odd while the call is open. */
proctype user() {
  byte generation = 0;
  byte call = 0;
  bool cancelled;
  mtype how;
  byte own, reply;
  do
  :: call < CALLS ->
    call++;
    generation++;                            /* begin_call() */
    cancelled = false;
    out!generation, call;
    if
    :: true                                  /* waits for the end */
    :: true -> cancelled = true              /* cancel(), or its own time-out: give_up() */
    fi;
#ifdef CANCEL_FREES_THE_PLACE
    if
    :: cancelled -> generation++; goto next
    :: else
    fi;
#endif
    ends?how, own, reply;                    /* take_end(): the place is not free before */
    assert(own == generation && generation % 2 == 1);
    generation++;                            /* accept_end() */
    if
    :: !cancelled ->
      assert(how != replied || reply == call)
    :: else
    fi;
next:
    skip
  :: else -> break
  od;
  user_done = true
}

/* The service thread's side: one place, one call at a time. */
proctype service() {
  byte generation = 0;
  bool is_open = false;
  byte own, what, id, reply, place;
end:
  do
  :: !is_open && out?[own, what] ->          /* start_call() */
    out?own, what;
    place = own;
    generation++;
    is_open = true;
    asked!generation, what
  :: replies?id, reply ->                       /* take_reply() */
    if
#ifdef REPLY_BY_PLACE_ONLY
    :: is_open ->
#else
    :: is_open && id == generation ->
#endif
      assert(nfull(ends));
      ends!replied, place, reply;
      ended[what]++;
      is_open = false
    :: else                                  /* late: counted and dropped */
    fi
  :: is_open ->                              /* the wheel says that its deadline has passed */
    assert(nfull(ends));
    ends!timed_out, place, 0;
    ended[what]++;
#ifndef TIME_OUT_LEAVES_IT_OPEN
    is_open = false
#endif
  :: is_open ->                              /* its connection is lost */
    assert(nfull(ends));
    ends!peer_lost, place, 0;
    ended[what]++;
    is_open = false
  :: user_done && empty(out) && !is_open ->
    assert(ended[1] == 1 && ended[2] == 1 && ended[3] == 1);
    assert(empty(ends));
    break
  od
}

/* Replies late, in any order, twice, or never. */
proctype peer() {
  byte id, what;
end:
  do
  :: asked?id, what ->
    if
    :: true -> replies!id, what
    :: true -> replies!id, what; replies!id, what
    :: true                                  /* never */
    fi
  :: user_done -> break
  od
}

init { atomic { run user(); run service(); run peer() } }
