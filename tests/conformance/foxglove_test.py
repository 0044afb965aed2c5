# SPDX-License-Identifier: Apache-2.0
"""Foxglove's protocol from raw sockets: what is malformed is answered, by a status or as a failed call, and
the connection stays; it harms nobody else."""
import json
import random
import struct
import unittest

import programs
from frames import BINARY, TEXT, frame


def call(service, number, body=b"{}", encoding=b"json"):
    return struct.pack("<BIII", 2, service, number, len(encoding)) + encoding + body


class viewer:
    def __init__(self, serving, subprotocol="foxglove.websocket.v1"):
        self.s = serving.connect(fields=(f"Sec-WebSocket-Protocol: {subprotocol}",))
        self.calls = 0
        self.services = {}
        self.channels = {}
        while "/rosapi/topics" not in self.services:
            self.learn(self.event())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.s.socket.close()

    def event(self):
        while True:
            opcode, payload = self.s.message()
            if opcode != BINARY or payload[0] != 2:  # the time, which comes all along
                return opcode, payload

    def learn(self, event):
        """False: it is none of the lists."""
        if event[0] != TEXT:
            return False
        said = json.loads(event[1])
        for channel in said.get("channels", ()):
            self.channels[channel["topic"]] = channel["id"]
        for service in said.get("services", ()):
            self.services[service["name"]] = service["id"]
        return said["op"] not in ("status", "serviceCallFailure")

    def answers(self):
        """What it says up to the answer to a call of ours."""
        self.calls += 1
        number = 0x70000000 + self.calls
        self.s.send(frame(BINARY, call(self.services["/rosapi/topics"], number)))
        said = []
        while True:
            opcode, payload = self.event()
            if opcode == BINARY and payload[0] == 3 and struct.unpack_from("<I", payload, 5)[0] == number:
                return said
            if not self.learn((opcode, payload)):
                said.append((opcode, payload))

    def says(self, opcode, payload):
        self.s.send(frame(opcode, payload))
        return self.answers()


bad_texts = [
    b"", b"{", b"[]", b"7", b"null", b'{"op":7}', b"{}", b'{"op":"subscribe"}',
    b'{"op":"subscribe","subscriptions":[]}',
    b'{"op":"subscribe","subscriptions":[{}]}',
    b'{"op":"subscribe","subscriptions":[{"id":1e9,"channelId":1}]}',
    b'{"op":"subscribe","subscriptions":[{"id":1,"channelId":99999999}]}',
    b'{"op":"subscribe","subscriptions":[{"id":NaN,"channelId":1}]}',
    b'{"op":"unsubscribe","subscriptionIds":[77]}', b'{"op":"unadvertise","channelIds":[77]}',
    b'{"op":"advertise","channels":[{"id":1,"topic":"","encoding":"json"}]}',
    b'{"op":"advertise","channels":[{"id":1,"topic":"/x","encoding":"protobuf"}]}',
    b'{"op":"advertise","channels":[{"id":1,"topic":"/' + b"x" * 500 + b'","encoding":"json"}]}',
    b'{"op":"advertise","channels":[{"id":1,"topic":"/rowe/mine","encoding":"json"}]}',
    b'{"op":"getParameters","parameterNames":[7],"id":"1"}', b'{"op":"getParameters","id":"1"}',
    b'{"op":"getParameters","parameterNames":[' + b",".join([b'"/a"'] * 1000) + b"]}",
    b'{"op":"getParameters","parameterNames":[],"id":{}}',
    b'{"op":"setParameters","parameters":[{"name":"/rowe/limits/topics_max","value":1}]}',
    b'{"op":"setParameters","parameters":[{"name":"' + b"x" * 300 + b'","value":1}]}',
    b'{"op":"setParameters","parameters":[7]}', b'{"op":"subscribeParameterUpdates","parameterNames":7}',
    b'{"op":"fetchAsset","uri":"file:///etc/passwd"}',
    b'{"op":"call_service","service":"/rosapi/topics"}',
]
bad_binaries = [b"", b"\x00", b"\x01", b"\x01abc", b"\x01abcd", b"\x01\x4d\x00\x00\x00{}", b"\x02",
                b"\x02abcdefg", b"\x03" + bytes(20), b"\xff" * 30]


class malformed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(programs.server("hub", *programs.unlimited))

    def test_texts_are_answered_by_a_status(self):
        with viewer(self.serving) as one:
            for text in bad_texts:
                with self.subTest(text):
                    said = one.says(TEXT, text)
                    self.assertEqual(len(said), 1)
                    status = json.loads(said[0][1])
                    self.assertEqual((status["op"], status["level"]), ("status", 2))
                    self.assertTrue(status["message"])

    def test_binaries_are_answered_by_a_status(self):
        with viewer(self.serving) as one:
            for payload in bad_binaries:
                with self.subTest(payload):
                    said = one.says(BINARY, payload)
                    self.assertEqual([json.loads(text)["op"] for _, text in said], ["status"])

    def test_calls_fail_under_their_numbers(self):
        with viewer(self.serving) as one:
            topics = one.services["/rosapi/topics"]
            bad = [(4000, call(4000, 5)), (topics, call(topics, 5, b"")[:12]),
                   (topics, call(topics, 5, b"{")), (topics, call(topics, 5, b"[1]")),
                   (topics, call(topics, 5, b"{}", b"cdr")),
                   (topics, struct.pack("<BIII", 2, topics, 5, 0xffffffff) + b"json{}"),
                   (0, call(0, 5)), (0xffffffff, call(0xffffffff, 5))]
            for service, payload in bad:
                with self.subTest(payload):
                    said = one.says(BINARY, payload)
                    self.assertEqual(len(said), 1)
                    failure = json.loads(said[0][1])
                    self.assertEqual(failure["op"], "serviceCallFailure")
                    self.assertEqual((failure["serviceId"], failure["callId"]), (service, 5))
                    self.assertTrue(failure["message"])

    def test_whatever_is_sent_others_are_served(self):
        random_bytes = random.Random(15)
        with viewer(self.serving) as bad, viewer(self.serving, "foxglove.sdk.v1") as other:
            for _ in range(300):
                begin = random_bytes.choice((b"\x01", b"\x02", b"\x07", b""))
                payload = begin + random_bytes.randbytes(random_bytes.randrange(40))
                if payload[:5] == b"\x02\x01\x00\x00\x00":
                    continue  # the stop
                self.assertLessEqual(len(bad.says(BINARY, payload)), 1)
            self.assertEqual(other.answers(), [])


if __name__ == "__main__":
    unittest.main()
