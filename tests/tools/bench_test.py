# SPDX-License-Identifier: Apache-2.0
"""`rowe bench`, each mode for a moment as a user runs it: against a peer of its own and one that runs
already, what it says, writes and ends with. Times are bounded from below only."""
import contextlib
import json
import os
import re
import select
import signal
import tempfile
import threading
import unittest
import xml.etree.ElementTree

from program import program, run

short = ("-D", "200ms", "--warm-up", "10ms")
patient = ("--timeout", "10s")  # what a starved machine loses is waited for until then
latencies = ["min_ns", "p50_ns", "p90_ns", "p99_ns", "p99_9_ns", "p99_99_ns", "max_ns"]


def let_pass(seconds):
    """For a measurement to have samples, and for a stall to have its length: that is the thing itself."""
    threading.Event().wait(seconds)


def given_time(attempt, measured_enough):
    """What attempt(SECONDS) returns, which interrupts a measurement after so long: again with more of them
    until that was enough. When a busy machine lets it begin to measure, nobody knows."""
    for seconds in (0.5, 2, 8, 20):
        got = attempt(seconds)
        if measured_enough(got):
            break
    return got


def measured(*arguments):
    """Runs a mode with --json -; returns its object, and the program."""
    timeout = patient if arguments[0] in ("rpc", "send", "stop") else ()
    ended = run("bench", *arguments, *timeout, "--json", "-")
    if len(ended.stdout) != 1:
        raise AssertionError((arguments, ended.code, ended.stdout, ended.stderr))
    return json.loads(ended.stdout[0]), ended


@contextlib.contextmanager
def standing_peer():
    with program("bench", "peer") as peer:
        yield peer, peer.line(r"^rowe bench peer at (ws://\S+) \(process \d+\)$", "stdout")[1]
        if peer.process.poll() is None:
            code = peer.end(signal.SIGTERM)
            assert code == 0, (code, peer.stderr)


class modes(unittest.TestCase):
    def holds(self, told, ended, samples_min):
        self.assertEqual(ended.code, told["exit_code"], ended.stderr)
        self.assertIn(ended.code, (0, 4), (ended.stderr, told))  # 4: a starved machine
        self.assertGreaterEqual(told["samples"], samples_min)
        self.assertEqual(told["samples"], told["intended"])
        self.assertEqual(told["finished"] + told["failed"] + told["unfinished"], told["intended"])
        times = [told[key] for key in latencies]
        self.assertEqual(times, sorted(times))
        self.assertGreater(times[0], 0)
        self.assertEqual(sum(count for _, _, count in told["buckets_ns"]), told["samples"])
        if told["measuring_thread"]["allocations"] is not None:
            self.assertEqual(told["measuring_thread"]["allocations"], 0, told)
            self.assertEqual(told["measuring_thread"]["locks"], 0, told)

    def test_rpc_and_send_measure_with_either_policy(self):
        for mode in ("rpc", "send"):
            for policy in ("poll", "spin", "wake", "phase"):
                told, ended = measured(mode, *short, "--idle", policy, "--size", "300")
                self.holds(told, ended, 200)
                self.assertEqual((told["bench"], told["settings"]["idle"]), (mode, policy))
                self.assertEqual(told["settings"]["size"], "300 bytes")
                self.assertIsNone(told["peer"])

    def test_rpc_and_send_measure_with_a_peer_that_runs_already(self):
        with standing_peer() as (_, url):
            for mode in ("rpc", "send"):
                told, ended = measured(mode, url, *short)
                self.holds(told, ended, 200)
                self.assertIn(url, told["settings"]["peer"])

    def test_rpc_calls_a_service_of_a_robot(self):
        with program("serve", "--port", "0", "--demo", "-q") as robot:
            url = robot.line(r"\((ws://\S+)\)", "stdout")[1]
            told, ended = measured("rpc", url, *short, "--service", "/robot/set_speed",
                                   "--request", '{"speed":0.5}')
            self.holds(told, ended, 200)
            self.assertIn("unknown", told["peer"])
            told, ended = measured("rpc", url, *short, "--service", "/nope")
            self.assertEqual((ended.code, told["exit_code"]), (1, 1))
            self.assertIn("no", told["problem"])
            run("bench", "send", url, *short, *patient, code=1, last="run `rowe bench peer` there")

    def test_stop_measures_the_brake_and_what_it_is_made_of(self):
        told, ended = measured("stop", "-D", "500ms", "--warm-up", "50ms")
        self.holds(told, ended, 9)
        self.assertEqual(set(told["parts"]), {"round_trip", "to_acceptance", "to_brake"})
        for part in told["parts"].values():
            self.assertGreaterEqual(part["samples"], told["finished"])
        self.assertGreater(told["parts"]["round_trip"]["max_ns"], told["parts"]["to_acceptance"]["min_ns"])
        with standing_peer() as (_, url):  # a peer that has no stop
            ended = run("bench", "stop", url, "-D", "100ms", *patient, code=1,
                        last="the robot cannot be reset")
            self.assertIn("`rowe bench peer --stop`", ended.stderr[-1])

    def test_loop_measures_how_late_it_wakes(self):
        told, ended = measured("loop", *short, "--rate", "500Hz")
        self.holds(told, ended, 100)
        self.assertEqual(told["settings"]["period"], "2.00 ms")
        self.assertGreaterEqual(told["measuring_thread"]["own_context_switches"], 1)

    def test_expiry_measures_among_as_many_as_it_is_told(self):
        told, ended = measured("expiry", "-D", "100ms", "--pending", "5000")
        self.holds(told, ended, 1)
        self.assertEqual(told["settings"]["pending"], "5000")
        self.assertGreater(told["parts"]["move"]["p50_ns"], 0)

    def test_idle_has_figures_for_each_policy_and_company(self):
        for _ in range(10):
            told, ended = measured("idle", "-D", "600ms")
            self.assertEqual(ended.code, 0, ended.stderr)
            # With poll it has to look at a listener's lane, and without one it does not; with spin it never
            # rests. If it gets to run.
            if told["figures"]["spin_no_peer_cpu_percent"] > 0 and \
               told["figures"]["poll_listening_peer_wakeups_per_s"] > \
               told["figures"]["poll_no_peer_wakeups_per_s"]:
                break
        else:
            self.fail(told["figures"])
        wanted = {f"{policy}_{company}_{what}" for policy in ("poll", "spin", "wake", "phase")
                  for company in ("no_peer", "quiet_peer", "listening_peer")
                  for what in ("cpu_percent", "wakeups_per_s")}
        self.assertEqual(set(told["figures"]), wanted)


class stalls(unittest.TestCase):
    def test_are_charged_to_the_messages_that_they_delayed(self):
        for mode in ("rpc", "send"):
            def stalled(seconds, mode=mode):
                with standing_peer() as (peer, url):
                    with program("bench", mode, url, "-D", "1h", "--rate", "1kHz", "--warm-up", "10ms",
                                 *patient, "--max", "80ms", "--json", "-") as bench:
                        bench.line("measuring for")
                        let_pass(seconds)
                        peer.process.send_signal(signal.SIGSTOP)
                        let_pass(0.1)
                        peer.process.send_signal(signal.SIGCONT)
                        let_pass(0.2)
                        bench.code = bench.end(signal.SIGINT)
                return bench

            def was_measuring(bench):
                return bench.code == 5 and json.loads(bench.stdout[0])["max_ns"] >= 90e6

            bench = given_time(stalled, was_measuring)
            self.assertEqual(bench.code, 5, (bench.stdout, bench.stderr))
            told = json.loads(bench.stdout[0])
            self.assertGreaterEqual(told["max_ns"], 90e6, mode)
            self.assertGreaterEqual(told["over"], 5, mode)  # at 1 kHz some 20 of 80 to 100 ms
            self.assertEqual(len(told["over_samples"]), min(told["over"], 1000))
            self.assertFalse(told["bounds"][0]["held"])
            self.assertEqual(told["over_limit_ns"], 80_000_000)


class ends(unittest.TestCase):
    def test_with_5_when_a_bound_is_exceeded_and_0_when_it_holds(self):
        ended = run("bench", "loop", *short, "--max", "1ns", code=5)
        self.assertRegex("\n".join(ended.stdout), r"(?m)^EXCEEDED: max \S+ \S+, allowed 1 ns$")
        ended = run("bench", "loop", *short, "--p99.95", "1ns", "--p50", "50s", code=5)
        self.assertRegex("\n".join(ended.stdout), r"(?m)^EXCEEDED: p99\.95 ")
        self.assertRegex("\n".join(ended.stdout), r"(?m)^held: +p50 ")
        self.assertEqual(run("bench", "loop", *short, "--max", "50s").code, 0)

    def test_on_ctrl_c_with_a_summary_and_the_verdict(self):
        for bound, code in (("1ns", 5), ("50s", 0)):
            def interrupted(seconds, bound=bound):
                with program("bench", "rpc", "-D", "1h", "--rate", "100Hz", *patient, "--max",
                             bound) as bench:
                    bench.line("measuring for")
                    let_pass(seconds)
                    bench.code = bench.end(signal.SIGINT)
                return bench

            # 130: before the first sample; 4: what was under way did not come back at once
            bench = given_time(interrupted, lambda bench: bench.code not in (130, 4))
            self.assertEqual(bench.code, code, (bench.stdout, bench.stderr))
            self.assertRegex(bench.stdout[0], "^machine +Linux ")

    def test_its_peer_with_itself_however_it_ends(self):
        with program("bench", "rpc", "-D", "1h", *patient) as bench:
            child = int(bench.line(r"started a peer, process (\d+)")[1])
            bench.line("measuring for")
            handle = os.pidfd_open(child)
            bench.process.kill()
            bench.process.wait()
        with os.fdopen(handle):
            self.assertTrue(select.select([handle], [], [], 60)[0], "the peer is still there")

    def test_with_1_when_the_peer_goes_away(self):
        for mode in ("rpc", "send"):
            with program("bench", mode, "-D", "1h", *patient) as bench:
                child = int(bench.line(r"started a peer, process (\d+)")[1])
                bench.line("measuring for")
                let_pass(0.4)
                os.kill(child, signal.SIGKILL)
                self.assertEqual(bench.end(), 1, (bench.stdout, bench.stderr))
                self.assertRegex("\n".join(bench.stdout), "(?m)^PROBLEM after ")

    def test_with_3_when_nobody_is_there(self):
        self.assertEqual(run("bench", "rpc", "ws://127.0.0.1:1", *short, "--timeout", "100ms").code, 3)


class files(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def path(self, name):
        return os.path.join(self.folder, name)

    def text(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return file.read()

    def test_are_written_and_name_the_machine(self):
        ended = run("bench", "loop", *short, "--json", self.path("a.json"), "--hgrm", self.path("a.hgrm"),
                    "--svg", self.path("a.svg"), "--max", "1s", "--p99", "1ms")
        self.assertIn(ended.code, (0, 5), ended.stderr)
        told = json.loads(self.text("a.json"))
        line = told["machine"]["line"]
        self.assertEqual(ended.stdout[0], f"machine   {line}")
        self.assertIn(line, self.text("a.hgrm"))
        rows = [row for row in self.text("a.hgrm").split("\n") if re.match(r" +\d", row)]
        self.assertTrue(all(len(row.split()) == 4 for row in rows[:-1]), rows)
        self.assertEqual([float(rows[-1].split()[1]), int(rows[-1].split()[2])], [1.0, told["samples"]])
        drawing = xml.etree.ElementTree.fromstring(self.text("a.svg"))
        space = "{http://www.w3.org/2000/svg}"
        self.assertEqual(drawing.tag, space + "svg")
        self.assertEqual(drawing.find(space + "title").text, line)
        words = " ".join("".join(one.itertext()) for one in drawing.iter(space + "text"))
        for word in ("Percentiles", "Histogram", "99 %", "time (log)", "samples (log)", "max allowed 1.00 s"):
            self.assertIn(word, words)
        self.assertTrue([one for one in drawing.iter(space + "rect") if one.get("class") == "bar"])
        self.assertIn("prefers-color-scheme: dark", self.text("a.svg"))

    def test_are_compared_with_earlier_ones(self):
        self.assertEqual(run("bench", "expiry", "-D", "50ms", "--json", self.path("a.json")).code, 0)
        ended = run("bench", "expiry", "-D", "50ms", "--pending", "20",
                    "--compare", self.path("a.json"), "--svg", self.path("b.svg"), code=0)
        text = "\n".join(ended.stdout)
        self.assertRegex(text, r"(?m)^before +Linux ")
        self.assertRegex(text, r"(?m)^differs +pending: 1000  ->  20$")
        self.assertRegex(text, r"(?m)^ +p99_ns +\S+ \S+ +\S+ \S+ +\d+\.\d\d$")
        xml.etree.ElementTree.fromstring(self.text("b.svg"))

    def test_that_cannot_be_compared_are_refused_before_the_run(self):
        with open(self.path("none.json"), "w", encoding="utf-8") as file:
            file.write("{}")
        run("bench", "loop", "--compare", self.path("none.json"), code=2, stdout=[], first="is no result")
        self.assertEqual(run("bench", "expiry", "-D", "50ms", "--json", self.path("a.json")).code, 0)
        run("bench", "loop", "--compare", self.path("a.json"), code=2, first="`rowe bench expiry`")

    def test_that_cannot_be_written_are_a_failure(self):
        ended = run("bench", "loop", *short, "--svg", self.path("no/folder.svg"))
        self.assertEqual((ended.code, ended.stdout), (1, []))  # before the run, not after it
        self.assertIn("cannot write", ended.stderr[-1])
        ended = run("bench", "loop", *short, "--svg", "/dev/full", code=1)
        self.assertTrue(ended.stdout)
        self.assertIn("cannot write", ended.stderr[-1])


class arguments(unittest.TestCase):
    def refused(self, *words, says):
        run("bench", *words, code=2, stdout=[], says=says)

    def test_that_make_no_sense_are_refused_with_the_value(self):
        self.refused(says="a mode is missing")
        self.refused("rcp", says="did you mean rpc?")
        self.refused("rpc", "--cpu", "x", says="'x'")
        self.refused("rpc", "--cpu", "100000", says="no CPU 100000")
        self.refused("rpc", "--cpu", "0,", says="'0,'")
        self.refused("rpc", "--rate", "2000kHz", says="at most 1000000 Hz")
        self.refused("rpc", "-D", "1000h", says="more than 100000000 samples")
        self.refused("rpc", "--size", "10", says="64 to 60000")
        self.refused("rpc", "--service", "/x", says="--service needs a URL")
        self.refused("rpc", "ws://127.0.0.1:1", "--service", "/x", "--request", "[]", says="'[]'")
        self.refused("rpc", "ws://127.0.0.1:1", "--peer-cpu", "0", says="--peer-cpu")
        self.refused("send", "/http", says="is no URL")
        self.refused("loop", "ws://127.0.0.1:1", says="one argument too many")
        self.refused("idle", "--svg", "x", says="unknown option")

    def test_help_shows_the_option_that_has_a_number(self):
        self.assertRegex("\n".join(run("bench", "rpc", "-h").stdout), r"(?m)^  --pN TIME ")


if __name__ == "__main__":
    unittest.main()
