#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What tools/test makes of the output of ninja, ctest, unittest and node."""
import contextlib
import io
import os
import pathlib
import subprocess
import tempfile
import time
import unittest
import unittest.mock

import areas
import builds
import discover
import main
import suites

BROKEN = """[1/9] Building CXX object lib/CMakeFiles/rowe_wire.dir/wire/utf8.cpp.o
[2/9] Building CXX object lib/CMakeFiles/rowe_json.dir/json/digits.cpp.o
FAILED: lib/CMakeFiles/rowe_json.dir/json/digits.cpp.o
/usr/bin/c++ -O3 -c lib/json/digits.cpp
In file included from lib/json/errors.cpp:1:
lib/json/errors.cpp:2:1: warning: nothing to do with it
lib/json/errors.cpp:3:1: note: nor this
In file included from lib/json/writer.hpp:12,
                 from lib/json/digits.cpp:3:
lib/json/digits.hpp: In function 'int digits()':
lib/json/digits.hpp:7:3: error: 'x' was not declared in this scope
lib/json/digits.hpp:9:3: error: 'y' was not declared in this scope
[3/9] Building CXX object lib/CMakeFiles/rowe_json.dir/json/writer.cpp.o
FAILED: lib/CMakeFiles/rowe_json.dir/json/writer.cpp.o
/usr/bin/c++ -O3 -c lib/json/writer.cpp
lib/json/writer.cpp:1:1: error: another
ninja: build stopped: subcommand failed.
"""

UNITTEST = """test_one (__main__.outer.test_one) ... ok
test_two (__main__.outer.test_two) ... skipped 'no network of its own here'

----------------------------------------------------------------------
Ran 2 tests in 0.012s

OK (skipped=1)
"""

TAP = """TAP version 13
# Subtest: first
ok 1 - first
  ---
  duration_ms: 1
  ...
# Subtest: group
    # Subtest: inner one
    ok 1 - inner one
    # Subtest: inner two
    not ok 2 - inner two
    1..2
not ok 2 - group
ok 3 - third # SKIP no browser
1..3
# tests 3
"""

GTEST = """[==========] Running 4 tests from 2 test suites.
[ RUN      ] queue.takes_one
said without an end[       OK ] queue.takes_one (0 ms)
[ RUN      ] queue.gives_one
queue_test.cpp:7: Failure
[  FAILED  ] queue.gives_one (1 ms)
[ RUN      ] all/queue.is_empty/0
queue_test.cpp:9: Skipped
not here
[  SKIPPED ] all/queue.is_empty/0 (0 ms)
[ RUN      ] queue.ends
"""

JUNIT = """<?xml version="1.0"?>
<testsuite name="x" tests="5">
<testcase name="json/a.passes" time="0.5" status="run">
<system-out>[  PASSED  ] 1 test.</system-out></testcase>
<testcase name="json/a.fails" time="0.25" status="fail">
<failure message=""/><system-out>wrong</system-out></testcase>
<testcase name="rt/a.is_skipped" time="0" status="notrun">
<skipped message="Skipped"/><system-out>
a_test.cpp:3: Skipped
asserted in dev builds only
</system-out></testcase>
<testcase name="web/page" time="0.1" status="notrun">
<skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>skipped: Node is not installed
</system-out></testcase>
<testcase name="wire/NOT_BUILT" time="0" status="notrun">
<skipped message="Unable to find executable"/><system-out></system-out></testcase>
<testcase name="verbs/serve" time="2" status="run"><system-out>""" + UNITTEST + """</system-out></testcase>
</testsuite>
"""

# In a tree of their own.
SOURCE = os.path.join("src", "json", "x.cpp")
SCRIPT = os.path.join("tests", "json", "x_test.py")


def written(told):
    """The lines of a report."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        told.write()
    return said.getvalue().splitlines()


class a_build(unittest.TestCase):
    def first_error(self, said):
        with tempfile.NamedTemporaryFile("w", encoding="utf-8") as log:
            log.write(said)
            log.flush()
            return subprocess.run([builds.first_error, log.name], stdout=subprocess.PIPE, text=True,
                                  check=True).stdout

    def test_shows_the_first_error_from_where_it_begins_and_not_the_command(self):
        self.assertEqual(self.first_error(BROKEN).splitlines(),
                         ["lib/CMakeFiles/rowe_json.dir/json/digits.cpp.o", *BROKEN.splitlines()[7:12]])

    def test_that_fails_otherwise_shows_the_end(self):
        self.assertEqual(self.first_error("one\ntwo\n"), "one\ntwo\n")

    def test_cuts_a_very_long_error_and_says_so(self):
        shown = self.first_error("FAILED: a.o\nc++\n" + "a.cpp:1: error: x\n" * 100).splitlines()
        self.assertEqual((len(shown), shown[-1]), (32, "... and 70 lines more"))

    def test_names_the_source_of_each_step_and_counts_a_step_once(self):
        steps = builds.timed(
            {"0\t1500\t1\tlib/CMakeFiles/x.dir/x.cpp.o\taa", "0\t200\t1\tbuild.ninja\tbb",
             "10\t400\t1\tbin/rowe\tcc", "10\t300\t1\tCMakeFiles/x.dir/cmake_pch.hxx.gch\tdd",
             "10\t300\t1\tCMakeFiles/x.dir/cmake_pch.hxx.gch\tdd"},
            {"lib/CMakeFiles/x.dir/x.cpp.o": "lib/x.cpp"})
        self.assertEqual(steps, [(1.5, "lib/x.cpp"), (0.39, "bin/rowe"), (0.29, "cmake_pch.hxx.gch")])


    def test_names_sources_that_were_compiled_together(self):
        root = pathlib.Path.cwd()
        self.assertEqual(builds.named([root / "lib/json/a_test.cpp"]), "lib/json/a_test.cpp")
        self.assertEqual(builds.named([root / "lib/json/reader_test.cpp", root / "lib/json/writer_test.cpp"]),
                         "lib/json/{reader,writer}_test.cpp")


class a_test(unittest.TestCase):
    def setUp(self):
        self.tests = {one.name: one for one in suites.taken_in(JUNIT)}

    def test_passes_or_fails(self):
        self.assertTrue(self.tests["json/a.passes"].passed)
        self.assertFalse(self.tests["json/a.fails"].passed)
        self.assertEqual(self.tests["json/a.fails"].said, "wrong")

    def test_is_skipped_with_its_reason(self):
        self.assertEqual(self.tests["rt/a.is_skipped"].skipped,
                         [("rt/a.is_skipped", "asserted in dev builds only")])
        self.assertEqual(self.tests["web/page"].skipped, [("web/page", "Node is not installed")])

    def test_that_is_a_script_counts_what_is_in_it(self):
        serve = self.tests["verbs/serve"]
        self.assertEqual(serve.count, 2)
        self.assertEqual(serve.skipped, [("verbs/serve test_two", "no network of its own here")])

    def test_counts_what_is_in_it(self):
        for what, said, parts in (
                ("of node, the leaves", TAP, (4, 1, [("third", "no browser")])),
                ("of a file, what never ended, too", GTEST, (4, 2, [("all/queue.is_empty/0", "not here")])),
                ("of a script", "Ran 7 tests in 1s\n\nFAILED (failures=2, errors=1)\n", (7, 3, [])),
                ("of no known sort, nothing", "ok, everything is well\n", (0, 0, []))):
            with self.subTest(what):
                self.assertEqual(suites.parts_of(said), parts)

    def test_of_a_file_names_what_failed_in_it_and_shows_only_that(self):
        junit = JUNIT.replace("wrong", GTEST)
        failed = {one.name: one for one in suites.taken_in(junit)}["json/a.fails"]
        self.assertEqual((failed.passed, failed.count, failed.failed), (False, 4, 2))
        self.assertEqual(failed.inside, ["queue.gives_one", "queue.ends"])
        shown = suites.of_those(failed.said, failed.inside)
        self.assertIn("queue_test.cpp:7: Failure", shown)
        self.assertNotIn("takes_one", shown)
        self.assertNotIn("not here", shown)

    def test_of_a_file_shows_what_a_sanitizer_said_in_another(self):
        said = GTEST.replace("said without an end", "WARNING: ThreadSanitizer: data race\n")
        self.assertIn("ThreadSanitizer", suites.of_those(said, ["queue.gives_one"]))
        self.assertEqual(suites.of_those(said, []), said)

    def test_whose_program_is_missing_has_failed(self):
        missing = self.tests["wire/NOT_BUILT"]
        self.assertFalse(missing.passed)
        self.assertEqual(missing.failed, 1)


class a_test_that_failed(unittest.TestCase):
    def run_with(self, *runs):
        """What suites.run() returns if ctest comes to these, one after the other; what it asked for is in
        self.asked."""
        self.asked, left = [], list(runs)

        def once(_, jobs, options, __):
            self.asked.append((jobs, list(options)))
            return left.pop(0)
        with unittest.mock.patch.object(suites, "run_once", once), contextlib.redirect_stdout(io.StringIO()):
            return suites.run("release", 6, ["-C", "all", "-R", "x"])

    @staticmethod
    def one(name, passed, said=""):
        return suites.test(name, 1.0, passed, 1, 0 if passed else 1, [], said)

    def test_and_passes_alone_has_passed_and_is_unsteady(self):
        tests = self.run_with(([self.one("a/b.c", False), self.one("d", True)], set()),
                              ([self.one("a/b.c", True)], set()))
        self.assertEqual([(each.passed, each.unsteady) for each in tests], [(True, True), (True, False)])
        self.assertEqual(self.asked[1], (1, ["-C", "all", "-R", r"^(a/b\.c)$"]))

    def test_and_fails_again_has_failed(self):
        tests = self.run_with(([self.one("a", False)], set()), ([self.one("a", False)], set()))
        self.assertEqual([(each.passed, each.unsteady) for each in tests], [(False, False)])

    def test_and_is_not_there_the_second_time_has_failed(self):
        tests = self.run_with(([self.one("a", False)], set()), ([self.one("ctest", False)], set()))
        self.assertFalse(tests[0].passed)

    def test_by_a_crash_or_a_report_of_a_sanitizer_is_not_run_again(self):
        for said, crashed in (("", {"a"}), ("WARNING: ThreadSanitizer: data race", set()),
                              ("==1==ERROR: AddressSanitizer: heap-use-after-free", set()),
                              ("x.cpp:1:2: runtime error: shift exponent", set())):
            tests = self.run_with(([self.one("a", False, said)], crashed))
            self.assertFalse(tests[0].passed)

    def test_among_many_is_not_run_again(self):
        many = [self.one(str(each), False) for each in range(suites.unsteady_max + 1)]
        self.assertFalse(any(each.passed for each in self.run_with((many, set()))))

    def test_of_a_file_among_many_in_it_is_not_run_again(self):
        one = self.one("a", False)._replace(inside=["b.c"] * (suites.unsteady_max + 1))
        self.assertFalse(any(each.passed for each in self.run_with(([one], set()))))

    def test_beside_a_crash_is_not_run_again(self):
        self.assertFalse(any(each.passed for each in self.run_with(
            ([self.one("a", False), self.one("b", False)], {"b"}))))

    def test_is_told_of_in_the_report(self):
        told = main.report()
        told.add("tsan", [self.one("a", True)._replace(unsteady=True)])
        self.assertIn("UNSTEADY: tsan: a: failed beside other tests, passed alone", written(told))
        self.assertTrue(told.ok())


class the_tests_of_a_program(unittest.TestCase):
    def test_are_one_for_each_file(self):
        def suite(name, *tests):
            return {"name": name, "testsuite": [{"name": test, "file": f"/x/{file}"} for test, file in tests]}
        self.assertEqual(
            discover.by_file({"testsuites": [suite("a", ("one", "a_test.cpp"), ("two", "a_test.cpp")),
                                             suite("all/a", ("one/0", "a_test.cpp")),
                                             suite("b", ("one", "a_test.cpp"), ("two", "b_test.cpp"))]}),
            {"a": ["a.*", "all/a.*", "b.one"], "b": ["b.two"]})


class a_report(unittest.TestCase):
    def test_names_what_failed_in_a_file(self):
        told = main.report()
        told.add("asan", suites.taken_in(JUNIT.replace("wrong", GTEST)))
        self.assertIn("FAILED: asan: json/a.fails queue.ends", written(told))

    def test_counts_what_passed_failed_and_was_skipped(self):
        told = main.report()
        told.add("asan", suites.taken_in(JUNIT))
        self.assertFalse(told.ok())
        self.assertEqual(sum(one.count for one in told.tests), 7)
        self.assertEqual(sum(one.failed for one in told.tests), 2)
        self.assertIn(("asan: web/page", "Node is not installed"), told.tests[3].skipped)

    def test_says_of_each_line_what_it_is_and_ends_with_how_many_of_what(self):
        told = main.report()
        told.add("release", suites.taken_in(JUNIT))
        told.left_out.append("presets asan, tsan and bench")
        lines = written(told)
        self.assertIn("SKIPPED: web/page: Node is not installed", lines)
        self.assertIn("SKIPPED: rt/a.is_skipped: asserted in dev builds only", lines)
        self.assertIn("LEFT OUT: presets asan, tsan and bench", lines)
        skipped = sum(line.startswith("SKIPPED: ") for line in lines)
        self.assertEqual(skipped, 3)
        self.assertEqual(lines[-2], "skipped, by area: rt 1, verbs 1, web 1")
        self.assertEqual(lines[-1], "2 passed, 2 failed, 3 skipped")


class an_area(unittest.TestCase):
    def setUp(self):
        self.enterContext(contextlib.chdir(self.enterContext(tempfile.TemporaryDirectory())))
        for name in (SCRIPT, SOURCE, "tests/json/CMakeLists.txt", "tests/rt/CMakeLists.txt", "rt/x.cpp",
                     "build/release/build.ninja", "build/release/bin/rowe"):
            pathlib.Path(name).parent.mkdir(parents=True, exist_ok=True)
            pathlib.Path(name).touch()
        self.record = areas.record("release")

    def passed(self):
        self.record.passed(areas.known(), time.time() + 1)

    def change(self, name):
        os.utime(name, (time.time() + 2, time.time() + 2))

    def test_is_due_until_its_tests_pass(self):
        self.assertEqual(self.record.due(), areas.known())
        self.passed()
        self.assertEqual(self.record.due(), [])

    def test_is_due_when_its_sources_or_its_tests_change(self):
        self.passed()
        self.change(SOURCE)
        self.assertEqual(self.record.due(), ["json"])
        self.change("tests/rt/CMakeLists.txt")
        self.assertEqual(self.record.due(), ["json", "rt"])

    def test_is_due_when_its_tests_failed(self):
        self.passed()
        self.record.failed(["rt"])
        self.assertEqual(self.record.due(), ["rt"])

    def test_runs_the_scripts_that_changed(self):
        self.passed()
        self.assertEqual(self.record.scripts_due("json"), set())
        self.change(SCRIPT)
        self.assertEqual(self.record.scripts_due("json"), {"json/x"})

    def test_leaves_out_what_would_take_too_long_but_not_what_changed(self):
        took = {"a": areas.seconds_max, "b": areas.seconds_max, "c": 1, "d": 0}
        self.assertEqual(areas.left_out(took, set(), 1), ["a", "b"])
        self.assertEqual(areas.left_out(took, {"a"}, 1), ["c", "b"])
        self.assertEqual(areas.left_out(took, set(), 8), [])

    def test_remembers_how_long_each_test_took_last(self):
        self.assertEqual(self.record.took(), {})
        self.record.remember([("json/a", 2.0), ("rt/c", 1.0)])
        self.record.remember([("json/a", 0.5)])
        self.assertEqual(self.record.took(), {"json/a": 0.5, "rt/c": 1.0})

    def test_is_not_current_when_a_program_is_newer_than_its_tests(self):
        self.passed()
        self.assertTrue(self.record.is_current("json"))
        self.change("build/release/bin/rowe")
        self.assertFalse(self.record.is_current("json"))

    def test_that_failed_is_due_and_the_others_are_not(self):
        tests = [one for one in suites.taken_in(JUNIT) if one.name.startswith("json/")]
        main.remember(self.record, tests, areas.known(), time.time() + 1)
        self.assertEqual(self.record.due(), ["json"])

    def test_of_which_ctest_ran_nothing_has_not_passed(self):
        nothing = suites.test("ctest", 0.0, False, 1, 1, [], "")
        main.remember(self.record, [nothing], areas.known(), time.time() + 1)
        self.assertEqual(self.record.due(), areas.known())


if __name__ == "__main__":
    unittest.main()
