# SPDX-License-Identifier: Apache-2.0
"""Foreign peers ask, the robot (robot.cpp) answers: Hop programs as its guests, with the profile for them,
and a rosbridge_server whose client it is."""
import json
import os
import signal
import unittest

import program
from fake_hop import hop_client, hop_server, later, may_2014
from fake_rosbridge import fake_rosbridge
from server import gone
from websocket import TEXT, frame, peer

ROBOT = os.environ["ROWE_PEERS_ROBOT"]
# Longer than an endpoint waits before it pings (3 s), and before it cuts who is silent (8 s).
silence = 9.5


class robot(program.server):
    """What it provides is there."""

    def __init__(self, *arguments):
        super().__init__(r"^ready at port (\d+)$", *arguments, command=(ROBOT,))
        self.port = int(self.ready[1])


class hop_guests:
    """Hop programs of one period ask the robot."""

    @classmethod
    def setUpClass(cls):
        cls.robot = cls.enterClassContext(robot("listen", cls.profile))

    def guest(self, at=None, **how):
        return self.enterContext(hop_client((at or self.robot).port, "/hop/robot", self.period, **how))

    def check(self, hop, identity="m1"):
        """It is answered in plain text frames, with the id as it came."""
        hop.send(json.dumps({"service": "add-two-numbers", "a": 38, "b": 4, "message_id": identity}))
        while (answer := json.loads(hop.receive())).get("in_reply_to") is None:
            pass  # plain messages of other guests
        self.assertEqual(answer, {"result": 42, "in_reply_to": identity})

    def test_keys_of_any_length_are_taken(self):
        for cookie in ("", 7, 1804289383, 10**13, 2**62):
            self.check(self.guest(cookie=cookie))

    def test_a_service_that_is_not_there_is_answered_too(self):
        hop = self.guest()
        hop.send('{"service":"add-three-numbers","message_id":7}')
        answer = json.loads(hop.receive())
        self.assertEqual(answer["in_reply_to"], 7)
        self.assertIn("error", answer)
        self.check(hop)

    def test_plain_messages_reach_whoever_spoke(self):
        talks, listens, idle = self.guest(), self.guest(), self.guest()
        self.check(listens)
        talks.send('{"status":"é/😀"}')
        for hop in (talks, listens):
            self.assertEqual(json.loads(hop.receive()), {"status": "é/😀"})
        self.check(idle)

    def test_a_subprotocol_of_the_program_s_own_is_no_obstacle(self):
        hop = self.guest(protocol="foo")
        self.assertNotIn("sec-websocket-protocol", hop.fields)
        self.check(hop)

    def test_silence_is_neither_pinged_nor_cut(self):
        hop = self.guest()
        with self.assertRaises(TimeoutError):
            hop.receive(silence)
        self.check(hop)

    def test_the_end_comes_without_a_frame(self):
        with robot("listen", self.profile) as leaving:
            hop = self.guest(leaving)
            self.check(hop)
            self.assertEqual(leaving.end(signal.SIGTERM), 0)
            with self.assertRaises(gone):
                hop.receive()

    def test_one_that_closes_is_forgotten_and_comes_again(self):
        for _ in range(100):  # more than there are places
            with hop_client(self.robot.port, period=self.period) as hop:
                self.check(hop)
                hop.close()

    def test_the_corrupt_length_of_a_long_message_ends_its_connection_and_no_other(self):
        stays, leaves = self.guest(), self.guest()
        leaves.send(json.dumps({"x": "x" * 70000}))
        with self.assertRaises(gone):
            while True:  # of May 2014 the lowest byte is taken for the length: of a text full of zeros
                self.assertIn("error", json.loads(leaves.receive()))
        self.check(stays)

    def test_roslib_is_still_understood(self):
        with peer(self.robot.port) as p:
            p.send({"op": "call_service", "id": "c1", "service": "/add-two-numbers",
                    "args": {"a": 1, "b": 2}})
            answer = p.receive()
            self.assertEqual((answer["id"], answer["values"]), ("c1", {"result": 3}))


class later_hop(hop_guests, unittest.TestCase):
    profile, period = "hop", later

    def test_who_does_not_mask_is_cut(self):
        hop = self.guest()
        hop.stream.send(frame(TEXT, b"{}", mask=False))
        with self.assertRaises(gone):
            hop.receive()


class hop_of_may_2014(hop_guests, unittest.TestCase):
    profile, period = "hop_2014", may_2014


class hop_hosts(unittest.TestCase):
    """The robot as the client of a Hop program that asks it."""

    def test_is_asked_and_answers(self):
        for profile, period in (("hop", later), ("hop_2014", may_2014)):
            with hop_server(period=period, program=lambda _: None) as hop:
                with robot("connect", profile, hop.url):
                    hop.wait(lambda h=hop: h.upgraded, "the connection")
                    for identity in ("m1", 7):
                        hop.send(json.dumps({"service": "add-two-numbers", "a": -1, "b": 43,
                                             "message_id": identity}))
                    hop.wait(lambda h=hop: len(h.heard) == 2, "the answers")
                    self.assertEqual([json.loads(text) for text in hop.heard],
                                     [{"result": 42, "in_reply_to": "m1"}, {"result": 42, "in_reply_to": 7}])
                hop.wait(lambda h=hop: h.ends, "the end")
                self.assertEqual(hop.drops, [])

    def test_comes_back(self):
        with hop_server(program=lambda _: None) as hop, robot("connect", "hop", hop.url):
            for count in range(1, 4):
                hop.wait(lambda c=count: len(hop.upgraded) == c, "the connection")
                hop.send('{"service":"add-two-numbers","a":1,"b":2,"message_id":%d}' % count)
                hop.wait(lambda c=count: len(hop.heard) == c, "the answer")
                hop.cut()
            self.assertEqual([json.loads(text)["in_reply_to"] for text in hop.heard], [1, 2, 3])


class providing_to_ros(unittest.TestCase):
    """The robot as a client of a rosbridge_server, which calls what it provides."""

    def setUp(self):
        self.bridge = self.enterContext(fake_rosbridge())
        self.robot = self.enterContext(robot("connect", "standard", self.bridge.url))
        self.bridge.wait(lambda: self.bridge.answers, "the first answer")

    def test_advertises_its_services_and_is_called_at_once(self):
        (advertised,) = [m for _, m in self.bridge.heard
                         if m["op"] == "advertise_service" and m["service"] == "/mine"]
        self.assertEqual(advertised["type"], "std_srvs/SetBool")
        answer = self.bridge.answers[0]
        self.assertEqual((answer["id"], answer["service"]), ("service_request:/mine:1", "/mine"))
        self.assertEqual((answer["values"], answer["result"]), ({"success": True, "message": "on"}, True))

    def test_answers_whoever_calls_through_the_bridge(self):
        with peer(self.bridge.port) as p:
            for data, message in ((False, "off"), (True, "on")):
                p.send({"op": "call_service", "id": message, "service": "/mine", "args": {"data": data}})
                answer = p.receive()
                self.assertEqual((answer["id"], answer["result"], answer["values"]["message"]),
                                 (message, True, message))

    def test_refuses_arguments_that_do_not_fit_with_a_sentence(self):
        with peer(self.bridge.port) as p:
            p.send({"op": "call_service", "id": "c", "service": "/mine", "args": {"data": "yes"}})
            answer = p.receive()
            self.assertEqual((answer["id"], answer["result"], type(answer["values"])), ("c", False, str))
            self.assertEqual(answer["values"], 'the member "data" must be true or false; it is "yes"')

    def test_advertises_anew_when_the_bridge_comes_back(self):
        self.bridge.cut()
        self.bridge.wait(lambda: len(self.bridge.answers) == 2, "the second answer")
        self.assertEqual(len(self.bridge.requests), 2)


if __name__ == "__main__":
    unittest.main()
