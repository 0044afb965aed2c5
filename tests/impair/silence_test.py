# SPDX-License-Identifier: Apache-2.0
"""How an endpoint notices that a peer is gone, for each way to go, and that other peers do not notice.

The endpoint is on side a of a bad network, its peers, each a process, on side b; one is on the endpoint's own
host. Times are bounded from below only."""
import contextlib
import os
import re
import signal
import sys
import time
import unittest

import link
import program
import bad_network

here = os.path.dirname(os.path.abspath(__file__))
why_not = bad_network.why_not()


class process(program.program):
    """In a namespace. `ip` becomes the command, so signals reach that; it ends with its input."""

    def __init__(self, between, side, *command):
        super().__init__(command=("ip", "netns", "exec", between.namespace(side), *command), stdin=-1)

    def say(self, line):
        self.process.stdin.write(line.encode() + b"\n")
        self.process.stdin.flush()

    def __exit__(self, *how):
        self.process.stdin.close()
        super().__exit__(*how)


class peer:
    def __init__(self, between, side, host, port):
        self.process = process(between, side, sys.executable, os.path.join(here, "peer.py"), host, str(port))
        self.address = f"{host if side == 'a' else link.address['b']}:{self.port()}"
        self.trips = 0

    def port(self):
        return self.process.line(r"^open (\d+)", "stdout")[1]

    def round_trip(self):
        """Returns the time before it: since then the endpoint has received something of this peer."""
        begin = time.monotonic()
        self.trips += 1
        self.process.say("trip")
        self.process.line("^heard", "stdout", self.trips)
        return begin

    def signal(self, number):
        self.process.process.send_signal(number)


@unittest.skipIf(why_not, why_not)
class gone(unittest.TestCase):
    """`patient` endpoints never disconnect for silence: they notice only what they are told."""

    silence_max = 3.0  # seconds

    def watch(self, patient):
        """An endpoint, a peer on its own host, two that stay and one that goes."""
        everything = self.enterContext(contextlib.ExitStack())
        self.between = everything.enter_context(bad_network.network("delay=1ms"))
        silence = "600000" if patient else f"{self.silence_max * 1000:.0f}"
        self.endpoint = process(self.between, "a", os.environ["ROWE_WATCHED"], "300", silence)
        everything.enter_context(self.endpoint)
        port = self.endpoint.line(r"^port (\d+)", "stdout")[1]
        self.peers = [peer(self.between, "a", "127.0.0.1", port),
                      *(peer(self.between, "b", link.address["a"], port) for _ in range(3))]
        for one in self.peers:
            everything.enter_context(one.process)
        self.local, *self.steady, self.victim = self.peers

    def left(self, who):
        """Waits until the endpoint says that it has lost this peer; returns why."""
        return self.endpoint.line(rf"^left {re.escape(who.address)}: (.*)", "stdout")[1]

    def counts(self):
        self.endpoint.say("counts")
        said = self.endpoint.line("^counts ", "stdout").string
        return {name: int(value) for name, value in re.findall(r"(\w+)=(\d+)", said)}

    def others_stay(self, *others, silent=0, trips=3):
        for _ in range(trips):
            for one in others:
                one.round_trip()
        found = [text for text in self.endpoint.stdout if text.startswith("left")]
        self.assertEqual(len(found), len(self.peers) - len(others), found)
        counted = self.counts()
        self.assertEqual(counted["silent_peers"], silent)
        for name in ("violations", "stalled_peers", "unfinished_messages", "events_lost"):
            self.assertEqual(counted[name], 0, name)

    def test_stopped_it_is_disconnected_for_its_silence_and_told_why(self):
        self.watch(patient=False)
        begin = self.victim.round_trip()
        self.victim.signal(signal.SIGSTOP)
        self.assertEqual(self.left(self.victim), "nothing was heard for too long")
        self.assertGreaterEqual(time.monotonic() - begin, self.silence_max)
        self.others_stay(self.local, *self.steady, silent=1)
        self.victim.signal(signal.SIGCONT)
        self.victim.process.line("^over nothing was heard for too long", "stdout")

    def test_killed_its_kernel_says_so(self):
        self.watch(patient=True)
        self.victim.round_trip()
        self.victim.signal(signal.SIGKILL)
        self.assertIn(self.left(self.victim), ("the peer closed the stream", "the connection was reset"))
        self.others_stay(self.local, *self.steady)

    def test_reset_it_is_noticed_as_that(self):
        self.watch(patient=True)
        self.victim.round_trip()
        self.victim.process.say("reset")
        self.assertEqual(self.left(self.victim), "the connection was reset")
        self.others_stay(self.local, *self.steady)

    def test_behind_a_black_hole_all_are_disconnected_and_no_others(self):
        self.watch(patient=False)
        begins = [one.round_trip() for one in self.peers]
        self.between.tell("black_hole=on")
        for one, begin in list(zip(self.peers, begins))[1:]:
            self.assertEqual(self.left(one), "nothing was heard for too long")
            self.assertGreaterEqual(time.monotonic() - begin, self.silence_max)
        self.others_stay(self.local, silent=3)

    def test_cut_off_in_one_direction_it_is_as_silent(self):
        """What it sends does not arrive, and it still receives."""
        self.watch(patient=False)
        begin = self.victim.round_trip()
        self.between.tell("ba.black_hole=on")
        self.assertEqual(self.left(self.victim), "nothing was heard for too long")
        self.assertGreaterEqual(time.monotonic() - begin, self.silence_max)
        self.local.round_trip()

    def test_half_open_it_is_noticed_by_the_next_ping(self):
        """Its host starts again behind a black hole, and knows nothing of the connection when it is back."""
        self.watch(patient=True)
        self.victim.round_trip()
        self.between.tell("black_hole=on")
        self.victim.process.say("reset")
        self.assertEqual(self.victim.process.end(), 0)
        self.between.tell("black_hole=off")
        self.assertEqual(self.left(self.victim), "the connection was reset")
        self.others_stay(self.local, *self.steady)


if __name__ == "__main__":
    unittest.main()
