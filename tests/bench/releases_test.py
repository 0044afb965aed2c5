# SPDX-License-Identifier: Apache-2.0
"""A run kept in a file, and what became faster or slower since: small runs, made by hand."""
import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

top = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(top / "bench" / "report"))
import main
import pages
import programs
import releases
import results
import runs

machine = {"processor": "P", "kernel": "6.1", "date": "2026-01-01", "commit": "abc", "load before": "0.1 0.1"}


def turns_of(program, values, commit="abc"):
    """Results of as many turns as the values of `ROW VALUE` have."""
    turns = []
    for turn in range(len(next(iter(values.values())))):
        found = {}
        for name, of_turns in values.items():
            row, value = name.split()
            found.setdefault(row, results.row(row, "us")).values[value] = of_turns[turn]
        turns.append(results.result(program, "ran", rows=list(found.values()), commit=commit))
    return turns


def run_of(program, values, name="this run", peers=(), **facts):
    told = {program: results.merged(turns_of(program, values))}
    return runs.of(name, told, {**machine, **facts}, peers)


def echo(*values, of="p50_us", row="echo_64/rowe", program="round_trip", **more):
    return run_of(program, {f"{row} {of}": values}, **more)


def verdicts(before, after):
    found = releases.between(before, after)
    return [(one.row, one.heading, one.verdict) for one in found.ours]


class merging(unittest.TestCase):
    def test_values_of_turns_become_their_median_and_their_range(self):
        told = results.merged(turns_of("publish", {"publish/rowe_all p50_ns": (11, 10, 13)}))
        self.assertEqual((told.turns, told.rows[0].values, told.rows[0].ranges),
                         (3, {"p50_ns": 11}, {"p50_ns": (10, 13)}))

    def test_a_program_that_failed_in_one_turn_did_not_run(self):
        turns = turns_of("publish", {"publish/rowe_all p50_ns": (11, 10)})
        turns[1].state, turns[1].why = "failed", "signal 6"
        self.assertEqual((results.merged(turns).state, results.merged(turns).why), ("failed", "signal 6"))


class keeping(unittest.TestCase):
    def told(self):
        return {"round_trip": results.merged(turns_of("round_trip", {
                    "echo_64/rowe p50_us": (8.12345, 8.2, 9), "echo_64/rowe calls": (3, 3, 3),
                    "echo_64/raw p50_us": (7, 7.5, 8), "echo_64/raw max_us": (1, float("nan"), 2)})),
                "publish": results.result("publish", why="it was not built"),
                "urgent_clients": results.result("urgent_clients", "ran", text="a text")}

    def test_a_row_is_a_line_with_four_digits_of_what_differs(self):
        text = runs.text(self.told(), machine)
        self.assertIn('\n    "echo_64/rowe": {"unit": "us", "values": '
                      '{"calls": 3, "p50_us": [8.123, 8.2, 9]}}\n', text)
        self.assertLess(text.index("echo_64/raw"), text.index("echo_64/rowe"))

    def test_what_is_no_number_or_only_a_text_is_left_out(self):
        told = json.loads(runs.text(self.told(), machine))
        raw = told["programs"]["round_trip"]["rows"]["echo_64/raw"]
        self.assertEqual(raw["values"], {"p50_us": [7, 7.5, 8]})
        self.assertEqual(sorted(told["programs"]), ["publish", "round_trip"])

    def test_it_is_read_back_with_its_machine_and_what_did_not_run(self):
        run = runs.of("0.1.0.json", self.told(), machine, [("ws", "8")])
        self.assertEqual(run.programs["round_trip"].find("echo_64/rowe").values,
                         {"calls": (3, 3, 3), "p50_us": (8.123, 8.2, 9)})
        self.assertEqual((run.programs["publish"].state, run.programs["publish"].why),
                         ("left out", "it was not built"))
        self.assertEqual((run.machine, run.peers), (machine, {"ws": "8"}))
        self.assertEqual(str(run), "0.1.0.json: commit abc of 2026-01-01, 3 turns")

    def test_results_of_two_commits_are_no_run(self):
        told = {name: results.merged(turns_of(name, {"a/b p50_us": (1, 2)}, commit))
                for name, commit in (("publish", "abc"), ("scale", "def"))}
        with self.assertRaisesRegex(runs.unusable, r"of 2 commits \(abc, def\)"):
            runs.text(told, machine)

    def test_the_newest_release_is_found_by_its_version_and_never_this_commit(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            self.assertIsNone(runs.newest(here, "abc"))
            for version, commit in (("0.9.0", "nine"), ("0.10.0", "ten"), ("0.2.0", "two")):
                told = {"round_trip": results.merged(turns_of("round_trip", {"a/b p50_us": (1, 2)}))}
                (here / f"{version}.json").write_text(runs.text(told, {**machine, "commit": commit}),
                                                      encoding="utf-8")
            self.assertEqual(runs.newest(here, "abc").name, "0.10.0.json")
            self.assertEqual(runs.newest(here, "ten").name, "0.9.0.json")


class refusing(unittest.TestCase):
    def refused(self, text):
        with self.assertRaises(runs.unusable) as wrong:
            runs.parse("old.json", text)
        return str(wrong.exception)

    def run_with(self, **program):
        return json.dumps({"format": 1, "machine": {}, "peers": {}, "programs": {
            "publish": {"state": "ran", "turns": 4, "rows": {}, **program}}})

    def test_a_file_that_is_not_there_is_named(self):
        with self.assertRaisesRegex(runs.unusable, "/nowhere/0.1.0.json cannot be read: No such file"):
            runs.load(pathlib.Path("/nowhere/0.1.0.json"))

    def test_what_is_no_json_or_no_run(self):
        self.assertIn("it is no JSON: ", self.refused("# Benchmarks"))
        self.assertIn("it has no `format`", self.refused("[]"))
        self.assertIn("it has no `format`", self.refused('{"context": {}}'))
        self.assertIn("it is not of format 1: KeyError 'programs'", self.refused('{"format": 1}'))
        self.assertIn("it is not of format 1", self.refused(self.run_with(rows={"a/b": [1]})))
        self.assertIn("it is not of format 1", self.refused(self.run_with(turns="4")))

    def test_another_format(self):
        self.assertEqual(self.refused('{"format": 2}'), "its format is 2, and only 1 can be read")

    def test_a_run_without_spread(self):
        self.assertEqual(self.refused(self.run_with(turns=1)),
                         "publish ran in 1 turn, and the spread of a value needs 2 (--turns 2 or more)")

    def test_a_median_that_is_not_between_the_others(self):
        rows = {"a/b": {"unit": "ns", "values": {"p50_ns": [3, 2, 4]}}}
        self.assertEqual(self.refused(self.run_with(rows=rows)),
                         "publish a/b, p50_ns: [3, 2, 4] is not in order")


class comparing(unittest.TestCase):
    def test_a_run_equals_itself(self):
        run = echo(10, 10.1, 10.2)
        self.assertEqual(verdicts(run, run), [("round_trip echo_64/rowe", "p50, µs", "")])
        said = releases.report(releases.between(run, run))
        self.assertIn("1 values: nothing became slower or faster;", said)

    def test_values_of_turns_are_judged_by_their_spread_and_their_kind(self):
        sent, more = {"row": "send_300/rowe", "program": "throughput"}, ((10, 10.1), (15, 15.1))
        counted = {"of": "instructions", "row": "instructions/send", "program": "instructions"}
        for what, before, after, how, verdict in (
                ("a fifth more, spread 2 %", (10, 10.1, 10.2), (12, 12.1, 12.2), {}, "slower"),
                ("a fifth less, spread 2 %", (12, 12.1, 12.2), (10, 10.1, 10.2), {}, "faster"),
                ("a fifth more, spread 30 %", (10, 11, 13), (12, 13.2, 15.6), {}, ""),
                ("a fifth more, spread 30 % of one", (10, 10.1, 10.2), (12, 12.5, 15.6), {}, ""),
                ("turns that overlap", (10, 10, 11.5), (11.4, 11.9, 12), {}, ""),
                ("numbers of turns that differ", (10, 10.1), (12, 12.1, 12.2, 12.3), {}, "slower"),
                ("more of a rate", *more, {"of": "messages_per_s", **sent}, "faster"),
                ("more of a rate in a peer's", *more, {"of": "of_best_peer", **sent}, "faster"),
                ("less of a time in a peer's", (1.5, 1.51), (1, 1.01), {"of": "of_raw"}, "faster"),
                ("more of times faster", (8, 8.1), (9, 9.1), {"of": "x_json_c"}, "faster"),
                ("one count more", (10213,), (10214,), counted, "slower"),
                ("one count less", (3, 3), (2, 2), {"of": "calls"}, "faster")):
            with self.subTest(what):
                self.assertEqual(verdicts(echo(*before, **how), echo(*after, **how))[0][2], verdict)

    def test_what_was_nothing_and_is_something_is_slower(self):
        found = releases.between(*(echo(*values, of="allocations") for values in ((0, 0), (1, 1))))
        self.assertEqual(found.ours[0].verdict, "slower")
        self.assertIn("  ∞ ", releases.report(found))

    def test_what_is_neither_better_nor_worse_is_left_out(self):
        self.assertEqual(verdicts(echo(3, 3, of="messages"), echo(4, 4, of="messages")), [])

    def of_ours(self, *others):
        """A fifth more, while those of others went from `others[0]` to `others[1]`."""
        sides = [run_of("round_trip", {"echo_64/rowe p50_us": ours, "echo_64/rowe of_raw": ours,
                                       "echo_64/raw p50_us": theirs})
                 for ours, theirs in zip(((10, 10.1), (12, 12.1)), others)]
        return releases.between(*sides)

    def test_what_others_differ_by_as_well_is_the_machine(self):
        found = self.of_ours((5, 5.1), (5.3, 5.4))
        self.assertEqual([one.verdict for one in found.ours], ["slower", "slower"])
        found = self.of_ours((5, 5.1), (6.5, 6.6))
        self.assertEqual([(one.heading, one.verdict) for one in found.ours],
                         [("p50, µs", ""), ("× raw", "slower")])
        self.assertIn("Of 1 values of contenders that are not rowe's, nine of ten differ by at most 29.7%, "
                      "of ratios 0.0%", releases.report(found))

    def test_of_counts_the_machine_takes_nothing_away(self):
        sides = [run_of("round_trip", {"echo_64/rowe calls": (count, count), "echo_64/raw p50_us": theirs})
                 for count, theirs in ((30, (5, 5.1)), (31, (9, 9.1)))]
        self.assertEqual([one.verdict for one in releases.between(*sides).ours], ["slower"])

    def test_one_of_ten_others_and_their_tails_do_not_show_the_machine(self):
        values = {f"{number}/raw p50_us": (5, 5.1) for number in range(9)}
        sides = [run_of("round_trip", {"0/rowe p50_us": ours, **{f"{number}/rowe p50_us": (1, 1.1)
                                                                 for number in range(1, 11)},
                                       **values, "9/raw p50_us": odd, "10/raw p99_us": odd})
                 for ours, odd in (((10, 10.1), (5, 5.1)), ((12, 12.1), (50, 51)))]
        self.assertEqual([one.verdict for one in releases.between(*sides).ours][0], "slower")

    def test_where_nothing_is_named_after_rowe_all_is_ours(self):
        sides = [echo(*values, row="arrives_spread_0/phase", program="phase")
                 for values in ((10, 10.1), (15, 15.1))]
        self.assertEqual(verdicts(*sides)[0][2], "slower")

    def test_rows_and_programs_of_one_run_only_are_named(self):
        before = run_of("round_trip", {"a/rowe p50_us": (1, 1.1), "b/rowe p50_us": (1, 1.1)})
        after = run_of("round_trip", {"a/rowe p50_us": (1, 1.1), "c/rowe p50_us": (1, 1.1)})
        before.programs["scale"] = results.result("scale", "failed", "signal 6")
        said = releases.report(releases.between(before, after))
        self.assertIn("Only before:\n  round_trip b/rowe\n", said)
        self.assertIn("Only after:\n  round_trip c/rowe\n", said)
        self.assertIn("Did not run:\n  scale, before: failed: signal 6\n  scale, after: it was not run", said)
        self.assertNotIn("scale", releases.report(releases.between(before, after, ["round_trip"])))


class telling(unittest.TestCase):
    def test_the_largest_change_comes_first_and_slower_ones_before_faster_ones(self):
        rows = ("a/rowe p50_us", "b/rowe p50_us", "c/rowe p50_us")
        before = run_of("round_trip", dict.fromkeys(rows, (10, 10.1)))
        after = run_of("round_trip", dict(zip(rows, ((12, 12.1), (2, 2.1), (15, 15.1)))))
        said = releases.report(releases.between(before, after))
        self.assertIn("3 values: 2 slower, 1 faster;", said)
        self.assertRegex(said, r"(?s)c/rowe.*10.1 \(10–10.1\).*15.1 \(15–15.1\).*1.50 +slower"
                               r".*a/rowe.*slower.*b/rowe.*faster")

    def test_other_machines_are_said_first(self):
        before = echo(10, 10.1, peers=[("ws", "8")])
        after = echo(10, 10.1, kernel="6.2", date="2026-02-02", commit="def", peers=[("ws", "9")])
        said = releases.report(releases.between(before, after))
        self.assertTrue(said.startswith("The machines differ"))
        self.assertRegex(said, r"kernel +before: 6.1 +after: 6.2\n +ws +before: 8 +after: 9\n\nbefore: ")
        self.assertNotIn("differ,", releases.report(releases.between(before, before)))
        self.assertIn("**The machines differ, so this compares machines as well:** kernel 6.1 → 6.2",
                      releases.section(releases.between(before, after)))

    def test_the_page_has_the_largest_changes_since_the_release(self):
        rows = [f"{number}/rowe p50_us" for number in range(30)]
        before = run_of("round_trip", dict.fromkeys(rows, (10, 10.1)), name="0.1.0.json")
        after = run_of("round_trip", dict.fromkeys(rows, (15, 15.1)))
        text = releases.section(releases.between(before, after))
        self.assertTrue(text.startswith("## Since 0.1.0\n\nAgainst [0.1.0.json](benchmarks/0.1.0.json), "
                                        "commit abc of 2026-01-01. 30 values: 30 slower, 0 faster;"), text)
        self.assertIn("These are the 20 largest. ", text)
        self.assertEqual(text.count("**slower**"), 20)
        told = {one.name: results.result(one.name, why="it was not built") for one in programs.programs}
        page, _ = pages.page(told, machine, since=text)
        self.assertIn(text, page)


class the_command(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.here = pathlib.Path(self.folder.name)

    def write(self, name, *values, **facts):
        told = {"round_trip": results.merged(turns_of("round_trip", {"echo_64/rowe p50_us": values}))}
        (self.here / name).write_text(runs.text(told, {**machine, **facts}), encoding="utf-8")
        return str(self.here / name)

    def run_it(self, *arguments):
        done = subprocess.run([top / "tools" / "benchmark", *arguments], capture_output=True, text=True,
                              check=False)
        return done.returncode, done.stdout, done.stderr

    def since(self, told, folder="."):
        """The section of the page."""
        with unittest.mock.patch.object(main.machine, "versions", return_value=[]):
            return main.since_release(self.here / folder, told, {**machine, "commit": "now"})

    def test_two_files_are_compared_and_nothing_runs(self):
        code, said, _ = self.run_it("--compare", self.write("old.json", 10, 10.1),
                                    self.write("new.json", 15, 15.1))
        self.assertEqual(code, 0)
        self.assertIn("before: old.json: ", said)
        self.assertIn("1 values: 1 slower, 0 faster", said)
        self.assertNotIn("==", said)

    def test_files_that_cannot_be_compared_are_refused_before_anything_runs(self):
        old = self.write("old.json", 10, 10.1)
        nowhere = str(self.here / "none.json")
        code, said, why = self.run_it("--compare", nowhere, old)
        self.assertEqual((code, said), (2, ""))
        self.assertIn(f"--compare: {nowhere} cannot be read: No such file or directory", why)
        _, _, why = self.run_it("--compare", old, old, old)
        self.assertIn("--compare: 3 files are given; it takes two at most", why)

    def arguments_refused(self, *arguments):
        said = io.StringIO()
        with contextlib.redirect_stderr(said), self.assertRaises(SystemExit), \
                unittest.mock.patch.object(sys, "argv", ["benchmark", "--bin", str(self.here), *arguments]):
            main.arguments()
        return said.getvalue()

    def test_one_turn_is_too_few_to_keep_or_to_compare(self):
        for option in ("--save", "--compare"):
            said = self.arguments_refused(option, self.write("old.json", 10, 10.1), "--turns", "1")
            self.assertIn("--turns: 1 is too few; a row's own spread needs 2", said)

    def test_a_file_in_no_folder_is_refused_before_anything_runs(self):
        said = self.arguments_refused("--save", str(self.here / "none" / "0.1.0.json"))
        self.assertIn(f"--save: {self.here}/none is no folder", said)

    def test_the_page_says_what_changed_since_the_newest_release_if_there_is_one(self):
        turns = turns_of("round_trip", {"echo_64/rowe p50_us": (15, 15.1)})
        told = {"round_trip": results.merged(turns)}
        self.assertEqual(self.since(told), "")
        self.write("0.1.0.json", 10, 10.1)
        self.assertIn("1 values: 1 slower", self.since(told))

    def test_the_page_says_why_a_run_of_one_turn_is_not_compared(self):
        told = {"round_trip": results.merged(turns_of("round_trip", {"echo_64/rowe p50_us": (15,)}))}
        self.write("0.1.0.json", 10, 10.1)
        self.assertEqual(self.since(told), "## Since 0.1.0\n\nNot compared: round_trip ran in 1 turn, and "
                                           "the spread of a value needs 2 (--turns 2 or more).\n")

    def test_runs_of_releases_stay_where_plots_are_made_anew(self):
        (self.here / "benchmarks").mkdir()
        self.write("benchmarks/0.1.0.json", 10, 10.1)
        (self.here / "benchmarks" / "old.svg").write_text("", encoding="utf-8")
        told = {one.name: results.result(one.name, why="it was not built") for one in programs.programs}
        pages.write(self.here, told, machine)
        self.assertEqual([path.name for path in (self.here / "benchmarks").iterdir()], ["0.1.0.json"])

    def test_every_program_runs_in_each_turn_but_those_that_count_or_failed(self):
        ran = []

        def one_turn(one, *_):
            ran.append(one.name)
            told = results.result(one.name, "ran", rows=[results.row("a/rowe", "us", {"p50_us": len(ran)})])
            told.commit = f"at {len(ran)}"
            return told if one.name != "scale" else results.result(one.name, "failed", "signal 6")

        asked = unittest.mock.Mock(only=["publish", "instructions", "scale"], turns=3, rounds=None, bin="bin")
        with unittest.mock.patch.object(main.runner, "run", one_turn), \
                unittest.mock.patch.multiple(main, kept=self.here, facts_file=self.here / "machine.json"), \
                unittest.mock.patch.object(main.machine, "facts", return_value=machine), \
                contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(main.run(asked), machine)
        self.assertEqual(ran, ["publish", "instructions", "scale", "publish", "publish"])
        told = {name: results.kept(self.here, name) for name in asked.only}
        self.assertEqual(told["publish"].rows[0].ranges, {"p50_us": [1, 5]})
        # One commit, whatever was committed while they ran.
        self.assertEqual({one.commit for one in told.values()}, {"abc"})
        runs.of("this run", told, machine)


if __name__ == "__main__":
    os.chdir(top)
    unittest.main()
