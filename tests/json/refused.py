#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A wrong program, and the one sentence that its author is told.

    tests/json/refused.py SENTENCE COMPILER ARGUMENT...

The program must not compile, and the compiler's first error must be a failed static_assert with this
sentence. With g++ it must be the only error: those that follow from a wrong line hide which one that is."""
import os
import subprocess
import sys


def main(sentence, command):
    ran = subprocess.run(command, capture_output=True, text=True, check=False,
                         env={**os.environ, "LC_ALL": "C"})
    errors = [line for line in ran.stderr.splitlines() if " error: " in line]
    if ran.returncode == 0 or not errors:
        return "it compiles"
    if sentence not in errors[0]:
        return f"the first error does not say: {sentence}\n{errors[0]}"
    is_gnu = "clang" not in subprocess.run([command[0], "--version"], capture_output=True, text=True,
                                           check=True).stdout
    if is_gnu and len(errors) > 1:
        return "more than one error:\n" + "\n".join(errors)
    return None


if __name__ == "__main__":
    wrong = main(sys.argv[1], sys.argv[2:])
    if wrong:
        sys.exit(wrong)
