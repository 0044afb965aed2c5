# SPDX-License-Identifier: Apache-2.0
"""`rowe stop` and `rowe reset`: of the demo robot, of robots that do not acknowledge, do not answer, have no
stop or are not there; what each says, and the exit code that means the same."""
import contextlib
import json
import os
import re
import signal
import tempfile
import threading
import unittest

from program import given_time, hub, program, run, undisturbed
from websocket import PING, ask_in_time, closed, connect, listener, peer, refused

acknowledged = re.compile(r"^stop acknowledged by \S+ in \d+(\.\d)? (µs|ms|s)"
                          r" \(send [\d.]+ (µs|ms), service [\d.]+ (µs|ms), return [\d.]+ (µs|ms)\)$")


def state_of(url):
    ended = run("call", url, "/rowe/stop/state")
    assert ended.code == 0, ended.stderr
    return json.loads(ended.stdout[0])


class answering:
    """A rosbridge server that answers each service as it is told: a function from a call's arguments to
    values, or None for no answer. What is not named does not exist."""

    def __init__(self, there, services):
        self.there, self.services, self.asked = there, services, []
        self.thread = threading.Thread(target=self.serve, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.thread.join()

    def serve(self):
        with contextlib.suppress(closed, OSError), self.there.accept() as p:
            while True:
                call = p.called()
                self.asked.append(call)
                name = call["service"]
                answer = self.services.get(name)
                values = answer(call.get("args", {})) if answer else f"Service {name} does not exist"
                if values is not None:
                    p.answer(call, values, answer is not None)


def stopped(**more):
    return lambda _: {"state": "stopped", "number": 8, "cause": "request", "source": "x",
                      "accepted_ns": "1000000", "observed_ns": "1340000", **more}


class the_demo_robot(unittest.TestCase):
    @undisturbed
    def test_stops_and_acknowledges(self):
        with hub("--demo") as robot:
            robot.line("the robot drives unguarded")
            self.assertEqual(state_of(robot.url)["state"], "running")
            ended = run("stop", robot.url, "--source", "a \"test\"", "--reason", "to see it stand")
            self.assertEqual((ended.code, len(ended.stdout)), (0, 1), ended.stderr)
            self.assertRegex(ended.stdout[0], acknowledged)
            robot.line("stopped: request, by 'a \"test\"', 'to see it stand'")
            state = state_of(robot.url)
            self.assertEqual((state["state"], state["cause"], state["source"]),
                             ("stopped", "request", 'a "test"'))
            self.assertGreaterEqual(state["since_ms"], 0)
            with program("echo", robot.url, "/odom", "--json", "--field", "twist.twist.linear.x") as echo:
                count = 1
                while float(echo.lines(count)[count - 1]) != 0:
                    count += 100
                echo.end(signal.SIGINT)

    @undisturbed
    def test_is_let_go_by_the_number_that_was_shown(self):
        with hub("--demo") as robot:
            robot.line("the robot drives unguarded")
            ended = run("stop", robot.url, "--source", "first")
            (number,) = re.findall(rf"rowe reset {robot.url} (\d+)$", ended.stderr[-1])
            run("reset", robot.url, code=1, prints=rf"^stopped by first .* ago, number {number}$")
            self.assertEqual(run("stop", robot.url, "--source", "second", "-q").code, 0)
            late = run("reset", robot.url, number, code=1, stdout=[], last="NOT reset: ")
            self.assertIn("stopped by second", late.stderr[-1])
            (newest,) = re.findall(r"number (\d+)$", late.stderr[-1])
            run("reset", robot.url, newest, code=0, stdout=["reset: the robot may move"])
            run("reset", robot.url, code=0, prints=r"^running, number \d+$")

    @undisturbed
    def test_stands_where_it_is_to_be_guarded_and_nobody_does(self):
        with hub("--demo", "--guarded") as robot:
            robot.line("stays stopped until a page guards it")
            state = state_of(robot.url)
            self.assertEqual((state["state"], state["cause"], state["unguarded"], state["guards"]),
                             ("stopped", "start", False, []))
            run("reset", robot.url, str(state["number"]), code=1, last="NOT reset: nobody guards the robot")
            self.assertRegex(run("reset", robot.url).stdout[0], r"^stopped since it started, .* ago, number ")

    @undisturbed
    def test_tells_programs(self):
        members = ["robot", "acknowledged", "number", "round_trip_ns", "send_ns", "service_ns", "return_ns",
                   "error", "text"]
        with hub("--demo", "--name", "ang-01") as robot:
            robot.line("the robot drives unguarded")
            ended = run("stop", robot.url, "--json", "-q")
            self.assertEqual((ended.code, ended.stderr, len(ended.stdout)), (0, [], 1))
            told = json.loads(ended.stdout[0])
            self.assertEqual(list(told), members)
            self.assertEqual((told["robot"], told["acknowledged"], told["error"]), ("ang-01", True, None))
            self.assertEqual(told["send_ns"] + told["service_ns"] + told["return_ns"], told["round_trip_ns"])
            self.assertTrue(all(value >= 0 for name, value in told.items() if name.endswith("_ns")))
            self.assertEqual(told["number"], state_of(robot.url)["number"])

    @undisturbed
    def test_says_how_to_let_it_go_with_the_options_that_it_was_given(self):
        with hub("--demo") as robot, tempfile.TemporaryDirectory() as folder:
            token = os.path.join(folder, "my token")
            with open(token, "w", encoding="ascii") as file:
                file.write("x" * 43)
            for ended in (run("stop", robot.url, "--token-file", token),
                          run("reset", robot.url, "--token-file", token)):
                words = f"to reset it: rowe reset {robot.url} [0-9]+ --token-file '{re.escape(token)}'$"
                self.assertTrue([line for line in ended.stderr if re.search(words, line)], ended.stderr)

    def test_is_asked_again_and_again_and_never_reset(self):
        members = ["robot", "stops", "acknowledged", "not_observed", "timed_out", "failed", "over_max",
                   "min_ns", "p50_ns", "p99_ns", "max_ns", "max_at_utc"]
        with hub("--demo") as robot:
            robot.line("the robot drives unguarded")
            ended = run("stop", robot.url, "--repeat", "200", "--max", "1h", "--json", "-q")
            self.assertEqual((ended.code, ended.stderr), (0, []))
            told = json.loads(ended.stdout[0])
            self.assertEqual(list(told), members)
            self.assertEqual(list(told.values())[1:7], [200, 200, 0, 0, 0, 0])
            times = list(told.values())[7:11]
            self.assertEqual(times, sorted(times))
            self.assertRegex(told["max_at_utc"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            state = state_of(robot.url)
            self.assertEqual(state["state"], "stopped")
            self.assertEqual(int(robot.summary()["stops"]), 200)

    @undisturbed
    def test_that_took_too_long_is_5_with_the_worst_one_and_when_it_was(self):
        with hub("--demo", "--name", "ang-01") as robot:
            robot.line("the robot drives unguarded")
            ended = run("stop", robot.url, "--repeat", "20", "--max", "1us", code=5)
            self.assertRegex(ended.stdout[0], r"^20 stops: 20 acknowledged by ang-01, 0 accepted only, 0 not "
                                              r"answered, 0 failed; min .*, max .* at \d{4}-.*Z$")
            self.assertRegex("\n".join(ended.stderr),
                             r"20 of 20 took longer than 1 µs; the worst, the \d+\. of them, .* at \d{4}-.*Z")
            self.assertEqual(run("stop", robot.url, "--max", "1us", "-q").code, 5)


class robots(unittest.TestCase):
    def stop(self, services, *arguments):
        with listener() as there, program("stop", there.url, *arguments) as asking:
            with answering(there, services) as robot:
                asking.code = asking.end()
        asking.asked = robot.asked
        return asking

    def test_whose_clock_is_another_tell_only_what_it_took_inside(self):
        ended = self.stop({"/rowe/stop": stopped(), "/rowe/stats": lambda _: {"name": "far"}})
        ended.expect(0, prints=r"^stop acknowledged by far in .* \(service 340 µs, there and back .*\)$")

    def test_that_do_not_say_their_name_are_told_by_their_url(self):
        ended = self.stop({"/rowe/stop": stopped()}, "--json")
        self.assertEqual(ended.code, 0, ended.stderr)
        self.assertIsNone(json.loads(ended.stdout[0])["robot"])

    def test_whose_loops_do_not_acknowledge_are_1_and_the_loops_are_named(self):
        def state(_):
            return {"state": "stopped", "number": 8, "loops": [{"name": "base", "acknowledged": 8},
                                                               {"name": "arm", "acknowledged": 7}]}
        services = {"/rowe/stop": stopped(observed_ns=None), "/rowe/stop/state": state}
        ended = self.stop(services)
        self.assertEqual(ended.code, 1, ended.stderr)
        self.assertRegex(ended.stdout[0],
                         r"^stop NOT acknowledged within .*: ws://\S+ accepted it, but not its loops: arm$")
        self.assertIn("use its wired emergency stop", ended.stderr[-1])
        ended = self.stop(services, "--json")
        told = json.loads(ended.stdout[0])
        self.assertEqual((ended.code, told["acknowledged"], told["error"]), (1, False, "not_observed"))
        ended = self.stop(services, "--repeat", "5")
        ended.expect(1, prints="^5 stops: 0 acknowledged by .*, 5 accepted only, ")

    def test_that_do_not_answer_are_4(self):
        ended = given_time(lambda time: self.stop({"/rowe/stop": lambda _: None}, "--timeout", time),
                           lambda ended: ended.code != 3, 0.02)
        ended.expect(4, prints=r"^stop NOT acknowledged within [\d.]+ m?s: ws://\S+ is connected, but "
                               r"does not answer$")

    def test_without_a_stop_are_1(self):
        with hub() as none:
            for arguments in (), ("--repeat", "2", "--json"):
                ended = run("stop", none.url, *arguments, code=1)
                told = ended.stdout[0] if not arguments else ended.stderr[0]
                self.assertIn(f"stop NOT acknowledged: {none.url} has no stop configured", told)
            run("reset", none.url, code=1, stdout=[], last="has no stop configured")

    def test_that_are_not_there_are_3_and_never_silent(self):
        run("stop", "127.0.0.1:1", "--timeout", "20ms", code=3,
            prints=r"^stop NOT acknowledged within 20 ms: ws://127\.0\.0\.1:1 unreachable since [\d.]+ m?s$")
        told = json.loads(run("stop", "127.0.0.1:1", "--timeout", "20ms", "--json").stdout[0])
        self.assertEqual((told["acknowledged"], told["error"]), (False, "unreachable"))
        self.assertEqual(run("reset", "127.0.0.1:1", "--timeout", "300ms").code, 3)

    def test_that_go_away_meanwhile_are_3(self):
        with listener() as there, program("stop", there.url, "--timeout", "50s") as asking:
            with there.accept() as p:
                p.called()
            self.assertEqual(asking.end(), 3)
            self.assertIn("was lost before the answer came", asking.stdout[0])

    def test_of_a_stranger_do_not_reach_the_terminal_as_control_characters(self):
        hostile = {"/rowe/stop": stopped(number="8\x1b[2J", observed_ns=None),
                   "/rowe/stop/state": lambda _: {"loops": [{"name": "\x1b[2J", "acknowledged": 1}]},
                   "/rowe/stats": lambda _: {"name": "\x1b\x9b"}}
        for how in (), ("--json",):
            ended = self.stop(hostile, *how)
            self.assertEqual(ended.code, 1)
            self.assertIsNone(re.search("[\x1b\x9b]", "\n".join(ended.stdout + ended.stderr)))

    def test_are_told_who_stops_and_why(self):
        ended = self.stop({"/rowe/stop": stopped()}, "--source", "CI", "--reason", "nightly")
        self.assertEqual(ended.asked[0]["args"], {"source": "CI", "reason": "nightly"})

    def test_are_asked_whatever_is_said_of_it(self):
        ended = self.stop({"/rowe/stop": stopped()}, "--source", b"\xff" * 5000, "--reason", "\u00e9" * 5000)
        self.assertEqual(ended.code, 0, ended.stderr)
        self.assertEqual(ended.asked[0]["args"], {"source": "\ufffd" * 250, "reason": "\u00e9" * 125})

    def test_that_answer_too_much_are_1_and_it_is_said_why(self):
        ended = self.stop({"/rowe/stop": stopped(source="x" * 8000)})
        ended.expect(1, prints=r"^stop NOT acknowledged: .*\d")


class full(unittest.TestCase):
    """Robots that take no further connection: 10 of 12 are anybody's, and 32 handshakes."""

    ordinary_max, handshakes_max, kept = 10, 32, 2

    @contextlib.contextmanager
    def robot(self):
        with hub("--demo", "--limit", "connections_max=12") as robot, contextlib.ExitStack() as held:
            robot.line("the robot drives unguarded")
            robot.peers = [held.enter_context(peer(robot.port)) for _ in range(self.ordinary_max)]
            robot.held = held
            with self.assertRaisesRegex(refused, "503"):
                peer(robot.port)
            yield robot

    def stops(self, robot):
        for one in robot.peers:  # or they would be cut after 8 s
            one.send_frame(PING)
        ended = run("stop", robot.url, "--source", "hand", code=0)
        said = "\n".join(ended.stderr)
        self.assertIn(f"asking on {robot.url}rowe/stop, where places are reserved for a stop", said)
        self.assertLessEqual(said.count("the other side has no room"), 1, said)
        self.assertRegex(ended.stdout[0], acknowledged)

    @undisturbed
    def test_are_stopped_all_the_same(self):
        with self.robot() as robot:
            idle = [robot.held.enter_context(peer(robot.port, path="/rowe/stop")) for _ in range(self.kept)]
            for _ in range(self.handshakes_max):
                robot.held.enter_context(connect(robot.port)).sendall(b"GET /rowe/stop HTTP/1.1\r\n")
            self.stops(robot)
            robot.line("stopped: request")
            self.assertEqual(idle[0].wait_for_close(), 1013)
            counts = robot.summary()
            self.assertGreaterEqual(int(counts["handshakes_evicted"]), 1)
            self.assertGreaterEqual(int(counts["stop_peers_displaced"]), 1)

    @undisturbed
    def test_are_stopped_though_others_want_the_places_again_and_again(self):
        with self.robot() as robot:
            over = threading.Event()

            def come_again():
                while not over.is_set():
                    with contextlib.suppress(refused, closed, OSError), peer(robot.port, path="/rowe/stop"):
                        pass

            crowd = [threading.Thread(target=come_again, daemon=True) for _ in range(4)]
            for one in crowd:
                one.start()
            try:
                self.stops(robot)
            finally:
                over.set()
                for one in crowd:
                    one.join()

    @undisturbed
    def test_may_be_asked_what_they_do_but_nothing_else(self):
        with self.robot() as robot, peer(robot.port, path="/rowe/stop") as p:
            self.assertEqual(p.call("/rowe/stop/state")["values"]["state"], "running")
            p.send({"op": "subscribe", "topic": "/odom"})
            said = p.receive_until(lambda m: m["op"] == "status")["msg"]
            self.assertIn("may only stop the robot", said)


class guards(unittest.TestCase):
    @undisturbed
    def test_that_went_away_are_named(self):
        with hub("--demo") as robot:
            robot.line("the robot drives unguarded")
            with peer(robot.port) as guard:
                self.assertIsNone(ask_in_time(guard, "/rowe/stop/guard", guard="desk")["refused"])
            robot.line("stopped: guard")
            shown = run("reset", robot.url,
                        prints=r"^stopped: the guard desk fell silent or went away .* ago, number ")
            number = shown.stdout[0].split()[-1]
            run("reset", robot.url, number, code=1, first="NOT reset: a guard is silent: desk",
                last="/rowe/stop/guard")
            run("call", robot.url, "/rowe/stop/guard", '{"guard":"desk","resign":true}', code=0)
            self.assertEqual(run("reset", robot.url, number).code, 0)


class arguments(unittest.TestCase):
    def test_that_make_no_sense_are_named(self):
        for words, says in ((("stop",), "the argument URL is missing"),
                            (("stop", "ws://127.0.0.1:1", "--max", "5"), "--max"),
                            (("stop", "ws://127.0.0.1:1", "--repeat", "0"), "out of range"),
                            (("reset", "ws://127.0.0.1:1", "x"), "NUMBER is a whole number, not 'x'"),
                            (("serve", "--guarded"), "--guarded is for the robot of serve.demo, or --demo")):
            run(*words, code=2, stdout=[], says=says)


if __name__ == "__main__":
    unittest.main()
