# SPDX-License-Identifier: Apache-2.0
"""Recordings where something is wrong: the disk is full or slow, or the clock is set. Each message is in the
file, or was counted as lost, and each file can be read. ROWE_FULL_DISKS=N: fills a disk so often."""
import itertools
import json
import os
import random
import re
import signal
import subprocess
import tempfile
import threading
import unittest
import zlib

from clock import clock, preloaded
from program import hub, program, run, timeout
from recordings import beside
from robot import drops
from small_disk import without_small_disk
from websocket import peer

slow_disk = os.environ.get("ROWE_FAULTS_SLOW_DISK", "")
full_disks = int(os.environ.get("ROWE_FULL_DISKS", "5"))
disk_bytes = 4 << 20
hour = 3600  # seconds

why_not = without_small_disk(disk_bytes) if __name__ == "__main__" else ""


class numbered:
    """Publishes messages that have a number, of so many bytes."""

    def __init__(self, port, size=40):
        self.size = size
        self.sent = 0
        self.numbers = {}  # by what a reader says of a message's text
        self.to = peer(port)
        self.to.send({"op": "advertise", "topic": "/n", "type": "x/N"})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.to.__exit__()

    def publish(self, count):
        for _ in range(count):
            text = f'{{"n":{self.sent},"x":"{"x" * self.size}"}}'
            self.numbers[f"{len(text)}:{zlib.crc32(text.encode())}"] = self.sent
            self.to.send_text(f'{{"op":"publish","topic":"/n","msg":{text}}}')
            self.sent += 1

    def recorded(self, path):
        """Those in a file, which can be read, in the file's order."""
        said = subprocess.run([beside("mcap_samples"), "read", path], check=True, capture_output=True,
                              text=True, timeout=timeout).stdout
        return [self.numbers[line.rsplit(" ", 1)[1]] for line in said.splitlines()
                if line.startswith("message /n ")]

    def all_are_taken(self):
        self.to.call("/rosapi/get_time")


def lost_in(path):
    """What a file says of the messages that it lacks."""
    about = json.loads(run("info", "--json", path).stdout[0])
    return sum(about.get("lost", {}).values())


class recording_test(unittest.TestCase):
    def setUp(self):
        self.serving = self.enterContext(hub("--limit", "messages_per_second_max=0"))
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "run.mcap")

    def recording(self, path=None, *arguments, **options):
        records = program("record", self.serving.url, "/n", "-o", path or self.path, *arguments, **options)
        self.addCleanup(records.__exit__)
        records.line("recording into")
        return records

    def until_written(self, source, *paths):
        """Publishes until what was published last is in a file: then nothing is on its way."""
        while True:
            source.publish(1)
            for _ in range(100):
                if any(source.sent - 1 in source.recorded(path) for path in paths):
                    return
                threading.Event().wait(0.05)
                source.all_are_taken()  # it answers pings meanwhile

    def lost_at_the_hub(self):
        """Ends it."""
        counts = self.serving.summary()
        return sum(counts[name] for name in drops)

    def subscribed(self, source):
        while not source.to.call("/rosapi/subscribers", topic="/n")["values"]["subscribers"]:
            pass


class recordings(recording_test):
    @unittest.skipIf(not preloaded, "nothing can be preloaded here")
    def test_go_on_when_the_clock_is_set(self):
        with clock() as time, numbered(self.serving.port) as source:
            records = self.recording(environment=time.environment)
            self.subscribed(source)
            for shift in (0, -hour, 2 * hour, -400 * 24 * hour, 0):
                time.set(shift)
                source.publish(200)
                source.all_are_taken()
            self.until_written(source, self.path)
            self.assertEqual(records.end(signal.SIGINT), 0)
            self.assertEqual(sorted(source.recorded(self.path)), list(range(source.sent)))
            run("info", self.path, code=0)

    @unittest.skipIf(not slow_disk, "nothing can be preloaded here")
    def test_on_a_slow_disk_lack_only_what_is_counted(self):
        environment = {"LD_PRELOAD": slow_disk, "ROWE_FAULTS_WRITE_MS": "300"}
        with numbered(self.serving.port, size=50_000) as source:
            records = self.recording(environment=environment)
            self.subscribed(source)
            for _ in range(15):
                source.publish(100)
                source.all_are_taken()
            self.until_written(source, self.path)
            self.assertIn(records.end(signal.SIGINT), (0, 6))
            there = source.recorded(self.path)
            self.assertEqual(there, sorted(set(there)))
            self.assertEqual(len(there) + lost_in(self.path) + self.lost_at_the_hub(), source.sent)


@unittest.skipIf(why_not, why_not)
class full_disk(recording_test):
    def setUp(self):
        super().setUp()
        self.disk = os.environ["ROWE_SMALL_DISK"]
        self.addCleanup(self.clear)

    def clear(self):
        for name in os.listdir(self.disk):
            os.unlink(os.path.join(self.disk, name))

    def fill(self, left):
        """But for so many bytes. Returns the file that does it."""
        path = os.path.join(self.disk, "filler")
        with open(path, "wb", buffering=0) as file:
            file.write(bytes(disk_bytes - left))
        return path

    def test_ends_a_recording_which_says_so_and_can_be_read(self):
        for attempt in range(full_disks):
            with self.subTest(attempt=attempt), numbered(self.serving.port, size=1000) as source:
                path = os.path.join(self.disk, "run.mcap")
                self.fill(random.randrange(20_000, 500_000))
                records = self.recording(path, "--compression", "none")
                self.subscribed(source)
                ended = threading.Event()
                waiting = threading.Thread(target=lambda: (records.process.wait(timeout), ended.set()))
                waiting.start()
                while not ended.is_set():
                    source.publish(20)
                    source.all_are_taken()
                waiting.join()
                self.assertEqual(records.end(), 1)
                self.assertIn("run.mcap: No space left on device", "\n".join(records.stderr))
                there = source.recorded(path)
                self.assertEqual(there, list(range(len(there))))
                said = re.search(r"(\d+) messages?, .* lost (\d+)$", records.stderr[-1])
                self.assertEqual(len(there), int(said[1]))
                self.assertGreater(int(said[2]), 0)
                self.clear()

    def test_is_waited_for_where_room_comes(self):
        with numbered(self.serving.port, size=1000) as source:
            filler = self.fill(100_000)
            records = self.recording(self.disk + "/", "--max-total", "2MiB", "--compression", "none")
            self.subscribed(source)
            for _ in itertools.takewhile(lambda _: "trying again" not in "\n".join(records.stderr),
                                         itertools.count()):
                source.publish(20)
                source.all_are_taken()
            os.unlink(filler)
            first = source.sent
            names = lambda: [one for one in os.listdir(self.disk) if one.endswith(".mcap")]
            while len(names()) < 2:
                source.publish(20)
                source.all_are_taken()
            self.until_written(source, *(os.path.join(self.disk, name) for name in names()))
            self.assertIn(records.end(signal.SIGINT), (0, 6))
            paths = [os.path.join(self.disk, name) for name in names()]
            there = [one for path in paths for one in source.recorded(path)]
            self.assertEqual(len(there), len(set(there)))
            self.assertGreater(max(there), first)
            said = re.search(r"(\d+) messages?, .* lost (\d+)$", records.stderr[-1])
            self.assertEqual(len(there) + int(said[2]), source.sent)


if __name__ == "__main__":
    unittest.main()
