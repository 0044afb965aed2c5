# SPDX-License-Identifier: Apache-2.0
"""The program under test, as a user runs it: its arguments, its lines, its exit code.

Every wait has an end (`timeout`), so a program that hangs fails a test instead of hanging it. ROWE_BIN names
the program. Nothing here sleeps to synchronise: a test waits for the line that says so.
"""
import collections
import contextlib
import fcntl
import functools
import inspect
import os
import pty
import queue
import random
import re
import signal
import socket
import struct
import subprocess
import termios
import threading
import time

ROWE = os.environ["ROWE_BIN"]
# The tests may run in the background or under nohup; the program is to notice its signals all the same.
for one in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(one) is signal.SIG_IGN:
        signal.signal(one, signal.SIG_DFL)

timeout = 60.0  # seconds; far above what anything here takes, sanitizers included
# Verbs that give up by themselves after a second or two.
asking = ("actions", "call", "list", "peers", "reset", "services", "stop", "topics")


def with_timeout(arguments):
    """Who asks is given as much time as the tests have, where a test does not say how much."""
    gives_up = arguments and arguments[0] in asking and "--timeout" not in arguments
    return (*arguments, "--timeout", f"{timeout:.0f}s") if gives_up else arguments


def of_the_machine(line):
    """Said where the clock source is a dear one, or under an emulator; no test asks for that."""
    return "reading the clock enters the kernel on this machine" in line


class program:
    """One run. Its output is gathered line by line while it runs."""

    begun = []  # all of them

    def __init__(self, *arguments, command=(ROWE,), stdin=subprocess.DEVNULL, environment=None, **options):
        env = {key: value for key, value in os.environ.items() if key != "ROWE_URL"}
        env.update(environment or {})
        self.arguments = arguments = with_timeout(arguments)
        self.process = subprocess.Popen([*command, *arguments], stdin=stdin, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, env=env, **options)
        self.said = {"stdout": [], "stderr": []}
        program.begun.append(self)
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
        """But what it says of connecting where that takes a while; line() finds that, too."""
        return [line for line in self.said["stderr"] if ": waiting for ws" not in line]

    def line(self, pattern, stream="stderr", count=1):
        """Waits for the `count`-th line that matches; returns the match."""
        end = time.monotonic() + timeout
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
        code = self.process.wait(timeout=timeout)
        for reader in self.readers:
            reader.join()
        return code

    def expect(self, code=None, stdout=None, stderr=None, says=(), first=None, last=None, prints="", ends=""):
        """It has ended with this exit code and with exactly these lines; stderr has the texts of `says` (one,
        or several), and its first and last line these; the first line of stdout is like `prints`, the last
        one of stderr like `ends`. What is not given may be anything. Returns it."""
        found = [self.process.returncode, self.stdout, self.stderr]
        wanted = [one if other is None else other for one, other in zip(found, (code, stdout, stderr))]
        lines, whole = self.stderr or [""], "\n".join(self.stderr)
        texts = [((says,) if isinstance(says, str) else says, whole), ([first or ""], lines[0]),
                 ([last or ""], lines[-1])]
        missing = [text for some, there in texts for text in some if text not in there]
        missing += [like for like, line in ((prints, (self.stdout or [""])[0]), (ends, lines[-1]))
                    if not re.search(like, line)]
        if missing or found != wanted:
            raise AssertionError(f"{self.arguments} ended with {found}, wanted: {wanted}, {missing}")
        return self


expectations = inspect.signature(program.expect).parameters.keys() - {"self"}


def run(*arguments, **options):
    """Runs to the end; returns the finished program, which has ended as expect() is told."""
    wanted = {name: options.pop(name) for name in expectations if name in options}
    with program(*arguments, **options) as running:
        running.code = running.end()
        return running.expect(**wanted)


def on_a_terminal(columns, *arguments, **options):
    """What it shows on one of so many columns; it ends well."""
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    shown = b""
    with subprocess.Popen([ROWE, *arguments], stdout=its, **{"stderr": its, **options}) as process:
        os.close(its)
        with contextlib.suppress(OSError):  # it has closed the terminal
            while piece := os.read(ours, 65536):
                shown += piece
        os.close(ours)
        code = process.wait(timeout=timeout)
    assert code == 0, (arguments, code, shown)
    return shown.decode().replace("\r\n", "\n")


def verbs():
    """Those that `rowe help` lists."""
    text = "\n".join(run("help").stdout).split("usage: ")[1].split("exit codes:")[0]
    return re.findall(r"^  ([\w-]+) +\S", text, re.M)


def given_time(attempt, came_to_it, seconds=0.2):
    """What attempt(TIME) returns, which has something run with `--timeout TIME` that passes in vain: again
    with four times the time until `came_to_it(it)`. How long a busy machine takes to start, to connect and
    the like, before the wait that the test is about, nobody knows."""
    while True:
        ended = attempt(f"{seconds * 1000:.0f}ms")
        if came_to_it(ended) or seconds >= timeout:
            return ended
        seconds *= 4


def learns(why, *arguments, **options):
    """A run that tries to connect in vain until it has learned why."""
    return given_time(lambda time: run(*arguments, "--timeout", time, **options),
                      lambda ended: why in "\n".join(ended.stderr))


def nobody_at(*arguments, **options):
    """A run that finds nobody at 127.0.0.1:1."""
    return learns("nobody listens", *arguments, **options)


# What is said where a loop, or a service thread, had to wait for longer than the robot bears.
kept_waiting = re.compile(r'stopped: (loop|service)|accepted it, but not its loops|"not_observed"(,|:[1-9])')


def undisturbed(test):
    """A test of the demo robot: again, where the machine kept that from running for so long that it stopped
    by itself or was late to acknowledge a stop, as it is to do then; skipped where that happens again and
    again."""
    @functools.wraps(test)
    def attempts(self):
        for _ in range(5):
            program.begun = []
            try:
                return test(self)
            except AssertionError as failure:
                said = [line for one in program.begun for line in (*one.stdout, *one.stderr)]
                if not kept_waiting.search("\n".join(said)) or "Sanitizer" in str(failure):
                    raise
        return self.skipTest("this machine keeps the demo robot from running for half a second at a time")
    return attempts


@contextlib.contextmanager
def kept_port():
    """A port that nobody gets by chance while it is kept, whether anybody listens there or not: below those
    that the kernel gives out. Elsewhere a program that tries to connect to a port that is free for the moment
    may even be given that port itself, and meets itself."""
    with open("/proc/sys/net/ipv4/ip_local_port_range", encoding="ascii") as file:
        first = int(file.read().split()[0])
    with socket.socket() as kept:
        for port in random.SystemRandom().sample(range(10_000, max(first, 12_000)), 1000):
            with contextlib.suppress(OSError):
                kept.bind(("127.0.0.1", port))
                break
        kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # from now on one may listen there
        yield kept.getsockname()[1]


class server(program):
    """One that is ready when it has printed a line like `pattern`, its `ready`. Ends in order where a test
    does not end it in another way."""

    def __init__(self, pattern, *arguments, **options):
        super().__init__(*arguments, **options)
        try:
            self.ready = self.line(pattern, "stdout")
        except BaseException as failure:
            self.__exit__(failure)
            raise

    def __exit__(self, failure=None, *how):
        code = self.end(signal.SIGTERM) if failure is None and self.process.poll() is None else 0
        super().__exit__(failure, *how)
        if code != 0:
            raise AssertionError(f"{self.arguments} ended with {code}: {self.stderr}")


class hub(server):
    """`rowe serve` on a free port."""

    def __init__(self, *arguments, port=0, **options):
        where = () if "--listen" in arguments else ("--port", str(port))
        super().__init__(r"^rowe serves https?://(\S+):(\d+)/ \(wss?://\1:\2/\)$", "serve", *where,
                         *arguments, **options)
        self.host, self.port = self.ready[1], int(self.ready[2])
        self.url = f"ws://{self.host}:{self.port}/"

    def summary(self):
        """Ends it; returns the counters it prints."""
        self.end(signal.SIGTERM)
        self.expect(0)
        counts = collections.defaultdict(int)  # zeros are not printed
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
