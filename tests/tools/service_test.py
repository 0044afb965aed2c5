# SPDX-License-Identifier: Apache-2.0
"""`rowe serve` as a service: what it tells systemd, when the watchdog is fed, its unit, and its log."""
import contextlib
import ctypes
import functools
import json
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from program import ROWE, hub, in_parallel, of_the_machine, program, timeout
from websocket import connect, get, peer, read_answer, request

UNIT = pathlib.Path(__file__).resolve().parents[2] / "contrib/systemd/rowe@.service"
PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207


class manager:
    """The socket of systemd's side."""

    def __init__(self, name):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(name.replace("@", "\0", 1) if name.startswith("@") else name)
        self.environment = {"NOTIFY_SOCKET": name}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def next(self, wait=timeout):
        """The lines of the next datagram; none where none comes."""
        readable, _, _ = select.select([self.socket], [], [], wait)
        return self.socket.recv(4096).decode().splitlines() if readable else None

    def next_of(self, wanted):
        while (lines := self.next()) is not None:
            if wanted in lines:
                return lines
        raise AssertionError(f"{wanted} did not come")

    def count(self, wanted, seconds):
        found, end = 0, time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            found += wanted in (self.next(left) or ())
        return found


def abstract():
    return manager(f"@rowe-test-{os.getpid()}-{time.monotonic_ns()}")


def service_thread(pid):
    """A sanitizer's own thread, which is there before, has the program's name as well."""
    tasks = pathlib.Path(f"/proc/{pid}/task").iterdir()
    found = [int(task.name) for task in tasks if (task / "comm").read_text().strip() == "rowe"]
    if found in ([], [pid]):
        raise AssertionError("there is no service thread")
    return max(found)


@contextlib.contextmanager
def stopped(thread):
    """Stops one thread; SIGSTOP would stop all of them."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]

    def trace(what):
        if libc.ptrace(what, thread, None, None) != 0:
            raise unittest.SkipTest(f"ptrace is not permitted here (errno {ctypes.get_errno()})")

    trace(PTRACE_SEIZE)
    trace(PTRACE_INTERRUPT)
    os.waitpid(thread, 0x40000000)  # __WALL
    try:
        yield
    finally:
        trace(PTRACE_DETACH)


class systemd(unittest.TestCase):
    def test_is_told_that_the_service_is_ready_and_that_it_stops(self):
        with tempfile.TemporaryDirectory() as folder:
            for make in (abstract, lambda: manager(f"{folder}/notify")):
                with make() as told:
                    with hub(environment=told.environment) as serving:
                        lines = told.next_of("READY=1")
                        self.assertIn(f"STATUS=serves http://127.0.0.1:{serving.port}/", lines)
                        self.assertEqual(told.count("WATCHDOG=1", 0.3), 0)  # nobody asked for it
                        serving.end(signal.SIGTERM)
                    self.assertEqual(told.next(), ["STOPPING=1", "STATUS=asked to end"])

    def test_is_told_that_it_is_ready_only_when_it_listens(self):
        with abstract() as told, hub() as first:
            with program("serve", "--port", str(first.port), environment=told.environment) as second:
                self.assertEqual(second.end(), 1)
            self.assertIsNone(told.next(0))

    def test_feeds_its_watchdog_while_cycles_advance_and_not_while_the_service_thread_hangs(self):
        with abstract() as told:
            watched = {**told.environment, "WATCHDOG_USEC": "400000"}
            with hub("--demo", environment=watched) as serving:
                for _ in range(4):
                    told.next_of("WATCHDOG=1")
                with stopped(service_thread(serving.process.pid)):
                    told.count("WATCHDOG=1", 0.5)  # what was on its way, or of the cycles before
                    self.assertEqual(told.count("WATCHDOG=1", 1.5), 0)
                told.next_of("WATCHDOG=1")
                self.assertEqual(get(serving.port, "/healthz")[0], 503)
                self.assertIn(b"began no cycle", get(serving.port, "/healthz")[2])

    def test_is_not_fed_for_another_process(self):
        with abstract() as told:
            with hub(environment={**told.environment, "WATCHDOG_USEC": "200000", "WATCHDOG_PID": "1"}):
                told.next_of("READY=1")
                self.assertEqual(told.count("WATCHDOG=1", 0.5), 0)

    def test_that_cannot_be_told_is_named_and_it_serves_all_the_same(self):
        with hub(environment={"NOTIFY_SOCKET": "/nobody/is/here"}) as serving:
            serving.line(r"NOTIFY_SOCKET '/nobody/is/here' cannot be reached: No such file")
            self.assertEqual(get(serving.port, "/healthz")[0], 200)


class the_unit(unittest.TestCase):
    """Of contrib/systemd."""

    @classmethod
    def setUpClass(cls):
        if shutil.which("systemd-analyze") is None:
            raise unittest.SkipTest("there is no systemd-analyze (package systemd)")
        cls.text = UNIT.read_text()
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.path = f"{folder}/{UNIT.name}"
        # It looks for the program, which is not installed here.
        pathlib.Path(cls.path).write_text(re.sub(r"(?m)^ExecStart=rowe\b", f"ExecStart={ROWE}", cls.text))

    def analyze(self, *words):
        return subprocess.run(["systemd-analyze", "--no-pager", *words], capture_output=True, text=True,
                              timeout=timeout, check=False)

    def test_is_right_in_every_line(self):
        ended = self.analyze("verify", "--man=no", self.path)
        self.assertEqual((ended.returncode, ended.stdout, ended.stderr), (0, "", ""))

    def test_gives_no_more_than_it_must(self):
        ended = self.analyze("security", "--offline=true", "--threshold=20", self.path)  # in tenths
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)

    def allowed(self):
        """The names of the system calls that its filter lets through."""
        groups = {}
        for line in self.analyze("syscall-filter").stdout.splitlines():
            if line.startswith("@"):
                current = groups.setdefault(line.strip(), [])
            elif line.strip() and not line.strip().startswith("#"):
                current.append(line.strip())

        def names(word):
            if not word.startswith("@"):
                return {word}
            return set().union(*(names(one) for one in groups[word]))

        found = set()
        for value in re.findall(r"(?m)^SystemCallFilter=(.*)$", self.text):
            listed = set().union(*(names(word) for word in value.lstrip("~").split()))
            found = found - listed if value.startswith("~") else found | listed
        return found

    def test_permits_each_system_call_that_serving_makes(self):
        if shutil.which("strace") is None:
            self.skipTest("there is no strace")
        allowed = self.allowed()
        self.assertIn("sched_setscheduler", allowed)
        self.assertNotIn("keyctl", allowed)
        self.assertNotIn("chroot", allowed)
        with tempfile.TemporaryDirectory() as folder, abstract() as told:
            trace = pathlib.Path(f"{folder}/trace")
            watched = {**told.environment, "WATCHDOG_USEC": "200000",
                       "ASAN_OPTIONS": "detect_leaks=0"}  # whoever is traced cannot be searched for leaks
            with hub("--demo", "--listen", "0.0.0.0:0", "--insecure", environment=watched,
                     command=("strace", "-f", "-o", str(trace), ROWE)) as serving:
                with peer(serving.port) as p:
                    p.send({"op": "subscribe", "topic": "/odom"})
                    p.receive()
                    p.call("/rowe/stop")
                self.assertEqual(get(serving.port, "/metrics")[0], 200)
                told.next_of("WATCHDOG=1")
                os.kill(int(trace.read_text().split(maxsplit=1)[0]), signal.SIGTERM)  # not strace
                self.assertEqual(serving.end(), 0)
            made = set(re.findall(r"(?m)^\d+\s+(\w+)\(", trace.read_text()))
        self.assertIn("epoll_wait", made | {"epoll_wait" if "epoll_pwait2" in made else ""})
        self.assertEqual(made - allowed, set())


class the_log(unittest.TestCase):
    def test_is_json_if_asked(self):
        with hub("--log", "json") as serving:
            with self.subTest("an event"), connect(serving.port) as stream:
                stream.sendall(request("GET", "/", {"Host": 'evil.example"\\'}))
                self.assertEqual(read_answer(stream)[0], 400)
            serving.line(r'"event":"refused_handshake"')
            serving.end(signal.SIGTERM)
            lines = [json.loads(line) for line in serving.stderr]  # each of them
            told = next(line for line in lines if line.get("event") == "refused_handshake")
            self.assertEqual((told["severity"], told["program"]), ("notice", "rowe serve"))
            self.assertRegex(told["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            self.assertRegex(told["peer"], r"^127\.0\.0\.1:\d+$")
            self.assertIn("Host", told["what"])
            self.assertIn(told["what"], told["message"])
            self.assertTrue(told["remedy"])
            self.assertIn("loss: none", [line["message"] for line in lines])

    def test_has_priorities_where_journald_reads_it(self):
        read, write = os.pipe()
        is_ = os.fstat(write)
        for name, said in ((f"{is_.st_dev}:{is_.st_ino}", True), (f"{is_.st_dev}:1", False), ("", False)):
            with subprocess.Popen([ROWE, "serve", "--port", "0", "--listen", "127.0.0.1:0x"], stderr=write,
                                  env={**os.environ, "JOURNAL_STREAM": name}) as ended:
                self.assertEqual(ended.wait(timeout), 2)
            os.read(read, 4096)
            with subprocess.Popen([ROWE, "serve", "--port", "0"], stdout=subprocess.PIPE, stderr=write,
                                  env={**os.environ, "JOURNAL_STREAM": name}) as serving:
                serving.stdout.readline()
                serving.send_signal(signal.SIGTERM)
                self.assertEqual(serving.wait(timeout), 0)
            lines = [line for line in os.read(read, 65536).decode().splitlines() if not of_the_machine(line)]
            self.assertEqual({bool(re.match(r"<6>rowe serve: ", line)) for line in lines}, {said})
        os.close(read)
        os.close(write)

    def test_folds_what_repeats_and_counts_it(self):
        with hub() as serving:
            for _ in range(40):
                get(serving.port, headers={"Host": "evil.example"})
            serving.line(r"evil\.example.*\[and \d+ more like it in a second\]")

    def test_cannot_be_flooded(self):
        """A thousand requests that are refused, each for another name."""
        begin = time.monotonic()
        with hub() as serving:
            def attack(number):
                for i in range(250):
                    self.assertEqual(get(serving.port, headers={"Host": f"evil-{number}-{i}"})[0], 403)

            in_parallel(*(functools.partial(attack, number) for number in range(4)))
            counts = serving.summary()
            seconds = time.monotonic() - begin
            text = "\n".join(serving.stderr)
        self.assertEqual(counts["refused_handshakes"], 1000)
        lines = len(re.findall(r"Host evil", text))
        self.assertLessEqual(lines, 21 * (seconds + 2))
        without = sum(int(n) for n in re.findall(r"(\d+) other events? in a second got no line", text))
        more = sum(int(n) for n in re.findall(r"\[and (\d+) more", text))
        self.assertEqual(lines + without + more + counts["events_lost"], 1000)
        self.assertIn(f"log: {without} events got no line", text)


if __name__ == "__main__":
    unittest.main()
