# SPDX-License-Identifier: Apache-2.0
"""The fakes are as strict as the real ones were seen to be: what the other tests here cannot notice, since
only a program that is wrong would meet it."""
import unittest

from fake_hop import hop_server, later, may_2014
from fake_rosbridge import fake_rosbridge
from websocket import CLOSE, PING, PONG, TEXT, closed, peer


class rosbridge(unittest.TestCase):
    def setUp(self):
        self.bridge = self.enterContext(fake_rosbridge())
        self.peer = self.enterContext(peer(self.bridge.port))

    def test_escapes_every_slash_and_everything_beyond_ascii(self):
        self.peer.send({"op": "subscribe", "topic": "/a/b", "type": "std_msgs/String"})
        self.bridge.wait(lambda: self.bridge.subscribers("/a/b"), "the subscription")
        self.bridge.publish("/a/b", "std_msgs/String", {"data": "é/😀"})
        self.assertEqual(self.peer.receive_text(),
                         '{"op":"publish","topic":"\\/a\\/b","msg":{"data":"\\u00e9\\/\\ud83d\\ude00"}}')

    def test_is_silent_to_everything_wrong(self):
        self.bridge.topics["/f"] = "std_msgs/Float64"
        wrong = ("nonsense", "[1]", "7", "{}", '{"op":7}', '{"op":"explode","id":"x"}', '{"op":"subscribe"}',
                 '{"op":"subscribe","topic":"/t"}', '{"op":"subscribe","topic":"/t","type":"no/Such"}',
                 '{"op":"advertise","topic":"/t","type":"std_msgs/msg/String"}',
                 '{"op":"publish","topic":"/unknown","msg":{}}', '{"op":"unsubscribe","topic":"/t"}',
                 '{"op":"publish","topic":"/f","msg":{"data":null}}',
                 '{"op":"publish","topic":"/f","msg":{"data":"1"}}',
                 '{"op":"publish","topic":"/f","msg":{"data":1,"more":2}}')
        for text in wrong:
            self.peer.send_text(text)
        self.peer.send({"op": "call_service", "id": "settle", "service": "/nope"})
        self.assertEqual(self.peer.receive()["id"], "settle")
        self.assertEqual(len(self.bridge.ignored), len(wrong))


class hop(unittest.TestCase):
    def test_drops_whatever_is_no_plain_text_frame(self):
        for period in (later, may_2014):
            with hop_server(period=period) as server:
                for opcode, how in ((PING, {}), (PONG, {}), (CLOSE, {}), (2, {}), (TEXT, {"fin": False}),
                                    (TEXT, {"reserved": 4})):
                    with peer(server.port, path=server.path) as p:
                        p.send_frame(opcode, b"", mask=False, **how)
                        with self.assertRaises(closed):
                            p.receive_frame()
                server.wait(lambda s=server: len(s.drops) == 6, "the drops")
                self.assertEqual(server.drops, [0x89, 0x8A, 0x88, 0x82, 0x01, 0xC1])


if __name__ == "__main__":
    unittest.main()
