#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""headers.py COMPILER INCLUDE_DIRECTORY...

What a user's file pays for rowe's headers: the lines that the compiler reads. Fails when one of LIMITS is
exceeded, or when a header is included that is far dearer than what is used of it."""
import re
import subprocess
import sys

LIMITS = {  # 1 % above what it is with libstdc++ 12, where <string>, <vector> and <memory> alone are 38,346
    "rowe/rowe.hpp": 52_900,
    "rowe/schema.hpp": 39_300,
    "rowe/rt/spsc_ring.hpp": 26_900,
}
DEAR = re.compile(r"/(algorithm|functional|iostream|mutex|ranges|regex|thread|unordered_map)$")


def preprocessed(compiler, folders, header):
    """(lines without empty ones, the headers that they came from)"""
    run = subprocess.run([compiler, "-std=c++20", *(f"-I{one}" for one in folders), "-E", "-x", "c++", "-"],
                         input=f"#include <{header}>\n", stdout=subprocess.PIPE, text=True, check=True)
    lines = run.stdout.splitlines()
    sources = {named[1] for named in (re.match(r'# \d+ "([^"]*)"', one) for one in lines) if named}
    return sum(bool(one.strip()) and not one.startswith("#") for one in lines), sources


def main():
    compiler, *folders = sys.argv[1:]
    wrong = 0
    for header, limit in LIMITS.items():
        count, sources = preprocessed(compiler, folders, header)
        dear = sorted(one for one in sources if DEAR.search(one))
        print(f"{header}: {count} lines, at most {limit}" + "".join(f"; it includes {one}" for one in dear))
        wrong += count > limit or bool(dear)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
