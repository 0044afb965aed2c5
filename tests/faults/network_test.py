# SPDX-License-Identifier: Apache-2.0
"""Bad networks and peers that vanish, under TLS: the robot is on side a of tests/impair, its peers on side b.
Each message is accounted for, received or counted as dropped, and the stop works meanwhile and afterwards."""
import contextlib
import itertools
import re
import signal
import socket
import struct
import threading
import unittest

import bad_network
import link
from program import ROWE, program
from robot import dropped, numbers_until, publish, robot, round_trip, topic, until
from websocket import connect

why_not = bad_network.why_not() if __name__ == "__main__" else ""
host = link.address["a"]
# How a network is bad, one after the other on the same connections.
impairments = (
    "delay=20ms jitter=5ms",
    "delay=2ms loss=5%",
    "delay=2ms reorder=10% reorder_by=10ms",
    "delay=2ms duplicate=10%",
    "delay=2ms rate=2mbit queue=64KiB",
    "delay=5ms jitter=2ms loss=2% reorder=2% duplicate=2% rate=8mbit",
)


def reset(stream):
    """Vanishes with a reset, and without a word of TLS."""
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    socket.socket.close(stream)


@unittest.skipIf(why_not, why_not)
class bad_networks(unittest.TestCase):
    def serve(self, *options):
        self.everything = self.enterContext(contextlib.ExitStack())
        enter = self.everything.enter_context
        self.between = enter(bad_network.network("delay=1ms"))
        self.bot = enter(robot("--host", host))
        self.serving = enter(self.bot.serving("--demo", *options, address=host, command=self.on("a")))
        self.url = f"wss://{host}:{self.serving.port}/"

    def on(self, side, command=ROWE):
        return ("ip", "netns", "exec", self.between.namespace(side), command)

    def peer(self, role, make="peer"):
        """On side b."""
        p = self.between.call("b", getattr(self.bot, make), self.serving, role)
        self.everything.callback(p.stream.close)
        return p

    def stop(self, side="b"):
        self.assertEqual(self.between.call(side, self.bot.stop, self.serving)["state"], "stopped")

    def echo(self):
        """Subscribes as a program does, and connects again by itself."""
        echo = program("echo", self.url, topic, "--json", command=self.on("b"),
                       environment=self.bot.who("observer"))
        self.everything.enter_context(echo)
        echo.line("nobody publishes")
        return echo

    def counts(self):
        return self.between.call("a", self.bot.counts, self.serving)

    def drops(self):
        return dropped(self.counts())

    def none_is_missing(self, got, sent):
        """Of those that one subscriber alone was to get: in order, none twice, the others counted."""
        self.assertEqual(sorted(set(got)), got)
        self.assertEqual(len(got) + self.drops(), sent)

    def test_lose_no_message_that_is_not_counted(self):
        self.serve()
        reader, writer = self.peer("observer", "subscriber"), self.peer("peer")
        got, sent = [], 0
        for impairment in impairments:
            self.between.tell("delay=0ms jitter=0ms loss=0% duplicate=0% reorder=0% rate=none")
            self.assertNotIn("error", self.between.tell(impairment))
            for size in (10, 100, 10):
                publish(writer, range(sent, sent + size))
                sent += size
                got += numbers_until(reader, sent - 1)  # the oldest are dropped, never the last one
            self.stop()
        self.none_is_missing(got, sent)
        counts = self.counts()
        self.assertEqual(counts["stops"], len(impairments))
        for name in ("silent_peers", "stalled_peers", "violations", "unfinished_messages"):
            self.assertEqual(counts[name], 0, name)

    def test_drop_the_oldest_for_one_that_is_too_slow_and_count_them(self):
        self.serve()
        reader, writer = self.peer("observer", "subscriber"), self.peer("peer")
        self.between.tell("ab.rate=400kbit ab.queue=64KiB")
        sent = 0
        for _ in range(30):
            publish(writer, range(sent, sent + 100))
            sent += 100
        round_trip(writer)
        self.stop()
        got = numbers_until(reader, sent - 1)
        self.none_is_missing(got, sent)
        self.assertGreater(self.drops(), 0)  # or this looked at nothing

    def test_a_reset_in_the_middle_of_a_stream_loses_what_is_counted_for_that_peer_alone(self):
        self.serve()
        steady, victim = (self.peer("observer", "subscriber") for _ in range(2))
        writer = self.peer("peer")
        got, sent, owed, answers = [], 0, 0, 2  # to those who settled
        for subscribers in (2, 1):
            for _ in range(20):  # far more than the victim's socket holds
                text = "x" * 1000
                for number in range(sent, sent + 20):
                    writer.send({"op": "publish", "topic": topic, "msg": {"n": number, "text": text}})
                sent += 20
                owed += 20 * subscribers
                got += numbers_until(steady, sent - 1)
            round_trip(writer)
            if subscribers == 2:
                reset(victim.stream)
                self.serving.line("the connection was reset")
        self.stop()
        counts = self.counts()
        answers += counts["stops"]
        self.assertEqual(counts["messages_out"] - answers + dropped(counts), owed)
        self.assertEqual(got, list(range(sent)))
        self.assertGreater(counts["lost_with_peer"] + counts["outbox_full"], 0)

    def test_resets_in_the_middle_of_handshakes_leave_every_place_free(self):
        self.serve("--limit", "handshakes_max=8")
        half_a_hello = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(60)
        for begun in (b"", half_a_hello[:3], half_a_hello) * 10:
            stream = self.between.call("b", connect, self.serving.port, host)
            stream.sendall(begun)
            reset(stream)
        self.stop()
        reader, writer = self.peer("observer", "subscriber"), self.peer("peer")
        publish(writer, range(100))
        self.none_is_missing(numbers_until(reader, 99), 100)

    def test_a_peer_that_is_stopped_for_a_while_gets_what_was_not_dropped(self):
        self.serve()
        echo, writer = self.echo(), self.peer("peer")
        publish(writer, range(100))
        echo.line('"n": 99', "stdout")
        echo.process.send_signal(signal.SIGSTOP)
        publish(writer, range(100, 3000))
        round_trip(writer)
        self.stop()
        echo.process.send_signal(signal.SIGCONT)
        echo.line('"n": 2999', "stdout")
        self.none_is_missing(self.printed(echo), 3000)

    def printed(self, echo):
        return [int(re.search(r'"n": (\d+)', line)[1]) for line in echo.stdout]

    def test_a_peer_that_is_stopped_for_longer_comes_again_and_gets_nothing_twice(self):
        self.serve("--ping-period", "200 ms", "--silence-max", "1 s")
        echo, writer = self.echo(), self.peer("peer")
        publish(writer, range(100))
        echo.line('"n": 99', "stdout")
        echo.process.send_signal(signal.SIGSTOP)
        publish(writer, range(100, 200))

        def is_given_up():
            round_trip(writer)  # or the writer would be given up as well
            return re.search("observer.*: nothing was heard for too long", "\n".join(self.serving.stderr))

        until(is_given_up)
        self.stop()
        echo.process.send_signal(signal.SIGCONT)
        self.publish_until_heard(writer, echo, 200)
        got = self.printed(echo)
        self.assertEqual(sorted(set(got)), got)
        self.assertEqual(self.counts()["silent_peers"], 1)

    def publish_until_heard(self, writer, echo, begin):
        following = itertools.count(begin)

        def heard():
            publish(writer, [next(following)])
            round_trip(writer)
            return self.printed(echo)[-1] >= begin

        until(heard)

    def test_behind_a_black_hole_all_are_given_up_and_come_again_by_themselves(self):
        self.serve("--ping-period", "200 ms", "--silence-max", "1 s")
        echo, writer = self.echo(), self.peer("peer")
        publish(writer, range(100))
        echo.line('"n": 99', "stdout")
        self.between.tell("black_hole=on")
        self.serving.line("observer.*: nothing was heard for too long")
        self.stop("a")  # who is on this side of it
        self.between.tell("black_hole=off")
        writer = self.peer("peer")
        self.publish_until_heard(writer, echo, 100)
        got = self.printed(echo)
        self.assertEqual(sorted(set(got)), got)

    def stopped_robot(self):
        """A reader and a writer of one that stopped as a machine does that is suspended, or swaps; and what
        the reader has got."""
        self.serve("--inbound-ttl", "1 h")
        reader, writer = self.peer("observer", "subscriber"), self.peer("peer")
        publish(writer, range(100))
        got = numbers_until(reader, 99)
        self.serving.process.send_signal(signal.SIGSTOP)
        return reader, writer, got

    def test_a_robot_that_is_stopped_itself_loses_nothing(self):
        reader, writer, got = self.stopped_robot()
        publish(writer, range(100, 200))
        writer.send({"op": "call_service", "service": "/rowe/stop", "id": "now"})
        self.serving.process.send_signal(signal.SIGCONT)
        answer = writer.receive_until(lambda m: m["op"] == "service_response")
        self.assertEqual((answer["id"], answer["result"]), ("now", True))
        got += numbers_until(reader, 199)
        self.none_is_missing(got, 200)

    def test_a_robot_that_is_stopped_for_longer_than_peers_may_be_silent_keeps_them(self):
        reader, writer, got = self.stopped_robot()
        threading.Event().wait(9)  # silence_max is 8 s
        self.serving.process.send_signal(signal.SIGCONT)
        until(lambda: self.counts()["pauses"])
        publish(writer, range(100, 200))
        got += numbers_until(reader, 199)
        self.none_is_missing(got, 200)


if __name__ == "__main__":
    unittest.main()
