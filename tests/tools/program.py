# SPDX-License-Identifier: Apache-2.0
"""The program under test, as a user runs it: its arguments, its lines, its exit code.

Every wait has an end (`patience`), so a program that hangs fails a test instead of hanging it. ROWE_BIN names
the program. Nothing here sleeps to synchronise: a test waits for the line that says so.
"""
import os
import queue
import re
import signal
import subprocess
import threading
import time

ROWE = os.environ["ROWE_BIN"]
# The tests may run in the background or under nohup; the program is to notice its signals all the same.
for one in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(one) is signal.SIG_IGN:
        signal.signal(one, signal.SIG_DFL)

patience = 60.0  # seconds; far above what anything here takes, sanitizers included


def of_the_machine(line):
    """Said where the clock source is a dear one, or under an emulator; no test asks for that."""
    return "reading the clock enters the kernel on this machine" in line


class program:
    """One run. Its output is gathered line by line while it runs."""

    def __init__(self, *arguments, command=(ROWE,), stdin=subprocess.DEVNULL, environment=None, **options):
        env = {key: value for key, value in os.environ.items() if key != "ROWE_URL"}
        env.update(environment or {})
        self.arguments = arguments
        self.process = subprocess.Popen([*command, *arguments], stdin=stdin, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, env=env, **options)
        self.said = {"stdout": [], "stderr": []}
        self.changed = threading.Condition()
        self.readers = [threading.Thread(target=self.gather, args=(name,), daemon=True) for name in self.said]
        for reader in self.readers:
            reader.start()

    def gather(self, name):
        for raw in getattr(self.process, name):
            line = raw.decode(errors="replace").rstrip("\n")
            if of_the_machine(line):
                continue
            with self.changed:
                self.said[name].append(line)
                self.changed.notify_all()
        with self.changed:
            self.changed.notify_all()

    def __enter__(self):
        return self

    def __exit__(self, failure=None, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for reader in self.readers:
            reader.join()
        self.process.stdout.close()
        self.process.stderr.close()
        found = [line for line in self.stderr if re.search(r"Sanitizer|runtime error:", line)]
        if failure is None and found:
            raise AssertionError("\n".join(self.stderr))

    @property
    def stdout(self):
        return self.said["stdout"]

    @property
    def stderr(self):
        return self.said["stderr"]

    def line(self, pattern, stream="stderr", count=1):
        """Waits for the `count`-th line that matches; returns the match."""
        end = time.monotonic() + patience
        with self.changed:
            while True:
                found = [m for m in (re.search(pattern, text) for text in self.said[stream]) if m]
                if len(found) >= count:
                    return found[count - 1]
                if self.process.poll() is not None and not any(reader.is_alive() for reader in self.readers):
                    code = self.process.returncode
                    raise AssertionError(f"{self.arguments} ended with {code} and no line like {pattern!r}:"
                                         f" {self.said}")
                if not self.changed.wait(min(0.5, end - time.monotonic())) and time.monotonic() > end:
                    raise AssertionError(f"{self.arguments} said no line like {pattern!r}: {self.said}")

    def lines(self, count, stream="stdout"):
        """Waits for `count` lines in all."""
        self.line("", stream, count)
        return self.said[stream]

    def end(self, with_signal=None):
        """Waits for the end, after a signal where one is named; returns the exit code."""
        if with_signal is not None:
            self.process.send_signal(with_signal)
        code = self.process.wait(timeout=patience)
        for reader in self.readers:
            reader.join()
        return code


def run(*arguments, **options):
    """Runs to the end; returns the finished program."""
    with program(*arguments, **options) as running:
        running.code = running.end()
        return running


class hub(program):
    """`rowe serve` on a free port, ready."""

    def __init__(self, *arguments, port=0, **options):
        where = () if "--listen" in arguments else ("--port", str(port))
        super().__init__("serve", *where, *arguments, **options)
        try:
            ready = self.line(r"^rowe serves http://(\S+):(\d+)/ \(ws://\1:\2/\)$", "stdout")
        except BaseException as failure:
            self.__exit__(failure)
            raise
        self.host, self.port = ready[1], int(ready[2])
        self.url = f"ws://{self.host}:{self.port}/"

    def __exit__(self, failure=None, *how):
        """Ends in order where a test does not end it in another way."""
        code = self.end(signal.SIGTERM) if failure is None and self.process.poll() is None else 0
        super().__exit__(failure, *how)
        if code != 0:
            raise AssertionError(f"serve ended with {code}: {self.stderr}")

    def summary(self):
        """Ends it; returns the counters it prints."""
        code = self.end(signal.SIGTERM)
        assert code == 0, f"serve ended with {code}: {self.stderr}"
        counts = {}
        for line in self.stderr:
            if re.match(r"rowe serve: (loss|chosen|flow|refusal|own): ", line):
                pairs = re.findall(r"(\w+) (\d+)", line.split(": ", 2)[2])
                counts.update((name, int(value)) for name, value in pairs)
        return counts


def in_parallel(*jobs):
    """Runs functions at the same time; raises what the first of them raised."""
    raised = queue.Queue()

    def attempt(job):
        try:
            job()
        except BaseException as error:  # an AssertionError is the very thing to hand on
            raised.put(error)

    threads = [threading.Thread(target=attempt, args=(job,)) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if not raised.empty():
        raise raised.get()
