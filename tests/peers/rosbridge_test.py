# SPDX-License-Identifier: Apache-2.0
"""The program against a rosbridge_server with all its oddities: subscribing and publishing."""
import json
import os
import tempfile
import unittest

from fake_rosbridge import fake_rosbridge, objects_in
from program import program, run
from ros_types import filled
from trajectory import bits, numbers_of, time_of, trajectory

odometry = "nav_msgs/Odometry"
at_once = 200  # poses; as many wait on their way for a bridge that is slow to take them


class listening(unittest.TestCase):
    def setUp(self):
        self.bridge = self.enterContext(fake_rosbridge())

    def echo(self, topic, kind, *arguments):
        """`rowe echo`, subscribed. The bridge knows the topic already: whoever subscribes need not."""
        self.bridge.topics[topic] = kind
        running = self.enterContext(program("echo", self.bridge.url, topic, "--json", *arguments))
        self.bridge.wait(lambda: self.bridge.subscribers(topic), "the subscription")
        return running

    def test_finds_its_topic_although_every_slash_is_escaped(self):
        echo = self.echo("/base/front/odom", odometry, "-n", "3")
        for x in (1.5, -0.0, 1e-320):
            self.bridge.publish("/base/front/odom", odometry, {"pose": {"pose": {"position": {"x": x}}},
                                                               "child_frame_id": "base/link é"})
        self.assertEqual(echo.end(), 0, echo.stderr)
        messages = [json.loads(line) for line in echo.stdout]
        self.assertEqual([bits(m["pose"]["pose"]["position"]["x"]) for m in messages],
                         [bits(x) for x in (1.5, -0.0, 1e-320)])
        self.assertEqual({m["child_frame_id"] for m in messages}, {"base/link é"})
        self.assertEqual({len(m["pose"]["covariance"]) for m in messages}, {36})
        self.assertEqual(self.bridge.ignored, [])

    def test_keeps_topics_apart_that_begin_alike(self):
        echo = self.echo("/odom", "std_msgs/String", "-n", "2")
        for one in self.bridge.subscribers("/odom"):
            for topic in ("/odo", "/odom/", "/odom2", "/odom\0"):
                one.send({"op": "publish", "topic": topic, "msg": {"data": "another's"}})
        for text in ("first", "second"):
            self.bridge.publish("/odom", "std_msgs/String", {"data": text})
        self.assertEqual(echo.end(), 0, echo.stderr)
        self.assertEqual([json.loads(line)["data"] for line in echo.stdout], ["first", "second"])

    def test_passes_on_what_numbers_became(self):
        echo = self.echo("/n", "std_msgs/Float64", "-n", "2")
        for number in (float("nan"), 0.1):
            self.bridge.publish("/n", "std_msgs/Float64", {"data": number})
        self.assertEqual(echo.end(), 0, echo.stderr)
        self.assertEqual(echo.stdout, ['{"data":null}', '{"data":0.1}'])
        echo = self.echo("/i", "std_msgs/Int64", "--once")
        self.bridge.publish("/i", "std_msgs/Int64", {"data": 2**63 - 1})
        self.assertEqual(echo.end(), 0, echo.stderr)
        self.assertEqual(echo.stdout, ['{"data":9223372036854775807}'])

    def test_offers_its_subprotocol_and_is_content_with_none(self):
        self.echo("/t", "std_msgs/String")
        self.assertEqual([one.offers for one in self.bridge.requests], [["rowe.v1"]])
        self.assertIsNone(self.bridge.requests[0]["origin"])

    def test_subscribes_anew_when_the_bridge_comes_back(self):
        echo = self.echo("/t", "std_msgs/String", "-n", "2")
        self.bridge.publish("/t", "std_msgs/String", {"data": "before"})
        echo.lines(1)
        self.bridge.cut()
        self.bridge.wait(lambda: len(self.bridge.requests) == 2 and self.bridge.subscribers("/t"),
                         "the second subscription")
        self.bridge.publish("/t", "std_msgs/String", {"data": "after"})
        self.assertEqual(echo.end(), 0, echo.stderr)
        self.assertEqual([json.loads(line)["data"] for line in echo.stdout], ["before", "after"])


class publishing(unittest.TestCase):
    def test_every_pose_arrives_in_order_and_exact(self):
        bridge = self.enterContext(fake_rosbridge())
        path = os.path.join(self.enterContext(tempfile.TemporaryDirectory()), "path.txt")
        wanted = trajectory(at_once, 10_000_000, seed=1)
        wanted.write(path)
        run("replay", bridge.url, "--tum", path, "--topic", "/base/odom", "--rate", "1kHz", code=0)
        bridge.wait(lambda: len(bridge.arrived("/base/odom")) == at_once, "all of them")
        messages = bridge.arrived("/base/odom")
        self.assertEqual([time_of(m) for m in messages], wanted.times)
        for message, numbers in zip(messages, wanted.numbers):
            self.assertEqual([bits(n) for n in numbers_of(message)], [bits(n) for n in numbers])
        self.assertEqual(bridge.ignored, [])
        self.assertEqual(bridge.topics["/base/odom"], odometry)
        self.assertEqual({tuple(m) for m in messages}, {tuple(filled(odometry))})


class what_is_written(unittest.TestCase):
    def test_is_one_object_a_text(self):
        with fake_rosbridge() as bridge:
            bridge.topics["/t"] = "std_msgs/String"
            texts = []
            take = bridge.take
            bridge.take = lambda sender, text: (texts.append(text), take(sender, text))
            with program("echo", bridge.url, "/t"):
                bridge.wait(lambda: bridge.subscribers("/t"), "the subscription")
            self.assertEqual([len(objects_in(text)) for text in texts], [1] * len(texts))


if __name__ == "__main__":
    unittest.main()
