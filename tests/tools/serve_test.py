# SPDX-License-Identifier: Apache-2.0
"""`rowe serve`: what it prints, who may connect, how it ends; and its demo robot."""
import gzip
import json
import math
import os
import pathlib
import re
import resource
import shutil
import signal
import socket
import tempfile
import unittest

from program import ROWE, hub, kept_port, program, run, undisturbed
from websocket import get, peer, refused


def own_address():
    """An address of this host that is not loopback, or None. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            address = probe.getsockname()[0]
        except OSError:
            return None
    return None if address.startswith("127.") else address


class serving(unittest.TestCase):
    def test_prints_exactly_one_line_on_stdout_and_ends_with_a_summary(self):
        for ending in (signal.SIGTERM, signal.SIGINT):
            with hub() as serving:
                self.assertEqual(serving.end(ending), 0)
                self.assertEqual(len(serving.stdout), 1)
                text = "\n".join(serving.stderr)
                for group in ("up for ", "loss: none", "own: cycles "):
                    self.assertIn(f"rowe serve: {group}", text)
                self.assertNotRegex(text, r" 0(,|$)")  # nothing happened, and nothing is said of it

    def test_survives_a_hangup_it_was_told_to_ignore(self):
        def as_nohup_does():
            signal.signal(signal.SIGHUP, signal.SIG_IGN)

        with hub(preexec_fn=as_nohup_does) as serving:
            serving.process.send_signal(signal.SIGHUP)
            with peer(serving.port):
                serving.line(r"connected")
            self.assertEqual(serving.end(signal.SIGTERM), 0)
        with hub() as serving:
            self.assertEqual(serving.end(signal.SIGHUP), 0)

    def test_counts_and_reports_its_peers(self):
        with hub() as serving:
            with peer(serving.port):
                serving.line(r"127\.0\.0\.1:\d+: came: connected")
            serving.line(r"127\.0\.0\.1:\d+: .*", count=2)
            self.assertEqual(serving.summary()["peers_joined"], 1)

    def test_says_nothing_but_errors_when_asked_to_be_quiet(self):
        with hub("--quiet") as serving:
            with peer(serving.port) as p:
                p.send({"op": "subscribe", "topic": "/rowe/stats"})
                p.receive()
            self.assertEqual(serving.end(signal.SIGTERM), 0)
            self.assertEqual([line for line in serving.stderr if "real-time" not in line], [])

    def test_a_port_in_use_is_named(self):
        with hub() as first:
            second = run("serve", "--port", str(first.port), code=1, first=f"port {first.port} is in use")
            self.assertIn("--port", second.stderr[0])

    def test_the_port_can_be_used_again_at_once(self):
        with hub(port=self.enterContext(kept_port())) as first:
            with peer(first.port):
                first.end(signal.SIGTERM)
        with hub(port=first.port):
            pass

    def test_listens_on_loopback_only(self):
        address = own_address()
        if address is None:
            self.skipTest("this host has no address but loopback")
        with hub() as serving:
            with self.assertRaises(ConnectionRefusedError):
                socket.create_connection((address, serving.port), timeout=10)

    def test_insecure_serves_the_whole_host_with_one_warning(self):
        with hub("--listen", "0.0.0.0:0", "--insecure") as serving:
            address = own_address()
            if address is not None:
                serving.line(rf"also at http://{address}:{serving.port}/$")
                with peer(serving.port, host=address):
                    pass
            serving.end(signal.SIGTERM)
            self.assertEqual(len([line for line in serving.stderr if "warning" in line]), 1)

    def test_listens_on_ipv6_loopback(self):
        if not os.path.exists("/proc/net/if_inet6"):
            self.skipTest("this kernel has no IPv6")
        with hub("--listen", "[::1]:0") as serving:
            self.assertEqual(serving.host, "[::1]")

    def test_accepts_its_real_time_options(self):
        with hub("--idle", "spin", "--cpu", "0", "--priority", "10", "--name", "bench") as serving:
            with peer(serving.port) as p:
                p.send({"op": "subscribe", "topic": "/rowe/stats"})
                self.assertEqual(p.receive()["msg"]["name"], "bench")
            self.assertEqual(serving.end(signal.SIGTERM), 0)


class limits(unittest.TestCase):
    def of(self, serving):
        return json.loads(run("peers", serving.url, "--json").stdout[0])["limits"]

    def test_are_chosen_one_by_one_and_the_environment_gives_way(self):
        with hub("--limit", "topics_max=7", "--limit=calls_max=9",
                 environment={"ROWE_LIMITS_TOPICS_MAX": "300", "ROWE_LIMITS_SERVICES_MAX": "5"}) as serving:
            told = self.of(serving)
            self.assertEqual([told[one] for one in ("topics_max", "calls_max", "services_max")], [7, 9, 5])

    def test_can_all_be_chosen_by_the_names_that_messages_have(self):
        with hub() as serving:
            usual = self.of(serving)
        self.assertGreater(len(usual), 20)
        chosen = [f"--limit={name}={value}" for name, value in usual.items()]
        with hub(*chosen) as serving:
            self.assertEqual(self.of(serving), usual)

    def test_that_are_met_name_the_option_that_raises_them(self):
        with hub("--limit", "topics_max=3") as serving, peer(serving.port) as p:
            p.send({"op": "subscribe", "topic": "/a"})
            p.send({"op": "subscribe", "topic": "/b"})
            self.assertIn("limit topics_max", p.receive_until(lambda m: m["op"] == "status")["msg"])
            serving.line(r"no more topics than it leaves.*0 are left \(raise `--limit topics_max`\)")

    def test_that_make_no_sense_are_named_with_their_range(self):
        for value, says in (
                ("calls_max=0", "--limit calls_max is out of range: 0 (1 to 65536)"),
                ("calls_max=x", '--limit calls_max needs a whole number, not "x" (1 to 65536)'),
                ("topics_max", "--limit needs NAME=VALUE such as topics_max=256, not 'topics_max'"),
                ("topic_max=3", "there is no limit 'topic_max'; did you mean topics_max?")):
            run("serve", "--limit", value, code=2, stdout=[], first=says)

    def test_of_the_environment_that_make_no_sense_end_every_verb(self):
        for variable, value, says in (
                ("ROWE_LIMITS_CALLS_MAX", "99999999",
                 "ROWE_LIMITS_CALLS_MAX is out of range: 99999999 (1 to 65536)"),
                ("ROWE_LIMITS_TOPIC_MAX", "9",
                 "there is no variable ROWE_LIMITS_TOPIC_MAX; there are ROWE_LIMITS_CONN")):
            for words in (("serve",), ("echo", "127.0.0.1:1", "/t"), ("pub", "127.0.0.1:1", "/t", "{}"),
                          ("call", "127.0.0.1:1", "/t"), ("peers", "127.0.0.1:1"), ("stop", "127.0.0.1:1"),
                          ("reset", "127.0.0.1:1"), ("bench", "idle"), ("bench", "peer")):
                run(*words, environment={variable: value}, code=2, stdout=[], first=says)


class the_page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.serving = cls.enterClassContext(hub())

    def test_is_served_gzipped_to_who_takes_it(self):
        status, plain, page = get(self.serving.port)
        self.assertEqual(status, 200)
        self.assertIn(b"<html", page)
        status, packed, body = get(self.serving.port, headers={"Accept-Encoding": "gzip, br"})
        self.assertEqual((status, packed["content-encoding"]), (200, "gzip"))
        self.assertEqual(gzip.decompress(body), page)
        self.assertNotEqual(packed["etag"], plain["etag"])

    def test_has_scripts_and_style_from_the_same_place_only(self):
        _, headers, page = get(self.serving.port)
        self.assertIn("default-src 'none'", headers["content-security-policy"])
        self.assertEqual(headers["x-content-type-options"], "nosniff")
        for asset, kind in (("app.js", "javascript"), ("page.css", "text/css"), ("favicon.svg", "svg")):
            status, headers, _ = get(self.serving.port, f"/{asset}", {"Accept-Encoding": "gzip"})
            self.assertEqual((status, headers["content-encoding"]), (200, "gzip"), asset)
            self.assertIn(kind, headers["content-type"])
            self.assertIn(asset.encode(), page)

    def test_is_not_sent_again_to_who_has_it(self):
        _, headers, _ = get(self.serving.port)
        status, _, body = get(self.serving.port, headers={"If-None-Match": headers["etag"]})
        self.assertEqual((status, body), (304, b""))

    def test_what_is_not_there_is_404_and_what_is_not_read_is_405(self):
        self.assertEqual(get(self.serving.port, "/../etc/passwd")[0], 404)
        self.assertEqual(get(self.serving.port, method="POST")[0], 405)


class pages_of_a_folder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.addCleanup(os.umask, os.umask(0o022))  # everyone may read what is served

    def test_are_served_before_the_own_page_and_large_ones_whole(self):
        (self.folder / "arm.html").write_text("<script>let a;</script>")
        large = bytes(range(256)) * 40000  # 10 MB, many times what is kept for one answer
        (self.folder / "arm.bin").write_bytes(large)
        (self.folder / "style.css").write_text("h1 {}")
        with hub("--web", str(self.folder)) as serving:
            status, headers, page = get(serving.port, "/arm.html")
            self.assertEqual((status, page), (200, b"<script>let a;</script>"))
            self.assertIn("'unsafe-inline'", headers["content-security-policy"])
            self.assertEqual(get(serving.port, "/arm.html", {"If-None-Match": headers["etag"]})[0], 304)
            self.assertEqual(get(serving.port, "/style.css")[2], b"h1 {}")
            self.assertIn(b"<html", get(serving.port)[2])
            self.assertNotEqual(get(serving.port, "/rowe/style.css")[2], b"h1 {}")
            self.assertEqual(get(serving.port, "/healthz")[2], b"ok")
            status, headers, body = get(serving.port, "/arm.bin")
            self.assertEqual((status, int(headers["content-length"])), (200, len(large)))
            self.assertTrue(body == large)

    def test_that_cannot_be_served_are_named(self):
        (self.folder / "my arm.html").write_text("x")
        run("serve", "--port", "0", "--web", str(self.folder), code=2,
            last=f"--web: {self.folder}/my arm.html: its name has")
        ended = run("serve", "--port", "0", "--web", "/nowhere")
        self.assertEqual((ended.code, ended.stderr[-1]),
                         (2, "rowe serve: --web: /nowhere: No such file or directory"))


class admission(unittest.TestCase):
    def test_pages_of_other_origins_are_refused_with_the_remedy(self):
        with hub() as serving:
            for origin in ("http://evil.example", "null", f"http://127.0.0.1:{serving.port + 1}"):
                with self.assertRaises(refused) as refusal:
                    peer(serving.port, headers={"Origin": origin})
                self.assertEqual(refusal.exception.status, 403)
                self.assertIn(origin, refusal.exception.body)
                remedy = "open the page over http" if origin == "null" else f"--allow-origin {origin}"
                self.assertIn(remedy, refusal.exception.body)
            serving.line(r"http://evil\.example.*--allow-origin")
            self.assertEqual(serving.summary()["refused_handshakes"], 3)

    def test_the_own_page_and_listed_origins_are_let_in(self):
        with hub("--allow-origin", "http://trusted.example") as serving:
            for origin in (f"http://127.0.0.1:{serving.port}", "http://trusted.example"):
                with peer(serving.port, headers={"Origin": origin}):
                    pass

    def test_other_host_names_are_refused_with_the_remedy(self):
        with hub() as serving:
            with self.assertRaises(refused) as refusal:
                peer(serving.port, headers={"Host": f"evil.example:{serving.port}"})
            self.assertEqual(refusal.exception.status, 403)
            self.assertIn("evil.example", refusal.exception.body)
            serving.line(r"evil\.example.*--allow-host")
            self.assertEqual(get(serving.port, headers={"Host": "evil.example"})[0], 403)

    def test_listed_host_names_are_let_in(self):
        with hub("--allow-host", "robot.local") as serving:
            with peer(serving.port, headers={"Host": f"robot.local:{serving.port}"}):
                pass


class the_demo(unittest.TestCase):
    def watch(self, serving, count):
        with peer(serving.port) as p:
            p.send({"op": "subscribe", "topic": "/odom", "type": "nav_msgs/Odometry"})
            return [p.receive()["msg"] for _ in range(count)]

    def check(self, poses):
        seconds = [m["header"]["stamp"]["secs"] + m["header"]["stamp"]["nsecs"] * 1e-9 for m in poses]
        numbers = [m["header"]["seq"] for m in poses]
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertEqual(seconds, sorted(seconds))
        for m in poses:
            turn = m["pose"]["pose"]["orientation"]
            self.assertAlmostEqual(turn["z"] ** 2 + turn["w"] ** 2, 1)
            place = m["pose"]["pose"]["position"]
            self.assertLess(math.hypot(place["x"], place["y"]), 2.3)
            self.assertEqual((m["header"]["frame_id"], m["child_frame_id"]), ("odom", "base_link"))
            self.assertGreater(m["pose"]["covariance"][0], 0)

    @undisturbed
    def test_drives_and_publishes_odometry(self):
        with hub("--demo") as serving:
            poses = self.watch(serving, 1500)
            self.check(poses)
            first, last = poses[0], poses[-1]
            self.assertGreater(last["twist"]["twist"]["linear"]["x"], 0.1)
            self.assertNotEqual(first["pose"]["pose"]["position"], last["pose"]["pose"]["position"])
            serving.end(signal.SIGTERM)
            serving.line(r"robot: \d+ cycles, \d+ skipped; late by .*; published \d+, refused \d+")

    def test_runs_on_one_core(self):
        if shutil.which("taskset") is None:
            self.skipTest("there is no taskset")
        with hub("--demo", command=("taskset", "-c", "0", ROWE)) as serving:
            self.check(self.watch(serving, 500))
            self.assertEqual(serving.end(signal.SIGTERM), 0)

    def test_says_in_one_line_what_the_machine_does_not_permit(self):
        options = {}
        if os.geteuid() == 0:
            nobody = 65534
            if not self.can_run_as(nobody):
                self.skipTest("the program's folder is closed to other users")
            options = {"user": nobody, "group": nobody, "extra_groups": []}

        def without_limits():
            resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
            resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))

        with hub("--demo", preexec_fn=without_limits, **options) as serving:
            line = serving.line(r"not granted as asked: (.*)")[1]
            self.assertIn("SCHED_FIFO 80 not permitted (rtprio limit 0)", line)
            self.assertIn("ulimit -r", line)
            service = serving.line(r"the service thread was not granted all options: (.*)")[1]
            self.assertIn("SCHED_FIFO 70 not permitted (rtprio limit 0): raise `ulimit -r`", service)
            if not self.sanitized():  # sanitizers answer mlock() themselves, and say yes
                self.assertIn("ulimit -l", line)
            self.check(self.watch(serving, 200))
            self.assertEqual(serving.end(signal.SIGTERM), 0)
            self.assertEqual(len([text for text in serving.stderr if "not granted as asked" in text]), 1)

    def sanitized(self):
        with open(ROWE, "rb") as file:
            return re.search(b"__[at]san_init", file.read()) is not None

    def can_run_as(self, user):
        try:
            with program("version", user=user, group=user, extra_groups=[]) as attempt:
                return attempt.end() == 0
        except PermissionError:
            return False


if __name__ == "__main__":
    unittest.main()
