#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the ordering instructions of each function of paths.cpp with what the line above it expects.

    orders.py COMPILER OBJDUMP SOURCE INCLUDE_FOLDER...
    orders.py --weakened COMPILER OBJDUMP SOURCE INCLUDE_FOLDER...

The second compiles it with every memory order relaxed, and fails where a function still is as expected that
expects any: what the first one says would mean nothing there.

Ordering instructions are loads and stores with acquire or release, exclusive and atomic ones, and barriers. A
call to what the same file defines counts as what that consists of; any other call stands among the
instructions as `call:NAME`.
"""
import collections
import re
import subprocess
import sys
import tempfile

exclusive = r"(?:ld|st)a?l?xp?r?[bh]?"  # ldxr, ldaxr, stlxr, ldxp ...
atomic = r"(?:swp|cas|(?:ld|st)(?:add|clr|eor|set|[su]max|[su]min))\w*"
one_way = r"(ldar|ldapr|ldapur|ldlar|stlr|stlur|stllr)s?[bhw]*"  # of whichever width
ordering = re.compile(rf"(?:{one_way}|({exclusive}|{atomic}|dmb|dsb|isb))$")
difference = collections.namedtuple("difference", "function expected found")


def expectations(source):
    """function -> (whether the order counts, the instructions); `2*ldar` is two of them"""
    found = {}
    lines = open(source, encoding="utf-8").read().split("\n")
    for number, line in enumerate(lines):
        said = re.match(r"// expects( in this order)?: (.*)", line)
        if said:
            name = re.search(r"(\w+)\(", lines[number + 1])[1]
            counted = [re.fullmatch(r"(?:(\d+)\*)?(.*)", one) for one in said[2].split()]
            wanted = [one[2] for one in counted for _ in range(int(one[1] or 1))]
            found[name] = (said[1] is not None, [] if said[2] == "nothing" else wanted)
    return found


def disassembled(compiler, objdump, source, folders, *more):
    """function -> its ordering instructions and calls, in the order in which they lie there"""
    with tempfile.NamedTemporaryFile(suffix=".o") as compiled:
        subprocess.run([compiler, "-std=c++20", "-O2", "-DNDEBUG", "-march=armv8-a", *more, "-c", source,
                        *(f"-I{folder}" for folder in folders), "-o", compiled.name], check=True)
        text = subprocess.run([objdump, "-dr", "--no-show-raw-insn", compiled.name], check=True,
                              capture_output=True, text=True).stdout
    functions = {}
    for line in text.split("\n"):
        begin = re.match(r"[0-9a-f]+ <([^>]+)>:", line)
        if begin:
            here = functions[begin[1]] = []
        elif call := re.search(r"R_AARCH64_(?:CALL|JUMP)26\s+(\S+)", line):
            here.append("call:" + call[1])
        elif instruction := re.match(r"\s+[0-9a-f]+:\t(\S+)", line):
            if instruction[1] in ("blr", "br"):
                here.append("call:unknown")
            elif known := ordering.match(instruction[1]):
                here.append(known[1] or known[2])
    return functions


def flattened(functions, name, within=()):
    """With what is defined there in place of the calls to it; parts split off as unlikely belong to it."""
    for what in functions[name]:
        callee = what.removeprefix("call:")
        if what.startswith("call:.text"):
            continue  # a jump into the part split off
        if callee in functions and callee not in within:
            yield from flattened(functions, callee, (*within, name))
        else:
            yield what
    if name + ".cold" in functions:
        yield from flattened(functions, name + ".cold", (*within, name))


def differences(expected, functions):
    for name, (in_order, instructions) in expected.items():
        found = list(flattened(functions, name))
        same = found == instructions if in_order else sorted(found) == sorted(instructions)
        if not same:
            yield difference(name, instructions, found)


def main(arguments):
    weakened = arguments[:1] == ["--weakened"]
    compiler, objdump, source, *folders = arguments[weakened:]
    expected = expectations(source)
    functions = disassembled(compiler, objdump, source, folders, *(["-DWEAKENED"] if weakened else []))
    public = {name for name in functions if not name.startswith("_Z") and not name.endswith(".cold")}
    if public != set(expected) or not public:
        sys.exit(f"{source}: not both with an expectation and compiled: {sorted(public ^ set(expected))}")
    wrong = {one.function: one for one in differences(expected, functions)}
    if weakened:
        ordered = [name for name, (_, those) in expected.items() if those]
        unnoticed = [name for name in ordered if name not in wrong]
        print(f"{len(wrong)} of {len(expected)} functions differ when weakened")
        sys.exit(f"not noticed when weakened: {unnoticed}" if unnoticed else 0)
    for one in wrong.values():
        print(f"{one.function}: expected {' '.join(one.expected) or 'nothing'}")
        print(f"{' ' * len(one.function)}  has      {' '.join(one.found) or 'nothing'}")
    print(f"{len(expected) - len(wrong)} of {len(expected)} functions are as expected")
    sys.exit(1 if wrong else 0)


main(sys.argv[1:])
