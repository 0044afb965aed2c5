# SPDX-License-Identifier: Apache-2.0
"""The keys of `rowe replay`, on a terminal of the test's own, and what becomes of that terminal."""
import contextlib
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import tempfile
import termios
import time
import unittest

from program import ROWE, timeout
from recordings import message, record
from replay_messages_test import taken

left, right = b"\x1b[D", b"\x1b[C"


class terminal:
    """`rowe replay` on one. What it shows is gathered in `shown`."""

    def __init__(self, *arguments, columns=100, run='exec "$@"'):
        self.ours, self.its = pty.openpty()
        fcntl.ioctl(self.its, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        self.before = termios.tcgetattr(self.its)
        self.shown = ""
        # A session of its own gets the terminal that it opens.
        name = os.ttyname(self.its)
        script = f"exec < {name} > {name} 2>&1; {run}"
        self.process = subprocess.Popen(["bash", "-c", script, "sh", ROWE, "replay", *arguments],
                                        start_new_session=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.ours)
        os.close(self.its)

    def press(self, keys):
        os.write(self.ours, keys)

    def read(self, seconds):
        if select.select([self.ours], [], [], seconds)[0]:
            with contextlib.suppress(OSError):
                self.shown += os.read(self.ours, 65536).decode(errors="replace")

    def see(self, pattern, behind=0):
        """Waits until it shows something like that behind this place; returns where it ends."""
        end = time.monotonic() + timeout
        while not (found := re.compile(pattern).search(self.shown, behind)):
            assert time.monotonic() < end, f"no {pattern!r} in {self.shown!r}"
            self.read(0.1)
        return found.end()

    def end(self):
        end = time.monotonic() + timeout
        while self.process.poll() is None:
            assert time.monotonic() < end, self.shown
            self.read(0.02)
        self.read(0)
        return self.process.returncode

    def flags(self):
        return termios.tcgetattr(self.its)


class keys(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "run.mcap")
        record(self.path, [message("/a", 1000 * i, {"n": i}) for i in range(120)])
        self.server = self.enterContext(taken())

    def playing(self, *more):
        return self.enterContext(terminal(self.server.url, self.path, *more))

    def numbers(self):
        return [body["n"] for _, body in self.server.messages]

    def test_space_pauses_and_goes_on(self):
        playing = self.playing()
        self.server.wait(1)
        playing.press(b" ")
        place = playing.see("paused")
        count = len(self.numbers())
        playing.press(b" ")
        self.server.wait(count + 1)
        playing.press(b"q")
        self.assertEqual(playing.end(), 0)
        playing.see(r"published \d+ messages? in", place)

    def test_one_message_at_a_time_is_taken_while_it_pauses(self):
        playing = self.playing("--rate", "0.001")
        self.server.wait(1)
        playing.press(b" ")
        playing.see("paused")
        for count, one in enumerate((b"s", right, b"s"), 2):
            playing.press(one)
            self.server.wait(count)
        playing.press(b"q")
        self.assertEqual(playing.end(), 0)
        self.assertEqual(self.numbers(), [0, 1, 2, 3])

    def test_seeks_forward_and_back(self):
        playing = self.playing("--rate", "0.001")
        self.server.wait(1)
        playing.press(b" ")
        place = playing.see("0:00.0 / 1:59.0  x0.00  paused")
        for one, shows in ((b"]", "0:05.0"), (b"]", "0:10.0"), (left, "0:05.0"), (b"]]]", "0:20.0"),
                           (b"[", "0:15.0")):
            playing.press(one)
            place = playing.see(shows, place)
        playing.press(b"s")
        self.server.wait(2)
        playing.press(b"[[[[[")  # not before the begin
        playing.see("0:00.0", place)
        playing.press(b"s")
        self.server.wait(3)
        playing.press(b"q")
        self.assertEqual(playing.end(), 0)
        self.assertIn(self.numbers(), ([0, 15, 0], [0, 16, 0]))  # it had paused a little after the begin

    def test_seeks_while_it_plays(self):
        playing = self.playing()
        self.server.wait(1)
        playing.press(right)
        self.server.wait(2)
        playing.press(b"q")
        self.assertEqual(playing.end(), 0)
        self.assertGreaterEqual(self.numbers()[1], 5)

    def test_at_the_end_it_waits_while_it_pauses(self):
        playing = self.playing("--from", "-3s")
        self.server.wait(1)
        playing.press(b" ")
        place = playing.see("paused")
        playing.press(b"]]")
        playing.see("0:03.0 / 0:03.0", place)
        playing.press(b"[")
        playing.see("0:00.0 / 0:03.0  x1  paused", place)
        playing.press(b"q")
        self.assertEqual(playing.end(), 0)

    def test_the_terminal_is_as_before_at_each_end(self):
        for how in (lambda it: it.press(b"q"), lambda it: it.press(b"\x03"),
                    lambda it: os.kill(it.process.pid, signal.SIGTERM),
                    lambda it: os.kill(it.process.pid, signal.SIGHUP), lambda it: it.press(b"\x1c")):
            with taken() as server, terminal(server.url, self.path) as playing:
                playing.see("space pauses")
                self.assertEqual(playing.flags()[3] & (termios.ICANON | termios.ECHO), 0)
                how(playing)
                playing.end()
                self.assertEqual(playing.flags(), playing.before)

    def test_the_terminal_is_as_before_while_it_is_suspended(self):
        """By a shell with job control, which waits for a line before it lets the program go on."""
        shell = 'set -m; "$@"; echo suspended; read line; fg'
        with terminal(self.server.url, self.path, run=shell) as playing:
            playing.see("space pauses")
            playing.press(b"\x1a")
            place = playing.see("suspended")
            self.assertEqual(playing.flags(), playing.before)
            playing.press(b"\n")
            place = playing.see("space pauses", place)
            self.assertEqual(playing.flags()[3] & termios.ICANON, 0)
            playing.press(b" ")
            playing.see("paused", place)
            playing.press(b"q")
            self.assertEqual(playing.end(), 0)
            self.assertEqual(playing.flags(), playing.before)

    def test_without_a_terminal_no_keys_are_read(self):
        short = os.path.join(self.folder, "short.mcap")
        record(short, [message("/a", i, {"n": i}) for i in range(3)])
        done = subprocess.run([ROWE, "replay", self.server.url, short], input=b"q ", timeout=timeout,
                              check=True, stderr=subprocess.PIPE)
        self.assertEqual([body["n"] for _, body in self.server.all()], [0, 1, 2])
        self.assertNotIn(b"\x1b", done.stderr)


if __name__ == "__main__":
    unittest.main()
