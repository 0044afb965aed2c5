/* SPDX-License-Identifier: Apache-2.0
 * Receivers asleep at the shared inbox, a service thread that delivers, and an endpoint that closes
 * (src/service/threads/shared_inbox.cpp: receive(), deliver(), close(), wake_receiver()): two receivers, each
 * of which receives until it is told that the inbox is closed. All accesses there are seq_cst or exchanges
 * of one word, so they are steps here. The kernel compares and begins to wait in one step, and wakes one
 * sleeper at a time.
 *
 * A lost wake-up is an invalid end state: a receiver sleeps for ever. And no message is left behind.
 *
 * variants: CLOSES_WHEN_ALL_IS_RECEIVED
 * mutants: CLOSED_IS_NOT_PASSED_ON CLOSES_AFTER_THE_WAKE LOOKS_BEFORE_IT_IS_COUNTED READS_THE_WORD_LAST
 * mutants: WORD_STAYS CLOSES_WHEN_ALL_IS_RECEIVED+DELIVERS_AFTER_THE_WAKE
 */
#define RECEIVERS 2
#define MESSAGES 2

byte tail = 0;                                 /* delivered */
byte head = 0;                                 /* received */
byte sleepers = 0;
byte word = 0;                                 /* the futex: even after a delivery, odd after closing */
bool closed = false;

bool asleep[RECEIVERS];                        /* in the kernel */
byte ended = 0;

inline wake_one() {                            /* futex wake */
  atomic {
    if
    :: asleep[0] -> asleep[0] = false
    :: asleep[1] -> asleep[1] = false
    :: else
    fi
  }
}

inline wake_receiver(value) {
  if
  :: sleepers == 0
  :: else ->
#ifndef WORD_STAYS
    word = value;
#endif
    wake_one()
  fi
}

inline try_pop(found) {                        /* by compare-exchange of the head: one receiver gets it */
  atomic {
    found = (head < tail);
    if
    :: found -> head++
    :: else
    fi
  }
}

proctype receiver(byte me) {
  bool found, over;
  byte seen;
next:
  try_pop(found);
  if
  :: found -> goto next
  :: else
  fi;
#ifdef LOOKS_BEFORE_IT_IS_COUNTED
  seen = word;
  over = closed;
  try_pop(found);
  sleepers++;
  goto sleep;
#else
  sleepers++;
#endif
again:
#ifndef READS_THE_WORD_LAST
  seen = word;
#endif
  over = closed;
  try_pop(found);
#ifdef READS_THE_WORD_LAST
  seen = word;
#endif
sleep:
  if
  :: found || over -> skip
  :: else ->
    atomic {                                   /* futex wait */
      if
      :: word == seen -> asleep[me] = true
      :: else
      fi
    }
    !asleep[me];
    goto again
  fi;
  sleepers--;
  if
#ifndef CLOSED_IS_NOT_PASSED_ON
  :: over -> wake_one()                        /* a wake reaches one sleeper */
#endif
  :: else
  fi;
  if
  :: found -> goto next
  :: else                                      /* closed */
  fi;
  ended++
}

active proctype service_and_closer() {
  byte i = 0;
  do
  :: i < MESSAGES ->
#ifdef DELIVERS_AFTER_THE_WAKE
    wake_receiver(2 * (i + 1));
    tail++;
#else
    tail++;
    wake_receiver(2 * (i + 1));
#endif
    i++
  :: else -> break
  od;
#ifdef CLOSES_WHEN_ALL_IS_RECEIVED
  head == tail;                                /* so closing wakes nobody that a delivery did not wake */
#endif
#ifdef CLOSES_AFTER_THE_WAKE
  wake_receiver(1);
  closed = true
#else
  closed = true;
  wake_receiver(1)
#endif
}

init {
  atomic { run receiver(0); run receiver(1) }
  ended == RECEIVERS;
  assert(head == MESSAGES && tail == MESSAGES)
}
