# SPDX-License-Identifier: Apache-2.0
"""`rowe hz`, `bw` and `delay`: what comes on topics; and `rowe echo --hz`, which thins it at the robot."""
import json
import signal
import time
import unittest

from program import hub, program, run
from websocket import peer, settle


def reports(ended):
    return [json.loads(line) for line in ended.stdout]


class rates(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))
        cls.url = cls.demo.url

    def test_say_how_often_messages_come(self):
        said, = reports(run("hz", self.url, "/odom", "--once", "--json", "--every", "300ms", code=0))
        self.assertEqual(said["topic"], "/odom")
        self.assertGreater(said["messages"], 1)
        self.assertGreater(said["rate_hz"], 0)
        gaps = said["gap_ns"]
        self.assertLessEqual(gaps["min"], gaps["p50"])
        self.assertLessEqual(gaps["p50"], gaps["p99"])
        self.assertLessEqual(gaps["p99"], gaps["max"])
        # The gaps add up to no more than the time that they were taken in, and one from before it.
        self.assertLessEqual(gaps["min"] * (said["messages"] - 1), said["over_ns"])
        run("hz", self.url, "/odom", "-n", "2", "--every", "200ms", code=0,
            prints=r"^/odom: \d+(\.\d+)? Hz, gaps min \S+ \S+, p50 \S+ \S+, p99 \S+ \S+, max \S+ \S+$")

    def test_say_how_many_bytes_there_are(self):
        run("bw", self.url, "/odom", "--once", "--every", "300ms", code=0,
            prints=r"^/odom: \S+ [kM]?B/s, \d+ messages of \S+ k?B on average$")

    def test_of_several_topics_stand_below_each_other(self):
        said = reports(run("hz", self.url, "odom", "/nothing", "--json", "-n", "2", "--every", "300ms",
                           code=0))
        self.assertEqual([one["topic"] for one in said], ["/odom", "/nothing"] * 2)
        self.assertEqual([one["messages"] for one in said if one["topic"] == "/nothing"], [0, 0])

    def test_of_nothing_end_with_no_answer(self):
        run("hz", self.url, "/nothing", "--once", "--every", "100ms", code=4, prints="^/nothing: no message")
        run("bw", self.url, "/nothing", "-n", "2", "--every", "50ms", "--json", code=4)

    def test_say_how_old_messages_are(self):
        said, = reports(run("delay", self.url, "/odom", "--once", "--json", "--every", "300ms", code=0))
        # One machine; but the robot's stamps do not follow a clock that is set, or hurried, meanwhile.
        self.assertGreaterEqual(said["delay_ns"]["min"], -1e9)
        with hub() as serving, peer(serving.port) as p:
            for form in (lambda s: {"sec": int(s), "nanosec": 0}, lambda s: {"secs": int(s), "nsecs": 0},
                         lambda s: s, lambda s: s * 1e3,
                         lambda s: time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(s))):
                with program("delay", serving.url, "/t", "--field", "at", "--once", "--json", "--every",
                             "1s") as asking:
                    self.subscribed(p, "/t")
                    p.send({"op": "publish", "topic": "/t", "msg": {"at": form(time.time() - 100)}})
                    end = asking.end()
                    delay = reports(asking)[0]["delay_ns"]
                    self.assertEqual(end, 4 if delay is None else 0)  # it may come after the one report
                    if delay is not None:
                        self.assertGreaterEqual(delay["min"], 99e9)

    @staticmethod
    def subscribed(p, topic):
        p.send({"op": "advertise", "topic": topic, "type": "x/T"})
        while not p.call("/rosapi/subscribers", topic=topic)["values"]["subscribers"]:
            pass

    def test_a_message_without_a_time_is_named(self):
        with hub() as serving, peer(serving.port) as p:
            for stamp in (None, {"sec": 2**63 - 1, "nanosec": 0}, {"secs": 1, "nsecs": 10**9}, -1, 1e300,
                          "yesterday"):
                with program("delay", serving.url, "/t") as asking:
                    self.subscribed(p, "/t")
                    p.send({"op": "publish", "topic": "/t", "msg": {"header": {"stamp": stamp}}})
                    self.assertEqual(asking.end(), 1)
                    self.assertIn("a message of '/t' has no time at 'header.stamp'", asking.stderr[-1])

    def test_of_a_topic_that_is_named_twice_are_those_of_one(self):
        said = reports(run("hz", self.url, "/odom", "odom", "--json", "--once", code=0))
        self.assertEqual([one["topic"] for one in said], ["/odom"])

    def test_say_that_nobody_publishes_and_what_was_probably_meant(self):
        with program("hz", self.url, "/odmo") as asking:
            asking.line(r"nobody publishes /odmo at ws://.* yet; did you mean /odom\?; waiting for it")
            asking.line("^/odmo: no message within 1.00. s", "stdout")
            self.assertEqual(asking.end(signal.SIGINT), 0)

    def test_nonsense_is_refused(self):
        for words, says in ((("hz", self.url), "TOPIC is missing"),
                            (("hz", self.url, "/a", "--once", "-n", "2"), "exclude"),
                            (("bw", self.url, *map(str, range(17))), "17 topics are too many: at most 16"),
                            (("hz", self.url, "/a", "--field", "x"), "unknown option '--field'")):
            run(*words, code=2, stdout=[], says=says)


class thinned(unittest.TestCase):
    def test_echo_has_the_robot_leave_out_messages(self):
        with hub() as serving, peer(serving.port) as p:
            with program("echo", serving.url, "/t", "--hz", "0.001", "--json") as echo:
                rates.subscribed(p, "/t")
                for i in range(200):
                    p.send({"op": "publish", "topic": "/t", "msg": {"i": i}})
                settle(p)
                counts = serving.summary()
                self.assertEqual(echo.line(r'^\{"i"', "stdout")[0], '{"i"')
                self.assertEqual(len(echo.stdout), 1)
                # Some before the first one is written, the others within the second behind it.
                self.assertEqual(counts["throttled"] + counts["replaced"], 199)
                echo.end(signal.SIGINT)

    def test_the_handle_that_wants_most_gets_it(self):
        run("echo", "127.0.0.1:1", "/t", "--plain", "--hz", "5", code=2)
        for rate in ("0", "2000", "-1"):
            run("echo", "127.0.0.1:1", "/t", f"--hz={rate}", code=2, says="--hz")


if __name__ == "__main__":
    unittest.main()
