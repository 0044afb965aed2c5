# SPDX-License-Identifier: Apache-2.0
"""The hub against peers that break the rules, by accident or not: raw bytes, RFC 6455 sections named."""
import contextlib
import os
import re
import socket
import struct
import time
import unittest

from program import hub, in_parallel
from websocket import (BINARY, CLOSE, CONTINUATION, PING, TEXT, closed, connect, frame, get, peer,
                       read_answer, refused, request, settle)


def upgrade(port, **changes):
    """The text of an upgrade request; a field set to None is left out."""
    fields = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade",
              "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version": "13"}
    fields.update({name.replace("_", "-"): value for name, value in changes.items()})
    lines = "".join(f"{name}: {value}\r\n" for name, value in fields.items() if value is not None)
    return f"GET / HTTP/1.1\r\n{lines}\r\n".encode()


class frames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub())

    def ends(self, data, code):
        with peer(self.serving.port) as p:
            p.send_raw(data)
            self.assertEqual(p.wait_for_close(), code, data[:20])

    def test_an_unmasked_frame_is_a_protocol_error(self):  # 5.1
        self.ends(frame(TEXT, b"{}", mask=False), 1002)

    def test_reserved_bits_and_opcodes_are_protocol_errors(self):  # 5.2
        self.ends(frame(TEXT, b"{}", reserved=4), 1002)
        self.ends(frame(0x3, b""), 1002)
        self.ends(frame(0xB, b""), 1002)

    def test_control_frames_are_short_and_whole(self):  # 5.5
        self.ends(frame(PING, b"x" * 126), 1002)
        self.ends(frame(PING, b"x", fin=False), 1002)

    def test_fragments_come_in_order(self):  # 5.4
        self.ends(frame(CONTINUATION, b"{}"), 1002)
        self.ends(frame(TEXT, b"{", fin=False) + frame(TEXT, b"}"), 1002)

    def test_text_is_utf8(self):  # 8.1
        self.ends(frame(TEXT, b'{"a":"\xff"}'), 1007)
        self.ends(frame(TEXT, b'{"a":"\xed\xa0\x80"}'), 1007)

    def test_close_codes_are_those_that_may_be_sent(self):  # 7.4
        self.ends(frame(CLOSE, b"\x03"), 1002)
        for code in (0, 999, 1004, 1005, 1006, 1015, 5000, 65535):
            self.ends(frame(CLOSE, struct.pack("!H", code)), 1002)

    def test_an_orderly_close_is_answered(self):  # 5.5.1
        self.ends(frame(CLOSE, struct.pack("!H", 1000)), 1000)

    def test_binary_messages_are_refused(self):
        self.ends(frame(BINARY, b"{}"), 1003)

    def test_messages_above_the_limit_are_refused_by_their_length(self):
        self.ends(frame(TEXT, b"", length=2**20 + 1), 1009)
        self.ends(frame(TEXT, b"", length=2**62), 1009)
        self.ends(frame(TEXT, b" " * 40_000, fin=False) + frame(CONTINUATION, b"", length=2**20), 1009)

    def test_a_length_with_its_highest_bit_set_is_a_protocol_error(self):  # 5.2
        self.ends(bytes([0x81, 0xFF]) + struct.pack("!Q", 2**63), 1002)

    def test_pings_are_answered_with_their_payload(self):  # 5.5.3
        with peer(self.serving.port) as p:
            for payload in (b"", b"x" * 125, os.urandom(60)):
                p.send_frame(PING, payload)
                self.assertEqual(p.receive_frame(), (True, 0xA, payload))

    def test_a_peer_that_vanishes_in_the_middle_of_a_frame_is_forgotten(self):
        with peer(self.serving.port) as p:
            p.send_raw(frame(TEXT, b"x" * 100)[:50])
        self.assertEqual(get(self.serving.port, "/healthz")[0], 200)


class scrapers(unittest.TestCase):
    def test_that_do_not_read_keep_nobody_from_stopping_or_asking(self):
        with hub("--demo") as serving, contextlib.ExitStack() as held:
            for _ in range(200):
                stream = held.enter_context(socket.socket())
                stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
                stream.connect(("127.0.0.1", serving.port))
                stream.sendall(request("GET", "/metrics", {"Host": f"127.0.0.1:{serving.port}"}))
            with peer(serving.port, path="/rowe/stop") as p:
                answer = p.call("/rowe/stop")
                self.assertEqual((answer["id"], answer["result"]), ("now", True))
            status, headers, body = get(serving.port, "/metrics")
            self.assertEqual((status, headers["cache-control"]), (200, "no-store"))
            self.assertIn(b"\nrowe_stopped 1\n", body)


class handshakes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub())

    def answer(self, request):
        with connect(self.serving.port) as stream:
            stream.sendall(request)
            return read_answer(stream)

    def test_what_is_wrong_in_an_upgrade_is_refused(self):  # 4.2.1
        port = self.serving.port
        for request, status in ((upgrade(port, Sec_WebSocket_Version="12"), 426),
                                (upgrade(port, Sec_WebSocket_Version=None), 426),
                                (upgrade(port, Sec_WebSocket_Key="short"), 400),
                                (upgrade(port, Sec_WebSocket_Key=None), 400),
                                (upgrade(port, Host=None), 400),
                                (upgrade(port).replace(b"GET", b"POST"), 405),
                                (upgrade(port).replace(b"HTTP/1.1", b"HTTP/1.0"), 505)):
            self.assertEqual(self.answer(request)[0], status, request)

    def test_no_other_protocol_can_be_switched_to(self):
        port = self.serving.port
        evil = {"Origin": "http://evil.example", "HTTP2_Settings": "AAMAAABkAAQAAP__"}
        self.assertNotEqual(self.answer(upgrade(port, Upgrade="h2c", **evil))[0], 101)
        request = f"CONNECT 127.0.0.1:{port} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
        self.assertGreaterEqual(self.answer(request)[0], 400)

    def test_a_header_that_is_too_long_is_refused(self):
        self.assertEqual(self.answer(upgrade(self.serving.port, X="x" * 5000))[0], 431)

    def test_a_handshake_may_come_byte_by_byte(self):
        with connect(self.serving.port) as stream:
            for byte in upgrade(self.serving.port):
                stream.sendall(bytes([byte]))
            self.assertEqual(read_answer(stream)[0], 101)

    def test_frames_may_follow_the_handshake_in_one_packet(self):
        with connect(self.serving.port) as stream:
            stream.sendall(upgrade(self.serving.port) + frame(PING, b"early"))
            status, _, _, rest = read_answer(stream)
            self.assertEqual(status, 101)
            while len(rest) < 7:
                rest += stream.recv(100)
            self.assertEqual(rest, b"\x8a\x05early")


class messages(unittest.TestCase):
    def test_that_are_too_big_are_told_their_size_the_limit_and_the_remedy(self):
        says = ("a message of 1100000 bytes exceeds the limit long_message_bytes_max of 1048576: send less, "
                "or raise it")
        with hub() as serving, peer(serving.port) as p:
            p.stream.sendall(b"\x81\xff" + struct.pack("!Q", 1100000) + b"keys")
            with self.assertRaises(closed) as end:
                p.receive()
            self.assertEqual((end.exception.code, end.exception.reason), (1009, says))
            serving.line(re.escape(says))


class crowds(unittest.TestCase):
    def test_the_connection_beyond_the_limit_is_answered_503_until_one_leaves(self):
        with hub("--limit", "connections_max=12") as serving:  # of which the last two are kept for the stop
            peers = [peer(serving.port) for _ in range(10)]
            try:
                for p in peers:  # lest it cuts those that were there before a busy machine had brought all
                    settle(p)
                with self.assertRaises(refused) as refusal:
                    peer(serving.port)
                self.assertEqual(refusal.exception.status, 503)
                serving.line(r"all 10 connections are taken")
                peers.pop().__exit__()
                end = time.monotonic() + 60
                while True:  # the place is free as soon as the hub has seen the end
                    try:
                        peers.append(peer(serving.port))
                        break
                    except refused:
                        self.assertLess(time.monotonic(), end)
            finally:
                for p in peers:
                    p.__exit__()
            self.assertEqual(serving.summary()["peers_joined"], 11)


class timeouts(unittest.TestCase):
    """Peers that keep the hub waiting, all at the same time, because that takes seconds by the clock."""

    def test_peers_that_stall_are_cut_and_those_that_answer_stay(self):
        with hub() as serving:
            kinds = (self.half_a_handshake, self.no_request, self.half_a_message, self.drips_a_message,
                     self.silence, self.answers)
            in_parallel(*(lambda kind=kind: kind(serving.port) for kind in kinds))
            counts = serving.summary()
        self.assertEqual(counts["unfinished_messages"], 2)
        self.assertEqual(counts["silent_peers"], 1)

    # Each says how long it was borne at least; the upper end is the sockets' own timeout.
    def half_a_handshake(self, port):
        self.is_cut(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n", at_least=4.5)

    def no_request(self, port):
        self.is_cut(port, b"", at_least=4.5)

    def is_cut(self, port, data, at_least):
        begin = time.monotonic()
        with connect(port) as stream:
            stream.sendall(data)
            while stream.recv(4096):
                pass
        self.assertGreater(time.monotonic() - begin, at_least)

    def half_a_message(self, port):
        begin = time.monotonic()
        with peer(port) as p:
            p.send_raw(frame(TEXT, b"{", length=100))
            p.wait_for_close(answer_pings=False)  # an answer would be part of the frame
        self.assertGreater(time.monotonic() - begin, 4.5)

    def drips_a_message(self, port):
        """A byte every now and then does not make a message younger."""
        begin = time.monotonic()
        with peer(port) as p:
            p.send_raw(frame(TEXT, length=4096, key=bytes(4)))
            opcode = None
            while opcode != CLOSE:
                try:
                    p.send_raw(b" ")
                    opcode = p.receive_frame(wait=0.3)[1]
                except TimeoutError:
                    continue
                except (closed, BrokenPipeError, ConnectionResetError):
                    break
        self.assertGreater(time.monotonic() - begin, 4.5)

    def silence(self, port):
        begin = time.monotonic()
        with peer(port) as p:
            p.wait_for_close(answer_pings=False)
        self.assertGreater(time.monotonic() - begin, 7.5)

    def answers(self, port):
        with peer(port) as p:
            with self.assertRaises(TimeoutError):
                p.receive(wait=11)  # answers pings meanwhile
            p.send_frame(PING, b"still there")
            self.assertEqual(p.receive_frame()[2], b"still there")


if __name__ == "__main__":
    unittest.main()
