# SPDX-License-Identifier: Apache-2.0
"""`rowe pub`: what it sends, on topics and as plain messages, and how it ends."""
import contextlib
import json
import os
import signal
import subprocess
import tempfile
import time
import unittest
import urllib.request

from program import given_time, hub, nobody_at, program, run
from websocket import closed, listener, peer


def lines_of(*messages):
    return "".join(json.dumps(one) + "\n" for one in messages).encode()


def fed(data, *arguments, **options):
    """`rowe pub` with `data` on stdin, to its end."""
    with program("pub", *arguments, stdin=subprocess.PIPE, **options) as pub:
        pub.process.stdin.write(data)
        pub.process.stdin.close()
        pub.code = pub.end()
        return pub


class on_topics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub())

    def setUp(self):
        self.there = self.enterContext(peer(self.serving.port))
        self.there.subscribe("/t")

    def arrived(self, count):
        return [self.there.receive()["msg"] for _ in range(count)]

    def check(self, ended, count):
        ended.expect(0, stdout=[])
        self.assertRegex(ended.stderr[-1], rf"sent {count} messages? in \d+\.\d+ s$")

    def test_publishes_once(self):
        for once in ((), ("--once",), ("-n", "1")):
            self.check(run("pub", self.serving.url, "/t", '{"a":1.50}', *once), 1)
            self.assertIn('"msg":{"a":1.50}', self.there.receive_text())

    def test_publishes_at_a_rate(self):
        begin = time.monotonic()
        self.check(run("pub", self.serving.url, "/t", '{"a":1}', "-r", "100Hz", "-n", "20"), 20)
        self.assertGreaterEqual(time.monotonic() - begin, 0.19)
        self.assertEqual(self.arrived(20), [{"a": 1}] * 20)

    def test_publishes_until_it_is_told_to_end(self):
        with program("pub", self.serving.url, "/t", '{"a":1}', "-r", "200") as pub:
            self.arrived(10)
            self.assertEqual(pub.end(signal.SIGINT), 0)
            self.assertRegex(pub.stderr[-1], r"sent \d+ messages in ")

    def test_publishes_the_lines_of_stdin(self):
        messages = [{"i": i, "text": "ä\n"} for i in range(1000)]
        with program("pub", self.serving.url, "/t", "-", "-r", "5kHz", stdin=subprocess.PIPE) as pub:
            for first in range(0, 1000, 100):  # fewer at a time than wait for a reader that is late
                pub.process.stdin.write(lines_of(*messages[first:first + 100]))
                pub.process.stdin.flush()
                self.assertEqual(self.arrived(100), messages[first:first + 100])
            pub.process.stdin.close()
            pub.code = pub.end()
            self.check(pub, 1000)
        self.check(fed(b'\r\n  \n{"a":1}\r\n\n{"a":2}', self.serving.url, "/t", "-"), 2)
        self.assertEqual(self.arrived(2), [{"a": 1}, {"a": 2}])
        self.check(fed(lines_of(*messages), self.serving.url, "/t", "-", "-n", "3"), 3)
        self.assertEqual(self.arrived(3), messages[:3])

    def test_publishes_each_line_when_it_comes(self):
        with program("pub", self.serving.url, "/t", "-", stdin=subprocess.PIPE) as pub:
            for i in range(3):
                pub.process.stdin.write(lines_of({"i": i}))
                pub.process.stdin.flush()
                self.assertEqual(self.arrived(1), [{"i": i}])
            self.assertEqual(pub.end(signal.SIGINT), 0)
            pub.process.stdin.close()

    def test_a_line_that_is_no_object_ends_it_and_is_named(self):
        long = b'{"a":"' + b"x" * (1 << 20) + b'"}'
        for bad, says in ((b"{", "line 2 of stdin is no JSON object: it ends too early (at byte 1)"),
                          (b"[]", "line 2 of stdin is no JSON object: it does not begin with {"),
                          (long, "line 2 of stdin is longer than 1048576 bytes "
                                 "(ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX raises")):
            ended = fed(lines_of({"a": 1}) + bad + b"\n" + lines_of({"a": 2}), self.serving.url, "/t", "-")
            ended.expect(1, stdout=[], says=says)
            self.assertRegex(ended.stderr[-1], "sent 1 message in ")
            self.assertEqual(self.arrived(1), [{"a": 1}])
        ended = fed(lines_of({"header": 7}), self.serving.url, "/t", "-", "--stamp")
        ended.expect(1, first="line 1 of stdin has a `header` that is no object")

    def test_stamps_with_the_time_of_sending(self):
        before = time.time()
        old = '{"header":{"seq":7,"stamp":{"secs":0,"nsecs":0}},"a":1}'
        self.check(run("pub", self.serving.url, "/t", old, "--stamp", "-r", "100", "-n", "3"), 3)
        messages = self.arrived(3)
        stamps = [m["header"]["stamp"]["secs"] + m["header"]["stamp"]["nsecs"] * 1e-9 for m in messages]
        self.assertEqual(stamps, sorted(set(stamps)))
        self.assertGreaterEqual(stamps[0], before - 1e-3)
        self.assertEqual([(m["header"]["seq"], m["a"]) for m in messages], [(7, 1)] * 3)

    def test_keeps_the_last_message_for_those_who_come_late(self):
        with program("pub", self.serving.url, "/kept", '{"a":1}', "--latch", "--type", "x/T") as pub:
            pub.line("is retained for late subscribers")
            with peer(self.serving.port) as late:
                late.send({"op": "subscribe", "topic": "/kept", "type": "x/T"})
                self.assertEqual(late.receive()["msg"], {"a": 1})
            ended = run("call", self.serving.url, "/rowe/stats")
            types = {one["topic"]: one["type"] for one in json.loads(ended.stdout[0])["topics"]}
            self.assertEqual(types["/kept"], "x/T")
            self.assertEqual(pub.end(signal.SIGINT), 0)

    def test_says_that_nobody_has_subscribed(self):
        ended = run("pub", self.serving.url, "/nobody", "{}")
        self.check(ended, 1)
        self.assertIn("nobody has subscribed to /nobody: only the server got it", ended.stderr[0])
        heard = run("pub", self.serving.url, "/t", "{}")
        self.check(heard, 1)
        self.assertNotIn("nobody", "\n".join(heard.stderr))
        for how in ((), ("-w",)):  # who takes one message is gone when the server is asked behind it
            with peer(self.serving.port) as once:
                once.subscribe("/once")
                with program("pub", self.serving.url, "/once", "{}", *how) as pub:
                    once.receive()
                    once.send({"op": "unsubscribe", "topic": "/once"})
                    self.assertEqual(pub.end(), 0)
                    self.assertNotIn("nobody", "\n".join(pub.stderr))
        with program("pub", self.serving.url, "/nobody", "{}", "-r", "100") as endless:
            endless.line("nobody has subscribed to /nobody yet")
            endless.end(signal.SIGINT)

    def test_says_once_that_the_server_refused_the_topic(self):
        with hub("--demo") as robot:
            for more in (), ("--latch",), ("-n", "5", "-r", "100Hz"):
                ended = run("pub", robot.url, "/odom", '{"a":1}', *more)
                said = "\n".join(ended.stderr)
                self.assertEqual(ended.code, 1, said)
                self.assertEqual(said.count("/odom is published by the program here"), 1, said)
                self.assertNotIn("unadvertise", said)
                self.assertRegex(ended.stderr[-1], r"sent \d messages? in .*; the server refused the topic$")

    def test_waits_for_a_subscriber_when_asked_to(self):
        for how in ((), ("-r", "100", "-n", "3"), ("-q",)):
            with program("pub", self.serving.url, "/late", '{"a":1}', "-w", *how) as pub:
                if "-q" not in how:
                    pub.line("waits until somebody has subscribed to /late")
                with peer(self.serving.port) as late:
                    late.send({"op": "subscribe", "topic": "/late"})
                    self.assertEqual(late.receive()["msg"], {"a": 1})
                    self.assertEqual(pub.end(), 0, pub.stderr)
        run("pub", self.serving.url, "/never", "{}", "-w", "--timeout", "1s", code=4,
            last="nobody has subscribed to /never within 1.000 s")

    def test_is_quiet_when_asked_to_be(self):
        run("pub", self.serving.url, "/t", "{}", "-q", code=0, stdout=[], stderr=[])

    def test_reaches_an_echo(self):
        with program("echo", self.serving.url, "/t", "/u", "--json") as echo:
            count = 0
            while len(echo.stdout) < 2:  # until it has subscribed
                count += 1
                run("pub", self.serving.url, "/t", f'{{"count":{count}}}')
                run("pub", self.serving.url, "/u", f'{{"count":{count}}}')
            self.assertEqual(echo.end(signal.SIGINT), 0)
            told = [json.loads(line) for line in echo.stdout]
            self.assertEqual({one["topic"] for one in told}, {"/t", "/u"})
            numbers = [one["msg"]["count"] for one in told if one["topic"] == "/t"]
            self.assertEqual(numbers, sorted(set(numbers)))


class as_plain_messages(unittest.TestCase):
    def setUp(self):
        self.there = self.enterContext(listener())

    def test_sends_what_it_is_given(self):
        for arguments, count in (((), 1), (("-n", "3"), 3), (("-r", "100", "-n", "3"), 3)):
            with program("pub", self.there.url, "--plain", '{"a":1.50}', *arguments) as pub:
                with self.there.accept() as p:
                    self.assertEqual([p.receive_text() for _ in range(count)], ['{"a":1.50}'] * count)
                    self.assertEqual(pub.end(), 0)
                pub.expect(stdout=[], ends=rf"sent {count} message[^,]*$")

    def test_sends_the_lines_of_stdin(self):
        messages = [{"i": i} for i in range(100)]
        with program("pub", self.there.url, "-", "--plain", stdin=subprocess.PIPE) as pub:
            with self.there.accept() as p:
                pub.process.stdin.write(lines_of(*messages))
                pub.process.stdin.close()
                self.assertEqual([p.receive() for _ in range(100)], messages)
                self.assertEqual(pub.end(), 0)

    def test_members_that_rowe_needs_itself_are_refused(self):
        for member in ("op", "message_id", "in_reply_to"):
            with program("pub", self.there.url, "--plain", json.dumps({member: "x"})) as pub:
                with self.there.accept() as p:
                    self.assertEqual(pub.end(), 2)
                    with self.assertRaises(closed):
                        p.receive_text()
                self.assertIn(member, "\n".join(pub.stderr))

    def test_a_number_that_no_double_can_hold_is_refused(self):
        with program("pub", self.there.url, "--plain", '{"a":1e999}') as pub:
            self.assertEqual(pub.end(), 2)
            self.assertIn("or too large for a double, from '1e999}' on", "\n".join(pub.stderr))

    def test_a_time_to_live_that_passed_is_6(self):
        with program("pub", self.there.url, "--plain", "{}", "--ttl", "1ns", "-n", "3") as pub:
            self.assertEqual(pub.end(), 6)
            self.assertRegex(pub.stderr[-1], "sent 0 messages in .*, not sent 3$")

    def test_a_time_to_live_includes_the_wait_for_somebody(self):
        ended = run("pub", "127.0.0.1:1", "--plain", "{}", "--ttl", "100ms", code=6, stdout=[])
        self.assertRegex(ended.stderr[-1], "sent 0 messages in .*, not sent 1$")
        with program("pub", self.there.url, "--plain", "{}", "--ttl", "50s") as pub, self.there.accept() as p:
            self.assertRegex(p.receive_text(), r'^\{"ttl_ms":49\d{3}(\.\d{3})?\}$')
            self.assertEqual(pub.end(), 0)

    def test_a_message_that_waits_for_nobody_can_be_interrupted(self):
        with program("pub", "127.0.0.1:1", "--plain", "{}", "--ttl", "50s") as pub:
            pub.line("nobody listens at 127.0.0.1:1")
            self.assertEqual(pub.end(signal.SIGINT), 130)


class ending(unittest.TestCase):
    def test_nobody_there_is_3(self):
        for arguments in (("/t", "{}"), ("--plain", "{}")):
            ended = nobody_at("pub", "127.0.0.1:1", *arguments)
            ended.expect(3, stdout=[], says="nobody listens at 127.0.0.1:1")

    def test_interrupted_before_all_was_sent_is_130(self):
        with hub() as serving, program("pub", serving.url, "/t", "{}", "-n", "1000", "-r", "1") as pub:
            serving.line(": connected")
            self.assertEqual(pub.end(signal.SIGINT), 130)

    def test_a_peer_that_does_not_read_costs_messages_once_their_time_is_over(self):
        data = lines_of(*[{"i": i, "x": "x" * 50000} for i in range(300)])

        def publish(*arguments):
            with listener(window=4096) as there:
                with program("pub", there.url, *arguments, "--ttl", "20ms", stdin=subprocess.PIPE) as pub:
                    with contextlib.suppress(closed, BrokenPipeError), there.accept():  # it may have given up
                        pub.process.stdin.write(data)
                        pub.process.stdin.close()
                        pub.end()
                    pub.code = pub.end()
            return pub

        on_topic = given_time(lambda time: publish("/t", "-", "--timeout", time), lambda it: it.code != 3, 1)
        for pub in (on_topic, publish("--plain", "-")):
            pub.expect(6, ends=r"sent \d+ messages? in .*, not sent [1-9]\d*$")

    def test_goes_on_once_the_connection_is_back(self):
        with listener() as there:
            with program("pub", there.url, "/t", "-", stdin=subprocess.PIPE) as pub:
                for i in range(2):
                    with there.accept() as p:
                        pub.process.stdin.write(lines_of({"i": i}))
                        pub.process.stdin.flush()
                        told = p.receive_until(lambda m: m["op"] == "publish")
                        self.assertEqual(told["msg"], {"i": i})
                    pub.line(r"127\.0\.0\.1:\d+: (?!connected)", count=i + 1)
                pub.process.stdin.close()
                pub.end()


class long_messages(unittest.TestCase):
    """Maps of several megabytes: from a file or stdin to stdout, through a hub that allows it."""
    most = 16 << 20
    raised = {"ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX": str(most)}

    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub("--limit", f"long_message_bytes_max={cls.most}"))
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())

    def file_of(self, text):
        path = os.path.join(self.folder, "map.json")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def check(self, map_text, pub):
        with program("echo", self.serving.url, "/map", "--json", "--once", environment=self.raised) as echo:
            echo.line("nobody publishes /map")
            ended = pub()
            self.assertEqual(ended.code, 0, ended.stderr)
            self.assertEqual((echo.end(), echo.stdout), (0, [map_text]))

    def test_go_from_a_file_and_from_stdin_to_stdout(self):
        map_text = json.dumps({"info": {"width": 3000}, "data": list(range(1_400_000))})
        self.assertGreater(len(map_text), 10_000_000)
        path = self.file_of(map_text + "\n")
        self.check(map_text, lambda: run("pub", self.serving.url, "/map", "@" + path,
                                         environment=self.raised))
        self.check(map_text, lambda: fed(map_text.encode() + b"\n", self.serving.url, "/map", "-",
                                         environment=self.raised))

    def test_stay_for_who_comes_late(self):
        text = json.dumps({"width": 3000, "data": [0] * 1_000_000}, indent=0)
        path = self.file_of(text)
        with program("pub", self.serving.url, "/late", "@" + path, "--latch", environment=self.raised) as pub:
            pub.line("is retained for late subscribers")
            run("echo", self.serving.url, "/late", "--field", "width", "--once",
                environment=self.raised, code=0, stdout=["3000", "---"])
            with urllib.request.urlopen(f"http://127.0.0.1:{self.serving.port}/api/v1/topics/late") as page:
                self.assertEqual(json.loads(page.read()), json.loads(text))
            self.assertEqual(pub.end(signal.SIGINT), 0)

    def test_that_are_too_long_are_named_with_their_length_and_the_limit(self):
        path = self.file_of(json.dumps({"data": "x" * 1_100_000}))
        run("pub", self.serving.url, "/map", "@" + path, code=2,
            first="has more than the 1048576 bytes that can be sent "
                  "(ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX raises that)")
        with hub() as small:
            ended = run("pub", small.url, "/map", "@" + path, environment=self.raised)
            self.assertIn(ended.code, (1, 6), ended.stderr)
            self.said_the_truth(ended, small, 1048576)
        with hub("--limit", "long_message_bytes_max=100000") as small:
            ended = run("pub", small.url, "/map", "@" + path, environment=self.raised)
            self.said_the_truth(ended, small, 100000)

    def said_the_truth(self, ended, server, most):
        said = "\n".join(ended.stderr)
        self.assertNotIn("did not answer within", said)
        server.line(f"exceeds the limit long_message_bytes_max of {most}")
        # What the server says may be lost with the connection that it ends.
        if "'a message of " in said:
            self.assertIn(f"{server.url} refused the message of 1100012 bytes: it takes {most} at most "
                          "(its limit long_message_bytes_max)", said)
            self.assertNotIn("nobody has subscribed", said)
        else:
            self.assertIn("the longest message has 1100012 bytes, which the server must allow", said)


if __name__ == "__main__":
    unittest.main()
