#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The part of tools/benchmark that runs and writes; see there. With --readme it writes bench/README.md, and
does nothing else."""
import argparse
import json
import os
import pathlib
import sys
import time

import compare
import machine
import methods
import pages
import results
import runner
import targets
import words
from programs import named, programs

kept = pathlib.Path("build/benchmark")


def arguments():
    parser = argparse.ArgumentParser(prog="tools/benchmark", allow_abbrev=False)
    parser.add_argument("--bin", help="the folder of the programs")
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs"))
    parser.add_argument("--against")
    parser.add_argument("--turns", type=int, default=4)
    parser.add_argument("--page-only", action="store_true")
    parser.add_argument("--no-page", action="store_true")
    parser.add_argument("--readme", action="store_true")
    asked = parser.parse_args()
    for name in asked.only:
        if not named(name):
            parser.error(f"there is no program {name}; there are " + ", ".join(one.name for one in programs))
    if asked.against and not os.path.isdir(asked.against):
        parser.error(f"--against: {asked.against} is no folder")
    if asked.against and os.path.samefile(asked.against, asked.bin):
        parser.error(f"--against: {asked.against} is where the other programs are")
    if asked.turns < 2:
        parser.error(f"--turns: {asked.turns} is too few; a row's own spread needs 2")
    return asked


def run(asked):
    chosen = [named(name) for name in asked.only] or programs
    facts_file = kept / "machine.json"
    if not asked.only or not facts_file.exists():
        facts_file.write_text(json.dumps(machine.facts(asked.bin)), encoding="utf-8")
    runner.raise_file_limit()
    begin = time.monotonic()
    for one in chosen:
        print(f"== {one.name}: {one.title} (after {time.monotonic() - begin:.0f} s)", flush=True)
        told = runner.run(one, asked.bin, kept, asked.rounds)
        if told.state == "ran":
            print(f"   {told.seconds:.0f} s", flush=True)
        else:
            print(f"   {told.state}: {told.why}", flush=True)
    return {one.name for one in chosen}


def run_by_turns(asked):
    """What compare.of_program() gives, by the names of programs."""
    chosen = [named(name) for name in asked.only] or [one for one in programs if one.kind != "text"]
    folder = kept / "by_turns"
    folder.mkdir(exist_ok=True)
    runner.raise_file_limit()
    begin = time.monotonic()
    found = {}
    for one in chosen:
        print(f"== {one.name}: {one.title} (after {time.monotonic() - begin:.0f} s)", flush=True)
        sides = {asked.against: [], asked.bin: []}
        for turn in range(1 if one.kind == "callgrind" else asked.turns):  # that counts, and measures nothing
            for programs_in in sorted(sides, reverse=turn % 2 == 1):  # neither is always the first
                sides[programs_in].append(runner.run(one, programs_in, folder, asked.rounds))
        for told in {each.why for side in sides.values() for each in side} - {""}:
            print(f"   {told}", flush=True)
        same = compare.same_code(one, sides)
        found[one.name] = compare.of_program(*sides.values(), same)
        for each in found[one.name]:
            if each.verdict:
                print(f"   {each.verdict}: {each.row}, {each.heading}: {each.ratio:.2f}", flush=True)
    return found


def compare_builds(asked):
    found = run_by_turns(asked)
    command = " ".join(["tools/benchmark --against DIR", f"--turns {asked.turns}"] +
                       ([f"--rounds {asked.rounds}"] if asked.rounds else []) +
                       [f"--only {name}" for name in asked.only])
    page = compare.page(programs, found, machine.facts(asked.bin), machine.commit(asked.against),
                        machine.commit(), asked.turns, asked.rounds, command)
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "benchmarks-compared.md").write_text(page, encoding="utf-8")
    print(f"\nwritten: {asked.out}/benchmarks-compared.md")


def summary(verdicts, told):
    """What a run of these programs means, in the terminal."""
    for one in verdicts:
        asked = one.target
        here = words.number(one.value) if one.value is not None else f"({one.why})"
        what = asked.quantity + (f": {asked.of}" if asked.of else "")
        print(f"{one.word:8}  {here:>8}  {str(asked.bound):8}  {what}")
    for one in told:
        if one.state != "ran":
            print(f"{one.state}: {one.program}: {one.why}")


def write_readme():
    pathlib.Path("bench/README.md").write_text(methods.readme(), encoding="utf-8")


def main():
    os.chdir(methods.top)
    asked = arguments()
    if asked.readme:
        write_readme()
        return
    kept.mkdir(parents=True, exist_ok=True)
    if asked.against:
        compare_builds(asked)
        return
    ran = {one.name for one in programs} if asked.page_only else run(asked)
    told = {one.name: results.kept(kept, one.name) for one in programs}
    print()
    summary([one for one in targets.judge_all(told) if one.target.program in ran],
            [told[name] for name in sorted(ran)])
    if not asked.no_page:
        try:
            facts = json.loads((kept / "machine.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            sys.exit("tools/benchmark: no results are kept; run it without --page first")
        pages.write(asked.out, told, facts)
        write_readme()  # the page links to its sections
        print(f"\nwritten: {asked.out}/benchmarks.md")


if __name__ == "__main__":
    sys.exit(main())
