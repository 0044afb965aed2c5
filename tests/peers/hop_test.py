# SPDX-License-Identifier: Apache-2.0
"""Hop peers at an endpoint that was not told to expect them: what works, and how the rest is refused.

This is why there is a profile for them: RFC 6455 obliges an endpoint to most of what Hop does not know.
"""
import json
import signal
import struct
import unittest

from fake_hop import dropped, hop_client, hop_server, may_2014
from program import hub, program
from websocket import peer, refused

sixteen_bytes = 10**13  # a cookie that makes Hop's key as long as RFC 6455 wants it: "ws" and 14 digits


class guests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub())

    def close_code(self, hop):
        """Waits until the endpoint closes, which Hop does not understand; the code it gave."""
        with self.assertRaises(dropped) as end:
            hop.receive()
        self.assertEqual(end.exception.byte, 0x88)
        hop.stream.exactly(1)  # the length
        return struct.unpack("!H", hop.stream.exactly(2))[0]

    def test_a_key_that_is_not_16_bytes_is_refused_with_words(self):
        with self.assertRaises(refused) as no:
            hop_client(self.serving.port, cookie=7)
        self.assertEqual(no.exception.status, 400)
        self.assertIn("Sec-WebSocket-Key does not decode to 16 bytes", str(no.exception))

    def test_one_that_masks_and_has_a_long_key_gets_plain_text_frames(self):
        with hop_client(self.serving.port, cookie=sixteen_bytes) as hop:
            hop.send('{"op":"explode","id":"%s"}' % ("x" * 100))
            self.assertEqual(json.loads(hop.receive())["level"], "error")

    def test_one_that_does_not_mask_is_closed_as_a_protocol_error(self):
        with hop_client(self.serving.port, period=may_2014, cookie=sixteen_bytes) as hop:
            hop.send('{"op":"explode"}')
            self.assertEqual(self.close_code(hop), 1002)

    def test_the_corrupt_length_of_a_long_message_ends_its_connection_and_no_other(self):
        with peer(self.serving.port) as other, hop_client(self.serving.port, cookie=sixteen_bytes) as hop:
            hop.send(json.dumps({"x": "x" * 70000}))
            self.assertIn(self.close_code(hop), (1002, 1009))
            other.send({"op": "explode"})
            self.assertEqual(other.receive()["level"], "error")

    def test_one_that_is_silent_is_pinged_and_gives_up(self):
        with hop_client(self.serving.port, cookie=sixteen_bytes) as hop:
            with self.assertRaises(dropped) as end:
                hop.receive()
            self.assertEqual(end.exception.byte, 0x89)


class hosts(unittest.TestCase):
    def test_a_program_that_speaks_rosbridge_is_heard(self):
        def answers(text):
            asked = json.loads(text)
            if asked["op"] != "subscribe":
                return None
            return json.dumps({"op": "publish", "topic": asked["topic"], "msg": {"n": 1}})

        with hop_server(program=answers) as hop:
            with program("echo", hop.url, "/t", "--once", "--json") as echo:
                self.assertEqual(echo.end(), 0, echo.stderr)
                self.assertEqual([json.loads(line) for line in echo.stdout], [{"n": 1}])
            hop.wait(lambda: hop.drops, "the close frame that Hop does not know")
            self.assertEqual(hop.drops, [0x88])

    def test_one_of_may_2014_drops_whoever_masks(self):
        with hop_server(period=may_2014) as hop, program("echo", hop.url, "/t") as echo:
            hop.wait(lambda: len(hop.drops) >= 2, "a second attempt")
            self.assertTrue(all(byte & 0x80 for byte in hop.drops), hop.drops)
            self.assertEqual(hop.heard, [])
            self.assertEqual(echo.end(signal.SIGINT), 130)


if __name__ == "__main__":
    unittest.main()
