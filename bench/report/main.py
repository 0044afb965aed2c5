#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The part of tools/benchmark that runs and writes; see there. With --readme it writes bench/README.md, and
does nothing else."""
import argparse
import dataclasses
import json
import os
import pathlib
import sys
import time

import compare
import machine
import methods
import pages
import releases
import results
import runner
import runs
import targets
import words
from programs import named, programs

kept = pathlib.Path("build/benchmark")
facts_file = kept / "machine.json"


def arguments():
    parser = argparse.ArgumentParser(prog="tools/benchmark", allow_abbrev=False)
    parser.add_argument("--bin", help="the folder of the programs")
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs"))
    parser.add_argument("--against")
    parser.add_argument("--turns", type=int)
    parser.add_argument("--save", type=pathlib.Path)
    parser.add_argument("--compare", type=pathlib.Path, nargs="+", default=[], metavar="OLD.json")
    parser.add_argument("--page-only", action="store_true")
    parser.add_argument("--no-page", action="store_true")
    parser.add_argument("--readme", action="store_true")
    asked = parser.parse_args()
    for name in asked.only:
        if not named(name):
            parser.error(f"there is no program {name}; there are " + ", ".join(one.name for one in programs))
    asked.only = [named(name).name for name in asked.only]
    if asked.against and not os.path.isdir(asked.against):
        parser.error(f"--against: {asked.against} is no folder")
    if asked.against and os.path.samefile(asked.against, asked.bin):
        parser.error(f"--against: {asked.against} is where the other programs are")
    needs_spread = bool(asked.against or asked.save or asked.compare)
    asked.turns = (4 if needs_spread else 1) if asked.turns is None else asked.turns
    if asked.turns < 2 and needs_spread:
        parser.error(f"--turns: {asked.turns} is too few; a row's own spread needs 2")
    if asked.turns < 1:
        parser.error(f"--turns: {asked.turns} is too few")
    if asked.against and (asked.save or asked.compare):
        parser.error("--against compares builds, and --save and --compare are about runs: one at a time")
    if asked.save and not asked.save.parent.is_dir():
        parser.error(f"--save: {asked.save.parent} is no folder")
    if asked.save and len(asked.compare) == 2:
        parser.error("--save: two files are compared, so there is no run to save")
    if len(asked.compare) > 2:
        parser.error(f"--compare: {len(asked.compare)} files are given; it takes two at most")
    try:  # before anything runs
        asked.compare = [runs.load(path) for path in asked.compare]
    except runs.unusable as wrong:
        parser.error(f"--compare: {wrong}")
    return asked


def run(asked):
    """What machine it was. The results are kept."""
    chosen = [named(name) for name in asked.only] or programs
    facts = machine.facts(asked.bin)
    if not asked.only or not facts_file.exists():
        facts_file.write_text(json.dumps(facts), encoding="utf-8")
    runner.raise_file_limit()
    begin = time.monotonic()
    turns = {one.name: [] for one in chosen}
    for turn in range(asked.turns):  # all programs in each: what differs from minute to minute is spread, too
        for one in chosen:
            if turn > 0 and (one.kind != "benchmark" or turns[one.name][-1].state != "ran"):
                continue  # it counts, or only prints, or does not run
            which = f"turn {turn + 1} of {asked.turns}, " if asked.turns > 1 else ""
            print(f"== {one.name}: {one.title} ({which}after {time.monotonic() - begin:.0f} s)", flush=True)
            told = runner.run(one, asked.bin, kept, asked.rounds)
            if told.state == "ran":
                print(f"   {told.seconds:.0f} s", flush=True)
            else:
                print(f"   {told.state}: {told.why}", flush=True)
            # They were built before the first of them ran.
            turns[one.name].append(dataclasses.replace(told, commit=facts["commit"]))
    for told in map(results.merged, turns.values()):
        results.keep(kept, told)
    return facts


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


def since_release(folder, told, facts):
    """The section of the page that compares with the newest release whose run is kept in the folder."""
    before = runs.newest(folder, facts["commit"])
    if not before:
        return ""
    try:
        now = runs.of("this run", told, facts, machine.versions())
    except runs.unusable as wrong:
        return f"{releases.heading(before)}\nNot compared: {wrong}.\n"
    return releases.section(releases.between(before, now))


def kept_facts():
    try:
        return json.loads(facts_file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        sys.exit("tools/benchmark: no results are kept; run it without --page first")


def save_and_compare(asked, told, facts):
    if asked.save:
        written = runs.text(told, facts, machine.versions())
        runs.parse(asked.save.name, written)  # nothing is written that cannot be compared with
        asked.save.write_text(written, encoding="utf-8")
        print(f"\nwritten: {asked.save}")
    if asked.compare:
        now = runs.of("this run", told, facts, machine.versions())
        print("\n" + releases.report(releases.between(asked.compare[0], now, asked.only)))


def write_readme():
    pathlib.Path("bench/README.md").write_text(methods.readme(), encoding="utf-8")


def main():
    os.chdir(methods.top)
    asked = arguments()
    if asked.readme:
        write_readme()
        return
    if len(asked.compare) == 2:
        print(releases.report(releases.between(*asked.compare, asked.only)))
        return
    kept.mkdir(parents=True, exist_ok=True)
    if asked.against:
        compare_builds(asked)
        return
    facts = kept_facts() if asked.page_only else run(asked)
    told = {one.name: results.kept(kept, one.name) for one in programs}
    chosen = {one.name: told[one.name] for one in ([named(name) for name in asked.only] or programs)}
    print()
    summary([one for one in targets.judge_all(told) if one.target.program in chosen],
            [chosen[name] for name in sorted(chosen)])
    try:
        save_and_compare(asked, chosen, facts)  # first: what took an hour must not be lost to a page
        if not asked.no_page:
            of_page = kept_facts()
            pages.write(asked.out, told, of_page, since_release(asked.out / "benchmarks", told, of_page))
            write_readme()  # the page links to its sections
            print(f"\nwritten: {asked.out}/benchmarks.md")
    except runs.unusable as wrong:
        sys.exit(f"tools/benchmark: {wrong}")


if __name__ == "__main__":
    sys.exit(main())
