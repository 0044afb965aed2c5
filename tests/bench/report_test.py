# SPDX-License-Identifier: Apache-2.0
"""What bench/report makes of results: small ones, made by hand."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

top = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(top / "bench" / "report"))
import compare
import methods
import pages
import programs
import results
import rows
import runner
import svg
import targets
import words

told_by_google_benchmark = {
    "context": {"date": "2026-01-01T00:00:00+00:00", "rounds": "11"},
    "benchmarks": [
        {"name": "echo_64/raw/iterations:1/manual_time", "run_type": "iteration", "iterations": 1,
         "real_time": 6.5, "cpu_time": 1.0, "time_unit": "us", "p99_us": 7.5, "of_raw": 1.0},
        {"name": "echo_64/rowe_busy/iterations:1/manual_time", "run_type": "iteration", "iterations": 1,
         "real_time": 6.8, "cpu_time": 1.0, "time_unit": "us", "p99_us": 8.5, "of_raw": 1.046},
        {"name": "fan_out/rowe/10/iterations:1/manual_time", "run_type": "iteration", "iterations": 1,
         "real_time": 38.0, "cpu_time": 1.0, "time_unit": "us", "sends": 10},
    ]}


def echo_results():
    told = results.result("hand_over", state="ran", date="2026-01-01", commit="abc", load="0.1 0.2")
    told.rows, told.rounds, _ = results.of_google_benchmark(told_by_google_benchmark)
    return told


def target(benchmark, counter, bound, **more):
    return rows.target("echo", "hand_over", benchmark, counter, bound, **more)


class reading(unittest.TestCase):
    def test_names_lose_what_google_benchmark_adds(self):
        told = echo_results()
        self.assertEqual([one.name for one in told.rows],
                         ["echo_64/raw", "echo_64/rowe_busy", "fan_out/rowe/10"])
        self.assertEqual((told.rows[2].group, told.rows[2].contender, told.rows[2].size),
                         ("fan_out", "rowe", "10"))

    def test_counters_and_the_time_are_values(self):
        told = echo_results()
        self.assertEqual(told.find("echo_64/raw").values, {"time": 6.5, "p99_us": 7.5, "of_raw": 1.0})
        self.assertEqual(told.rounds, "11")

    def test_an_error_of_one_benchmark_is_not_a_row(self):
        told = {"benchmarks": [{"name": "echo_64/lws", "error_occurred": True, "error_message": "no socket"}]}
        self.assertEqual(results.of_google_benchmark(told), ([], "", ["echo_64/lws: no socket"]))

    def test_rows_of_one_size_stand_together(self):
        told = results.result("x")
        told.rows = [results.row(f"fan_out/{who}/{size}") for who in ("rowe", "lws") for size in (1, 10)]
        (_, ordered), = told.groups()
        self.assertEqual([one.name for one in ordered],
                         ["fan_out/rowe/1", "fan_out/lws/1", "fan_out/rowe/10", "fan_out/lws/10"])

    def test_groups_of_one_row_each_are_one_table(self):
        told = results.result("x")
        names = ("a/p", "a/q", "b/p", "c/p", "d/p", "d/q")
        told.rows = [results.row(name, "ns", {"time": 1}) for name in names]
        self.assertEqual([(group, [one.name for one in rows]) for group, rows in told.tables()],
                         [("a", ["a/p", "a/q"]), ("", ["/b: p", "/c: p"]), ("d", ["d/p", "d/q"])])

    def test_instructions_are_of_one_call(self):
        said = ("  117,000 (11.06%)  ???:steps::call_finish(rowe::lane&) [/x]\n"
                "1,998,066 (18.73%)  a.cpp:steps::request_next(rowe::responder<a, b>&) [/x]\n"
                "   20,000 ( 1.73%)  a.cpp:main [/x]\n")
        self.assertEqual([(one.name, one.values["instructions"]) for one in results.of_callgrind(said)],
                         [("instructions/call_finish", 117), ("instructions/request_next", 1998.066)])

    def test_what_is_kept_is_read_back(self):
        with tempfile.TemporaryDirectory() as folder:
            told = echo_results()
            results.keep(pathlib.Path(folder), told)
            self.assertEqual(results.kept(pathlib.Path(folder), "hand_over"), told)
            self.assertEqual(results.kept(pathlib.Path(folder), "publish").why, "it was not run")


class judging(unittest.TestCase):
    def word(self, *arguments):
        return targets.judge(target(*arguments), echo_results()).word

    def test_a_target_is_met_or_missed(self):
        self.assertEqual(self.word("echo_64/rowe_busy", "of_raw", rows.at_most(1.05)), "met")
        self.assertEqual(self.word("echo_64/rowe_busy", "of_raw", rows.at_most(1.04)), "missed")
        self.assertEqual(self.word("echo_64/rowe_busy", "time", rows.at_least(6.9)), "missed")
        self.assertEqual(self.word("fan_out/rowe/10", "sends", rows.exactly(10)), "met")

    def test_a_ratio_of_two_counts_is_taken_here(self):
        asked = target("echo_64/rowe_busy", "p99_us", rows.at_most(2), over="echo_64/raw")
        self.assertEqual(targets.judge(asked, echo_results()).value, 8.5 / 7.5)

    def test_what_was_not_measured_is_left_out_with_its_reason(self):
        self.assertEqual(self.word("echo_64/lws", "of_raw", rows.at_most(1)), "left out")
        absent = results.result("hand_over", why="it needs a library")
        verdict = targets.judge(target("echo_64/raw", "time", rows.at_most(1)), absent)
        self.assertEqual((verdict.word, verdict.why), ("left out", "it needs a library"))

    def test_a_reason_is_shown_only_when_the_target_is_missed(self):
        missed, met = (targets.judge(target("echo_64/rowe_busy", "of_raw", rows.at_most(limit),
                                            reason="because"), echo_results()) for limit in (1.0, 1.1))
        said = pages.targets_section([missed, met])
        self.assertIn("1 met, 1 missed, 0 left out", said)
        self.assertEqual(said.count("because"), 1)


class wording(unittest.TestCase):
    def test_counters_become_headings(self):
        for name, heading in (("p50_us", "p50, µs"), ("push_p999_ns", "push p99.9, ns"),
                              ("p99.9_us", "p99.9, µs"), ("of_raw", "× raw"), ("taken_per_s", "taken, /s"),
                              ("million_per_s", "M/s"),
                              ("x_baseline_v1", "times faster than baseline v1"), ("sends", "sends"),
                              ("cpu_percent", "cpu, %"), ("bytes", "bytes"), ("max_ms", "max, ms")):
            self.assertEqual(words.read(name).heading, heading)

    def test_quantiles_come_first_and_ratios_last(self):
        names = ("of_raw", "bytes", "max_us", "p99_us", "sends", "time")
        one = results.row("a/b", "us", dict.fromkeys(names, 1))
        self.assertEqual([each.name for each in words.columns([one])],
                         ["time", "p99_us", "max_us", "bytes", "sends", "of_raw"])

    def test_a_counted_median_stands_for_the_time(self):
        one = results.row("a/b", "us", dict.fromkeys(("time", "p50_us", "p99_us"), 1))
        self.assertEqual([each.name for each in words.columns([one])], ["p50_us", "p99_us"])

    def test_numbers_have_three_digits(self):
        for value, text in ((0.0123, "0.012"), (1.046, "1.05"), (12.34, "12.3"), (123.4, "123"),
                            (12345.6, "12,346"), (7, "7"), (float("nan"), "–"), (None, "")):
            self.assertEqual(words.number(value), text)


class drawing(unittest.TestCase):
    def test_a_plot_has_a_bar_for_each_contender_and_a_mark_for_each_tail(self):
        told = echo_results()
        drawn = xml.etree.ElementTree.fromstring(svg.plot("Echo <64>", told.rows[:2]))
        classes = [each.get("class") for each in drawn.iter()]
        self.assertEqual((classes.count("ours"), classes.count("limit"), classes.count("tail")), (1, 1, 2))

    def test_what_lies_far_apart_is_drawn_on_a_logarithmic_scale(self):
        pair = [results.row(f"a/{name}", "ns", {"time": value}) for name, value in (("x", 1), ("y", 1e6))]
        self.assertIn("logarithmic", svg.plot("far", pair))

    def test_of_one_contender_the_sizes_are_compared(self):
        rows = [results.row(f"peers/rowe/{size}", "ns", {"time": size, "cpu_ns": size}) for size in (1, 10)]
        drawn = xml.etree.ElementTree.fromstring(svg.plot("Scale", rows))
        self.assertEqual([each.get("class") for each in drawn.iter()].count("ours"), 2)
        self.assertNotIn(">rowe<", svg.plot("Scale", rows))

    def test_one_row_is_no_comparison(self):
        self.assertIsNone(svg.plot("one", echo_results().rows[:1]))


class running(unittest.TestCase):
    def setUp(self):
        self.here = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def run_script(self, script, kind="benchmark"):
        (self.here / "bench_x").write_text(script, encoding="utf-8")
        (self.here / "bench_x").chmod(0o755)
        return runner.run(programs.program("x", "X", kind=kind), str(self.here), self.here, 3)

    def test_a_program_is_given_the_rounds_and_its_json_is_read(self):
        told = self.run_script("#!/bin/sh\n[ \"$1\" = --rounds=3 ] || exit 1\n"
                               f"echo '{json.dumps(told_by_google_benchmark)}' >\"${{2#*=}}\"\n")
        self.assertEqual((told.state, told.why, len(told.rows)), ("ran", "", 3))

    def test_a_program_that_fails_is_named_with_its_last_words(self):
        told = self.run_script("#!/bin/sh\necho 'needs two cores' >&2\nexit 1\n")
        self.assertEqual((told.state, told.why), ("failed", "exit code 1: needs two cores"))

    def test_a_program_that_fails_is_tried_once_more_and_the_page_says_so(self):
        told = self.run_script("#!/bin/sh\n[ -e \"$0.tried\" ] && echo good && exit\n>\"$0.tried\"\n"
                               "echo bad minute >&2\nexit 1\n", "text")
        self.assertEqual((told.state, told.why, told.text), ("ran", "", "good"))
        self.assertIn("exit code 1: bad minute", told.notes[0])

    def test_a_program_that_writes_nothing_has_failed(self):
        self.assertEqual(self.run_script("#!/bin/sh\n").state, "failed")

    def test_a_program_may_go_without_some_contenders_and_says_so(self):
        told = self.run_script("#!/bin/sh\necho 'ws is left out: it does not serve' >&2\necho 1\n", "text")
        self.assertEqual((told.state, told.notes), ("ran", ["ws is left out: it does not serve"]))

    def test_what_a_text_program_prints_is_kept(self):
        self.assertEqual(self.run_script("#!/bin/sh\necho poll 1 us\n", "text").text, "poll 1 us")

    def test_a_program_that_hangs_is_killed_with_what_it_started(self):
        hangs = ["sh", "-c", "sleep 1000 & wait"]
        self.assertEqual(runner.start(hangs, self.here / "log", 0.2), ("", None))

    def test_a_program_that_was_not_built_is_left_out_with_cmakes_reason(self):
        said = "-- bench_w and bench_x left out: they need json-c\n-- Done\n"
        (self.here / "configure.log").write_text(said, encoding="utf-8")
        told = runner.run(programs.program("x", "X"), str(self.here), self.here, 0)
        self.assertEqual((told.state, told.why), ("left out", "they need json-c"))


class whole_pages(unittest.TestCase):
    def test_each_program_has_its_section_or_its_reason(self):
        told = {one.name: results.result(one.name, why="it was not built") for one in programs.programs}
        told["hand_over"] = echo_results()
        facts = {"processor": "P", "commit": "abc", "date": "2026-01-01"}
        text, drawings = pages.page(told, facts)
        self.assertIn("**P** · commit abc", text)
        self.assertIn("| **rowe_busy** | 6.80 | 8.50 | 1.05 |", text)
        self.assertEqual(list(drawings), ["hand_over-echo_64.svg"])
        for one in programs.programs:
            if one.name != "hand_over":
                self.assertIn(f"- `{one.name}` left out: it was not built", text)

    def test_a_result_of_another_commit_says_so(self):
        told = {one.name: results.result(one.name, why="it was not run") for one in programs.programs}
        told["hand_over"] = echo_results()
        text, _ = pages.page(told, {"processor": "P", "commit": "def", "date": "2026-01-01"})
        self.assertIn("of 2026-01-01, commit abc", text)

    def test_a_comment_becomes_markdown(self):
        comment = methods.opening_comment("// SPDX-License-Identifier: Apache-2.0\n// Question: what?\n//\n"
                                          "// Measured, a:\n//   one  1\n#include <x>\n")
        parts = [methods.markdown(part) for part in methods.paragraphs(comment)]
        self.assertEqual(parts, ["**Question:** what?", "**Measured**, a:\n\n```text\n  one  1\n```"])



class builds_by_turns(unittest.TestCase):
    """One row of one program, as either build measured it in each turn."""

    def of(self, before, after, value="p50_us", **more):
        sides = [[results.result("hand_over", state="ran",
                                 rows=[results.row("echo/rowe", "us", {value: each})])
                  for each in side] for side in (before, after)]
        for told in sides[0]:
            told.state = more.get("state", "ran")
        return compare.of_program(*sides)

    def test_what_is_slower_in_each_turn_and_beyond_its_spread_is_said(self):
        for what, before, after, how, verdicts in (
                ("in each turn", [10, 10.1, 10], [11, 11.1, 11], {}, ["slower"]),
                ("in each turn", [11, 11.1, 11], [10, 10.1, 10], {}, ["faster"]),
                ("by less than its spread", [10, 12, 10], [11, 13, 11], {}, [""]),
                ("in one turn only", [10, 10, 11.5], [11.4, 11.4, 11.4], {}, [""]),
                ("instructions of one turn", [100], [101], {"value": "instructions"}, ["slower"]),
                ("as many instructions", [100], [100], {"value": "instructions"}, [""]),
                ("a ratio is left out", [1, 1], [2, 2], {"value": "of_raw"}, []),
                ("a count is left out", [1, 1], [2, 2], {"value": "sends"}, []),
                ("a program that failed once is left out", [1, 1], [2, 2], {"state": "failed"}, [])):
            with self.subTest(what):
                self.assertEqual([one.verdict for one in self.of(before, after, **how)], verdicts)

    def test_of_a_rate_more_is_faster(self):
        (found,) = self.of([100, 100], [150, 150], value="messages_k_per_s")
        self.assertEqual(found.verdict, "faster")
        self.assertAlmostEqual(found.ratio, 2 / 3)

    def test_what_differs_between_builds_of_the_same_code_is_chance(self):
        sides = [[results.result("expiry", state="ran",
                                 rows=[results.row("recent/rowe", "ns", {"time": each})])
                  for each in side] for side in ([10, 10], [13, 13])]
        found = compare.of_program(*sides, same=True)
        self.assertEqual([(one.verdict, one.beyond) for one in found], [("", "slower")])
        text = compare.page(programs.programs, {"expiry": found}, {}, "aaa", "bbb", 2, None, "x")
        self.assertIn("1 values: 0 slower, 0 faster.", text)
        self.assertIn("of 1 such values\n1 would have counted", text)
        self.assertIn("| same code |", text)

    def test_code_is_the_same_whatever_surrounds_it(self):
        with tempfile.TemporaryDirectory() as folder:
            folders = [os.path.join(folder, name) for name in "abc"]
            for where, made in zip(folders, ("return x;", "return x;", "return x + 1;")):
                os.mkdir(where)
                with open(f"{where}/it.c", "w", encoding="utf-8") as file:
                    file.write(f'const char* name = "{where}"; int f(int x) {{ {made} }}\n')
                subprocess.run(["cc", "-c", f"{where}/it.c", "-o", f"{where}/bench_it"], check=True)
            it = programs.program("it", "It")
            self.assertTrue(compare.same_code(it, folders[:2]))
            self.assertFalse(compare.same_code(it, folders[1:]))
            self.assertFalse(compare.same_code(it, [folders[0], "/nowhere"]))
            starts = programs.program("it", "It", starts_others=True)
            self.assertFalse(compare.same_code(starts, folders[:2]))

    def test_the_page_has_the_slower_ones_first(self):
        found = {"hand_over": self.of([10, 10], [12, 12]) + self.of([10, 10], [10, 10], value="p99_us")}
        text = compare.page(programs.programs, found, {"cores": "2", "commit": "x"}, "aaa", "bbb", 2, None,
                            "tools/benchmark --against DIR --turns 2")
        self.assertIn("2 values: 1 slower, 0 faster.", text)
        self.assertIn("| echo/rowe | p50, µs | 10 | 12 | 1.20 | 1.20–1.20 | 0.00 | **slower** |", text)
        self.assertLess(text.index("## What became slower"), text.index("## Hand-over between threads"))
        self.assertNotIn("commit x", text)


if __name__ == "__main__":
    os.chdir(top)
    unittest.main()
