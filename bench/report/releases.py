# SPDX-License-Identifier: Apache-2.0
"""What became faster or slower from one kept run to another: tools/benchmark --compare, and the section of
the page about the newest release. The verdict is that of compare.py, but the turns of two runs are no pairs:
a value differs if the medians do so by more than the spread of either run, and all turns of the one are on
the same side of all turns of the other.

Between two runs lie days, and a run does not know how much the machine differs from day to day. Contenders
that are not rowe's show it: their code is what it was. So a value must also differ by more than nine of ten
of theirs do. Ratios, in which the machine cancels out, are held against their ratios. What was the same in
every turn of either run is a count: any difference is one."""
import dataclasses
import itertools
import math
import statistics

import compare
import rows
import words
from pages import table

# Where less is better and the unit does not say so.
_costs = {"allocations", "calls", "calls_per_message", "core_percent", "cpu_percent", "cycle_max_us",
          "memory_kib", "resident_kib", "sends", "unanswered", "watched_percent"}
_not_of_the_machine = ("date", "commit", "load before")
_lines_of_page_max = 20


@dataclasses.dataclass(frozen=True)
class unpaired(compare.compared):
    """`before` and `after` are (lowest, median, highest)."""
    is_ours: bool = True
    is_ratio: bool = False
    is_tail: bool = False
    drift: float = 0  # how much others differ between the runs

    @property
    def spread(self):
        own = super().spread
        return max(own, self.drift) if own > 0 else 0

    @property
    def size(self):
        """1.25 for a quarter slower, and for as much faster."""
        return max(self.ratio, compare.times(1, self.ratio))

    @property
    def ratios(self):
        turns = itertools.product(self.before, self.after)
        return [compare.times(b, a) if self.more_is_better else compare.times(a, b) for b, a in turns]

    @property
    def ratio(self):
        return compare.times(*((self.before[1], self.after[1]) if self.more_is_better else
                               (self.after[1], self.before[1])))


@dataclasses.dataclass
class difference:
    """Between two runs. Rows are named `PROGRAM ROW`."""
    before: object
    after: object
    ours: list = dataclasses.field(default_factory=list)
    others: int = 0  # values
    drift: dict = dataclasses.field(default_factory=dict)  # of others, by whether they are ratios
    only_before: list = dataclasses.field(default_factory=list)
    only_after: list = dataclasses.field(default_factory=list)
    not_run: list = dataclasses.field(default_factory=list)  # sentences

    def those(self, word):
        return sorted((one for one in self.ours if one.verdict == word), key=lambda one: -one.size)

    @property
    def machines(self):
        """[(fact, before, after)] of those that differ; with another machine it is compared, too."""
        before = {**self.before.machine, **self.before.peers}
        after = {**self.after.machine, **self.after.peers}
        return [(name, before.get(name, "none"), after.get(name, "none")) for name in {**before, **after}
                if before.get(name) != after.get(name) and name not in _not_of_the_machine]


def _more_is_better(program, row, read):
    """Nothing where more is neither better nor worse."""
    of_target = next((one.bound for one in rows.targets
                      if (one.program, one.counter) == (program, read.name) and not one.over), None)
    if of_target:
        return of_target.sign == "≥"
    judged = compare.judged(read.name, row.unit)
    if judged:
        return judged[1]
    if read.name in _costs:
        return False
    if read.what.startswith("x_"):
        return True
    if read.what.startswith("of_"):  # of a rate, or of a time
        return any((compare.judged(name, row.unit) or (name, False))[1] for name in row.values)
    return False if read.is_ratio else None


def _of_program(before, after):
    with_rowe = {one.group for one in after.rows if one.contender.startswith("rowe")}
    for group, those in after.groups():
        # Where none is named after rowe, all are: phases, steps, numbers of peers.
        for column, row in itertools.product(words.columns(list(map(_medians, those))), those):
            ours = row.contender.startswith("rowe") or group not in with_rowe
            was = before.find(row.name)
            if not was or column.name not in row.values or column.name not in was.values:
                continue
            more = _more_is_better(after.program, row, column)
            sides = was.values[column.name], row.values[column.name]
            if more is not None and min(*sides[0], *sides[1]) >= 0:
                yield unpaired(f"{after.program} {row.name}", column.heading or column.name, more, *sides,
                               is_ours=ours, is_ratio=column.is_ratio,
                               is_tail=column.quantile not in ("", "p50", "median"))


def _medians(row):
    return dataclasses.replace(row, values={name: value[1] for name, value in row.values.items()})


def _drift(others):
    """By how much nine of ten of them differ; tails do so by more, and have more spread of their own."""
    sizes = sorted(one.size - 1 for one in others if not one.is_tail and one.spread > 0)
    return sizes[math.ceil(0.9 * len(sizes)) - 1] if sizes else 0


def between(before, after, only=()):
    """`only`: of these programs, if there are any."""
    found = difference(before, after)
    every = []
    for name in dict.fromkeys([*before.programs, *after.programs]):
        if only and name not in only:
            continue
        sides = [run.programs.get(name) for run in (before, after)]
        absent = [f"{name}, {where}: " + (f"{told.state}: {told.why}" if told else "it was not run")
                  for told, where in zip(sides, ("before", "after")) if not told or told.state != "ran"]
        found.not_run += absent
        if absent:
            continue
        names = [{f"{name} {one.name}" for one in told.rows} for told in sides]
        found.only_before += sorted(names[0] - names[1])
        found.only_after += sorted(names[1] - names[0])
        every += _of_program(*sides)
    others = [one for one in every if not one.is_ours]
    found.others = len(others)
    found.drift = {kind: _drift([one for one in others if one.is_ratio == kind]) for kind in (False, True)}
    found.ours = [dataclasses.replace(one, drift=found.drift[one.is_ratio]) for one in every if one.is_ours]
    return found


def _counts(found):
    slower, faster = (len(found.those(word)) for word in ("slower", "faster"))
    what = f"{slower} slower, {faster} faster; the others" if slower + faster else \
        "nothing became slower or faster; all"
    middle = statistics.median(one.ratio for one in found.ours) if found.ours else 1
    lines = [f"{len(found.ours)} values: {what} differ by no more than chance. "
             f"Their median is {middle:.3f} × before."]
    if found.others:
        of_values, of_ratios = found.drift[False], found.drift[True]
        lines.append(f"Of {found.others} values of contenders that are not rowe's, nine of ten differ by at "
                     f"most {of_values:.1%}, of ratios {of_ratios:.1%}: that is the machine, and less does "
                     "not count.")
    return lines


def _cell(triple):
    low, middle, high = map(words.number, triple)
    return middle if low == high else f"{middle} ({low}–{high})"


_heads = ["row", "value", "before", "after", "× before", ""]
_legend = "Above 1 × before is slower, of rates as well. In brackets: the lowest and the highest turn."


def _lines(those, strong=""):
    for one in those:
        yield [one.row, one.heading, _cell(one.before), _cell(one.after), words.number(round(one.ratio, 4)),
               strong + one.verdict + strong]


def _columns(lines):
    widths = [max(map(len, cells)) for cells in zip(*lines)]
    for cells in lines:
        yield "  ".join(cell.ljust(width) for cell, width in zip(cells, widths)).rstrip()


def report(found):
    """For the terminal."""
    out = []
    if found.machines:
        out += ["The machines differ, so this compares machines as well:",
                *_columns([[f"  {name}", f"before: {before}", f"after: {after}"]
                           for name, before, after in found.machines]), ""]
    out += [f"before: {found.before}", f"after:  {found.after}", "", *_counts(found)]
    changed = [*found.those("slower"), *found.those("faster")]
    if changed:
        out += ["", *_columns([_heads, *_lines(changed)]), "", _legend]
    for said, names in (("Only before", found.only_before), ("Only after", found.only_after),
                        ("Did not run", found.not_run)):
        if names:
            out += ["", f"{said}:", *(f"  {name}" for name in names)]
    return "\n".join(out)


def section(found, folder="benchmarks"):
    """For the page: `found` is since the newest release."""
    name = found.before.name
    changed = [*found.those("slower"), *found.those("faster")]
    largest = sorted(changed, key=lambda one: -one.size)[:_lines_of_page_max]
    out = [heading(found.before),
           f"Against [{name}]({folder}/{name}), commit {found.before.commit} of "
           f"{found.before.machine.get('date', 'unknown')}. " + " ".join(_counts(found)) + "\n"]
    if found.machines:
        out.append("**The machines differ, so this compares machines as well:** " + " · ".join(
            f"{fact} {before} → {after}" for fact, before, after in found.machines) + "\n")
    if largest:
        which = "" if len(largest) == len(changed) else f"These are the {len(largest)} largest. "
        out += [f"{which}{_legend}\n",
                table(_heads, _lines([one for one in changed if one in largest], "**"))]
    return "\n".join(out)


def heading(before):
    return f"## Since {before.name.removesuffix('.json')}\n"
