# SPDX-License-Identifier: Apache-2.0
"""What one program measured, in one form whatever it is like; kept as JSON between runs.

A result is of one program: its `state` is `ran`, `failed` or `left out` (then `why` says why), and its rows
are what was compared. A row has a name, `GROUP/CONTENDER[/SIZE...]`, and values by their names: the counters,
and `time`, what Google Benchmark calls real time, in `unit`.
"""
import dataclasses
import json
import re
import statistics

# Keys of Google Benchmark's JSON that are no counters.
_fixed = {"name", "run_name", "run_type", "family_index", "per_family_instance_index", "repetitions",
          "repetition_index", "threads", "iterations", "real_time", "cpu_time", "time_unit", "label",
          "error_occurred", "error_message", "aggregate_name", "aggregate_unit"}


@dataclasses.dataclass
class row:
    name: str
    unit: str = ""
    values: dict = dataclasses.field(default_factory=dict)
    ranges: dict = dataclasses.field(default_factory=dict)  # value: (lowest, highest) of several turns

    @property
    def group(self):
        return self.name.split("/")[0]

    @property
    def contender(self):
        return (self.name.split("/") + [""])[1]

    @property
    def size(self):
        return "/".join(self.name.split("/")[2:])


@dataclasses.dataclass
class result:
    program: str
    state: str = "left out"
    why: str = ""
    seconds: float = 0
    date: str = ""
    commit: str = ""
    load: str = ""
    rounds: str = ""
    rows: list = dataclasses.field(default_factory=list)
    text: str = ""
    notes: list = dataclasses.field(default_factory=list)  # what it said it left out by itself
    turns: int = 1

    def find(self, name):
        return next((one for one in self.rows if one.name == name), None)

    def groups(self):
        """[(group, its rows)], both in the order they were registered in; rows of one size stand together."""
        found = {}
        for one in self.rows:
            found.setdefault(one.group, {}).setdefault(one.size, []).append(one)
        return [(group, sum(sizes.values(), [])) for group, sizes in found.items()]

    def tables(self):
        """As groups(), but groups of one row each that follow one another and have the same values are one
        table, without a name; its rows have those of their groups."""
        found, singles = [], []
        for group, rows in [*self.groups(), (None, [])]:
            if singles and (len(rows) != 1 or rows[0].values.keys() != singles[0].values.keys()):
                found.append(("", singles) if len(singles) > 1 else (singles[0].group, singles))
                singles = []
            if len(rows) == 1:
                singles.append(rows[0])
            elif rows:
                found.append((group, rows))

        def named(one):
            name = " ".join((one.group.replace("_", " ") + ":", one.contender, one.size)).strip()
            return row("/" + name, one.unit, one.values)

        return [(group, rows if group else [named(one) for one in rows]) for group, rows in found]


def plain_name(name):
    """Without what Google Benchmark adds, as `/iterations:1/manual_time`."""
    return re.sub(r"/(iterations|repeats|min_time|threads):[^/]*|/(manual_time|real_time|process_time)\b", "",
                  name)


def of_google_benchmark(told):
    """(rows, rounds, errors) of a parsed --benchmark_out."""
    rows, errors = [], []
    for one in told.get("benchmarks", ()):
        name = plain_name(one["name"])
        if one.get("run_type", "iteration") != "iteration":
            continue
        if one.get("error_occurred"):
            errors.append(f"{name}: {one.get('error_message', 'failed')}")
            continue
        values = {"time": one["real_time"]} if one.get("real_time") else {}
        values |= {key: value for key, value in one.items()
                   if key not in _fixed and isinstance(value, (int, float))}
        rows.append(row(name, one.get("time_unit", "ns"), values))
    return rows, str(told.get("context", {}).get("rounds", "")), errors


def of_callgrind(annotated, calls=1000):
    """Rows from what `callgrind_annotate --inclusive=yes` prints."""
    rows = []
    for count, step in re.findall(r"(?m)^\s*([\d,]+) .*?:(?:\w+::)*steps::(\w+)\(", annotated):
        name = "instructions/" + step
        if not any(one.name == name for one in rows):
            rows.append(row(name, "", {"instructions": int(count.replace(",", "")) / calls}))
    return sorted(rows, key=lambda one: one.name)


def merged(turns):
    """One result of those of several turns: medians, and how far each value went. A program that did not run
    in one of them did not run."""
    told = next((one for one in turns if one.state != "ran"), turns[0])
    if told.state != "ran" or len(turns) == 1:
        return told
    rows = []
    for one in told.rows:
        same = [each.find(one.name) for each in turns]
        if None in same:
            continue
        of_turns = {name: [each.values[name] for each in same] for name in one.values
                    if all(name in each.values for each in same)}
        rows.append(row(one.name, one.unit,
                        {name: statistics.median(values) for name, values in of_turns.items()},
                        {name: (min(values), max(values)) for name, values in of_turns.items()}))
    return dataclasses.replace(told, rows=rows, turns=len(turns), seconds=sum(one.seconds for one in turns),
                               notes=list(dict.fromkeys(line for one in turns for line in one.notes)))


def keep(folder, told):
    with open(folder / (told.program + ".json"), "w", encoding="utf-8") as file:
        json.dump(dataclasses.asdict(told), file, indent=1)


def kept(folder, program):
    """What was kept of the program; `left out` if there is nothing."""
    try:
        with open(folder / (program + ".json"), encoding="utf-8") as file:
            told = json.load(file)
    except FileNotFoundError:
        return result(program, why="it was not run")
    told["rows"] = [row(**one) for one in told["rows"]]
    return result(**told)
