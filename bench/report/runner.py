# SPDX-License-Identifier: Apache-2.0
"""Runs one program to its result. Whatever goes wrong becomes a result with its reason: a program that is not
there, ends badly or takes too long never keeps the others from running."""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import time

import machine
import methods
import results

seconds_max = 600


def raise_file_limit():
    """Thousands of connections need as many descriptors."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != hard:
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def start(command, log, seconds=seconds_max):
    """Runs it with all that it starts, and ends all of it; what it printed and its code, None when killed."""
    with open(log, "w", encoding="utf-8") as errors:
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors,
                                 text=True, start_new_session=True)
        try:
            printed, _ = child.communicate(timeout=seconds)
            return printed, child.returncode
        except subprocess.TimeoutExpired:
            return "", None
        finally:
            try:
                os.killpg(child.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            child.stdout.close()
            child.wait()


def lines_of(log):
    """Without blank ones, and without where on this machine the tree is."""
    with open(log, encoding="utf-8", errors="replace") as file:
        lines = (line.strip().replace(str(methods.top) + "/", "") for line in file)
        return [line for line in lines if line]


def last_words(log):
    return (lines_of(log) or ["it said nothing"])[-1]


def configured_without(one, kept):
    """Why CMake left the program out."""
    try:
        with open(kept / "configure.log", encoding="utf-8") as file:
            found = re.search(rf"bench_{one.name}\b.*? left out: (.*(?:\n +.*)*)", file.read())
    except FileNotFoundError:
        found = None
    return " ".join(found[1].split()) if found else "it was not built"


def missing(one, command, kept):
    for needed in command:
        if os.path.basename(needed).startswith("bench_") and not os.path.exists(needed):
            return configured_without(one, kept)
    if one.kind == "callgrind" and not shutil.which("valgrind"):
        return "valgrind is not installed"
    return ""


def left_out(log):
    """The lines in which a program says what it goes without."""
    return [line for line in lines_of(log) if "left out" in line]


def failed(told, code, log):
    if code is None:
        told.state, told.why = "failed", f"killed after {seconds_max} s"
    elif code != 0:
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        told.state, told.why = "failed", f"{how}: {last_words(log)}"
    return told.state == "failed"


def measure(one, command, kept, rounds, told):
    log = kept / (one.name + ".log")
    out = kept / (one.name + ".out")
    out.unlink(missing_ok=True)
    if rounds and one.takes_rounds:
        command = [*command, f"--rounds={rounds}"]
    if one.kind == "benchmark":
        command = [*command, f"--benchmark_out={out}", "--benchmark_out_format=json"]
    elif one.kind == "callgrind":
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}",
                   "--toggle-collect=*steps::*", *command]
    printed, code = start(command, log)
    told.state, told.notes = "ran", left_out(log)
    if failed(told, code, log):
        return
    if one.kind == "text":
        told.text = printed.rstrip()
        return
    try:
        if one.kind == "benchmark":
            with open(out, encoding="utf-8") as file:
                told.rows, told.rounds, errors = results.of_google_benchmark(json.load(file))
            if errors:
                told.state, told.why = "failed", "; ".join(errors)
        else:
            told.rows = results.of_callgrind(
                machine.said("callgrind_annotate", "--inclusive=yes", "--threshold=100", str(out)))
    except (OSError, ValueError) as wrong:
        told.state, told.why = "failed", f"what it wrote cannot be read: {wrong}"
    if told.state == "ran" and not told.rows:
        told.state, told.why = "failed", "it wrote no results"


def run(one, programs, kept, rounds):
    """The result of a program of programs.py, built in the folder `programs`; also kept in `kept`. One that
    fails is tried once more, and the page says so: machines have bad minutes."""
    told = results.result(one.name, date=machine.today(), commit=machine.commit(), load=machine.load())
    command = [part.format(bin=programs) for part in one.command]
    told.why = missing(one, command, kept)
    if not told.why:
        begin = time.monotonic()
        measure(one, command, kept, rounds, told)
        if told.state == "failed" and time.monotonic() - begin < seconds_max:
            first, told.why = told.why, ""
            measure(one, command, kept, rounds, told)
            told.notes.append(f"This is the second try; the first ended with {first}.")
        told.seconds = round(time.monotonic() - begin, 1)
    results.keep(kept, told)
    return told
