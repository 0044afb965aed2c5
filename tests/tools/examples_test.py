# SPDX-License-Identifier: Apache-2.0
"""The documentation's programs, started, listened to and ended as a reader would; from ROWE_EXAMPLES."""
import contextlib
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from program import hub, program, run, timeout

folder = os.environ["ROWE_EXAMPLES"]
port = 8080  # what the documentation says


def example(name, *arguments, before=(), **options):
    return program(*arguments, command=(*before, os.path.join(folder, name)), **options)


def says(*how, code, stderr):
    """What a program says that has nothing else to do."""
    with example(*how) as ended:
        ended.end()
        ended.expect(code, stderr=stderr)


@contextlib.contextmanager
def listening(*how):
    """One that prints the port it listens on, at `url`, and does not catch SIGTERM."""
    with example(*how) as robot:
        robot.port = robot.line(r"listening on port (\d+)", "stdout")[1]
        robot.url = "ws://127.0.0.1:" + robot.port
        yield robot
        assert robot.end(signal.SIGTERM) == -signal.SIGTERM, robot.stderr


def stop_acknowledged(url):
    """The run of `rowe stop` that did so, where a busy machine keeps a loop from it for a while."""
    return until(lambda: run("stop", url), lambda it: "but not its loops" not in it.stdout[0]).expect(0)


def may_run_on(cpu):
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {cpu})
    except OSError:
        return False
    os.sched_setaffinity(0, before)
    return True


def until(attempt, right):
    """attempt() again until it is right(it), where a busy machine keeps a program longer than it waits."""
    end = time.monotonic() + timeout
    while not right(got := attempt()) and time.monotonic() < end:
        pass
    return got


class drive(unittest.TestCase):
    def test_is_driven_until_the_commands_end(self):
        with listening("drive", "0") as robot:
            robot.line("braking", "stdout")
            command = '{"linear":{"x":5},"angular":{}}'

            def drives():
                """Whether it did so, once it may move. `rowe pub` has no ticks: its first ones do nothing."""
                shown = run("reset", robot.url)
                if shown.code != 0:
                    run("reset", robot.url, shown.stdout[0].split()[-1])
                run("pub", robot.url, "/cmd_vel", command, "-r", "20Hz", "-n", "20")
                return any(line.startswith("driving") for line in robot.stdout)

            self.assertTrue(until(drives, bool), robot.stdout)
            self.assertNotIn("driving at 5.00", robot.stdout)  # the parameter says how fast it may go
            self.assertIn("driving at 0.50", robot.stdout)
            before = robot.stdout[:robot.stdout.index("driving at 0.50")]
            robot.line("standing still", "stdout", 1 + sum(line.startswith("standing") for line in before))

    def test_says_how_it_is_used(self):
        for how in ((), ("x",), ("70000",), ("0", "1")):
            says("drive", *how, code=2, stderr=["usage: drive PORT; a port is a number from 0 to 65535"])


class types(unittest.TestCase):
    def lines(self, form):
        return run(form, command=(os.path.join(folder, "types"),), code=0, stderr=[]).stdout

    def test_prints_what_a_page_a_validator_and_ros_read(self):
        self.assertIn('    mode: "off" | "manual" | "automatic";', self.lines("typescript"))
        schema = json.loads("\n".join(self.lines("json-schema")))
        self.assertEqual(schema["title"], "my_robot/State")
        self.assertEqual(schema["properties"]["uptime"]["description"], "milliseconds")
        header, mode, *_ = self.lines("ros")
        self.assertEqual((header, mode[:19]), ("std_msgs/Header header", "string mode # off, "))

    def test_says_how_it_is_used(self):
        says("types", "xml", code=2, stderr=["usage: types typescript|json-schema|ros"])


class control_loop(unittest.TestCase):
    def setUp(self):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                self.skipTest(f"port {port} is in use by another program")

    def check(self, **options):
        with example("control_loop", **options) as robot:
            ended = run("echo", f"ws://127.0.0.1:{port}", "/odom", "-n", "100", "--json", "--timeout", "60s")
            # 6: some were lost, on a machine that is too busy to print them.
            self.assertIn(ended.code, (0, 6), (ended.stderr, robot.said))
            self.assertEqual(robot.end(signal.SIGINT), 0)
            self.assertEqual(robot.said["stdout"], [])
            service, granted = robot.said["stderr"]
            self.assertRegex(service, "^service thread: .*cpu 0")
            self.assertTrue(granted.startswith("control loop: "), granted)
            self.assertIn("pinned to cpu 1" if may_run_on(1) else
                          "cpu 1 does not exist or is not allowed to this process: see `taskset -p`", granted)
            self.assertIn("SCHED_FIFO 80", granted)  # or what is to be done for it
        messages = [json.loads(line) for line in ended.stdout]
        self.assertEqual(list(messages[0]), ["stamp", "x", "y", "heading", "speed"])
        for m in messages:
            self.assertAlmostEqual(math.hypot(m["x"], m["y"]), 1)
            self.assertAlmostEqual(math.cos(m["heading"]), -m["y"])
            self.assertAlmostEqual(math.sin(m["heading"]), m["x"])
            self.assertEqual(m["speed"], 0.5)
        stamps = [m["stamp"] for m in messages]
        self.assertEqual(stamps, sorted(set(stamps)))

    def test_publishes_what_it_measures(self):
        self.check()

    def test_says_that_its_port_is_taken(self):
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            other.bind(("127.0.0.1", port))
            other.listen()
            says("control_loop", code=1, stderr=[f"port {port} is in use by another program"])

    def test_does_so_when_started_on_one_core(self):
        if shutil.which("taskset") is None:
            self.skipTest("there is no taskset")
        self.check(before=("taskset", "-c", "0"))


class listen(unittest.TestCase):
    def test_prints_the_messages_of_a_robot(self):
        with hub("--demo") as robot, example("listen", robot.url, "/odom") as there:
            numbers = [json.loads(line)["header"]["seq"] for line in there.lines(50)[:50]]
            self.assertEqual(numbers, sorted(set(numbers)))
            self.assertEqual(there.end(signal.SIGTERM), -signal.SIGTERM)

    def test_says_how_it_is_used(self):
        says("listen", code=2, stderr=["usage: listen URL TOPIC"])


class answer(unittest.TestCase):
    setUp = control_loop.setUp

    def test_answers_by_either_codec_and_refuses_with_its_sentence(self):
        url = f"ws://127.0.0.1:{port}"
        with example("answer") as robot:
            for codec in ([], ["--plain"]):
                # It can be reached a moment before it provides its service.
                asked = until(lambda how=codec: run("call", url, "/set_speed", '{"speed":0.5}', *how),
                              lambda ended: "nobody provides it" not in "\n".join(ended.stderr))
                self.assertEqual((asked.code, json.loads(asked.stdout[0])["speed"]), (0, 0.5), asked.stderr)
            run("call", url, "/set_speed", '{"speed":5}', code=1, stdout=[], last="at most 1 m/s")
            self.assertEqual(robot.end(signal.SIGTERM), -signal.SIGTERM)


class add_two_numbers(unittest.TestCase):
    def ask(self, url):
        def once():
            with example("add_two_numbers", url, "38", "4") as asking:
                asking.code = asking.end()
            return asking

        return until(once, lambda asking: "nothing happened" not in "\n".join(asking.stderr))

    def test_is_answered_by_the_robot_in_c(self):
        with listening("robot", "0") as server:
            self.ask(server.url).expect(0, stdout=["38 + 4 = 42"])

    def test_says_why_it_has_no_answer(self):
        with hub() as nobody:
            self.ask(nobody.url).expect(1, stderr=["nobody provides the service"])


class stop(unittest.TestCase):
    def reset(self, url):
        shown = run("reset", url)
        if shown.code != 0:  # it does not run already
            run("reset", url, shown.stdout[0].split()[-1])

    def check(self, *how):
        with listening(*how) as robot:
            robot.line("braking", "stdout")  # it starts stopped
            # Where its loop or its service thread is late it stops by itself, and answers without the loop.
            until(lambda: self.reset(robot.url), lambda _: "driving" in robot.stdout)
            self.assertIn("driving", robot.stdout)
            self.assertIn("stop acknowledged by ", stop_acknowledged(robot.url).stdout[0])
            run("reset", robot.url, code=1)
            robot.line("braking", "stdout", robot.stdout.count("driving") + 1)

    def test_is_obeyed_by_a_loop(self):
        self.check("stop", "0", "unguarded")

    def test_is_obeyed_by_a_loop_in_c(self):
        self.check("stop_in_c", "0")

    def test_is_obeyed_by_a_loop_of_structs_in_c(self):
        with example("control_loop_in_c", "0") as robot:
            url = "ws://127.0.0.1:" + robot.line(r"listening on port (\d+)", "stdout")[1]
            asked = until(lambda: run("call", url, "/set_speed", '{"speed":5}'),
                          lambda ended: ended.code == 0)
            self.assertEqual((asked.code, json.loads(asked.stdout[0])), (0, {"taken": False}), asked.stderr)
            run("call", url, "/set_speed", '{"speed":"fast"}', code=1,
                last='the member "speed" must be a number')

            def drives(speed, *change):
                """Whether it says so, once it may move and was told."""
                self.reset(url)
                run(*change)
                said = run("echo", url, "/odom", "--once", "--json")
                return said.code == 0 and json.loads(said.stdout[0])["speed"] == speed

            self.assertTrue(until(lambda: drives(1.5, "call", url, "/set_speed", '{"speed":1.5}'), bool))
            self.assertTrue(until(lambda: drives(-1, "pub", url, "/command", '{"speed":-1}'), bool))
            stop_acknowledged(url)
            self.assertEqual(robot.end(signal.SIGTERM), 0)

    def test_takes_no_port_that_there_is_not(self):
        for name in ("control_loop_in_c", "stop", "stop_in_c", "your_own_robot"):
            for port in ("70000", "-1", "abc", "", "80x"):
                says(name, port, code=2, stderr=[f"a port is a number from 0 to 65535, not '{port}'"])

    def test_of_a_robot_that_nobody_guards_is_not_reset(self):
        with listening("stop", "0") as robot:
            robot.line("braking", "stdout")
            number = run("reset", robot.url).stdout[0].split()[-1]
            run("reset", robot.url, number, code=1)

    def test_says_how_it_is_used(self):
        for name, usage in (("stop", "usage: stop PORT [unguarded]"), ("stop_in_c", "usage: stop_in_c PORT"),
                            ("control_loop_in_c", "usage: control_loop_in_c PORT")):
            says(name, code=2, stderr=[usage])


class your_own_robot(unittest.TestCase):
    """What docs/your-own-robot.md says that one may try."""

    @contextlib.contextmanager
    def started(self):
        with example("your_own_robot", "0") as robot:
            self.url = robot.line(r"http://(127\.0\.0\.1:\d+)/", "stdout")[1]
            robot.line("^control loop: ", "stdout")
            robot.line(r"^stop: loop_timeout \d+ ms \(.*\), service_timeout \d+ ms \(.*\)$", "stdout")
            yield robot
            self.assertEqual(robot.end(signal.SIGINT), 0)
            self.assertEqual(robot.stdout[-1], "stopped")

    def state(self):
        ended = run("echo", self.url, "/state", "--json", "--once", code=0)
        return json.loads(ended.stdout[0])

    def drive(self, message):
        return run("pub", self.url, "/cmd_vel", message, "-r", "50", "-n", "10", "--type",
                   "geometry_msgs/Twist")

    def test_publishes_its_state_and_ends_at_ctrl_c(self):
        with self.started():
            self.assertEqual(list(self.state()), ["stamp", "x", "y", "heading", "speed"])

    def test_drives_as_it_is_told_once_it_was_reset_and_stops(self):
        with self.started():
            self.assertEqual(self.drive('{"linear":{"x":0.3}}').code, 0)
            self.assertEqual(self.state()["x"], 0)  # it is stopped

            def driven():
                stop.reset(self, self.url)
                self.assertEqual(self.drive('{"linear":{"x":0.3}}').code, 0)
                return self.state()["x"]

            # Where its loop or its service thread is late it stops by itself.
            self.assertGreater(until(driven, lambda x: x > 0), 0)
            self.drive('{"linear":{"x":"fast"}}').expect(1, says='the member "linear.x" must be a number')
            self.assertIn("stop acknowledged by my-robot in ", stop_acknowledged(self.url).stdout[0])
            self.assertEqual(self.state()["speed"], 0)

    def test_answers_and_refuses(self):
        with self.started():
            answered = run("call", self.url, "/set_place", '{"x":1,"y":2,"heading":0}')
            self.assertEqual(json.loads(answered.stdout[0]), {"x": 1, "y": 2, "heading": 0}, answered.stderr)
            self.assertEqual(self.state()["y"], 2)
            run("call", self.url, "/set_place", '{"x":1000,"y":0,"heading":0}', code=1,
                last="at most 100 m from here")

    def test_has_a_parameter(self):
        with self.started():
            self.assertEqual(run("param", "list", self.url).stdout, ["/speed_max 0.5"])
            run("param", "list", self.url, "--json", code=0, stdout=['{"name":"/speed_max","value":0.5}'])
            run("param", "get", self.url, "/sped_max", code=1, says="; did you mean /speed_max?")
            self.assertEqual(run("param", "set", self.url, "/speed_max", "0.2").code, 0)
            run("param", "set", self.url, "/speed_max", "3", code=1,
                last="it is 3; a number from 0 to 2 is wanted")
            self.assertEqual(run("param", "get", self.url, "/speed_max").stdout, ["0.2"])

    def test_says_that_its_port_is_taken(self):
        with self.started():
            taken = self.url.rpartition(":")[2]
            says("your_own_robot", taken, code=1, stderr=[f"port {taken} is in use by another program"])


class robot(unittest.TestCase):
    def test_two_of_them_talk_and_add(self):
        with listening("robot", "0") as server:
            with example("robot", "127.0.0.1", server.port) as client:
                client.line(r"38 \+ 4 = 42", "stdout", 2)
                client.line("the other one is at", "stdout", 10)
                server.line("the other one is at", "stdout", 10)
                self.assertEqual(client.end(signal.SIGTERM), -signal.SIGTERM)
                self.assertEqual(client.said["stderr"], [])

    def test_goes_on_without_a_server_and_says_so(self):
        with socket.socket() as unused:
            unused.bind(("127.0.0.1", 0))  # nobody listens there
            with example("robot", "127.0.0.1", str(unused.getsockname()[1])) as client:
                client.line("nothing happened within", "stdout", 2)
                self.assertEqual(client.end(signal.SIGTERM), -signal.SIGTERM)

    def test_says_how_it_is_used_and_what_is_wrong(self):
        says("robot", code=2, stderr=["usage: robot PORT | robot HOST PORT"])
        says("robot", "65536", code=1, stderr=["the argument port is out of range: 65536 (limit 65535)"])


class record(unittest.TestCase):
    def test_has_a_file_of_all_and_one_of_its_black_box(self):
        with tempfile.TemporaryDirectory() as there:
            with example("record", there) as robot:
                robot.end()
                robot.expect(0, prints=r"^\d+ messages, 0 lost$")
            files = [name for name in os.listdir(there) if name.endswith(".mcap")]
            boxes = os.listdir(os.path.join(there, "black_box"))
            self.assertEqual((len(files), len(boxes)), (1, 1))
            self.assertIn("-asked_", boxes[0])

    def test_says_how_it_is_used_and_what_is_wrong(self):
        says("record", code=2, stderr=["usage: record FOLDER"])
        says("record", "/proc/nowhere", code=1, stderr=["/proc/nowhere/: No such file or directory"])


class configured(unittest.TestCase):
    def test_listens_as_the_file_and_the_environment_say(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write('[endpoint]\nport = 1\nname = "a file"\n')
            file.flush()
            with example("configured", file.name, stdin=subprocess.PIPE,
                         environment={"ROWE_ENDPOINT_PORT": "0"}) as robot:
                url = robot.line(r"ws://\S+", "stdout")[0]
                run("echo", url, "/battery", "--once", "--json", code=0, stdout=['{"percent":83}'])
                robot.process.stdin.close()
                self.assertEqual(robot.end(), 0)

    def test_says_what_is_wrong_and_where(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("[endpoint]\nport = 70000\n")
            file.flush()
            says("configured", file.name, code=2,
                 stderr=[f"{file.name}:2: endpoint.port is out of range: 70000 (0 to 65535)"])


if __name__ == "__main__":
    unittest.main()
