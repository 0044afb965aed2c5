# SPDX-License-Identifier: Apache-2.0
"""What a robot says where two programs misunderstand each other: to WebSockets by hand, and to `rowe pub`."""
import json
import unittest

from program import run
from robot_test import robot
from websocket import peer, settle

twist = {"linear": {"x": 0.1, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.5}}
diagnostic = 'publish /cmd_vel: the member "linear.y" is missing; a number is wanted'


def odometry(header):
    place = {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    return {"header": header, "child_frame_id": "base", "pose": {"pose": place, "covariance": [0] * 36},
            "twist": {"twist": twist, "covariance": [0] * 36}}


class driving(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = cls.enterClassContext(robot("drive", "standard"))
        cls.url = f"ws://127.0.0.1:{cls.robot.port}"

    def setUp(self):
        self.there = self.enterContext(peer(self.robot.port))

    def subscribe(self, *topics):
        for topic in topics:
            self.there.send({"op": "subscribe", "topic": topic})
        settle(self.there)

    def test_pub_says_what_was_wrong_and_fails(self):
        ended = run("pub", self.url, "/cmd_vel", '{"linear":{"x":0.1}}', code=1, first=diagnostic)
        self.assertRegex(ended.stderr[-1], r"sent 1 message in \d+\.\d+ s; the server reported errors$")

    def test_pub_says_so_quietly_and_of_latched_or_many_messages_too(self):
        ended = run("pub", self.url, "/cmd_vel", '{"linear":{"x":0.1}}', "-q", "-n", "300", "-r", "10kHz")
        self.assertEqual(ended.code, 1, ended.stderr)
        self.assertEqual(len(ended.stderr), 1)
        self.assertIn(diagnostic, ended.stderr[0])

    def test_pub_hears_nothing_where_the_message_is_taken(self):
        self.subscribe("/driven")
        for topic, message in (("/cmd_vel", twist), ("cmd_vel", twist),
                               ("/cmd_vel_lenient", {"linear": {"x": 0.1}, "angular": {"z": 0.5}})):
            ended = run("pub", self.url, topic, json.dumps(message), "--type", "geometry_msgs/msg/Twist")
            self.assertEqual(ended.code, 0, ended.stderr)
            self.assertEqual(len(ended.stderr), 1)
            self.assertEqual(self.there.receive()["msg"], twist)

    def test_pub_says_that_the_topic_has_another_type(self):
        run("pub", self.url, "/cmd_vel", json.dumps(twist), "--type", "std_msgs/String", code=1,
            first="the topic exists with the type geometry_msgs/Twist")

    def test_not_a_number_is_answered_by_the_codec_it_came_by(self):
        text = json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": float("nan")}}})
        self.there.send_text(text)
        answer = self.there.receive()
        self.assertEqual((answer["op"], answer["level"]), ("status", "error"))
        self.assertIn("NaN", answer["msg"])
        self.assertIn("send null", answer["msg"])

    def test_odometry_of_either_ros_is_read_and_published_in_both_shapes(self):
        self.subscribe("odom1", "/odom2")
        for header in ({"seq": 7, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "odom"},
                       {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "odom"}):
            self.there.send({"op": "publish", "topic": "/odom", "type": "nav_msgs/msg/Odometry",
                             "msg": odometry(header)})
            heard = [self.there.receive(), self.there.receive()]
            told = {one["topic"]: one["msg"] for one in heard}
            self.assertEqual(set(told), {"odom1", "/odom2"})
            self.assertEqual(told["odom1"]["header"], {"seq": header.get("seq", 0), "frame_id": "odom",
                                                       "stamp": {"secs": 1, "nsecs": 2}})
            self.assertEqual(told["/odom2"]["header"], {"stamp": {"sec": 1, "nanosec": 2},
                                                        "frame_id": "odom"})
            for message in told.values():
                self.assertEqual({**message, "header": header}, odometry(header))


if __name__ == "__main__":
    unittest.main()
