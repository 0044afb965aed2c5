/* SPDX-License-Identifier: Apache-2.0
 * idle::wake (rowe/rt/waker.hpp) on machines with store buffers: what the explorer shows for the orders
 * of C++, shown again for what such orders become. Each handle puts values into its queue, advances its
 * epoch, looks whether the service thread sleeps, and wakes it if so. The service thread marks the epochs,
 * takes what is there, says that it sleeps, looks at the epochs again, and waits for the eventfd.
 *
 * A store goes into its thread's buffer and leaves it at any later time. Buffers are not first in, first
 * out (as they are on x86): stores to different words leave in any order, but a release store not before
 * those in front of it. A seq_cst store is a release store after which the thread waits until its buffer is
 * empty. The eventfd is the kernel's: it keeps one signal, and writing it empties the buffer.
 *
 * A lost wake-up is an invalid end state: the service thread waits for ever with something in a queue.
 *
 * mutants: HANDLE_DOES_NOT_WAIT SERVICE_DOES_NOT_WAIT EPOCH_OVERTAKES SERVICE_LOOKS_ONCE EVENTFD_FORGETS
 */
#define HANDLES 2
#define VALUES 2

byte tail[HANDLES];      /* what is in each queue: values pushed */
byte epoch[HANDLES];     /* of each producer */
bool sleeping = false;
bool signal = false;     /* in the eventfd */
bool waits = false;      /* the service thread, in the kernel */

/* Buffered: the store is not in memory yet. */
bool tail_buffered[HANDLES];
bool epoch_buffered[HANDLES];
bool sleeping_buffered = false;
bool sleeping_next;      /* the value there */

proctype handle_buffer(byte h) {
end:
  do
  :: atomic { tail_buffered[h] -> tail[h]++; tail_buffered[h] = false }
#ifdef EPOCH_OVERTAKES
  :: atomic { epoch_buffered[h] -> epoch[h]++; epoch_buffered[h] = false }
#else
  :: atomic { epoch_buffered[h] && !tail_buffered[h] -> epoch[h]++; epoch_buffered[h] = false }
#endif
  od
}

proctype service_buffer() {
end:
  do
  :: atomic { sleeping_buffered -> sleeping = sleeping_next; sleeping_buffered = false }
  od
}

proctype handle(byte h) {
  byte i = 0;
  bool seen;
  do
  :: i < VALUES ->
    atomic { !tail_buffered[h] -> tail_buffered[h] = true }      /* publish: release, into the ring */
    atomic { !epoch_buffered[h] -> epoch_buffered[h] = true }    /* pull(): seq_cst */
#ifndef HANDLE_DOES_NOT_WAIT
    !tail_buffered[h] && !epoch_buffered[h];
#endif
    seen = sleeping;                                             /* ring() */
    if
    :: seen ->
      !tail_buffered[h] && !epoch_buffered[h];
#ifdef EVENTFD_FORGETS
      if :: waits -> signal = true :: else fi;
#else
      signal = true;
#endif
    :: else
    fi;
    i++
  :: else -> break
  od
}

#define SET_SLEEPING(value) atomic { !sleeping_buffered -> sleeping_next = value; sleeping_buffered = true }

proctype service() {
  byte marked[HANDLES];
  byte taken[HANDLES];
  byte h;
  bool quiet;
  do
  :: true ->
    h = 0;
    do
    :: h < HANDLES -> marked[h] = epoch[h]; taken[h] = tail[h]; h++   /* mark(), then look */
    :: else -> break
    od;
    if
    :: taken[0] == VALUES && taken[1] == VALUES -> break
    :: else
    fi;
    SET_SLEEPING(true);                                               /* seq_cst */
#ifndef SERVICE_DOES_NOT_WAIT
    !sleeping_buffered;
#endif
    quiet = true;
#ifndef SERVICE_LOOKS_ONCE
    h = 0;
    do
    :: h < HANDLES -> quiet = quiet && (epoch[h] == marked[h]); h++   /* quiet(): seq_cst */
    :: else -> break
    od;
#endif
    if
    :: quiet -> !sleeping_buffered; waits = true; atomic { signal -> signal = false }; waits = false
    :: else
    fi;
    SET_SLEEPING(false)                                               /* relaxed */
  od;
  assert(taken[0] == VALUES && taken[1] == VALUES)
}

init {
  atomic {
    run handle_buffer(0); run handle_buffer(1); run service_buffer();
    run handle(0); run handle(1); run service()
  }
}
