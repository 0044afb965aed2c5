# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of a preset with ctest and takes in what became of them, from its JUnit file.

Some tests are about time: how long a peer is waited for, what is cut for being late. On a machine that is
busy with other tests one of them fails now and then. So what failed is run once more, alone. What passes
then has passed, and is reported as unsteady. A crash and a sanitizer's report count at once: they are faults
however seldom they come. So does everything if more than unsteady_max tests fail.
(docs/decisions/0057-run-a-failed-test-again-alone.md)"""
import collections
import os
import pathlib
import re
import subprocess
import xml.etree.ElementTree as tree

import terminal

output_lines_max = 100
shown_max = 10
unsteady_max = 6
of_sanitizers = re.compile(r"(ERROR|WARNING): \w+Sanitizer|runtime error: ")

# What a test of ctest was: `count` and `failed` are of single tests, since a script, or a file of tests, can
# have many. `skipped` has a (name, reason) for each that did not run. `unsteady`: it failed beside others and
# passed alone. `inside`: those that failed in it, where it names them.
test = collections.namedtuple("test", "name seconds passed count failed skipped said unsteady inside",
                              defaults=(False, ()))


def run(preset, jobs, options=(), environment=None):
    """Returns the tests that ran, or did not; prints those that failed, also if they passed then alone."""
    tests, crashed = run_once(preset, jobs, options, environment)
    again = [one.name for one in tests if may_run_again(one, crashed)]
    bad = [one for one in tests if not one.passed]
    if again and len(again) == len(bad) and sum(len(one.inside) or 1 for one in bad) <= unsteady_max:
        terminal.line(f"again, alone: {' '.join(again)}")
        of_all = [option for option in options if option == "all"]  # ctest -C all
        alone, _ = run_once(preset, 1, [*(["-C", "all"] if of_all else []), "-R",
                                        "^(" + "|".join(map(re.escape, again)) + ")$"], environment)
        tests = judged(tests, alone)
    return tests


def may_run_again(one, crashed):
    return not (one.passed or one.name in {"ctest", *crashed} or of_sanitizers.search(one.said))


def judged(tests, alone):
    """The tests, of which some failed and ran once more."""
    second = {one.name: one for one in alone}
    return [second[one.name]._replace(unsteady=True) if not one.passed and one.name in second
            and second[one.name].passed and not second[one.name].skipped else one for one in tests]


def run_once(preset, jobs, options, environment):
    """The tests, and the names of those that crashed."""
    folder = pathlib.Path("build") / preset
    results = folder / "tests.xml"
    results.unlink(missing_ok=True)
    command = ["ctest", "--preset", preset, "-j", str(jobs), "--timeout", "600", "--output-junit",
               str(results.resolve()), "--test-output-size-passed", "1000000",
               "--test-output-size-failed", "1000000", *options]
    failed, crashed = 0, set()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8",
                          errors="replace", env={**os.environ, **(environment or {})}) as ran:
        said = []
        for one in ran.stdout:
            said.append(one)
            done = re.match(r"\s*(\d+/\d+) Test\s+#\d+: (\S+) [. ]*(.*)", one)
            if done:
                if "Exception" in done[3]:
                    crashed.add(done[2])
                failed += "Failed" in done[3] or "Exception" in done[3] or "Timeout" in done[3]
                count = f", {failed} failed" if failed else ""
                terminal.progress(f"[{done[1]}{count}] {done[2]}")
    terminal.clear()
    tests = taken_in(results.read_text(encoding="utf-8", errors="replace")) if results.exists() else []
    if not tests or (ran.returncode != 0 and all(one.passed for one in tests)):
        tests.append(test("ctest", 0.0, False, 1, 1, [], "".join(said[-output_lines_max:])))
    show([one for one in tests if not one.passed], folder / "Testing/Temporary/LastTest.log")
    return tests, crashed


def show(tests, log):
    for one in tests[:shown_max]:
        lines = of_those(one.said, one.inside).rstrip().splitlines()
        if len(lines) > output_lines_max:
            lines = [f"... ({len(lines) - output_lines_max} lines more above)", *lines[-output_lines_max:]]
        terminal.line(f"FAILED: {one.name} ({one.seconds:.1f} s)")
        terminal.line("\n".join("  " + each for each in lines))
    for one in tests[shown_max:]:
        terminal.line(f"FAILED: {one.name}")
    if tests:
        terminal.line(f"what all tests printed: {log}")


def taken_in(junit):
    """The tests of a JUnit file that ctest wrote."""
    return [taken(case) for case in tree.fromstring(junit).iter("testcase")]


def taken(case):
    name, said = case.get("name"), case.findtext("system-out", "")
    skip = case.find("skipped")
    message = skip.get("message", "") if skip is not None else ""
    # A program that is missing is "notrun", too, and no reason to be content.
    if case.get("status") == "disabled" or message.startswith("SKIP_") or message == "Skipped":
        reason = re.search(r": Skipped\n(.*)|^skipped: (.*)$", said, re.MULTILINE)
        why = (reason[1] or reason[2]) if reason else said.strip().split("\n")[-1] or message
        return test(name, 0.0, True, 1, 0, [(name, why)], said)
    passed = case.find("failure") is None and case.get("status") == "run"
    ran = pieces(said)
    inside = [] if passed else [inner for inner, of_it in ran.items() if how(inner, of_it) == "FAILED"]
    count, failed, skipped = parts_of(said)
    return test(name, float(case.get("time", 0)), passed, max(count, 1), 0 if passed else max(failed, 1),
                [(f"{name} {inner}", why) for inner, why in skipped], said if passed or said else message,
                inside=inside)


def pieces(said):
    """What each test of a GoogleTest program said, by its name."""
    parts = re.split(r"\[ RUN      \] (\S+)\n", said)
    return dict(zip(parts[1::2], parts[2::2]))


def how(name, said):
    """How such a test ended; one that crashed did not."""
    for end in ("OK", "SKIPPED"):
        if re.search(rf"\[ +{end} \] {re.escape(name)} \(", said):
            return end
    return "FAILED"


def of_those(said, inside):
    """What these tests said, and what a sanitizer says; all of it where no tests are named."""
    kept = [f"[ RUN      ] {name}\n{of_it}" for name, of_it in pieces(said).items()
            if name in inside or of_sanitizers.search(of_it)]
    return "".join(kept) if inside else said


def parts_of(said):
    """How many tests a script had, how many of them failed, and which it skipped, by its own words:
    GoogleTest, Python's unittest, or the TAP of node --test."""
    ended = {name: how(name, of_it) for name, of_it in pieces(said).items()}
    if ended:
        reasons = {name: re.search(r": Skipped\n(.*)", of_it) for name, of_it in pieces(said).items()}
        skipped = [(name, reasons[name][1] if reasons[name] else "") for name, end in ended.items()
                   if end == "SKIPPED"]
        return len(ended), sum(end == "FAILED" for end in ended.values()), skipped
    ran = re.findall(r"^Ran (\d+) tests? in ", said, re.MULTILINE)
    if ran:
        skipped = re.findall(r"^(\S+) \([^)]*\).* skipped ['\"](.*)['\"]$", said, re.MULTILINE)
        failed = re.findall(r"^FAILED \((.*)\)$", said, re.MULTILINE)
        bad = sum(int(number) for one in failed for number in re.findall(r"(?:failures|errors)=(\d+)", one))
        return sum(map(int, ran)), bad, skipped
    count, failed, skipped, plan = 0, 0, [], None
    for indent, planned, bad, name, directive, why in re.findall(
            r"^( *)(?:(\d+\.\.\d+)|(not )?ok \d+ - (.*?)(?: # ([A-Z]+) ?(.*))?)$", said, re.MULTILINE):
        if planned:
            plan = len(indent)  # the next point of the level above is that of these together
        elif plan == len(indent) + 4:
            plan = None
        else:
            count += 1
            failed += bool(bad)
            if directive == "SKIP":
                skipped.append((name, why))
    return count, failed, skipped
