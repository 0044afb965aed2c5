# SPDX-License-Identifier: Apache-2.0
"""`rowe record`: what is in its files, however it ends. ROWE_KILLS=N: kills it so often."""
import json
import os
import random
import re
import resource
import signal
import subprocess
import tempfile
import threading
import time
import unittest

from program import ROWE, hub, program, run, timeout
from websocket import peer

samples = os.path.join(os.path.dirname(ROWE), "mcap_samples")
pause = threading.Event()  # nobody sets it
kills = int(os.environ.get("ROWE_KILLS", "12"))


class recording:
    """A file, as another program reads it: its messages by topic, in order of time."""

    def __init__(self, path):
        said = subprocess.run([samples, "read", path], check=True, capture_output=True, text=True,
                              timeout=timeout).stdout
        self.ended = "summary yes" in said
        self.topics = {}
        self.sequences = {}
        for line in said.splitlines():
            if line.startswith("message "):
                _, topic, *rest = line.split()
                after = re.search(r" (\d+) (\d+) (\d+) \d+:\d+$", line)
                self.topics.setdefault(topic, []).append(int(after[1]))
                self.sequences.setdefault(topic, []).append(int(after[3]))
                self.types = getattr(self, "types", {}) | {topic: rest[2].lstrip("(")}

    def count(self, topic):
        return len(self.topics.get(topic, ()))


class recording_test(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "run.mcap")

    def recorded(self, *arguments, at_least=20_000, with_signal=signal.SIGINT, code=0, **options):
        """Records until the file has so many bytes, then has it end."""
        with program("record", self.demo.url, *arguments, "-o", self.path, **options) as records:
            records.line("recording into")
            self.until(lambda: os.path.getsize(self.path) >= at_least)
            self.assertIn(records.end(with_signal), (code, 6) if code == 0 else (code,), records.stderr)
        return records

    def until(self, holds):
        end = time.monotonic() + timeout
        while not holds():
            self.assertLess(time.monotonic(), end)
            pause.wait(0.01)

    def test_has_all_topics_with_their_types(self):
        said = self.recorded().stderr[-1]
        file = recording(self.path)
        self.assertTrue(file.ended)
        self.assertGreater(file.count("/odom"), 50)
        self.assertGreater(file.count("/rowe/stop/state"), 0)
        self.assertGreater(file.count("/rowe/stats"), 0)
        self.assertEqual(file.types["/odom"], "nav_msgs/Odometry")
        self.assertEqual(file.sequences["/odom"], list(range(file.count("/odom"))))
        messages = sum(len(times) for times in file.topics.values())
        self.assertRegex(said, rf"^rowe record: {messages} messages, [\d.]+ kB in 1 file")

    def test_has_the_topics_that_are_named_and_those_that_come_later(self):
        with program("record", self.demo.url, "/odom", "/later", "/arm/**", "--exclude", "/arm/raw", "-o",
                     self.path) as records, peer(self.demo.port) as p:
            records.line("recording into")
            for topic in ("/later", "/arm/left/joints", "/arm/raw", "/other"):
                p.send({"op": "advertise", "topic": topic, "type": "a/B"})

            def publish():
                for topic in ("/later", "/arm/left/joints", "/arm/raw", "/other"):
                    p.send({"op": "publish", "topic": topic, "msg": {"a": 1}})
                there = recording(self.path).topics
                return {"/odom", "/later", "/arm/left/joints"} <= set(there)
            self.until(publish)
            self.assertIn(records.end(signal.SIGINT), (0, 6))
        self.assertEqual(set(recording(self.path).topics), {"/odom", "/later", "/arm/left/joints"})

    def test_says_what_nobody_publishes(self):
        with program("record", self.demo.url, "odmo", "/arm/*", "-o", self.path) as records:
            records.line(r"no topic matches '/arm/\*' yet")
            records.line(r"nobody publishes /odmo at ws://.* yet; did you mean /odom\?")
            self.assertEqual(records.end(signal.SIGINT), 0)

    def test_ends_its_file_by_a_container_stop_and_after_a_time(self):
        self.recorded(with_signal=signal.SIGTERM)
        self.assertTrue(recording(self.path).ended)
        os.remove(self.path)
        began = time.monotonic()
        run("record", self.demo.url, "/odom", "-o", self.path, "--duration", "300ms")
        self.assertGreaterEqual(time.monotonic() - began, 0.3)
        self.assertTrue(recording(self.path).ended)

    def test_begins_other_files_and_deletes_the_oldest(self):
        with program("record", self.demo.url, "-o", self.folder + "/", "--split", "100ms", "--max-total",
                     "1MiB", "--compression", "none") as records:
            records.line("recording into", count=4)
            self.assertIn(records.end(signal.SIGINT), (0, 6))
        names = os.listdir(self.folder)
        self.assertGreaterEqual(len(names), 4)
        for name in names:
            self.assertRegex(name, r"_\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ(_\d+)?\.mcap$")
            self.assertTrue(recording(os.path.join(self.folder, name)).ended)

    def test_has_the_parameters_of_the_robot(self):
        self.recorded()
        said = json.loads(run("info", "--json", self.path, code=0).stdout[0])
        self.assertIn("/robot/speed_max", next(one["values"] for one in said["metadata"]
                                               if one["name"] == "rowe"))

    def test_has_the_types_of_topics_that_are_named(self):
        self.recorded("/odom")
        said = json.loads(run("info", "--json", self.path, code=0).stdout[0])
        self.assertEqual([one["type"] for one in said["topics"]], ["nav_msgs/Odometry"])

    def test_is_thinned_at_the_robot(self):
        with hub() as serving, peer(serving.port) as p:
            with program("record", serving.url, "/t", "-o", self.path, "--throttle", "0.001Hz") as records:
                records.line("recording into")
                p.send({"op": "advertise", "topic": "/t", "type": "x/T"})
                while not p.call("/rosapi/subscribers", topic="/t")["values"]["subscribers"]:
                    pass
                for i in range(200):
                    p.send({"op": "publish", "topic": "/t", "msg": {"i": i}})
                p.call("/rosapi/get_time")
                counts = serving.summary()
                self.assertEqual(counts["throttled"] + counts["replaced"], 199)
                self.assertEqual(records.end(signal.SIGINT), 0)
        self.assertEqual(recording(self.path).count("/t"), 1)

    def test_is_done_by_the_robot_itself_as_its_settings_say(self):
        boxes = os.path.join(self.folder, "boxes")
        with hub("--demo", "--record", self.folder + "/all/", "--black-box", boxes, "--black-box-after",
                 "100 ms", "--record-exclude", "/rowe/**") as robot:
            robot.line("a black box keeps the last 30.000 s for .*/boxes/")
            robot.line("recording into .*/all/")
            run("record", robot.url, "--snapshot", "--cause", "it shakes", "--timeout", "60s", code=0,
                says="its black box writes")
            self.until(lambda: os.path.isdir(boxes) and os.listdir(boxes))
            self.assertEqual(robot.end(signal.SIGTERM), 0)
        name, = os.listdir(boxes)
        self.assertRegex(name, r"-asked_.*\.mcap$")  # that the robot ends is no stop
        said = json.loads(run("info", "--json", os.path.join(boxes, name), code=0).stdout[0])
        self.assertIn("it shakes", [value for one in said["metadata"] for value in one["values"].values()])
        whole = recording(os.path.join(self.folder, "all", os.listdir(os.path.join(self.folder, "all"))[0]))
        self.assertTrue(whole.ended)
        self.assertEqual(set(whole.topics), {"/odom"})

    def test_asks_for_a_snapshot_where_there_is_a_black_box(self):
        run("record", self.demo.url, "--snapshot", "--timeout", "60s", code=1, says="has no black box")
        run("record", self.demo.url, "/odom", "--snapshot", code=2, says="--snapshot takes no TOPIC")
        run("record", self.demo.url, "--cause", "why", code=2, says="--cause is for --snapshot")

    def test_says_when_the_disk_takes_no_more_and_keeps_what_is_whole(self):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        ended = run("record", self.demo.url, "-o", self.path, preexec_fn=limit, code=1,
                    says=f"{self.path}: File too large")
        file = recording(self.path)
        self.assertGreater(file.count("/odom"), 50)
        written, lost = re.search(r"(\d+) messages, .* lost (\d+)$", ended.stderr[-1]).groups()
        self.assertEqual(int(written), sum(len(times) for times in file.topics.values()))
        self.assertGreater(int(lost), 0)

    def test_is_readable_wherever_it_is_killed_and_repaired(self):
        for attempt in range(kills):
            with self.subTest(attempt=attempt):
                path = os.path.join(self.folder, f"{attempt}.mcap")
                with program("record", self.demo.url, "/odom", "-o", path) as records:
                    records.line("recording into")
                    pause.wait(random.uniform(0, 0.6))  # at any moment
                    records.end(signal.SIGKILL)
                before = recording(path)
                ended = run("record", "--repair", path, code=0)
                after = recording(path)
                self.assertEqual(before.topics, after.topics)
                self.assertTrue(after.ended)
                self.assertEqual(after.sequences.get("/odom", []), list(range(after.count("/odom"))))
                self.assertIn(f"{after.count('/odom')} message", ended.stderr[-1])

    def test_says_what_an_earlier_one_has_left(self):
        with program("record", self.demo.url, "-o", self.folder + "/") as records:
            left = records.line("recording into (.*)$")[1]
            records.end(signal.SIGKILL)
        with program("record", self.demo.url, "-o", self.folder + "/") as records:
            records.line(re.escape(left) + " was not ended by its program")
            self.assertIn(records.end(signal.SIGINT), (0, 6))

    def test_repairs_no_more_than_is_damaged(self):
        self.recorded(at_least=100_000)
        run("record", "--repair", self.path, code=0, says="is whole")
        whole = recording(self.path)
        with open(self.path, "r+b") as file:
            file.seek(30_000)
            file.write(b"\0" * 100)
        repaired = os.path.join(self.folder, "run.repaired.mcap")
        run("record", "--repair", self.path, code=0,
            says=[f"{repaired} has what could be read", "cannot be read"])
        saved = recording(repaired)
        self.assertTrue(saved.ended)
        self.assertLess(0, saved.count("/odom"))
        self.assertLess(saved.count("/odom"), whole.count("/odom"))
        run("record", "--repair", "/dev/null", "/nowhere", code=1,
            says=["/dev/null", "/nowhere: No such file"])

    def test_refuses_what_makes_no_sense(self):
        for arguments, says in ((("--split", "x"), "--split takes a size or a time"),
                                (("--max-total", "10"), "--max-total needs 1MiB at least"),
                                (("--compression", "zip"), "--compression")):
            run("record", self.demo.url, *arguments, code=2, says=says)
        run("record", "--repair", code=2, says="--repair needs a FILE")
        with open(self.path, "wb"):
            run("record", self.demo.url, "-o", self.path, code=1,
                says=f"{self.path}: File exists; -o names another file")


if __name__ == "__main__":
    unittest.main()
