# SPDX-License-Identifier: Apache-2.0
"""`rowe echo`: what it prints and how it ends."""
import csv
import json
import signal
import subprocess
import unittest

from program import ROWE, given_time, hub, kept_port, of_the_machine, program, run
from websocket import listener, peer


class echoing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))

    def test_prints_one_json_object_a_line(self):
        ended = run("echo", self.demo.url, "/odom", "--json", "-n", "20", code=0)
        numbers = [json.loads(line)["header"]["seq"] for line in ended.stdout]
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertEqual(ended.stderr, [])

    def test_prints_what_people_can_read(self):
        ended = run("echo", self.demo.url, "/odom", "--once", code=0)
        self.assertEqual(ended.stdout[0], "header:")
        self.assertRegex(ended.stdout[1], r"^  seq: \d+$")
        self.assertIn('  frame_id: "odom"', ended.stdout)
        self.assertEqual(ended.stdout[-1], "---")

    def test_prints_a_table(self):
        ended = run("echo", self.demo.url, "/odom", "--csv", "-n", "3", code=0, stderr=[])
        header, *rows = csv.reader(ended.stdout)
        self.assertEqual(header[:4], [f"header.{name}" for name in ("seq", "stamp.secs", "stamp.nsecs",
                                                                     "frame_id")])
        self.assertEqual([len(row) for row in rows], [len(header)] * 3)
        self.assertEqual([row[3] for row in rows], ["odom"] * 3)
        ended = run("echo", self.demo.url, "/odom", "--csv", "--field", "pose.pose.position", "--once")
        self.assertEqual(ended.stdout[0], ",".join(f"pose.pose.position.{axis}" for axis in "xyz"))

    def test_prints_one_field(self):
        ended = run("echo", self.demo.url, "/odom", "--field", "pose.covariance[0]", "-n", "2")
        self.assertEqual((ended.code, ended.stdout), (0, ["0.0001", "---"] * 2))
        ended = run("echo", self.demo.url, "/odom", "--field", "header.frame_id", "--json", "--once")
        self.assertEqual((ended.code, ended.stdout), (0, ['"odom"']))
        run("echo", self.demo.url, "/odom", "--field", "pose.x", code=1, stdout=[],
            first='the member "pose.x" is missing')
        run("echo", self.demo.url, "/odom", "--field", "pose..x", code=2, stdout=[],
            first='the path "pose..x" is wrong at byte 5')

    def test_prints_several_topics_by_name(self):
        with program("echo", self.demo.url, "/odom", "/rowe/stats", "--json") as echo:
            echo.line(r'^\{"topic":"/odom","msg":\{', "stdout", count=100)
            echo.line(r'^\{"topic":"/rowe/stats","msg":\{', "stdout", count=2)
            # 6: some were lost, on a machine that is too busy to print them.
            self.assertIn(echo.end(signal.SIGINT), (0, 6))
            told = [json.loads(line) for line in echo.stdout]
            numbers = [one["msg"]["header"]["seq"] for one in told if one["topic"] == "/odom"]
            self.assertEqual(numbers, sorted(set(numbers)))
        ended = run("echo", self.demo.url, "/odom", "/nothing", "--once")
        self.assertEqual(ended.stdout[:2], ["/odom:", "  header:"])
        self.times_out("/nothing", "/naught", says="/nothing or /naught")

    def test_prints_the_robots_statistics_and_not_its_own(self):
        ended = run("echo", self.demo.url, "/rowe/stats", "--json", "--field", "name", "-n", "8")
        self.assertEqual((ended.code, len(set(ended.stdout))), (0, 1), ended.stdout)
        ended = run("echo", self.demo.url, "/rowe/stats", "--json", "--field", "topics", "-n", "4")
        for line in ended.stdout:
            self.assertIn("/odom", [one["topic"] for one in json.loads(line) if one["type"]])

    def test_lists_the_topics_there_are_where_none_is_named(self):
        ended = run("echo", self.demo.url, code=0)
        self.assertIn(["/odom", "nav_msgs/Odometry"], [line.split() for line in ended.stdout])
        self.assertIn(["/rowe/stats", "rowe/Stats"], [line.split() for line in ended.stdout])
        self.assertIn("TOPIC prints", ended.stderr[-1])
        ended = run("echo", self.demo.url, "--json", "-q")
        self.assertIn("/odom", json.loads(ended.stdout[0])["topics"])
        run("echo", self.demo.url, "--once", code=2, first="a TOPIC is missing")

    def test_says_that_a_server_does_not_tell_its_topics(self):
        with listener() as there, program("echo", there.url) as asking, there.accept() as p:
            p.answer(p.called(), "Service /rosapi/topics does not exist", False)
            self.assertEqual(asking.end(), 1)
            self.assertIn("does not say what topics it has: nobody provides the service",
                          asking.stderr[-1])

    def test_says_that_nobody_publishes_a_topic_and_waits_for_it(self):
        with hub() as serving, program("echo", serving.url, "/od", "/rowe/stats", "--json") as echo:
            echo.line("nobody publishes /od at ws://.* yet; waiting for it")
            with peer(serving.port) as p:
                p.send({"op": "advertise", "topic": "/od", "type": "x/T"})
                p.send({"op": "publish", "topic": "/od", "msg": {"a": 1}})
                echo.line(r'^\{"topic":"/od","msg":\{"a": 1\}\}', "stdout")
            self.assertEqual(echo.end(signal.SIGINT), 0)
            self.assertEqual([line for line in echo.stderr if "/rowe/stats" in line], [])

    def test_tells_when_it_is_connected_again(self):
        with hub(port=self.enterContext(kept_port())) as first:
            with program("echo", first.url, "/t") as echo:
                first.line("connected")
                first.end(signal.SIGTERM)
                with hub(port=first.port):
                    echo.line(rf"connected again to ws://127\.0\.0\.1:{first.port}")
                    self.assertEqual(echo.end(signal.SIGINT), 130)

    def test_takes_the_url_as_a_browser_shows_it(self):
        for url in (f"http://127.0.0.1:{self.demo.port}/", f"127.0.0.1:{self.demo.port}",
                    f"localhost:{self.demo.port}"):
            run("echo", url, "/odom", "--once", "--timeout", "60s", code=0)

    def test_a_message_with_line_breaks_stays_on_one_line(self):
        with hub() as serving, peer(serving.port) as p:
            with program("echo", serving.url, "/t", "--json", "--once") as echo:
                p.send({"op": "advertise", "topic": "/t", "type": "x/T"})
                while echo.process.poll() is None and not echo.stdout:
                    p.send_text('{"op":"publish","topic":"/t",\n"msg":{"a":\r\n1,\n"b":"x\\ny"}}')
                    p.call("/rosapi/topics")
                self.assertEqual(echo.end(), 0)
                self.assertEqual([json.loads(line) for line in echo.stdout], [{"a": 1, "b": "x\ny"}])

    def times_out(self, *topics, says):
        ended = given_time(lambda time: run("echo", self.demo.url, *topics, "--timeout", time),
                           lambda ended: ended.code != 3)
        ended.expect(4, ends=rf"no message on {says} within \d+\.\d{{3}} s")

    def test_a_topic_without_messages_is_a_time_out(self):
        self.times_out("/nothing", says="/nothing")

    def test_a_host_that_has_no_address_is_named(self):
        run("echo", "no-such-host.invalid:80", "/odom", "--timeout", "300ms", code=3,
            says="no-such-host.invalid")

    def test_interrupted_after_a_message_is_success(self):
        with program("echo", self.demo.url, "/odom", "--json") as running:
            running.lines(5)
            self.assertEqual(running.end(signal.SIGINT), 0)
            running.line(r"\d+ messages?(, lost \d+)?$")

    def test_a_reader_that_has_enough_ends_it_quietly(self):
        with subprocess.Popen([ROWE, "echo", self.demo.url, "/odom", "--json"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as echo:
            echo.stdout.readline()
            echo.stdout.close()
            self.assertEqual(echo.wait(timeout=60), 0)
            self.assertEqual([line for line in echo.stderr if not of_the_machine(line.decode())], [])


if __name__ == "__main__":
    unittest.main()
