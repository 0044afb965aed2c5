# SPDX-License-Identifier: Apache-2.0
"""The server's role: RFC 6455 sections 5, 7 and 8.1 against `transport_echo` and `rowe serve`."""
import json
import time
import unittest

import cases
import programs
from frames import BINARY, CLOSE, PING, PONG, TEXT, close_body, cut, frame, wrong

bytewise_max = 2000  # longer scripts are sent at once only


def ways_to_send(one):
    yield "at once", "send"
    if len(one.script) < 300 and sum(len(part) if isinstance(part, bytes) else len(part.payload) + 14
                                     for part in one.script) < bytewise_max:
        yield "byte by byte", "send_bytewise"


def send_all(test, kind, what, some, act):
    """Calls act(server, case, way to send) for each case and each way."""
    count = 0
    with programs.server(kind) as serving:
        for one in some:
            for how, method in ways_to_send(one):
                with test.subTest(f"{one.section}: {one.name}, {how}"):
                    act(serving, one, method)
                count += 1
    print(f"server role, {kind}: {count} {what}", flush=True)


class endings(unittest.TestCase):
    """After each of these the server says why, in a Close frame, and then closes the stream itself."""

    def ends(self, serving, one, method):
        with serving.connect() as s:
            s.send_what_it_takes(method, *one.script)
            before, code, _ = s.until_close()
            if serving.kind == "echo":
                self.assertEqual(before, list(one.replies))
            else:  # texts are answered with a status here; and who is silent for three seconds is pinged
                pongs = [reply for reply in one.replies if reply[0] == PONG]
                self.assertEqual([event for event in before if event[0] not in (TEXT, PING)], pongs)
            self.assertIn(code, one.codes())
            s.until_end()  # 7.1.1: we have not closed anything

    def test_the_echo(self):
        send_all(self, "echo", "endings", cases.endings(), self.ends)

    def test_the_hub(self):
        send_all(self, "hub", "endings", cases.endings(), self.ends)


class echoes(unittest.TestCase):
    def test_what_an_echo_sends_back(self):
        send_all(self, "echo", "echoes", cases.echoes(), self.goes_on)

    def goes_on(self, serving, one, method):
        with serving.connect() as s:
            getattr(s, method)(*one.script)
            for reply in one.replies:
                self.assertEqual(s.event(), reply)
            self.closes_well(s)

    def closes_well(self, s):
        """Nothing is left over, and the connection is alive."""
        s.send(frame(PING, b"alive?"), frame(CLOSE, close_body(1000, b"done")))
        self.assertEqual(s.until_close()[:2], ([(PONG, b"alive?")], 1000))
        s.until_end()

    def test_16_mib(self):  # 5.2, 10.4: up to the limit, whole and in pieces
        size = 1 << 24
        payload = bytes(range(256)) * (size // 256)
        with programs.server("echo") as serving:
            for name, opcode, script in (
                    ("whole", BINARY, [frame(BINARY, payload)]),
                    ("whole, as text", TEXT, [frame(TEXT, b"x" * size)]),
                    ("in frames of 1 MiB", BINARY, cut(BINARY, payload, [1 << 20] * 15)),
                    ("in frames of 4 KiB", BINARY, cut(BINARY, payload, [4096] * (size // 4096 - 1)))):
                with self.subTest(name), serving.connect() as s:
                    s.send(*script)
                    self.assertTrue(s.event() == (opcode, b"x" * size if opcode == TEXT else payload))
                    self.closes_well(s)
            with self.subTest("one byte more"), serving.connect() as s:
                s.send(frame(BINARY, payload[:1], fin=False), frame(0, length=size, length_bytes=8))
                self.assertEqual(s.until_close()[:2], ([], 1009))

    def test_a_million_fragments_of_one_byte(self):  # 5.4
        count = 1 << 20
        fragment = b"\x00\x81\0\0\0\0*"
        with programs.server("echo") as serving, serving.connect() as s:
            s.socket.sendall(b"\x02" + fragment[1:] + fragment * (count - 2) + b"\x80" + fragment[1:])
            self.assertTrue(s.event() == (BINARY, b"*" * count))
            self.closes_well(s)

    def test_64_kib_in_segments_of_one_byte(self):  # a message has nothing to do with segments
        payload = b"segment!" * 8192
        with programs.server("echo") as serving, serving.connect() as s:
            s.send_bytewise(frame(BINARY, payload))
            self.assertTrue(s.event() == (BINARY, payload))
            self.closes_well(s)

    def test_each_place_for_a_read_to_end(self):
        """A frame of each header's size, cut into two segments at each of its bytes, with a pause."""
        with programs.server("echo") as serving, serving.connect() as s:
            for payload in (b"", b"x" * 20, b"y" * 200):
                data = frame(TEXT, payload, key=b"\x11\x22\x33\x44").to_bytes(True)
                for at in range(1, len(data)):
                    s.socket.sendall(data[:at])
                    programs.pause(s.socket, 0.001)
                    s.socket.sendall(data[at:])
                    self.assertEqual(s.event(), (TEXT, payload))
            self.closes_well(s)


class hub(unittest.TestCase):
    """Messages of a JSON codec, sent in all ways: each reaches a subscriber."""

    def test_every_shape_of_a_message(self):
        count = 0
        with programs.server("hub") as serving, serving.connect() as subscriber, \
                serving.connect() as publisher:
            subscriber.send(frame(TEXT, b'{"op":"subscribe","topic":"/t"}'), frame(PING, b"there?"))
            self.assertEqual(subscriber.message(), (PONG, b"there?"))
            for name, way, script, body in cases.published():
                with self.subTest(name):
                    getattr(publisher, way)(*script)
                    opcode, payload = subscriber.message()
                    self.assertEqual((opcode, json.loads(payload)["msg"]), (TEXT, body))
                    self.drain_pongs(publisher, script)
                count += 1
        print(f"server role, hub: {count} messages", flush=True)

    def drain_pongs(self, s, script):
        """5.5.3: a pong may stand for several pings; none is for one that was not sent, nor out of turn."""
        s.send(frame(PING, b"last"))
        sent = iter([*cases.pongs_of(script), (PONG, b"last")])
        while True:
            event = s.message()
            if event not in sent:
                raise wrong(f"5.5.3: {event} is for no ping")
            if event[1] == b"last":
                return

    def test_the_latest_of_many_pings_is_answered(self):  # 5.5.3
        with programs.server("hub") as serving:
            for size in (0, 1, 125):
                for burst in (1, 3, 4, 10, 100):
                    with self.subTest(f"{burst} pings of {size} bytes"), serving.connect() as s:
                        last = b"\xff" * size
                        s.send(*[frame(PING, bytes(size))] * (burst - 1), frame(PING, last))
                        said = [s.message()]
                        s.send(frame(PING, b"behind"))  # the burst has been read by now
                        while said[-1] != (PONG, b"behind"):
                            said.append(s.message())
                        self.assertEqual(said[-2], (PONG, last))

    def test_a_burst_of_pings_does_not_hide_the_close_frame(self):  # 5.5.1
        with programs.server("hub") as serving:
            for name, end, code in (("close", frame(CLOSE, close_body(1000, b"bye")), 1000),
                                    ("a violation", frame(PING, bytes(126)), 1002)):
                for burst in (3, 4, 100):
                    with self.subTest(f"{burst} pings, then {name}"), serving.connect() as s:
                        s.send(*[frame(PING, bytes(125))] * burst, end)
                        self.assertEqual(s.until_close()[1], code)

    def test_a_binary_message_is_of_no_codec(self):  # 7.4.1
        with programs.server("hub") as serving:
            for script in ([frame(BINARY, b"{}")], cut(BINARY, b"{}", [1])):
                with serving.connect() as s:
                    s.send(*script)
                    self.assertEqual(s.until_close()[1], 1003)
                    s.until_end()


class ends_of_the_stream(unittest.TestCase):
    def test_a_peer_that_goes_without_a_word_is_forgotten(self):  # 7.1.5
        for serving in programs.servers():
            for begun in (b"", b"\x81", b"\x81\xfe\x01", frame(TEXT, b"x" * 50).to_bytes(True)[:30]):
                for cut_short in (True, False):
                    with serving.connect() as s:
                        s.socket.sendall(begun)
                        if cut_short:
                            programs.reset(s.socket)
                    with serving.connect() as other:
                        other.send(frame(PING, b"?"))
                        self.assertEqual(other.event(), (PONG, b"?"))

    def test_a_half_closed_stream_is_closed(self):
        for serving in programs.servers():
            with serving.connect() as s:
                programs.half_close(s.socket)
                s.until_end()

    def test_an_ending_server_sends_a_close_frame(self):  # 7.4.1: 1001
        serving = programs.server("hub")
        with serving.connect() as s:
            serving.__exit__(None)
            self.assertEqual(s.until_close()[1], 1001)

    @unittest.skipIf(programs.TLS, "Python's TLS cannot send once the other side has ended; tests/net has it")
    def test_a_peer_that_does_not_close_is_left_after_a_second(self):  # 7.1.1
        for serving in programs.servers():
            with serving.connect() as s:
                begin = time.monotonic()
                s.send(frame(CLOSE))
                s.until_close()
                s.until_end()
                with self.assertRaises((BrokenPipeError, ConnectionResetError)):
                    while True:  # our side is open; in the end theirs is not there any more
                        s.socket.sendall(b"x" * 100)
                        programs.pause(s.socket)
            self.assertGreater(time.monotonic() - begin, 0.9)


if __name__ == "__main__":
    for section, what, why in cases.waived:
        print(f"waived: {section}: {what}: {why}")
    unittest.main()
