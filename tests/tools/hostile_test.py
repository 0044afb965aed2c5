# SPDX-License-Identifier: Apache-2.0
"""The hub against peers that are too many, too large or too slow. tests/conformance has those that break a
rule of RFC 6455 or of HTTP."""
import contextlib
import re
import socket
import struct
import time
import unittest

from program import hub, in_parallel
from websocket import CLOSE, PING, TEXT, closed, frame, get, peer, refused, request, settle


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
            kinds = (self.half_a_message, self.drips_a_message, self.silence, self.answers)
            in_parallel(*(lambda kind=kind: kind(serving.port) for kind in kinds))
            counts = serving.summary()
        self.assertEqual(counts["unfinished_messages"], 2)
        self.assertEqual(counts["silent_peers"], 1)

    # Each says how long it was borne at least; the upper end is the sockets' own timeout.
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
