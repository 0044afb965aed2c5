#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""instructions.py VALGRIND CALLGRIND_ANNOTATE PROGRAM DOCUMENT

Counts the instructions of each call of a loop (bench/instructions.cpp, which is PROGRAM) and compares them
with the table in DOCUMENT, docs/real-time.md. Fails when a call takes more or fewer than is said there, by
more than one: then the change belongs into the table, with its reason in the commit. What is done with JSON
fails when it takes more than the limits below."""
import os
import re
import subprocess
import sys
import tempfile

# The functions of bench/instructions.cpp that each row of the table is about, in its order.
ROWS = {
    "`publish`, every value kept; the newest kept": ("publish_all", "publish_newest"),
    "`publish`, nobody listens; the queue is full": ("publish_to_nobody", "publish_when_full"),
    "`publish` of a text; `try_send`": ("publish_text", "send"),
    "`try_take` and its view given back; nothing there": ("take_and_release", "take_nothing"),
    "`try_receive` and its view given back": ("receive_and_release",),
    "`start` a call; `try_finish` it and give its view back": ("call_start", "call_finish"),
    "`try_next` and `reply`, with structs": ("request_next_and_reply",),
    "`engaged` while running; stopped anew, and `acknowledge`":
        ("latch_engaged", "latch_trips_and_acknowledges"),
}
# Of bench/json_steps.cpp, for one message or one piece of a long text: some 4 % above what it takes.
LIMITS = {
    "encode_odometry": 3270,
    "encode_odometry_as_cbor": 1745,
    "encode_scan_as_cbor": 915,
    "encode_16k_of_bytes": 151500,
    "decode_16k_of_bytes": 142500,
    "write_small_call": 312,
    "read_small_call": 1930,
    "read_publish_envelope": 4830,
    "scan_4k_of_map": 72000,
    "scan_4k_of_points": 52200,
    "scan_4k_of_image": 5150,
    "scan_4k_of_brackets": 204000,
    "scan_4k_of_escapes": 65000,
    "scan_4k_of_short_texts": 225000,
    "scan_4k_of_exponents": 78000,
    "scan_4k_of_characters": 79000,
}
CALLS = 1000  # of each function
# What every x86-64 of the last fifteen years has: the instructions of simdjson depend on the processor.
ENVIRONMENT = {**os.environ, "SIMDJSON_FORCE_IMPLEMENTATION": "westmere"}


def counted(valgrind, annotate, program):
    """Instructions of each function of namespace steps, for one call."""
    with tempfile.TemporaryDirectory() as folder:
        counts = os.path.join(folder, "counts")
        subprocess.run([valgrind, "-q", "--tool=callgrind", f"--callgrind-out-file={counts}",
                        "--toggle-collect=steps::*", program], check=True, env=ENVIRONMENT)
        said = subprocess.run([annotate, "--inclusive=yes", "--threshold=100", counts], check=True,
                              stdout=subprocess.PIPE, text=True).stdout
    return {name: int(total.replace(",", "")) / CALLS
            for total, name in re.findall(r"^ *([\d,]+) .*:steps::(\w+)\(", said, re.MULTILINE)}


def documented(text):
    """The same, as the document's table says."""
    numbers = {}
    for label, functions in ROWS.items():
        row = re.search(r"^\| " + re.escape(label) + r" \| ([\d; ]+) \|$", text, re.MULTILINE)
        if not row:
            sys.exit(f"the table has no row {label!r}")
        numbers.update(zip(functions, map(int, row[1].split(";")), strict=True))
    return numbers


def main():
    valgrind, annotate, program, document = sys.argv[1:]
    there = counted(valgrind, annotate, program)
    with open(document, encoding="utf-8") as file:
        said = documented(file.read())
    if missing := (said.keys() | LIMITS.keys()) - there.keys():
        sys.exit(f"not counted: {sorted(missing)}")
    wrong = [f"{name}: {there[name]:.0f} instructions, documented are {said[name]}" for name in said
             if abs(there[name] - said[name]) > 1]
    wrong += [f"{name}: {there[name]:.0f} instructions, the limit is {limit}"
              for name, limit in LIMITS.items() if there[name] > limit]
    fine = [f"{name}: {count:.0f}, as documented" for name, count in there.items() if name in said]
    fine += [f"{name}: {there[name]:.0f}, at most {limit}" for name, limit in LIMITS.items()]
    print("\n".join(wrong or fine))
    sys.exit(bool(wrong))


main()
