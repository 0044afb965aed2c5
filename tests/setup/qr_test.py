# SPDX-License-Identifier: Apache-2.0
"""The QR code that `rowe setup` prints, read as a phone does."""
import pathlib
import re
import subprocess
import sys
import unittest

from program import on_a_terminal, timeout
from robot import tokens_of
from robot_folder import in_a_folder

modules = {"█": "11", "▀": "10", "▄": "01", " ": "00"}  # the upper one, the lower one


def rows_of(lines):
    """Rows of 0 and 1 out of the lines of a code."""
    rows = []
    for line in lines:
        drawn = re.match(r"\x1b\[38;5;16;48;5;231m(.*)\x1b\[0m$", line)
        if drawn:
            rows += ["".join(modules[one][half] for one in drawn[1]) for half in (0, 1)]
    return rows


def decoded(rows):
    reader = str(pathlib.Path(__file__).with_name("read_qr.py"))
    for python in (sys.executable, "/usr/bin/python3"):  # where Debian's python3-zbar is
        if subprocess.run([python, "-c", "import zbar"], capture_output=True, check=False).returncode == 0:
            return subprocess.run([python, reader], input="\n".join(rows), capture_output=True, text=True,
                                  timeout=timeout, check=True).stdout.splitlines()
    raise unittest.SkipTest("python3-zbar is not there")


class qr_code(in_a_folder):
    def on_a_terminal(self, columns, *arguments):
        """What it prints on one of so many columns."""
        return on_a_terminal(columns, "setup", "--name", "ang-01", "--dir", "r", "--force", *arguments,
                             cwd=self.top, stderr=subprocess.DEVNULL).split("\n")

    def test_is_that_of_the_drivers_link(self):
        ended = self.set_up("--qr", "--address", "192.168.100.100", "--port", "65535")
        link = f"https://192.168.100.100:65535/#token={tokens_of(ended)['driver']}"
        self.assertEqual(decoded(rows_of(ended.stdout)), [link])

    def test_has_a_light_frame_of_four_modules(self):
        rows = rows_of(self.set_up("--qr").stdout)
        self.assertTrue(len(rows) - len(rows[0]) in (0, 1))
        side = len(rows[0])
        for row in (*rows[:4], *rows[side - 4:]):
            self.assertNotIn("1", row)
        for row in rows:
            self.assertNotIn("1", row[:4] + row[-4:])

    def test_is_drawn_on_a_terminal_that_is_wide_enough(self):
        said = self.on_a_terminal(80)
        self.assertEqual(len(decoded(rows_of(said))), 1)
        self.assertLessEqual(len(rows_of(said)[0]), 80)
        self.assertEqual(rows_of(self.on_a_terminal(30)), [])
        self.assertNotEqual(rows_of(self.on_a_terminal(30, "--qr")), [])

    def test_is_left_out_where_nobody_looks(self):
        self.assertNotIn("\x1b", "\n".join(self.set_up().stdout))


if __name__ == "__main__":
    unittest.main()
