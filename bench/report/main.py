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
    parser.add_argument("--page-only", action="store_true")
    parser.add_argument("--no-page", action="store_true")
    parser.add_argument("--readme", action="store_true")
    asked = parser.parse_args()
    for name in asked.only:
        if not named(name):
            parser.error(f"there is no program {name}; there are " + ", ".join(one.name for one in programs))
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
