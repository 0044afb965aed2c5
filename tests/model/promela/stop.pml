/* SPDX-License-Identifier: Apache-2.0
 * The stop (docs/stop.md, src/service/threads/stop_rules.cpp, rowe/detail/stop_permit.hpp): two loops of any
 * speed; a service thread of any speed that may die; a guard whose heartbeats the network delays by any time,
 * and whose connection may end and come again; two sources of stops; and an operator who resets whatever he
 * has seen, stopped or not yet, at any later time. Time may pass at any step.
 *
 * What must hold whenever a loop decides to move:
 *   no stop was accepted that this loop has not met (also not by a reset that came too soon);
 *   since it was last stopped, there was a reset;
 *   the guard sent something less than its timeout ago; when that arrived does not count;
 *   if the service thread died, it did so less than its time-out ago;
 *   the other loop has looked less than its time-out plus the service thread's ago.
 * And a reset is accepted only from somebody who has seen every stop.
 *
 * variants: RACES
 * long: A_STOP
 * mutants: RACES+RESET_WITHOUT_LOOPS RACES+RESET_OF_ANY_NUMBER RACES+SECOND_SOURCE_KEEPS_NUMBER
 * mutants: RACES+STOP_KEEPS_NUMBER
 * mutants: TIMEOUT_FROM_ARRIVAL NO_SERVICE_TIMEOUT NO_MEMORY_OF_TRIPS IGNORES_SLOW_LOOPS GUARD_LOSS_IGNORED
 */
#ifdef RACES                                   /* of stops and resets, in one moment */
#define TIMES 0
#define RESETS 3
#define STOPS_OF_ONE 2                         /* a source that repeats itself */
#define STOPS_OF_OTHER 2
#define HEARTBEATS 0
#else                                          /* time */
#define TIMES 3
#define RESETS 1
#ifdef A_STOP                                  /* that somebody asks for: four times as many states */
#define STOPS_OF_ONE 1
#else
#define STOPS_OF_ONE 0
#endif
#define STOPS_OF_OTHER 0
#define HEARTBEATS 1
#endif
#define TIMEOUT 2
#define SERVICE_TIMEOUT 1
#define LOOP_TIMEOUT 1
#define LOOPS 2

mtype = { heartbeat, gone };

byte now = 0;

/* The shared words. */
byte permit_number = 1, permit_until = SERVICE_TIMEOUT;
byte checked_in[LOOPS], tripped[LOOPS], acknowledged[LOOPS];

/* A loop's own. */
byte own[LOOPS];

/* The service thread's. */
byte number = 1;
bool running = true;
byte guard_until = TIMEOUT;
byte asked_by = 0;                             /* sources of this stop, a bit each */
bool alive = true;

/* The network. */
chan from_guard = [2] of { mtype, byte };      /* the tick */
byte stops_left[2];                            /* of each source; when they were sent does not matter */
chan resets = [RESETS] of { byte, byte };           /* the number; how many stops were seen */

/* What only this model knows. */
byte stops_accepted = 0;
bool must_meet[LOOPS];                         /* a stop that it has not met */
bool stood[LOOPS];                             /* since the last reset */
byte guard_sent = 0;                           /* when it last said something */
bool guard_connected = true;
byte died = 0;

#define MINIMUM(a, b) ((a) < (b) -> (a) : (b))
#define MAXIMUM(a, b) ((a) > (b) -> (a) : (b))

inline accept_stop() {
  stops_accepted++;
  must_meet[0] = (own[0] != number);           /* a loop stopped at this number cannot move again at it */
  must_meet[1] = (own[1] != number)
}

inline stop() {                                /* stop_rules::stop() */
  running = false;
  asked_by = 0;
#ifndef STOP_KEEPS_NUMBER
  number++;                                    /* what was shown while running names no stop */
#endif
  permit_number = number;
  permit_until = 0;
  accept_stop()
}

inline grant() {                               /* run_until(), write_permit() */
  permit_number = number;
#ifdef NO_SERVICE_TIMEOUT
  permit_until = guard_until
#else
  permit_until = MINIMUM(guard_until, now + SERVICE_TIMEOUT)
#endif
}

#ifdef IGNORES_SLOW_LOOPS
#define SLOW(l) false
#else
#define SLOW(l) (now > checked_in[l] + LOOP_TIMEOUT)
#endif

inline turn() {                                /* turn(), find_trouble() */
  if
  :: running && (guard_until <= now || tripped[0] == number || tripped[1] == number || SLOW(0) || SLOW(1)) ->
    stop()
  :: running && !(guard_until <= now || tripped[0] == number || tripped[1] == number || SLOW(0) || SLOW(1)) ->
    grant()
  :: !running
  fi
}

inline take_stop(source) {                     /* request() */
  turn();
  if
  :: running -> stop(); asked_by = 1 << source
  :: !running && !(asked_by & (1 << source)) ->
    asked_by = asked_by | (1 << source);
#ifndef SECOND_SOURCE_KEEPS_NUMBER
    number++;
    permit_number = number;
#endif
    accept_stop()
  :: else                                      /* a repeat */
  fi
}

#ifdef RESET_OF_ANY_NUMBER
#define NAMED(asked) true
#else
#define NAMED(asked) (asked == number)
#endif
#ifdef RESET_WITHOUT_LOOPS
#define LOOPS_READY true
#else
#define LOOPS_READY (acknowledged[0] == number && acknowledged[1] == number && !SLOW(0) && !SLOW(1))
#endif

inline take_reset(asked, seen) {               /* reset(), loops_ready(), guarded() */
  turn();
  if
  :: !running && NAMED(asked) && LOOPS_READY && guard_until > now ->
    assert(seen == stops_accepted);
    number++;                                  /* else no stopped loop would ever move again */
    running = true;
    stood[0] = false;
    stood[1] = false;
    grant()
  :: else
  fi
}

inline take_heartbeat(tick) {                      /* heartbeat() */
  turn();
#ifdef TIMEOUT_FROM_ARRIVAL
  guard_until = now + TIMEOUT
#else
  if
  :: tick + TIMEOUT > now ->
    guard_until = MAXIMUM(guard_until, tick + TIMEOUT)
  :: else
  fi
#endif
}

inline take_gone() {                           /* peer_gone() */
  turn();
#ifdef GUARD_LOSS_IGNORED
  accept_stop()
#else
  guard_until = MINIMUM(guard_until, now);
  if
  :: running -> stop()
  :: else
  fi
#endif
}

active proctype service() {
  byte a, b;
  stops_left[0] = STOPS_OF_ONE;
  stops_left[1] = STOPS_OF_OTHER;
end:
  do
  :: atomic { turn() }
  :: atomic { from_guard?heartbeat(a) -> take_heartbeat(a); a = 0 }
  :: atomic { from_guard?gone(a) -> take_gone(); a = 0 }
  :: atomic { stops_left[0] > 0 -> stops_left[0]--; take_stop(0) }
  :: atomic { stops_left[1] > 0 -> stops_left[1]--; take_stop(1) }
  :: atomic { resets?a, b -> take_reset(a, b); a = 0; b = 0 }
  :: atomic { alive = false; died = now; break }
  od
}

/* latch_engaged() and latch_acknowledge(). One loop may be held up between any two steps of its look; the
 * other looks in one step, as often or as seldom as it likes. */
#ifdef NO_MEMORY_OF_TRIPS
#define MAY_MOVE(me) (time < permit_until)
#else
#define MAY_MOVE(me) (time < permit_until && permit_number != own[me])
#endif

inline look(me) {
  if
  :: MAY_MOVE(me) ->
    assert(!must_meet[me]);
    assert(!stood[me]);
    assert(time < guard_sent + TIMEOUT);
    assert(alive || time < died + SERVICE_TIMEOUT);
    assert(time <= checked_in[1 - me] + LOOP_TIMEOUT + SERVICE_TIMEOUT)
  :: else ->
    stood[me] = true;
    must_meet[me] = false;
    own[me] = permit_number
  fi
}

active proctype held_up_loop() {
  byte time;
end:
  do
  :: atomic { time = now; checked_in[0] = time }
    atomic { look(0); time = 0 }
    tripped[0] = own[0];
    acknowledged[0] = own[0]                   /* the brake is commanded */
  od
}

active proctype other_loop() {
  byte time;
end:
  do
  :: atomic {
      time = now;
      checked_in[1] = time;
      look(1);
      tripped[1] = own[1];
      acknowledged[1] = own[1];
      time = 0
    }
  od
}

active proctype clock() {
end:
  do
  :: now < TIMES -> now++
  od
}

/* A heartbeat has the newest tick; an older one only makes its time end earlier. */
active proctype guard() {
  byte sent = 0;
end:
  do
  :: atomic { guard_connected && sent < HEARTBEATS -> from_guard!heartbeat(now); guard_sent = now; sent++ }
  :: atomic { guard_connected && sent < HEARTBEATS -> from_guard!gone(0); guard_connected = false }
  :: atomic { !guard_connected -> guard_connected = true }
  od
}

active proctype resetter() {
  byte sent = 0;
end:
  do
  :: atomic { sent < RESETS -> resets!number, stops_accepted; sent++ }
  od
}
