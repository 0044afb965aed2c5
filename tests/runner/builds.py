# SPDX-License-Identifier: Apache-2.0
"""Configures and builds a preset, and says how: progress, the first error, what took longest."""
import json
import os
import pathlib
import re
import subprocess

import terminal

first_error = pathlib.Path(__file__).resolve().parents[2] / "tools" / "first-error"


class failed(Exception):
    """The text is for the user, and whole."""


def configure(preset, options=()):
    """Runs CMake where it has not made this build folder with these options and presets; Ninja runs it again
    by itself for the rest. Returns what it leaves out, a line each."""
    folder = pathlib.Path("build") / preset
    cache = folder / "CMakeCache.txt"
    rules = folder / "build.ninja"
    made = cache.read_text(encoding="utf-8") if rules.exists() and cache.exists() else ""
    as_asked = all(re.search(one[2:].replace("=", ":[A-Z]+=") + "$", made, re.MULTILINE) for one in options)
    if made and as_asked and rules.stat().st_mtime > pathlib.Path("CMakePresets.json").stat().st_mtime:
        return left_out(folder)
    ran = subprocess.run(["cmake", "--preset", preset, *options], stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", check=False)
    if ran.returncode != 0:
        raise failed(f"preset {preset} cannot be configured:\n{ran.stdout}")
    said = re.findall(r"^-- (.*(?:left out|compared|compiles through).*)$", ran.stdout, re.MULTILINE)
    for one in said:
        terminal.line(one)
    kept = "\n".join(one for one in said if "compiles" not in one)
    (folder / "left_out").write_text(kept, encoding="utf-8")
    return left_out(folder)


def left_out(folder):
    """What CMake left out when it last made this build folder, a line each."""
    file = folder / "left_out"
    return file.read_text(encoding="utf-8").splitlines() if file.exists() else []


def build(preset, jobs, targets=()):
    """Returns how long each step took, as (seconds, what); nothing where nothing had to be done."""
    folder = pathlib.Path("build") / preset
    log = folder / ".ninja_log"
    before = entries(log)
    command = ["cmake", "--build", "--preset", preset, "-j", str(jobs)]
    if targets:
        command += ["--target", *targets]
    kept = folder / "build.log"
    status = {**os.environ, "NINJA_STATUS": "[%f/%t] "}
    with (subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=status,
                           encoding="utf-8", errors="replace") as ran,
          kept.open("w", encoding="utf-8") as copy):
        for said in ran.stdout:
            copy.write(said)
            step = re.match(r"\[(\d+/\d+)\] (.*)", said)
            if step:
                terminal.progress(f"[{step[1]}] {short(step[2])}")
    terminal.clear()
    if ran.returncode != 0:
        shown = subprocess.run([first_error, kept], stdout=subprocess.PIPE, encoding="utf-8",
                               errors="replace", check=True).stdout
        raise failed(f"preset {preset} does not build; the first error (all of them: {kept}):\n\n{shown}")
    return timed(entries(log) - before, compiled_from(folder))


def entries(log):
    """The lines of a .ninja_log: each step that was ever done, with when it began and ended."""
    return set(log.read_text(encoding="utf-8").splitlines()[1:]) if log.exists() else set()


def timed(lines, sources):
    """(seconds, what) of the lines of a .ninja_log, one for each step: those with several outputs stand there
    once for each. Steps of CMake itself are left out."""
    steps = {}
    for begin, end, _, output, step in (one.split("\t") for one in lines):
        if output.endswith((".o", ".a", ".gch")) or "." not in pathlib.PurePath(output).name:
            steps[step] = ((int(end) - int(begin)) / 1000, sources.get(output, short(output)))
    return sorted(steps.values(), reverse=True)


def compiled_from(folder):
    """object file -> its source, or its sources, as the tree names them."""
    database = folder / "compile_commands.json"
    if not database.exists():
        return {}
    sources = {}
    for one in json.loads(database.read_text(encoding="utf-8")):
        output = re.search(r" -o (\S+)", one["command"])
        if output:
            source = pathlib.Path(one["file"])
            together = re.findall(r'^#include "(.*)"$', source.read_text(encoding="utf-8"), re.MULTILINE) \
                if source.parent.name == "Unity" and source.exists() else []
            sources[output[1]] = named([pathlib.Path(each) for each in together] or [source])
    return sources


def named(sources):
    """tests/json/{decoder,digits}_test.cpp"""
    root = pathlib.Path.cwd()
    names = [str(one.relative_to(root) if one.is_relative_to(root) else one) for one in sources]
    if len(names) == 1:
        return names[0]
    begin = os.path.commonprefix([os.path.dirname(one) + "/" for one in names])
    end = os.path.commonprefix([one[::-1] for one in names])[::-1]
    end = end[min((i for i, c in enumerate(end) if not c.isalnum()), default=0):]
    return begin + "{" + ",".join(one[len(begin):len(one) - len(end)] for one in names) + "}" + end


def short(step):
    """What a step is about, without where CMake keeps it."""
    return re.sub(r"CMakeFiles/[\w.-]+\.dir/|^Building \w+ object |^Linking \w+ ", "", step)
