# SPDX-License-Identifier: Apache-2.0
"""What becomes of each program's output where it cannot be written, and where nobody reads it."""
import contextlib
import os
import signal
import subprocess
import tempfile
import unittest

from program import ROWE, hub, of_the_machine, run, timeout, verbs, with_timeout
from recordings import message, record

folder = os.path.dirname(ROWE)
no_space = "rowe: cannot write to standard output: No space left on device (0 bytes written)"


def ended(command, stdout, until=None):
    """The exit code and the lines on stderr; `until`: the line after which it is told to end."""
    environment = {key: value for key, value in os.environ.items() if key != "ROWE_URL"}
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stdout, stderr=subprocess.PIPE, text=True,
                          env=environment) as running:
        lines = []
        for line in running.stderr:
            lines.append(line.rstrip("\n"))
            if until is not None and until in line:
                running.send_signal(signal.SIGTERM)
        code = running.wait(timeout=timeout)
    return code, [line for line in lines if not of_the_machine(line) and ": waiting for ws" not in line]


@contextlib.contextmanager
def closed_pipe():
    reading, writing = os.pipe()
    os.close(reading)
    yield writing
    os.close(writing)


class output(unittest.TestCase):
    """Of all verbs that `rowe help` lists, of each with --help, and of the other programs."""

    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))
        cls.folders = cls.enterClassContext(tempfile.TemporaryDirectory())
        # What each verb is asked so that it prints something.
        url, cls.made, new = cls.demo.url, *(os.path.join(cls.folders, name) for name in ("made", "new"))
        run("setup", "--name", "bot", "--dir", cls.made, code=0)
        cls.recording = os.path.join(cls.folders, "run.mcap")
        record(cls.recording, [message("/a", 0, {"n": 1})])
        cls.prints = {
            "actions": [(url, "--json")],
            "bench": [("idle", "-D", "100ms", "--json", "-")],
            "bw": [(url, "/odom", "--once")],
            "call": [(url, "/rosapi/topics"), (url, "/rosapi/topics", "--json"),
                     (url, "/rosapi/topics", "--repeat", "3")],
            "completion": [("bash",), ("zsh",), ("fish",)],
            "config": [("show",)],
            "delay": [(url, "/odom", "--once")],
            "discover": [],  # what is there is the network's
            "doctor": [("--quick",), ("--quick", "--json")],
            "echo": [(url,), (url, "/odom"), (url, "/odom", "--csv", "-n", "3")],
            "help": [(), ("echo",)],
            "hz": [(url, "/odom", "--once"), (url, "/odom", "--once", "--json")],
            "info": [(cls.recording,), (cls.recording, "--json"),
                     (url, "/odom", "--timeout", "60s"), (url, "/odom", "--json", "--timeout", "60s")],
            "list": [(url,), (url, "--json")],
            "man": [(), ("echo",)],
            "param": [("list", url, "--all")],
            "peers": [(url,), (url, "--json")],
            "plot": [(cls.recording, "--field", "/a:n", "--output", "-", "--format", kind)
                     for kind in ("svg", "png", "html")],
            "pub": [],
            "record": [],
            "replay": [],
            "reset": [(url,)],
            "serve": [],  # until it is told to end: below
            "services": [(url,)],
            "setup": [("--name", "bot", "--dir", new)],
            "stop": [(url,), (url, "--json")],
            "token": [("list", "--dir", cls.made)],
            "top": [(url, "--once", "--timeout", "60s")],
            "topics": [(url,)],
            "types": [(url,), (url, "--ros"), (url, "--json-schema")],
            "version": [(), ("--json",)],
        }

    def commands(self):
        self.assertEqual(set(self.prints), set(verbs()), "each verb says here what makes it print")
        for verb, some in self.prints.items():
            for arguments in some:
                yield [ROWE, *with_timeout((verb, *arguments))]
            yield [ROWE, verb, "--help"]
        yield from ([ROWE], [ROWE, "--help"], [ROWE, "--version"], [ROWE, "bench", "idle", "--help"])
        for name in ("rowe_echo", "rowe_echo_client"):
            yield [os.path.join(folder, name), "--help"]

    def test_that_cannot_be_written_is_told_once_with_how_much_was_and_is_a_failure(self):
        for command in self.commands():
            with open("/dev/full", "wb") as full, self.subTest(command=command):
                code, lines = ended(command, full)
                self.assertEqual(lines.count(no_space), 1, lines)
                self.assertNotIn(code, (0, 2), lines)

    def test_that_nobody_reads_is_no_failure_and_nothing_is_said(self):
        for command in self.commands():
            if "setup" in command and "--help" not in command:
                continue  # nobody has seen the tokens
            with closed_pipe() as unread, self.subTest(command=command):
                endless = command[1:3] == ["echo", self.demo.url]
                as_usual = 0 if endless else ended(command, subprocess.DEVNULL)[0]
                code, lines = ended(command, unread)
                self.assertEqual(code, as_usual, lines)
                self.assertNotRegex("\n".join(lines), "(?i)pipe|write")

    def test_of_tokens_that_nobody_saw_makes_none(self):
        made, new = self.made, os.path.join(self.folders, "newer")

        def settings():
            with open(os.path.join(made, "rowe.toml"), "rb") as file:
                return file.read()

        before, files, around = settings(), sorted(os.listdir(made)), sorted(os.listdir(self.folders))
        setup, token = [ROWE, "setup", "--name", "bot", "--dir"], [ROWE, "token", "add", "anna", "driver"]
        commands = [[*setup, new, *more] for more in ((), ("--quiet",), ("--qr", "--link", "peer"),
                                                      ("--save-tokens", "--keep-ca"))]
        commands += [[*setup, made, "--force"], [*token, "--dir", made], [*token, "--in-url", "--dir", made]]
        for command in commands:
            with open("/dev/full", "wb") as full, closed_pipe() as unread:
                for to in full, unread:
                    with self.subTest(command=command, to=to):
                        code, lines = ended(command, to)
                        self.assertEqual(code, 1, lines)
                        self.assertIn("could not be shown", lines[-1])
                        self.assertEqual(settings(), before)
                        self.assertEqual(sorted(os.listdir(made)), files)
                        self.assertEqual(sorted(os.listdir(self.folders)), around)

    def test_of_a_server_is_told_and_it_serves_all_the_same(self):
        echo = os.path.join(folder, "rowe_echo")
        for command in ([ROWE, "serve", "--port", "0"], [ROWE, "bench", "peer"], [echo]):
            with open("/dev/full", "wb") as full, self.subTest(command=command):
                code, lines = ended(command, full, until="cannot write")
                self.assertEqual((code, lines.count(no_space)), (1, 1), lines)

    def test_that_is_cut_short_says_how_much_was_written(self):
        limit = 10_000
        with tempfile.NamedTemporaryFile() as file:
            limited = ["prlimit", f"--fsize={limit}:{limit}"]
            code, lines = ended([*limited, ROWE, "echo", self.demo.url, "/odom", "--json"], file)
            self.assertEqual(code, 1, lines)
            self.assertEqual(os.path.getsize(file.name), limit)
            self.assertIn(f"rowe: cannot write to standard output: File too large ({limit} bytes written)",
                          lines)
            with open(file.name, encoding="utf-8") as text:
                whole = text.read().count("\n")
            self.assertRegex("\n".join(lines), rf"(?m)^rowe echo: {whole} messages?(, lost \d+)?$")

    def test_that_nobody_asked_for_does_not_go_to_a_peer(self):
        """Where stdout is closed, its number would be the next socket's."""
        for closed in ([1], [0, 1], [0, 1, 2]):
            shut = " ".join(f"{number}>&-" for number in closed)
            echo = [ROWE, "echo", self.demo.url, "/odom", "-n", "3"]
            done = subprocess.run(["sh", "-c", f'exec "$0" "$@" {shut}', *echo], check=False, text=True,
                                  stderr=subprocess.PIPE, timeout=timeout)
            self.assertEqual(done.returncode, 1, (closed, done.stderr))
            if 2 not in closed:
                self.assertIn("standard output: Bad file descriptor (0 bytes written)", done.stderr)

    def test_for_people_that_cannot_be_written_is_a_failure(self):
        with open("/dev/full", "wb") as full:
            done = subprocess.run([ROWE, "echo", self.demo.url], check=False, stdout=subprocess.PIPE,
                                  stderr=full, timeout=timeout)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"/odom", done.stdout)


if __name__ == "__main__":
    unittest.main()
