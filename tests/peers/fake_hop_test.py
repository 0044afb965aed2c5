# SPDX-License-Identifier: Apache-2.0
"""The fake Hop peers against what their source says of the real ones, server and client of both periods."""
import base64
import json
import time
import unittest

from fake_hop import dropped, frame, hop_client, hop_server, later, may_2014, read_text
from server import answer, gone, server, timeout
from websocket import (CLOSE, PING, PONG, TEXT, accept_value, closed, connect, peer, read_answer, refused,
                       request)


class serving(unittest.TestCase):
    def setUp(self):
        self.later = self.enterContext(hop_server())
        self.early = self.enterContext(hop_server(period=may_2014))

    def connect(self, hop):
        return self.enterContext(peer(hop.port, path=hop.path))

    def fields_of(self, hop, headers):
        """Those of the answer to an upgrade request with `headers`."""
        fields = {"Host": "x", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": "d3M3",
                  "Sec-WebSocket-Version": "13", **headers}
        with connect(hop.port) as stream:
            stream.sendall(request("GET", hop.path, fields))
            return read_answer(stream)[1]

    def test_answers_the_paper_s_question(self):
        for hop, masked in ((self.later, True), (self.later, False), (self.early, False)):
            with peer(hop.port, path=hop.path) as p:
                p.send_text('{"service":"add-two-numbers","a":38,"b":4,"message_id":"m1"}', mask=masked)
                fin, opcode, text = p.receive_frame()
                self.assertEqual((fin, opcode), (True, TEXT))
                self.assertEqual(json.loads(text), {"result": 42, "in_reply_to": "m1"})

    def test_drops_whatever_is_no_plain_text_frame(self):
        for hop in (self.later, self.early):
            for opcode, how in ((PING, {}), (PONG, {}), (CLOSE, {}), (2, {}), (TEXT, {"fin": False}),
                                (TEXT, {"reserved": 4})):
                with peer(hop.port, path=hop.path) as p:
                    p.send_frame(opcode, b"", mask=False, **how)
                    with self.assertRaises(closed) as end:
                        p.receive_frame()
                    self.assertIsNone(end.exception.code)
            self.assertEqual(hop.wait(lambda h=hop: len(h.drops) == 6 and h.drops, "the drops"),
                             [0x89, 0x8A, 0x88, 0x82, 0x01, 0xC1])

    def test_of_may_2014_does_not_understand_masks(self):
        p = self.connect(self.early)
        p.send_text("{}")
        with self.assertRaises(closed):
            p.receive_frame()
        self.assertEqual(self.early.drops, [0x82])

    def test_reads_lengths_of_every_size(self):
        for hop in (self.later, self.early):
            p = self.connect(hop)
            texts = [json.dumps({"x": "x" * length}) for length in (0, 116, 117, 65526, 65527, 70000)]
            self.assertEqual([len(text) for text in texts], [9, 125, 126, 65535, 65536, 70009])
            for text in texts:
                p.send_text(text, mask=False)
            hop.wait(lambda h=hop: len(h.heard) == len(texts), "all of them")
            self.assertEqual(hop.heard, texts)

    def test_writes_nine_bytes_of_length_beyond_65535(self):
        for hop, head in ((self.later, b"\x81\x7f"), (self.early, b"\x81")):
            p = self.connect(hop)
            hop.wait(lambda h=hop: h.upgraded, "the connection")
            hop.send("x" * 65535)
            self.assertEqual(p.receive_frame()[2], b"x" * 65535)
            hop.send("x" * 70000)
            wanted = head + b"\x70\x11\x01\0\0\0\0\0\0" + b"xxx"
            self.assertEqual(p.exactly(len(wanted), time.monotonic() + timeout), wanted)

    def test_chooses_a_subprotocol_it_knows_or_none(self):
        with hop_server(protocols=("foo", "bar")) as hop, hop_server(period=may_2014) as early:
            for one, offered, chosen in ((hop, "x, bar, foo", "bar"), (hop, "x", None), (early, "bar", None)):
                fields = self.fields_of(one, {"Sec-WebSocket-Protocol": offered})
                self.assertEqual(fields.get("sec-websocket-protocol"), chosen)
                self.assertEqual(fields["upgrade"], "WebSocket")
            fields = self.fields_of(early, {"WebSocket-Protocol": "bar"})
            self.assertEqual(fields["websocket-protocol"], "bar")

    def test_is_where_its_path_says_below_hop(self):
        with self.assertRaises(refused) as wrong:
            peer(self.later.port, path="/robot")
        self.assertEqual(wrong.exception.status, 404)


class one_guest(server):
    """Takes one Hop client, and says what it is told to."""

    def __init__(self, said=b"", accept=accept_value):
        super().__init__()
        self.said, self.accept_of, self.bytes = said, accept, []

    def serve(self, one):
        asked = self.read_request(one)
        one.send(answer("101 Switching Protocols",
                        (("Upgrade", "websocket"), ("Connection", "Upgrade"),
                         ("Sec-WebSocket-Accept", self.accept_of(asked["sec-websocket-key"])))) + self.said)
        while True:
            one.fill()
            self.note(self.bytes, one.buffer)


class connecting(unittest.TestCase):
    def test_sends_a_key_that_need_not_be_16_bytes(self):
        with one_guest() as host:
            for cookie, period in ((7, later), (1804289383, may_2014)):
                with hop_client(host.port, "/hop/x", period, cookie):
                    asked = host.requests[-1]
                self.assertEqual(base64.b64decode(asked["sec-websocket-key"]), f"ws{cookie}".encode())
                self.assertEqual(asked["origin"], f"http://127.0.0.1:{host.port}")
                self.assertRegex(asked["user-agent"], "^Hop ")

    def test_masks_in_the_later_period_only(self):
        for period, second in ((later, 0x82), (may_2014, 0x02)):
            with one_guest() as host, hop_client(host.port, period=period) as hop:
                hop.send("{}")
                data = host.wait(lambda h=host: h.bytes and len(h.bytes[-1]) >= 4 and h.bytes[-1], "a frame")
                self.assertEqual(data[:2], bytes((0x81, second)))

    def test_looks_at_the_accept_value_only(self):
        with one_guest(accept=lambda _: "wrong") as host, self.assertRaises(refused):
            hop_client(host.port)

    def test_gives_up_at_the_first_frame_that_is_no_plain_text(self):
        for said, byte in ((b"\x89\0", 0x89), (b"\x88\0", 0x88), (b"\x01\0", 0x01), (b"\x82\0", 0x82)):
            with one_guest(frame("{}", later, masked=False) + said) as host, hop_client(host.port) as hop:
                self.assertEqual(hop.receive(), "{}")
                with self.assertRaises(dropped) as end:
                    hop.receive()
                self.assertEqual(end.exception.byte, byte)

    def test_closes_by_tcp_alone(self):
        with one_guest() as host, hop_client(host.port) as hop:
            hop.close()
            with self.assertRaises(gone):
                read_text(hop.stream, later)
            self.assertEqual(host.bytes, [])


if __name__ == "__main__":
    unittest.main()
