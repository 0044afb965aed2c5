# SPDX-License-Identifier: Apache-2.0
"""`rowe replay` into a hub and out of `rowe echo`: every pose, in order, to the last bit."""
import json
import os
import random
import re
import signal
import tempfile
import unittest

from program import hub, kept_port, program, run
from robot import round_trip
from trajectory import bits, numbers_of, time_of, trajectory
from websocket import peer

seed = int(os.environ.get("ROWE_SEED", random.SystemRandom().randrange(2**32)))


# Poses that are sent faster than anybody may be taking them: as many as wait for a slow reader on their way.
at_once = 200


class listening:
    """`rowe echo --json`, known to be subscribed: it has printed the last of the probes that we published."""

    def __init__(self, serving, topic, alone=True):
        self.echo = program("echo", serving.url, topic, "--json", "--timeout", "60s")
        if not alone:  # somebody publishes already, and says by what arrives that it is subscribed
            return
        with peer(serving.port) as p:
            p.send({"op": "advertise", "topic": topic, "type": "nav_msgs/Odometry"})
            probes = 0
            while not self.echo.stdout:  # published into the void until somebody is there
                probes += 1
                p.send({"op": "publish", "topic": topic, "msg": {"probe": probes}})
                round_trip(p)
                if self.echo.process.poll() is not None:
                    raise AssertionError(self.echo.stderr)
                with self.echo.changed:
                    self.echo.changed.wait(0.02)
            self.echo.line(f'"probe": {probes}}}', "stdout")  # nothing is in the way of what comes now

    def __enter__(self):
        return self

    def __exit__(self, *how):
        self.echo.__exit__(*how)

    def messages(self, count):
        """Waits until `count` messages that are no probes were printed; returns them."""
        while True:
            lines = list(self.echo.stdout)
            found = [m for m in map(json.loads, lines) if "probe" not in m]
            if len(found) >= count:
                return found
            self.echo.lines(len(lines) + 1)


class replaying(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "path.txt")

    def replay(self, *arguments, **options):
        return run("replay", *arguments, "--tum", self.path, "--topic", "/odom", **options)

    def check(self, messages, wanted):
        self.assertEqual([time_of(m) for m in messages], wanted.times, f"ROWE_SEED={seed}")
        for i, (message, numbers) in enumerate(zip(messages, wanted.numbers)):
            self.assertEqual([bits(n) for n in numbers_of(message)], [bits(n) for n in numbers],
                             f"pose {i}: {numbers}, ROWE_SEED={seed}")
        self.assertEqual([m["header"]["seq"] for m in messages], list(range(len(messages))))

    def test_every_pose_arrives_in_order_and_exact_at_a_fixed_rate(self):
        wanted = trajectory(at_once, 10_000_000, seed)
        wanted.write(self.path)
        with hub() as serving, listening(serving, "/odom") as listener:
            ended = self.replay(serving.url, "--rate", "2kHz")
            ended.expect(0, ends=rf"sent {at_once} of {at_once} poses in \d+\.\d+ s")
            self.check(listener.messages(at_once), wanted)

    def test_every_pose_arrives_at_its_own_pace(self):
        wanted = trajectory(60, 10_000_000, seed + 1)
        wanted.write(self.path)
        with hub() as serving, listening(serving, "/odom") as listener:
            ended = self.replay(serving.url)
            self.assertEqual(ended.code, 0, ended.stderr)
            seconds = float(re.search(r"sent 60 of 60 poses in (\S+) s", ended.stderr[-1])[1])
            self.assertGreaterEqual(seconds, 0.59)
            self.check(listener.messages(60), wanted)

    def test_says_what_it_publishes(self):
        trajectory(1, 1, seed).write(self.path)
        with hub() as serving, peer(serving.port) as p:
            p.subscribe("/odom", type="nav_msgs/Odometry")
            self.assertEqual(self.replay(serving.url).code, 0)
            message = p.receive()["msg"]
            self.assertEqual(message["header"]["frame_id"], "odom")
            self.assertEqual(message["child_frame_id"], "base_link")
            self.assertEqual(message["pose"]["covariance"], [0] * 36)
            self.assertEqual(message["twist"]["twist"]["linear"], {"x": 0, "y": 0, "z": 0})

    def test_loops_with_stamps_that_go_on_until_it_is_interrupted(self):
        wanted = trajectory(10, 1_000_000, seed)
        wanted.write(self.path)
        with hub() as serving, listening(serving, "/odom") as listener:
            with program("replay", serving.url, "--tum", self.path, "--topic", "/odom", "--loop") as looping:
                messages = listener.messages(35)
                self.assertEqual(looping.end(signal.SIGINT), 0)
                looping.line(r"sent \d+ poses in")
        first = messages[0]["header"]["seq"]
        self.assertGreaterEqual(messages[-1]["header"]["seq"], 30)  # more than two laps
        for message in messages:  # which need not be all of them: nobody waits for a reader that is slow
            number = message["header"]["seq"]
            secs, nsecs = (a - b for a, b in zip(time_of(message), time_of(messages[0])))
            self.assertEqual(secs * 10**9 + nsecs, (number - first) * 1_000_000)
            self.assertEqual([bits(n) for n in numbers_of(message)],
                             [bits(n) for n in wanted.numbers[number % 10]])

    def test_a_replay_that_is_interrupted_says_how_far_it_came(self):
        trajectory(10, 10**9, seed).write(self.path)
        with hub() as serving, listening(serving, "/odom") as listener:
            with program("replay", serving.url, "--tum", self.path, "--topic", "/odom") as playing:
                listener.messages(1)
                self.assertEqual(playing.end(signal.SIGINT), 130)
                playing.line(r"sent \d+ of 10 poses")

    def test_waits_for_a_hub_that_comes_later(self):
        trajectory(5, 1_000_000, seed).write(self.path)
        port = self.enterContext(kept_port())  # nobody listens there, until the hub does
        with program("replay", f"127.0.0.1:{port}", "--tum", self.path, "--topic", "/odom") as playing:
            playing.line(r"waiting for ws://127\.0\.0\.1:\d+ \(Ctrl-C to stop\)")
            with hub(port=port):
                self.assertEqual(playing.end(), 0)
                playing.line("sent 5 of 5 poses")

    def test_goes_on_when_the_hub_comes_back(self):
        trajectory(10, 1_000_000, seed).write(self.path)
        with hub(port=self.enterContext(kept_port())) as first:
            arguments = ("replay", first.url, "--tum", self.path, "--topic", "/odom", "--loop")
            playing = self.enterContext(program(*arguments))
            with listening(first, "/odom", alone=False) as listener:
                listener.messages(20)
            first.end(signal.SIGKILL)
        with hub(port=first.port) as second, listening(second, "/odom", alone=False) as listener:
            listener.messages(20)
        self.assertIn(playing.end(signal.SIGINT), (0, 6))  # 6: some were under way when the first one died

    def test_a_broken_file_is_named_with_its_line(self):
        with open(self.path, "w") as file:
            file.write("# comment\n1 0 0 0 0 0 0 1\n2 0 0 zero 0 0 0 1\n")
        ended = self.replay("127.0.0.1:1")
        ended.expect(1, first=f"{self.path}:3: field 4 (tz) is 'zero', not a finite number")

    def test_a_file_that_is_not_there_is_named(self):
        self.replay("127.0.0.1:1").expect(1, first=f"{self.path}: No such file or directory")

    def test_a_file_without_duration_needs_a_rate_to_loop(self):
        trajectory(1, 1, seed).write(self.path)
        self.replay("127.0.0.1:1", "--loop").expect(2, first="--rate")


if __name__ == "__main__":
    unittest.main()
