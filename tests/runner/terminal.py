# SPDX-License-Identifier: Apache-2.0
"""What a run says while it goes on: headings everywhere, a line of progress only where somebody looks."""
import shutil
import sys
import time

_begin = time.monotonic()
_looked_at = sys.stdout.isatty()


def begun_before(seconds):
    """The run began so long before this program did."""
    global _begin
    _begin -= seconds


def heading(text):
    clear()
    print(f"\n== {text} (after {time.monotonic() - _begin:.0f} s)", flush=True)


def line(text):
    clear()
    print(text, flush=True)


def progress(text):
    """Replaces the last line of progress; nothing in a log."""
    if _looked_at:
        columns = shutil.get_terminal_size().columns
        print("\r\x1b[K" + text[:columns - 1], end="", flush=True)


def clear():
    if _looked_at:
        print("\r\x1b[K", end="", flush=True)
