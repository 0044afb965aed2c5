#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""paths.py VALGRIND PROGRAM TABLE [--write]

Counts the instructions of the service thread for one step of each path (tests/counts/path_steps.cpp, which is
PROGRAM) and compares them with TABLE, paths.txt. Fails when a path takes over 2 % more than is said there,
and when it takes over 5 % fewer, since then the table hides the next loss. With --write the table is
written anew: with the commit that changed a path, which says why. Its last column, what each path took at
first, is not written anew: over 2 % more than that fails, too, else small losses would add up unseen. With
decision 73, when a folder became one unit, it became lower, but for pages, which rose from 746 to 778."""
import os
import re
import subprocess
import sys
import tempfile

STEPS = 1000  # that are counted of each path
MORE, FEWER = 0.02, 0.05
# What every x86-64 has: the instructions of simdjson and of the C library depend on the processor.
ENVIRONMENT = {**os.environ, "SIMDJSON_FORCE_IMPLEMENTATION": "westmere",
               "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX_Fast_Unaligned_Load,-ERMS"}
HEAD = """\
# Instructions of the service thread for one step of each path, with preset release, gcc 12, x86-64. Made by
# python3 tests/counts/paths.py valgrind build/release/tests/counts_path_steps tests/counts/paths.txt --write
# Path, instructions now, instructions at first.
"""


def counted(valgrind, program):
    """Instructions of each path for one step, in the program's order."""
    with tempfile.TemporaryDirectory() as folder:
        counts = os.path.join(folder, "counts")
        names = subprocess.run([valgrind, "-q", "--tool=callgrind", f"--callgrind-out-file={counts}",
                                "--toggle-collect=*scale::crossing<*", "--zero-before=counted_steps",
                                "--dump-after=counted_steps", program],
                               check=True, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True).stdout.split()
        there = {}
        for number, name in enumerate(names, 1):
            with open(f"{counts}.{number}", encoding="utf-8") as file:
                dump = file.read()
            if "--dump-after=counted_steps" not in dump:
                sys.exit(f"{name}: callgrind wrote something else")
            there[name] = round(int(re.search(r"^(?:totals|summary): (\d+)$", dump, re.MULTILINE)[1]) / STEPS)
        return there


def said_in(table):
    """Of each path: what it takes, and what it took at first."""
    with open(table, encoding="utf-8") as file:
        rows = [line.split() for line in file if line[0] != "#"]
        return {name: (int(now), int(first)) for name, now, first in rows}


def main():
    valgrind, program, table = sys.argv[1:4]
    there = counted(valgrind, program)
    said = said_in(table)
    if sys.argv[4:] == ["--write"]:
        with open(table, "w", encoding="utf-8") as file:
            file.write(HEAD)
            for name, count in there.items():
                file.write(f"{name:25} {count:6} {said[name][1] if name in said else count:6}\n")
        return
    if there.keys() != said.keys():
        sys.exit(f"either only counted or only in the table: {sorted(there.keys() ^ said.keys())}")
    wrong = False
    for name, count in there.items():
        now, first = said[name]
        change, in_all = count / now - 1, count / first - 1
        finding = ""
        if change > MORE:
            finding = f"  OVER {MORE:.0%} MORE"
        elif in_all > MORE:
            finding = f"  OVER {MORE:.0%} MORE THAN AT FIRST"
        elif change < -FEWER:
            finding = f"  OVER {FEWER:.0%} FEWER: write the table anew"
        wrong = wrong or bool(finding)
        print(f"{name:25} {count:6}, the table says {now:6}: {change:+.1%}; since the first {in_all:+.1%}"
              f"{finding}")
    sys.exit(wrong)


main()
