# SPDX-License-Identifier: Apache-2.0
"""A whole run in one file, to be compared with later ones: docs/benchmarks/VERSION.json of each release.

    {"format": 1,
     "machine": {what is on top of the page},
     "peers": {what it was compared with: its version},
     "programs": {NAME: {"state": "ran", "turns": N, "rows": {ROW: {"unit": U, "values": {VALUE: V}}}},
                  NAME: {"state": "left out", "why": W}}}

V is [lowest, median, highest] of the turns, or a number where all of them gave the same. A row is a line,
and everything is sorted, so a difference of two files can be read. Of what differs between turns four digits
are kept, else five.
"""
import dataclasses
import json
import math
import re

import results
from programs import named

format_version = 1
turns_min = 2  # from one turn nobody knows how much a value differs from itself


class unusable(ValueError):
    """This is no run to compare with; the text says why."""


@dataclasses.dataclass(frozen=True)
class run:
    name: str
    machine: dict
    peers: dict
    programs: dict  # results.result by name; the values of its rows are triples, as in the file

    @property
    def commit(self):
        return self.machine.get("commit", "unknown")

    def __str__(self):
        turns = sorted({told.turns for told in self.programs.values() if told.state == "ran"})
        return f"{self.name}: commit {self.commit} of {self.machine.get('date', 'unknown')}, " \
            f"{turns[-1] if turns else 0} turns"


def _number(low, middle, high):
    if low == high:
        return f"{middle:.5g}"
    return f"[{low:.4g}, {middle:.4g}, {high:.4g}]"


def _object(members, indent=""):
    lines = [f"{indent}{json.dumps(name, ensure_ascii=False)}: {text}" for name, text in members]
    return "{\n" + ",\n".join(lines) + f"\n{indent[1:]}" + "}"


def _strings(members):
    return _object([(name, json.dumps(value, ensure_ascii=False)) for name, value in members.items()], "  ")


def _row(one):
    values = []
    for name, middle in sorted(one.values.items()):
        low, high = one.ranges.get(name, (middle, middle))
        if math.isfinite(low) and math.isfinite(middle) and math.isfinite(high):
            values.append(f"{json.dumps(name)}: {_number(low, middle, high)}")
    return f'{{"unit": {json.dumps(one.unit)}, "values": {{{", ".join(values)}}}}}'


def _program(told):
    if told.state != "ran":
        return _object([("state", json.dumps(told.state)), ("why", json.dumps(told.why))], "   ")
    rows = _object([(one.name, _row(one)) for one in sorted(told.rows, key=lambda one: one.name)], "    ")
    return _object([("state", '"ran"'), ("turns", str(told.turns)), ("rounds", json.dumps(told.rounds)),
                    ("rows", rows)], "   ")


def text(told, machine, peers=()):
    """Of a run, whose results `told` are by program. What only prints a text has nothing to compare."""
    comparable = {name: one for name, one in sorted(told.items())
                  if not named(name) or named(name).kind != "text"}
    commits = sorted({one.commit for one in comparable.values() if one.state == "ran"})
    if len(commits) > 1:
        raise unusable(f"the results are of {len(commits)} commits ({', '.join(commits)}); a run is of one")
    return _object([("format", str(format_version)), ("machine", _strings(machine)),
                    ("peers", _strings(dict(peers))),
                    ("programs", _object([(name, _program(one)) for name, one in comparable.items()],
                                         "  "))], " ") + "\n"


def _triple(value):
    return tuple(value) if isinstance(value, list) else (value, value, value)


def _result(program, told):
    found = results.result(program, told["state"], told.get("why", ""), turns=told.get("turns", 1))
    counts = named(program) is not None and named(program).kind == "callgrind"
    if found.state == "ran" and found.turns < turns_min and not counts:
        raise unusable(f"{program} ran in {found.turns} turn, and the spread of a value needs {turns_min} "
                       f"(--turns {turns_min} or more)")
    for name, one in told.get("rows", {}).items():
        values = {value: _triple(number) for value, number in one["values"].items()}
        for value, (low, middle, high) in values.items():
            if not low <= middle <= high:
                raise unusable(f"{program} {name}, {value}: [{low}, {middle}, {high}] is not in order")
        found.rows.append(results.row(name, one["unit"], values))
    return found


def parse(name, written):
    try:
        told = json.loads(written)
    except ValueError as wrong:
        raise unusable(f"it is no JSON: {wrong}") from wrong
    if not isinstance(told, dict) or "format" not in told:
        raise unusable("it is no run that tools/benchmark --save wrote: it has no `format`")
    if told["format"] != format_version:
        raise unusable(f"its format is {told['format']}, and only {format_version} can be read")
    try:
        programs = {program: _result(program, one) for program, one in told["programs"].items()}
        return run(name, told["machine"], told["peers"], programs)
    except (AttributeError, KeyError, TypeError, ValueError) as wrong:
        if isinstance(wrong, unusable):
            raise
        raise unusable(f"it is not of format {format_version}: {type(wrong).__name__} {wrong}") from wrong


def of(name, told, machine, peers=()):
    """The run of these results, rounded as one that was saved: only then counts can be equal."""
    return parse(name, text(told, machine, peers))


def load(path):
    try:
        return parse(path.name, path.read_text(encoding="utf-8"))
    except OSError as wrong:
        raise unusable(f"{path} cannot be read: {wrong.strerror}") from wrong
    except ValueError as wrong:  # unusable, or no UTF-8
        raise unusable(f"{path}: {wrong}") from wrong


def version(path):
    """Of the release whose run it is; nothing if the name does not say."""
    found = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)\.json", path.name)
    return tuple(map(int, found.groups())) if found else None


def newest(folder, commit):
    """The run of the newest release in the folder that is not of this commit; None without any."""
    for path in sorted(filter(version, folder.glob("*.json")), key=version, reverse=True):
        found = load(path)
        if found.commit != commit:
            return found
    return None
