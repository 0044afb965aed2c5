#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The part of tools/test that builds, runs and reports; see there."""
import argparse
import collections
import os
import re
import sys
import time

import areas
import builds
import suites
import terminal

slowest_shown = 10
with_tests = ["-DROWE_TESTS=ON", "-DROWE_TOOLS=ON"]
# What tools/test --all runs longer than tools/test does, or alone.
long_runs = ["^rt_contract/", "^sim/(sim|messaging_sim|swarm_|growth)", "^failures/",
             "^conformance/tls_(client|json|limits)$", "^counts/cycles", "^faults/testssl$",
             "^install/fetched$", "^load/.*minute", "^model/promela.*long$"]
# What the sanitizers' presets leave out: nothing of it is compiled by them, or they find nothing in it that
# they do not find in its neighbours.
same_everywhere = ["^(tidy|runner)/", "^model/promela", "^json/refused$", "^arm64/memory_orders",
                   "^bench/(report|releases|pages)$", "needs_every_memory_order",
                   "^sim/stop_silence.needs_a_timeout", "^sim/backlog_sim.follows",
                   "^sim/delays.let_all_messages"]
# What AddressSanitizer's preset leaves out besides: scripts that start a thousand processes to look at what
# they print. Each start costs it a tenth of a second; what these processes do, others do as well.
only_words = ["^tools/(arguments|completion|output)$", "^bench/(programs)$"]
# What ThreadSanitizer's preset leaves out besides: scripts of verbs whose one thread talks to an endpoint, of
# which others test that it may.
one_thread = ["^tools/(arguments|bench|config|connection|doctor|echo|info|network|output)$",
              "^tools/(plain|pub|replay.*|types)$"]
# Most tests that take long wait for something; under a sanitizer they compute.
tests_per_core = {"release": 3, "asan": 2, "tsan": 2}


class report:
    """What a run comes to, in the end."""

    def __init__(self):
        self.steps = []     # (seconds, what) of building
        self.tests = []     # suites.test, each named with its preset
        self.left_out = []  # whole suites, with their reason
        self.broken = ""    # what does not build

    def add(self, preset, tests):
        self.tests += [one._replace(name=with_preset(preset, one.name),
                                    skipped=[(with_preset(preset, name), why) for name, why in one.skipped])
                       for one in tests]

    def ok(self):
        return not self.broken and all(one.passed for one in self.tests)

    def write(self):
        skipped = [one for each in self.tests for one in each.skipped]
        terminal.heading("done")
        slowest("slowest steps of building", sorted(self.steps, reverse=True))
        slowest("slowest tests", sorted(((one.seconds, one.name) for one in self.tests), reverse=True))
        for name, why in skipped:
            print(f"SKIPPED: {name}: {why}")
        for what in self.left_out:
            print(f"LEFT OUT: {what}")
        for one in self.tests:
            if one.unsteady:
                print(f"UNSTEADY: {one.name}: failed beside other tests, passed alone")
            if not one.passed:
                inside = [inner for inner in one.inside if not one.name.endswith(inner)]
                for inner in inside or [""]:
                    print(f"FAILED: {one.name} {inner}".rstrip())
        if self.broken:
            print(f"NOT BUILT: {self.broken}")
        count, failed = sum(one.count for one in self.tests), sum(one.failed for one in self.tests)
        of_what = collections.Counter(area_of(name) for name, _ in skipped)
        if skipped:
            print("skipped, by area: "
                  + ", ".join(f"{area} {number}" for area, number in sorted(of_what.items())))
        # The last line, in the form that continuous integration reads.
        print(f"{count - failed - len(skipped)} passed, {failed} failed, {len(skipped)} skipped", flush=True)


def with_preset(preset, name):
    return name if preset == "release" else f"{preset}: {name}"


def area_of(name):
    return name.split("/")[0]


def slowest(what, timed):
    shown = [one for one in timed[:slowest_shown] if one[0] >= 0.05]
    if shown:
        print(f"the {len(shown)} {what}:")
        for seconds, name in shown:
            print(f"  {seconds:6.1f} s  {name}")


def arguments():
    parser = argparse.ArgumentParser(prog="tools/test", allow_abbrev=False)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--quick", nargs="?", const="", metavar="AREA")
    parser.add_argument("--offline", action="store_true")
    parser.add_argument("--began", type=float, default=0.0, help=argparse.SUPPRESS)
    parser.add_argument("-j", type=int, default=len(os.sched_getaffinity(0)), dest="jobs", metavar="N")
    asked = parser.parse_args()
    if asked.jobs < 1:
        parser.error(f"-j: {asked.jobs} is less than 1")
    if asked.quick is not None and asked.all:
        parser.error("--all and --quick do not go together")
    if asked.quick and asked.quick not in areas.known():
        parser.error(f"there is no area {asked.quick}; there are {', '.join(areas.known())}")
    return asked


def build(told, preset, asked, targets=(), options=()):
    terminal.heading(f"preset {preset}: building")
    told.left_out += [with_preset(preset, one) for one in builds.configure(preset, options)]
    begin = time.monotonic()
    steps = builds.build(preset, asked.jobs, targets)
    told.steps += [(seconds, with_preset(preset, what)) for seconds, what in steps]
    compiled = [seconds for seconds, name in steps if name.endswith((".cpp", ".c", ".S", ".gch"))]
    terminal.line(f"{len(compiled)} units compiled in {sum(compiled):.0f} s of one core; "
                  f"{len(steps)} steps in {time.monotonic() - begin:.0f} s")


def run(told, preset, asked, options=(), environment=None, name=None):
    begin = time.monotonic()
    tests = suites.run(preset, tests_per_core[preset] * asked.jobs, options, environment)
    told.add(name or preset, tests)
    bad = sum(one.failed for one in tests)
    terminal.line(f"{sum(one.count for one in tests)} tests in {time.monotonic() - begin:.0f} s"
                  + (f", {bad} failed" if bad else ""))
    return tests


def remember(record, tests, due, began):
    """What these tests, of these areas, mean for the next `--quick`."""
    record.remember((one.name, one.seconds) for one in tests if one.seconds)
    bad = {one.name.split("/")[0] for one in tests if not one.passed}
    known = set() if "ctest" in bad else set(due)  # ctest itself did not do what it should
    record.failed(bad.intersection(due))
    record.passed(known - bad, began)


def whole(told, asked):
    record, began = areas.record("release"), time.time()
    # With --all, what the tests of ROS need has been installed.
    ros1 = ["-DROWE_ROS1=ON"] if asked.all and not asked.offline else []
    build(told, "release", asked, options=[*with_tests, *ros1])
    terminal.heading("preset release: testing")
    record.failed(areas.known())
    tests = run(told, "release", asked)
    record.forget_times()
    remember(record, tests, areas.known(), began)
    if not asked.all:
        told.left_out.append("presets asan and tsan, the long runs and the benches: tools/test --all")
        return
    for preset in ("asan", "tsan"):
        build(told, preset, asked)
        terminal.heading(f"preset {preset}: testing")
        not_here = same_everywhere + (one_thread if preset == "tsan" else only_words)
        run(told, preset, asked, ["-E", "|".join(not_here)], {"ROWE_SIM_SEEDS": "30"})
    build(told, "release", asked, ["sim_swarm_mutants"])
    terminal.heading("the long runs: 10^6 calls, 10 000 seeds, 10^8 messages, each failure, each mutant")
    run(told, "release", asked, ["-C", "all", "-R", "|".join(long_runs)],
        {"ROWE_CONTRACT_CALLS": "1000000", "ROWE_SIM_SEEDS": "10000", "ROWE_GROWTH_MESSAGES": "100000000",
         "ROWE_FAILURES": "all", "ROWE_SIM_JOBS": str(asked.jobs)}, "long")
    # So that they go on to build; tools/benchmark runs them. The library that they need is built already.
    build(told, "release", asked, options=[*with_tests, "-DROWE_BENCH=ON"])


def quick(told, asked):
    record = areas.record("release")
    due = [asked.quick] if asked.quick else record.due()
    if not due:
        terminal.line("no area has changed since its tests passed")
        return
    began = time.time()
    build(told, "release", asked, [f"area_{one}" for one in due], with_tests)
    if asked.quick and record.is_current(asked.quick):
        terminal.line(f"nothing that {asked.quick} needs has changed since its tests passed")
        return
    terminal.heading(f"testing {', '.join(due)}")
    expression = f"^({'|'.join(due)})/"
    took = {name: seconds for name, seconds in record.took().items() if re.match(expression, name)}
    out = areas.left_out(took, set().union(*(record.scripts_due(one) for one in due)), asked.jobs)
    options = ["-R", expression]
    if out:
        options += ["-E", "^(" + "|".join(map(re.escape, out)) + ")$"]
    told.left_out += [f"{name}: took {took[name]:.1f} s" for name in out]
    record.failed(due)
    remember(record, run(told, "release", asked, options), due, began)


def main():
    if sys.argv[1:2] == ["--check"]:
        del sys.argv[1]
        arguments()
        return
    asked = arguments()
    sys.stdout.reconfigure(errors="replace")
    terminal.begun_before(asked.began)
    if not asked.offline:
        os.environ["ROWE_COMPLETE"] = "1"  # what is missing is an error
    told = report()
    ended = None
    try:
        (quick if asked.quick is not None else whole)(told, asked)
    except builds.failed as why:
        terminal.line(str(why))
        told.broken = str(why).splitlines()[0]
    except KeyboardInterrupt:
        terminal.line("interrupted")
        ended = 130
    told.write()
    sys.exit(ended or (0 if told.ok() else 1))


if __name__ == "__main__":
    main()
