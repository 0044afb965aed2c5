# SPDX-License-Identifier: Apache-2.0
"""`rowe top`: what it shows, on a terminal of the test's own, and as text."""
import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import termios
import time
import unittest

from program import ROWE, hub, on_a_terminal, program, run, timeout, undisturbed


class screen:
    """`rowe top` on a terminal; its bytes are gathered in `shown`."""

    def __init__(self, *arguments, columns=100, rows=40):
        self.ours, self.its = pty.openpty()
        fcntl.ioctl(self.its, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(self.its)
        self.shown = ""
        self.process = subprocess.Popen([ROWE, "top", *arguments], stdin=self.its, stdout=self.its,
                                        stderr=self.its, env={**os.environ, "TERM": "xterm-256color"})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.ours)
        os.close(self.its)

    def see(self, pattern, behind=0):
        end = time.monotonic() + timeout
        while not (found := re.compile(pattern, re.S).search(self.shown, behind)):
            assert time.monotonic() < end, f"no {pattern!r} in {self.shown!r}"
            if select.select([self.ours], [], [], 0.2)[0]:
                self.shown += os.read(self.ours, 65536).decode(errors="replace")
        return found.end()

    def press(self, key):
        os.write(self.ours, key)

    def ended(self):
        end = time.monotonic() + timeout
        while self.process.poll() is None and time.monotonic() < end:
            if select.select([self.ours], [], [], 0.1)[0]:
                self.shown += os.read(self.ours, 65536).decode(errors="replace")
        return self.process.wait(timeout=1)


class top(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))

    def test_shows_the_robot_until_it_is_told_to_end(self):
        with screen(self.demo.url, "--timeout", "60s") as shows:
            shows.see("stop: .*PEER.*LOOP.*q quit  s sort: rate")
            shows.press(b"s")
            at = shows.see("bytes")
            shows.press(b"p")
            shows.see("go on", at)
            shows.press(b"q")
            self.assertEqual(shows.ended(), 0)
            self.assertEqual(termios.tcgetattr(shows.its), shows.before)

    def test_goes_on_when_the_robot_is_gone_and_says_so(self):
        with hub() as gone, screen(gone.url, "--every", "200ms", "--timeout", "1s") as shows:
            shows.see("lost: none")
            gone.process.kill()
            gone.process.wait()
            shows.see("(no peer|not answer|connect|lost)", len(shows.shown))
            shows.press(b"q")
            self.assertEqual(shows.ended(), 0)

    def test_ends_at_a_signal_and_leaves_the_terminal_as_it_was(self):
        with screen(self.demo.url, "--timeout", "60s") as shows:
            shows.see("stop: ")
            shows.process.terminate()
            self.assertEqual(shows.ended(), 0)
            self.assertEqual(termios.tcgetattr(shows.its), shows.before)

    @undisturbed
    def test_once_is_text(self):
        with hub("--demo") as robot:
            run("stop", robot.url, code=0)
            text = "\n".join(run("top", robot.url, "--once", "--timeout", "60s", code=0).stdout)
            for like in (r"^\S+, up for 0:\d\d, \d+ peers?, longest cycle \d+ us$",
                         r"(?m)^stop: stopped, number \d+, request",
                         r"(?m)^lost: none$", r"(?m)^PEER +FORMAT? *"):
                self.assertRegex(text.split("\n")[0] if "up for" in like else text, like)

    def test_what_was_not_wanted_is_no_loss(self):
        with program("echo", self.demo.url, "/odom", "--hz", "1") as thinned:
            thinned.line("", "stdout")
            for verb, lost in ((("top", self.demo.url, "--once"), "lost: "),
                               (("peers", self.demo.url), "losses: ")):
                lines = run(*verb, "--timeout", "60s", code=0).stdout
                self.assertRegex("\n".join(lines), r"(?m)^thinned on purpose: .*(throttled|replaced) \d+")
                said = next(line for line in lines if line.startswith(lost))
                self.assertNotRegex(said, "throttled|replaced")

    def test_has_each_heading_in_bold_once(self):
        text = "\n".join(run("top", self.demo.url, "--once", "--timeout", "60s", "--color=always").stdout)
        self.assertIn("\x1b[1mTOPIC", text)
        self.assertNotIn("\x1b[1m\x1b", text)
        with screen(self.demo.url, "--timeout", "60s") as shows:
            shows.see("TOPIC.*q quit")
            self.assertNotIn("^[[1m", shows.shown)

    def test_needs_a_terminal_or_once(self):
        run("top", self.demo.url, code=2, says="--once prints it once anywhere")
        run("top", self.demo.url, "--sort", "size", code=2, says="--sort is rate or bytes or gap or name")

    def test_fits_a_narrow_terminal(self):
        shown = on_a_terminal(40, "top", self.demo.url, "--once", "--timeout", "60s", "--color=never")
        for line in shown.split("\n"):
            self.assertLessEqual(len(line), 40)


if __name__ == "__main__":
    unittest.main()
