#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Names the tests of a GoogleTest program to ctest, one for each file: NAME_test.cpp is AREA/NAME.

    tests/runner/discover.py PROGRAM AREA FILE [PROPERTY VALUE]...

writes FILE, which ctest includes."""
import collections
import json
import os
import pathlib
import subprocess
import sys
import tempfile


def by_file(listed):
    """name -> the filters of its tests, from what --gtest_list_tests writes as JSON. A test of several files
    is named by each."""
    tests, files_of = collections.defaultdict(list), collections.defaultdict(set)
    for suite in listed["testsuites"]:
        for one in suite["testsuite"]:
            name = os.path.basename(one["file"]).removesuffix(".cpp").removesuffix("_test")
            tests[name].append((suite["name"], one["name"]))
            files_of[suite["name"]].add(name)
    return {name: list(dict.fromkeys(f"{suite}.*" if len(files_of[suite]) == 1 else f"{suite}.{one}"
                                     for suite, one in inside))
            for name, inside in tests.items()}


def listed_by(program):
    with tempfile.TemporaryDirectory() as folder:
        written = pathlib.Path(folder, "tests.json")
        subprocess.run([program, "--gtest_list_tests", f"--gtest_output=json:{written}"],
                       stdout=subprocess.DEVNULL, timeout=60, check=True)
        return json.loads(written.read_text(encoding="utf-8"))


def main(program, area, file, *properties):
    lines = []
    for name, filters in sorted(by_file(listed_by(program)).items()):
        lines += [f"add_test([=[{area}/{name}]=] [=[{program}]=] [=[--gtest_filter={':'.join(filters)}]=])",
                  f"set_tests_properties([=[{area}/{name}]=] PROPERTIES {' '.join(properties)})"]
    pathlib.Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
