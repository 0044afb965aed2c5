# SPDX-License-Identifier: Apache-2.0
"""Limits, and what one peer's misbehaviour does to others: nothing. Times have lower ends only."""
import contextlib
import json
import re
import threading
import time
import unittest

import programs
from frames import BINARY, CLOSE, CONTINUATION, PING, PONG, TEXT, close_body, cut, ended, frame, wrong
from programs import in_parallel, read_answer, upgrade

reserved_for_stop = 2  # of connections, and of handshakes
others_max = {"echo": 64 - reserved_for_stop, "hub": 40 - reserved_for_stop}
handshakes_max = 32
message_bytes_max = 60 * 1024
long_message_bytes_max = 1 << 20
fragments_max = 1024


def round_trip(s):
    """Something goes there and comes back."""
    s.send(frame(PING, b"?"))
    while s.message() != (PONG, b"?"):
        pass


def publish(body):
    return json.dumps({"op": "publish", "topic": "/t", "msg": body}).encode()


class crowds(unittest.TestCase):
    def refused(self, serving, status):
        with serving.dial() as s:
            s.sendall(upgrade(serving.port))
            got, fields, _ = read_answer(s)
            self.assertEqual((got, fields["connection"]), (status, "close"))

    def test_connections(self):
        for kind in ("echo", "hub"):
            with self.subTest(kind):
                self.fills_and_empties(kind)

    @programs.within(7)  # then the hub cuts those that have not answered its pings
    def fills_and_empties(self, kind):
        with programs.server(kind) as serving:
            peers = [serving.connect() for _ in range(others_max[kind])]
            for _ in range(3):
                self.refused(serving, 503)
            for one in peers:
                round_trip(one)
            for one in peers[:10]:  # who goes makes room, however it goes
                programs.reset(one.socket)
                one.socket.close()
            with peers[10]:
                peers[10].send(frame(CLOSE))
                peers[10].until_close()
            peers = peers[11:]
            while len(peers) < others_max[kind]:
                with contextlib.suppress(programs.frames.wrong):  # 503 until it has seen the ends
                    peers.append(serving.connect())
            self.refused(serving, 503)
            for one in peers:
                round_trip(one)
                one.socket.close()

    @programs.within(7)
    def test_a_page_is_served_when_all_connections_are_taken(self):
        with programs.server("hub") as serving:
            peers = [serving.connect() for _ in range(others_max["hub"])]
            peers += [serving.connect(target="/rowe/stop") for _ in range(reserved_for_stop)]
            with serving.dial() as s:
                s.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{serving.port}\r\n\r\n".encode())
                self.assertEqual(read_answer(s)[0], 200)
            for one in peers:
                one.socket.close()

    def test_handshakes(self):
        for kind in ("echo", "hub"):
            with self.subTest(kind):
                self.give_way(kind)

    @programs.within(4.5)  # then it answers 408 to those that have not come to an end
    def give_way(self, kind):
        with programs.server(kind) as serving:
            before = serving.connect()
            waiting = [serving.dial() for _ in range(handshakes_max)]
            for s in waiting:
                s.sendall(b"GET / HTTP/1.1\r\n")
            for _ in range(100):  # one after another, in the place of the oldest
                serving.connect().socket.close()
            round_trip(before)  # who is in does not notice
            answers = []
            for s in waiting:
                with contextlib.suppress(OSError):  # the answer is overtaken by a reset
                    s.sendall(upgrade(serving.port).partition(b"\r\n")[2])
                answers.append(read_answer(s)[0])
                s.close()
            self.assertIn(answers[0], (503, None))
            self.assertEqual(answers[1:], [101] * (handshakes_max - 1))
            before.socket.close()

    def test_a_storm_of_connections(self):
        """Opened, and left in all ways; a peer that is there stays."""
        for serving in programs.servers():
            with self.subTest(serving.kind):
                one, over = serving.connect(), threading.Event()

                def stays(_, one=one, over=over):
                    while not over.is_set():
                        round_trip(one)

                def others_leave(_, serving=serving, over=over):
                    try:
                        in_parallel([(f"{n}", lambda _: self.leaves(serving)) for n in range(8)], 8)
                    finally:
                        over.set()

                in_parallel([("one stays", stays), ("others leave", others_leave)], 2)
                one.socket.close()
                while True:  # and the next one finds a place
                    with contextlib.suppress(programs.frames.wrong):
                        serving.connect().socket.close()
                        break

    def leaves(self, serving):
        """Comes and goes sixty times, in different ways."""
        for n in range(60):
            s = serving.dial()
            with contextlib.suppress(OSError):
                s.sendall((b"", b"GET", upgrade(serving.port), upgrade(serving.port) + b"\x81", b"\xff" * 50,
                           b"\r\n\r\n")[n % 6])
                if n % 6 in (2, 3):
                    s.recv(10)
            if n % 2:
                programs.reset(s)
            s.close()


class sizes(unittest.TestCase):
    """10.4: a limit is said with 1009 or 1008, and what is just below it passes."""

    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(programs.server("hub"))

    def passes(self, *script):
        with self.serving.connect() as s, self.serving.connect() as other:
            other.send(frame(TEXT, b'{"op":"subscribe","topic":"/t"}'))
            round_trip(other)
            s.send(*script)
            opcode, payload = other.message()
            self.assertEqual((opcode, json.loads(payload)["op"]), (TEXT, "publish"))

    def is_cut(self, code, *script):
        with self.serving.connect() as s:
            s.send_what_it_takes("send", *script)
            self.assertEqual(s.until_close()[1], code)
            s.until_end()

    def filled(self, size):
        empty = publish({"x": ""})
        return empty.replace(b'""', b'"' + b"x" * (size - len(empty)) + b'"')

    def test_messages(self):
        for size in (125, 126, 127, 2048, 65535 // 2, message_bytes_max - 1, message_bytes_max,
                     message_bytes_max + 1, 65535, 65536, long_message_bytes_max):
            with self.subTest(size):
                self.passes(frame(TEXT, self.filled(size)))
        for size in (long_message_bytes_max + 1, 1 << 24):
            with self.subTest(size):
                self.is_cut(1009, frame(TEXT, b" " * size))
                self.is_cut(1009, frame(TEXT, length=size))  # by what it claims
                self.is_cut(1009, *cut(TEXT, b" " * size, [5000] * (size // 5000)))

    def test_fragments(self):
        text = self.filled(2000)
        self.passes(*cut(TEXT, text, [1] * (fragments_max - 1)))
        self.passes(*cut(TEXT, text, [0] * (fragments_max - 1)))
        self.is_cut(1008, *cut(TEXT, text, [1] * fragments_max))
        self.is_cut(1008, *cut(TEXT, text, [0] * fragments_max))

    def test_control_frames_do_not_count(self):
        parts = cut(TEXT, self.filled(2000), [10] * 199)
        self.passes(*[one for part in parts for one in (part, *[frame(PONG, b"x" * 125)] * 20)])

    def test_a_limit_is_of_each_message(self):
        with self.serving.connect() as s:
            for _ in range(20):
                s.send(*cut(TEXT, self.filled(message_bytes_max), [100] * 500))
            round_trip(s)


class time_limits(unittest.TestCase):
    def test_messages_that_do_not_end_and_peers_that_do_not_answer(self):
        """All at the same time, because it takes seconds by the clock."""
        with programs.server("hub") as serving:
            def is_left(script, at_least, drip=None, answers=False):
                begin = time.monotonic()
                with serving.connect() as s:
                    s.send(*script)
                    s.socket.settimeout(0.5 if drip else programs.timeout)
                    while True:
                        try:
                            opcode, payload = s.event()
                            if opcode == CLOSE:
                                self.assertEqual(payload[:2], close_body(1008))
                                break
                            if answers and opcode == PING:
                                s.send(frame(PONG, payload))
                        except TimeoutError:
                            with contextlib.suppress(OSError):  # cut meanwhile: what it said is still there
                                s.send(*drip)
                        except (ended, ConnectionError):
                            self.fail("no Close frame")
                self.assertGreater(time.monotonic() - begin, at_least)

            begun = frame(TEXT, b"{", fin=False)
            in_parallel([
                ("half a header", lambda _: is_left([b"\x81"], 4.5)),
                ("half a frame", lambda _: is_left([b"\x81\x85\0\0\0\0ab"], 4.5)),
                ("a frame, a byte at a time", lambda _: is_left(
                    [frame(TEXT, length=1000, key=bytes(4))], 4.5, drip=[b" "])),
                ("half a message", lambda _: is_left([begun], 4.5, answers=True)),
                ("a message, a fragment at a time", lambda _: is_left(
                    [begun], 4.5, drip=[frame(CONTINUATION, b" ", fin=False)], answers=True)),
                ("a message, and pings", lambda _: is_left([begun], 4.5, drip=[frame(PONG)], answers=True)),
                ("silence", lambda _: is_left([], 7.5)),
            ], 7)


class isolation(unittest.TestCase):
    deaf_readers = 8

    @contextlib.contextmanager
    def with_deaf_readers(self):
        """A hub, a publisher, a subscriber that reads, and some that never do; these must be cut."""
        with programs.server("hub") as serving:
            publisher, subscriber = serving.connect(), serving.connect()
            deaf = [serving.connect() for _ in range(self.deaf_readers)]
            for one in (subscriber, *deaf):
                one.send(frame(TEXT, b'{"op":"subscribe","topic":"/t"}'))
                round_trip(one)
            before = serving.resident_bytes()
            with publisher, subscriber:
                yield serving, publisher, subscriber
                round_trip(publisher)
                round_trip(subscriber)
            self.assertLess(serving.resident_bytes() - before, 16 << 20)
            for one in deaf:
                with one, self.assertRaises((ended, ConnectionError)):
                    while True:
                        one.event()

    def cut_off(self, serving):
        """What is like it is folded into one line: "[and 7 more like it in a second]"."""
        folded = [re.search(r"does not read.*?(?:\[and (\d+) more|$)", line) for line in serving.errors]
        return sum(1 + int(found[1] or 0) for found in folded if found) == self.deaf_readers

    def test_readers_that_never_read(self):
        """Their queues fill, and they are cut; another gets every message meanwhile."""
        with self.with_deaf_readers() as (serving, publisher, subscriber):
            n = 0
            while not self.cut_off(serving):
                n += 1
                publisher.send(frame(TEXT, publish({"n": n, "fill": "x" * 1000})))
                opcode, payload = subscriber.message()
                self.assertEqual((opcode, json.loads(payload)["msg"]["n"]), (TEXT, n))

    def test_readers_that_never_read_large_messages(self):
        """The same with messages for which there are few slots: see `waived`."""
        with self.with_deaf_readers() as (serving, publisher, subscriber):
            last = threading.Event()

            def publishes(_):
                while not self.cut_off(serving):
                    publisher.send(frame(TEXT, publish({"fill": "x" * 16000})))
                    round_trip(publisher)
                publisher.send(frame(TEXT, publish({"last": True})))

            def reads(_):
                while not last.is_set():
                    opcode, payload = subscriber.message()
                    self.assertEqual(opcode, TEXT)
                    if json.loads(payload)["msg"] == {"last": True}:
                        last.set()

            in_parallel([("publishes", publishes), ("reads", reads)], 2)

    def test_an_echo_is_not_held_up_either(self):
        with programs.server("echo") as serving:
            with serving.connect() as deaf, serving.connect() as other:
                deaf.socket.settimeout(0.2)
                with self.assertRaises(TimeoutError):  # until both ends are full
                    while True:
                        deaf.send(frame(BINARY, bytes(65536), key=bytes(4)))
                for n in range(100):
                    other.send(frame(TEXT, b"%d" % n))
                    self.assertEqual(other.event(), (TEXT, b"%d" % n))

    def test_a_peer_that_floods(self):
        """Pings, messages, requests and nonsense as fast as they can; another's messages get through."""
        floods = (frame(PING, b"x" * 125), frame(PONG), frame(TEXT, publish({}).replace(b"/t", b"/flood")),
                  frame(TEXT, b"nonsense"), frame(TEXT, b'{"op":"subscribe","topic":"/flood"}'),
                  frame(TEXT, b'{"op":"advertise","topic":"/flood","type":"a/B"}'))
        with programs.server("hub") as serving, serving.connect() as publisher, \
                serving.connect() as subscriber:
            subscriber.send(frame(TEXT, b'{"op":"subscribe","topic":"/t"}'))
            round_trip(subscriber)
            over = threading.Event()

            def flood(one):
                while not over.is_set():
                    try:
                        s = serving.connect()
                    except wrong:  # 503: those that were left are not all forgotten yet
                        over.wait(0.05)
                        continue
                    with s, contextlib.suppress(OSError):
                        s.socket.settimeout(0.2)
                        for _ in range(200):
                            s.send(*[one] * 50)
                            if over.is_set():
                                break

            def others(_):
                try:
                    for n in range(500):
                        publisher.send(frame(TEXT, publish({"n": n})))
                        self.assertEqual(json.loads(subscriber.message()[1])["msg"], {"n": n})
                finally:
                    over.set()

            jobs = [(one.payload[:40], lambda _, one=one: flood(one)) for one in floods]
            in_parallel([*jobs, ("others", others)], len(jobs) + 1)


if __name__ == "__main__":
    unittest.main()
