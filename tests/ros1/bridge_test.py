# SPDX-License-Identifier: Apache-2.0
"""rowe_ros1 between a real roscore, rostopic, rosservice and a rospy node on one side, and a real `rowe
serve` with peers on the other. Skipped, with the reason, where Debian's ROS is not installed."""
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, "..", "tools"))
from program import ROWE, hub, kept_port, program, run, timeout  # noqa: E402
from websocket import peer  # noqa: E402

debian_python = "/usr/bin/python3"  # that of Debian's packages
bridge_program = os.path.join(os.path.dirname(ROWE), "rowe_ros1")


def missing():
    for one in ("roscore", "rostopic", "rosservice"):
        if shutil.which(one) is None:
            return f"{one} is not installed (tools/packages, group ros1)"
    needed = "import rospy, std_srvs.srv, nav_msgs.msg, geometry_msgs.msg"
    found = subprocess.run([debian_python, "-c", needed], capture_output=True, text=True, check=False)
    return found.stderr.strip().split("\n")[-1] or None


class ros:
    """A roscore on a port of its own, and what is run beside it."""

    def __init__(self):
        self.ends = contextlib.ExitStack()
        self.port = self.ends.enter_context(kept_port())
        self.home = self.ends.enter_context(tempfile.TemporaryDirectory())
        self.environment = {"ROS_MASTER_URI": f"http://127.0.0.1:{self.port}", "ROS_IP": "127.0.0.1",
                            "ROS_HOME": self.home, "ROS_LOG_DIR": self.home}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ends.close()

    def core(self):
        core = self.start("roscore", "-p", str(self.port))
        core.line("started core service", "stdout")
        return core

    def stop_core(self, core):
        """In order: it ends its children, the master among them, which are in sessions of their own."""
        core.end(signal.SIGINT)
        core.__exit__()

    def start(self, *command, **options):
        environment = {**self.environment, **options.pop("environment", {})}
        return program(*command, command=("env",), environment=environment, **options)

    def run(self, *command):
        with self.start("timeout", f"{timeout:.0f}", *command) as one:
            one.code = one.end()
            return one

    def node(self, *names):
        return self.start(debian_python, os.path.join(here, "node.py"), *names)

    def bridge(self, url, *arguments, **options):
        return self.start(bridge_program, url, *arguments, **options)


def first(url, topic):
    """The first message that `rowe echo` prints."""
    ended = run("echo", url, topic, "--json", "--once", "--timeout", f"{timeout:.0f}s")
    assert ended.code == 0, ended.stderr
    return ended.stdout[0]


if missing() and "ROWE_COMPLETE" in os.environ:
    raise SystemExit(f"tests/ros1: {missing()}")


@unittest.skipIf(missing(), missing())
class the_bridge(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ends = contextlib.ExitStack()
        cls.addClassCleanup(cls.ends.close)
        cls.ros = cls.ends.enter_context(ros())
        cls.core = cls.ros.core()
        cls.ends.callback(cls.ros.stop_core, cls.core)
        cls.node = cls.ends.enter_context(cls.ros.node())
        cls.node.line("ready", "stdout")

    def say_until_heard(self, page, topic, message, words):
        """Again and again, since a message may be there before the node's own connection is."""
        for _ in range(round(10 * timeout)):
            page.send({"op": "publish", "topic": topic, "msg": message})
            with self.node.changed:
                if words in self.node.stdout:
                    return
                self.node.changed.wait(0.1)
        self.fail(f"the node does not hear {words!r}: {self.node.stdout}")

    def test_hands_on_what_ros_publishes(self):
        with hub() as robot, self.ros.bridge(robot.url, "--from-ros", "/hard/*") as bridge:
            bridge.line(r"/hard/int64 \(std_msgs/Int64\): from ROS")
            self.assertEqual(first(robot.url, "/hard/int64"), '{"data":-9223372036854775807}')
            self.assertEqual(json.loads(first(robot.url, "/hard/floats"))["data"], [None, None, 0.1])
            self.assertEqual(json.loads(first(robot.url, "/hard/bytes"))["data"], "AP8=")
            odom = json.loads(first(robot.url, "/hard/odom"))
            self.assertEqual((odom["child_frame_id"], odom["pose"]["covariance"]), ("base", [0] * 36))
            # What a publisher of ROS keeps is kept here, too, for who comes late.
            bridge.line(r"/hard/kept \(std_msgs/String, latched\): from ROS")
            self.assertEqual(first(robot.url, "/hard/kept"), '{"data":"since long"}')
            # What is too large is dropped, counted, and said.
            bridge.line(r"/hard/large, from ROS: \d+ dropped: a message of 100004 bytes is longer than \d+")
            topics = run("echo", robot.url, "--json").stdout
            self.assertIn("nav_msgs/Odometry", "\n".join(topics))
            self.assertEqual(bridge.end(signal.SIGTERM), 0)
            bridge.line(r"/hard/int64, from ROS: passed [1-9]\d*")
            bridge.line(r"/hard/large, from ROS: passed 0, too_big [1-9]\d*")

    def test_hands_on_what_rostopic_publishes(self):
        with hub() as robot, self.ros.bridge(robot.url, "--from-ros", "/said"), \
                self.ros.start("rostopic", "pub", "-r", "5", "/said", "std_msgs/String", 'data: "h\u00e9"'):
            self.assertEqual(first(robot.url, "/said"), '{"data":"h\u00e9"}')

    def test_hands_on_to_ros_what_peers_publish(self):
        with hub() as robot, peer(robot.port) as page, \
                self.ros.bridge(robot.url, "--to-ros", "/cmd_vel", "--to-ros", "/odd*", "--to-ros",
                                "/picture=std_msgs/UInt8MultiArray") as bridge:
            page.send({"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"})
            page.send({"op": "advertise", "topic": "/odd/one", "type": "odd_msgs/Odd"})
            bridge.line(r"/cmd_vel \(geometry_msgs/Twist\): to ROS")
            bridge.line(r"/odd/one is not bridged: there is no definition of odd_msgs/Odd \(looked below")
            self.say_until_heard(page, "/cmd_vel", {"linear": {"x": 0.5, "y": None}}, "cmd_vel 0.5 nan 0.0")
            # rostopic sees the type, and so its md5sum; a message that is wrong is dropped and said.
            ended = self.ros.run("rostopic", "type", "/cmd_vel")
            self.assertEqual(ended.stdout, ["geometry_msgs/Twist"])
            page.send({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"w": 1}}})
            bridge.line(r'/cmd_vel, to ROS: 1 dropped: the member "linear" has a member "w",')
            # Bytes come as base64 or as numbers.
            for data, words in (("AP8=", "AP8="), ([1, 2], "AQI=")):
                self.say_until_heard(page, "/picture", {"data": data}, f"picture {words}")

    def test_offers_services_of_ros_and_one_that_hangs_keeps_no_other(self):
        with hub() as robot, self.ros.bridge(robot.url, "--service-from-ros", "*") as bridge:
            bridge.line(r"the service /set \(std_srvs/SetBool\): from ROS")
            bridge.line(r"the service /hang \(std_srvs/Trigger\): from ROS")
            with program("call", robot.url, "/hang", "--timeout", "60s"):
                ended = run("call", robot.url, "/set", '{"data":true}')
                self.assertEqual(ended.stdout, ['{"success":true,"message":"set to True"}'])
                run("call", robot.url, "/set", '{"date":true}', code=1,
                    last='the message has a member "date", which std_srvs/SetBoolRequest has not')
                self.assertFalse([line for line in bridge.stderr if "get_loggers" in line])
                # It ends all the same.
                self.assertEqual(bridge.end(signal.SIGTERM), 0)

    def test_a_provider_that_is_gone_while_a_call_hangs_keeps_nothing(self):
        with hub() as robot, self.ros.node("second", "/second") as node, \
                self.ros.bridge(robot.url, "--service-from-ros", "/second/*") as bridge:
            node.line("ready", "stdout")
            bridge.line(r"the service /second/hang \(std_srvs/Trigger\): from ROS")
            with program("call", robot.url, "/second/hang", "--timeout", "60s"):
                node.line("hanging", "stdout")
                self.assertEqual(self.ros.run("rosservice", "call", "/second/withdraw").code, 0)
                bridge.line("the service /second/hang: gone from ROS")
                self.assertEqual(self.ros.run("rosservice", "call", "/second/offer").code, 0)
                bridge.line(r"the service /second/new \(std_srvs/Trigger\): from ROS")

    def test_offers_services_of_peers_to_ros(self):
        with hub() as robot, peer(robot.port) as page, \
                self.ros.bridge(robot.url, "--service-to-ros", "/ask*", "--timeout", "2s") as bridge:
            for name in ("/ask", "/ask_in_vain"):
                page.send({"op": "advertise_service", "service": name, "type": "std_srvs/srv/SetBool"})
            bridge.line(r"the service /ask \(std_srvs/SetBool\): to ROS")
            bridge.line(r"the service /ask_in_vain \(std_srvs/SetBool\): to ROS")
            for ok, printed in ((True, ["success: True", 'message: "yes"']), (False, [])):
                with self.ros.start("rosservice", "call", "/ask", "true") as asking:
                    call = page.called()
                    self.assertEqual(call["args"], {"data": True})
                    page.answer(call, {"success": True, "message": "yes"} if ok else "no, thanks", ok)
                    self.assertEqual(asking.end() == 0, ok)
                    self.assertEqual(asking.stdout, printed)
                    if not ok:
                        self.assertIn("no, thanks", "\n".join(asking.stderr))
            with self.ros.start("rosservice", "call", "/ask_in_vain", "true") as asking:
                self.assertNotEqual(asking.end(), 0)
                self.assertIn("nothing happened within 2000000000 ns", "\n".join(asking.stderr))

    def test_stops_the_robot(self):
        with hub("--demo") as robot, self.ros.bridge(robot.url) as bridge:
            bridge.line(r"/rowe/stop \(std_srvs/Trigger\): a service in ROS")
            ended = self.ros.run("rosservice", "call", "/rowe/stop")
            self.assertIn(ended.stdout[0], ("success: True", "success: False"))
            state = json.loads(run("call", robot.url, "/rowe/stop/state").stdout[0])
            self.assertEqual((state["state"], state["cause"]), ("stopped", "request"))
            self.assertIn("rosservice", state["source"])

    def test_says_that_a_robot_that_is_not_there_was_not_stopped(self):
        with self.ros.bridge("ws://127.0.0.1:1") as bridge:
            bridge.line(r"/rowe/stop \(std_srvs/Trigger\)")
            ended = self.ros.run("rosservice", "call", "/rowe/stop")
            self.assertEqual(ended.stdout[0], "success: False")
            self.assertIn("NOT stopped", ended.stdout[1])

    def test_goes_one_way_only(self):
        ended = self.ros.run(bridge_program, "ws://127.0.0.1:1", "--from-ros", "/a", "--to-ros", "a")
        ended.expect(2, first="/a cannot go both ways")
        with hub() as robot, self.ros.bridge(robot.url, "--from-ros", "*", "--to-ros", "*") as bridge:
            bridge.line(r"/hard/int64 \(std_msgs/Int64\): from ROS")
            before = first(robot.url, "/hard/int64")
            self.assertEqual(before, first(robot.url, "/hard/int64"))
            self.assertNotIn("rowe_ros1: /hard/int64 (std_msgs/Int64): to ROS", bridge.stderr)

    def test_finds_a_robot_that_comes_back(self):
        with kept_port() as port:
            with hub(port=port) as robot, self.ros.bridge(robot.url, "--from-ros", "/hard/int64") as bridge:
                first(robot.url, "/hard/int64")
                robot.end(signal.SIGKILL)
                bridge.line("/hard/int64, from ROS: [0-9]+ dropped: the robot's endpoint is not connected")
                with hub(port=port) as again:
                    self.assertEqual(first(again.url, "/hard/int64"), '{"data":-9223372036854775807}')
                    bridge.line("connected again to")


@unittest.skipIf(missing(), missing())
class a_master(unittest.TestCase):
    def test_is_waited_for_and_followed_when_it_is_another_one(self):
        with ros() as own, hub() as robot, own.bridge(robot.url, "--from-ros", "/hard/int64") as bridge:
            bridge.line("no ROS master answers at http://127.0.0.1:[0-9]+; waiting for it")
            for count in (1, 2):
                core = own.core()
                try:
                    with own.node() as node:
                        node.line("ready", "stdout")
                        bridge.line(r"/hard/int64 \(std_msgs/Int64\): from ROS", count=count)
                        self.assertEqual(first(robot.url, "/hard/int64"), '{"data":-9223372036854775807}')
                finally:
                    own.stop_core(core)
            bridge.line("the ROS master is another one; everything is registered anew")
            self.assertEqual(bridge.end(signal.SIGTERM), 0)


if __name__ == "__main__":
    unittest.main()
