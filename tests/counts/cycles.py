#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""cycles.py VALGRIND PROGRAM

Counts the instructions of each cycle of the service thread (core::cycle and all that it calls) while clients
come, under callgrind. PROGRAM is tests/counts/cycle_steps.cpp, with TLS and without. Fails when the longest
cycle of a phase takes more than the limit below: so no cycle is long because of a TLS handshake. One
handshake takes over a million instructions, so a cycle that did any part of one would be far beyond.

What the kernel does in system calls is not counted. tests/net and tests/counts/tls_test.cpp bound those."""
import os
import re
import subprocess
import sys
import tempfile

# Of each phase, with TLS: the most instructions of a cycle. How many clients a cycle finds differs from run
# to run, so these are far above what was seen: 10 000, 79 000 and 16 000. Without TLS an upgrade takes
# 64 000.
LIMITS = {"handshakes": 30_000, "upgrades": 140_000, "failures": 40_000}
CYCLE = "rowe::service::core::cycle(*"
CYCLE_IS_OVER = "rowe::service::core::record_cycle(*"  # called behind each
ENVIRONMENT = {**os.environ, "SIMDJSON_FORCE_IMPLEMENTATION": "westmere"}


def counted(valgrind, program, how, attempts=3):
    """The instructions of each cycle, by phase. Under valgrind on a busy machine a client may take longer
    than the server waits for it. Then the program fails, and is run again."""
    with tempfile.TemporaryDirectory() as folder:
        counts = os.path.join(folder, "counts")
        ran = subprocess.run([valgrind, "-q", "--fair-sched=yes", "--tool=callgrind",
                              f"--callgrind-out-file={counts}", "--combine-dumps=yes",
                              f"--toggle-collect={CYCLE}", f"--dump-after={CYCLE_IS_OVER}",
                              "--dump-after=phase_ends", program, how],
                             check=False, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True, timeout=250)
        if ran.returncode != 0:
            print(f"{how}: ended with {ran.returncode}: {ran.stderr[-300:]}")
            if attempts > 1:
                return counted(valgrind, program, how, attempts - 1)
            sys.exit(1)
        names = ran.stdout.split()
        with open(counts, encoding="utf-8", errors="replace") as file:
            dumps = re.findall(r"^desc: Trigger: --dump-after=(\S+)|^totals: (\d+)", file.read(),
                               re.MULTILINE)
    phases, cycles, trigger = {}, [], ""
    for triggered, total in dumps:
        if triggered:
            trigger = triggered
        elif trigger == "phase_ends":
            phases[names[len(phases)]] = cycles
            cycles = []
        else:
            cycles.append(int(total))
    return phases


def main():
    valgrind, program = sys.argv[1:]
    there = {how: counted(valgrind, program, how) for how in ("plain", "tls")}
    wrong = False
    for how, phases in there.items():
        for name, cycles in phases.items():
            if not cycles:
                sys.exit(f"{how}, {name}: no cycle was counted")
            longest = max(cycles)
            limit = LIMITS.get(name) if how == "tls" else None
            over = limit is not None and longest > limit
            wrong = wrong or over
            print(f"{how:5} {name:10} {len(cycles):4} cycles, the longest takes {longest:7} instructions"
                  f"{f', at most {limit}' if limit else ''}{'  TOO MANY' if over else ''}")
    sys.exit(wrong)


main()
