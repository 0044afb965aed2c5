# SPDX-License-Identifier: Apache-2.0
"""The fake rosbridge_server against what was seen of the real one (0.11.17), point by point."""
import json
import unittest

from fake_rosbridge import fake_rosbridge
from websocket import peer


class quirks(unittest.TestCase):
    def setUp(self):
        self.bridge = self.enterContext(fake_rosbridge())
        self.peer = self.enterContext(peer(self.bridge.port))

    def ask(self, *messages):
        for message in messages:
            self.peer.send(message)

    def settle(self):
        """Everything asked for so far is done: the bridge does one thing after the other."""
        self.ask({"op": "call_service", "id": "settle", "service": "/nope"})
        return self.peer.receive_until(lambda m: m.get("id") == "settle")

    def silent(self, *texts):
        """Whether these are answered by nothing at all."""
        for text in texts:
            self.peer.send_text(text)
        self.ask({"op": "call_service", "id": "settle", "service": "/nope"})
        self.assertEqual(self.peer.receive()["id"], "settle")

    def test_escapes_every_slash_and_everything_beyond_ascii(self):
        self.ask({"op": "subscribe", "topic": "/a/b", "type": "std_msgs/String"})
        self.settle()
        self.bridge.publish("/a/b", "std_msgs/String", {"data": "é/😀"})
        self.assertEqual(self.peer.receive_text(),
                         '{"op":"publish","topic":"\\/a\\/b","msg":{"data":"\\u00e9\\/\\ud83d\\ude00"}}')

    def test_is_silent_to_everything_wrong(self):
        self.silent("nonsense", "[1]", "7", "{}", '{"op":7}', '{"op":"explode","id":"x"}',
                    '{"op":"subscribe"}', '{"op":"subscribe","topic":"/t"}',
                    '{"op":"subscribe","topic":"/t","type":"no/Such"}',
                    '{"op":"advertise","topic":"/t","type":"std_msgs/msg/String"}',
                    '{"op":"publish","topic":"/unknown","msg":{}}', '{"op":"unsubscribe","topic":"/t"}',
                    '{"op":"set_level","level":"info"}', '{"op":"explode"}')

    def test_carries_out_both_objects_of_one_text(self):
        self.peer.send_text('{"op":"advertise","topic":"/t","type":"std_msgs/String"}'
                            ' {"op":"publish","topic":"/t","msg":{"data":"two"}}')
        self.bridge.wait(lambda: self.bridge.arrived("/t") == [{"data": "two"}], "the second object")

    def test_publishes_without_an_advertisement_once_the_type_is_known(self):
        self.silent('{"op":"publish","topic":"/t","msg":{"data":"early"}}')
        self.ask({"op": "subscribe", "topic": "/t", "type": "std_msgs/String"},
                 {"op": "publish", "topic": "/t", "msg": {"data": "late"}}, {"op": "publish", "topic": "/t"})
        self.assertEqual([self.peer.receive()["msg"]["data"] for _ in range(2)], ["late", ""])
        self.assertEqual(self.bridge.arrived("/t"), [{"data": "late"}, {"data": ""}])

    def test_fills_in_what_a_message_lacks(self):
        self.ask({"op": "subscribe", "topic": "/odom", "type": "nav_msgs/Odometry"},
                 {"op": "publish", "topic": "/odom", "msg": {"child_frame_id": "base"}})
        message = self.peer.receive()["msg"]
        self.assertEqual(message["child_frame_id"], "base")
        self.assertEqual(message["pose"]["covariance"], [0.0] * 36)
        self.assertGreater(message["header"]["stamp"]["secs"], 1_600_000_000)

    def test_numbers_leave_as_they_can(self):
        self.ask({"op": "subscribe", "topic": "/f", "type": "std_msgs/Float64"},
                 {"op": "subscribe", "topic": "/s", "type": "std_msgs/Float32"},
                 {"op": "subscribe", "topic": "/i", "type": "std_msgs/Int64"},
                 {"op": "subscribe", "topic": "/b", "type": "std_msgs/UInt8MultiArray"})
        for topic, sent, received in (("/f", "NaN", "null"), ("/f", "1e400", "null"),
                                      ("/f", "-1e400", "null"),
                                      ("/s", "0.1", "0.10000000149011612"),
                                      ("/i", "9223372036854775807", "9223372036854775807"),
                                      ("/b", "[1,2,255]", '"AQL\\/"'), ("/b", '"AQL/"', '"AQL\\/"')):
            self.peer.send_text('{"op":"publish","topic":"%s","msg":{"data":%s}}' % (topic, sent))
            self.assertTrue(self.peer.receive_text().endswith('"msg":{"data":%s}}' % received), (topic, sent))
        self.silent('{"op":"publish","topic":"/f","msg":{"data":null}}',
                    '{"op":"publish","topic":"/f","msg":{"data":"1"}}',
                    '{"op":"publish","topic":"/i","msg":{"data":9223372036854775808}}',
                    '{"op":"publish","topic":"/f","msg":{"data":1,"more":2}}')

    def test_merges_the_subscriptions_of_one_client(self):
        self.ask({"op": "subscribe", "id": "a", "topic": "/t", "type": "std_msgs/String"},
                 {"op": "subscribe", "id": "b", "topic": "/t", "throttle_rate": 60_000},
                 {"op": "publish", "topic": "/t", "msg": {"data": "once"}})
        self.assertEqual(self.peer.receive()["msg"]["data"], "once")
        self.silent()
        self.ask({"op": "unsubscribe", "id": "a", "topic": "/t"}, {"op": "publish", "topic": "/t"})
        self.silent()  # the throttle of the one that is left
        self.ask({"op": "unsubscribe", "id": "b", "topic": "/t"}, {"op": "publish", "topic": "/t"})
        self.silent()
        self.assertEqual(self.bridge.subscribers("/t"), [])

    def test_repeats_the_id_of_a_call_that_had_one(self):
        call = {"op": "call_service", "service": "/add_two_ints", "args": {"a": 38, "b": 4}}
        for message, values in (({**call, "id": "c1"}, {"sum": 42}), (call, {"sum": 42}),
                                ({**call, "args": [1, 2]}, {"sum": 3}),
                                ({"op": "call_service", "service": "/add_two_ints"}, {"sum": 0})):
            self.ask(message)
            answer = self.peer.receive()
            self.assertEqual((answer["values"], answer["result"]), (values, True))
            self.assertEqual("id" in answer, "id" in message)

    def test_says_why_a_call_failed_as_a_string_in_values(self):
        self.peer.send_text('{"op":"call_service","service":"/nope"}')
        self.assertEqual(self.peer.receive_text(), '{"op":"service_response","service":"\\/nope",'
                         '"values":"Service \\/nope does not exist","result":false}')
        for service, arguments in (("/fail", {}), ("/add_two_ints", {"c": 1}), ("/add_two_ints", {"a": "1"})):
            self.ask({"op": "call_service", "service": service, "args": arguments, "id": 7})
            answer = self.peer.receive()
            self.assertEqual((answer["id"], answer["result"], type(answer["values"])), (7, False, str))

    def test_calls_whoever_advertises_a_service(self):
        self.peer.send_text('{"op":"advertise_service","service":"/mine","type":"std_srvs/SetBool"}')
        self.assertEqual(self.peer.receive_text(), '{"op":"call_service","id":"service_request:\\/mine:1",'
                         '"service":"\\/mine","args":{"data":true}}')
        values = {"success": True, "message": "done"}
        self.ask({"op": "service_response", "id": "service_request:/mine:1", "service": "/mine",
                  "values": values, "result": True})
        self.bridge.wait(lambda: self.bridge.answers, "the answer")
        self.assertEqual(self.bridge.answers[0]["values"], values)
        with peer(self.bridge.port) as other:
            other.send({"op": "call_service", "id": "o", "service": "/mine", "args": {"data": False}})
            asked = self.peer.receive()
            self.assertEqual((asked["id"], asked["args"]), ("service_request:/mine:2", {"data": False}))
            self.ask({"op": "service_response", "id": asked["id"], "service": "/mine", "values": "no",
                      "result": False})
            answer = other.receive()
            self.assertEqual((answer["id"], answer["values"], answer["result"]), ("o", "no", False))

    def test_fragments_everything_once_one_subscription_asked_for_it(self):
        self.ask({"op": "subscribe", "topic": "/t", "type": "std_msgs/String"},
                 {"op": "subscribe", "topic": "/u", "type": "std_msgs/String", "fragment_size": 64})
        self.bridge.wait(lambda: self.bridge.subscribers("/u"), "the subscription")
        data = "x" * 150
        self.bridge.publish("/t", "std_msgs/String", {"data": data})
        pieces, text = [], ""
        while not text.endswith("}}"):
            pieces.append(self.peer.receive())
            text = "".join(piece["data"] for piece in pieces)
        self.assertEqual(json.loads(text)["msg"]["data"], data)
        self.assertEqual([(piece["id"], piece["num"]) for piece in pieces],
                         [(0, number) for number in range(len(pieces))])
        twice = len(json.dumps(text).replace("/", "\\/"))
        self.assertEqual({piece["total"] for piece in pieces}, {twice / 64})
        self.assertNotEqual(twice % 64, 0)

    def test_offers_no_subprotocol_and_answers_pings_and_closing(self):
        with peer(self.bridge.port, headers={"Sec-WebSocket-Protocol": "rowe.v1"}) as p:
            p.send_frame(0x9, b"there?")
            self.assertEqual(p.receive_frame(), (True, 0xA, b"there?"))
            p.send_frame(0x8, b"\x03\xe8")
            self.assertEqual(p.wait_for_close(), 1000)


if __name__ == "__main__":
    unittest.main()
