# SPDX-License-Identifier: Apache-2.0
"""tools/benchmark --against: the programs of two builds by turns, and what became faster or slower from the
one to the other. A row is judged by its own spread: it differs if it does so by more than either build
differs from itself between turns, and in the same direction in every turn."""
import dataclasses
import hashlib
import math
import os
import statistics
import struct

import words
from pages import table

# Where more is better, by the unit; of a share or a count nobody can say.
_rates = {"/s", "k/s", "M/s"}
_times = {"ns", "µs", "ms", "s"}
_costs = {"instructions", "wakeups_per_s"}


def times(one, other):
    """How often `other` is in `one`, where both may be nothing."""
    if one == other:
        return 1
    return one / other if other else math.inf


@dataclasses.dataclass(frozen=True)
class compared:
    """One value of one row: what each turn measured in either build."""
    row: str
    heading: str
    more_is_better: bool
    before: tuple
    after: tuple
    same_code: bool = False  # both builds run the same instructions

    @property
    def ratios(self):
        """In each turn, how much of the time of before it takes now, whatever the unit."""
        pairs = zip(self.before, self.after)
        return [b / a if self.more_is_better else a / b for b, a in pairs]

    @property
    def ratio(self):
        return statistics.median(self.ratios)

    @property
    def spread(self):
        """By how much a build differs from itself between turns; the larger one of both."""
        return max(times(max(values), min(values)) - 1 for values in (self.before, self.after))

    @property
    def beyond(self):
        """Whether it looks slower or faster, which without any difference of the code is chance."""
        far = max(self.ratio, times(1, self.ratio)) - 1 > self.spread
        if far and min(self.ratios) > 1:
            return "slower"
        if far and max(self.ratios) < 1:
            return "faster"
        return ""

    @property
    def verdict(self):
        return "" if self.same_code else self.beyond


def code_of(program):
    """A digest of the instructions in a program (ELF, 64 bits): its section .text; nothing if it has none."""
    try:
        with open(program, "rb") as file:
            image = file.read()
    except OSError:
        return None
    if image[:5] != b"\x7fELF\x02":
        return None
    table, = struct.unpack_from("<Q", image, 0x28)
    size, count, names_at = struct.unpack_from("<HHH", image, 0x3a)
    sections = [struct.unpack_from("<IIQQQQ", image, table + i * size) for i in range(count)]
    names = sections[names_at][4]
    for name, _, _, _, offset, length in sections:
        if image[names + name:].startswith(b".text\0"):
            return hashlib.sha256(image[offset:offset + length]).hexdigest()
    return None


def same_code(one, folders):
    """Whether two builds of a program, in these folders, run the same instructions. A program that starts
    others is different, whatever it is itself: theirs are not looked at."""
    if len(one.command) != 1 or one.starts_others:
        return False
    made = {code_of(one.command[0].format(bin=folder)) for folder in folders}
    return len(made) == 1 and None not in made


def judged(value, unit_of_time):
    """(heading, whether more is better), or nothing where more is neither better nor worse."""
    read = words.read(value, unit_of_time)
    if value in _costs:
        return read.heading, False
    if read.is_ratio or read.unit not in _rates | _times:
        return None
    return read.heading or value, read.unit in _rates


def of_program(before, after, same=False):
    """`before` and `after`: the results of one program in each turn; `same`: of one and the same code. All
    that both builds measured."""
    if any(told.state != "ran" for told in (*before, *after)):
        return []
    found = []
    for row in after[0].rows:
        for value in row.values:
            told = judged(value, row.unit)
            sides = [[each.find(row.name) for each in side] for side in (before, after)]
            if told is None or None in sides[0] + sides[1]:
                continue
            b, a = (tuple(each.values.get(value, 0) for each in side) for side in sides)
            if min(*b, *a) > 0:
                found.append(compared(row.name, *told, b, a, same))
    return found


def _lines(rows):
    for one in rows:
        yield [one.row, one.heading, words.number(statistics.median(one.before)),
               words.number(statistics.median(one.after)), f"{one.ratio:.2f}",
               f"{min(one.ratios):.2f}–{max(one.ratios):.2f}", f"{one.spread:.2f}",
               f"**{one.verdict}**" if one.verdict else ("same code" if one.same_code else "")]


_heads = ["row", "value", "before", "after", "time of before", "in each turn", "own spread", ""]

_opening = """# Benchmarks of two builds

Before: commit {before}. After: commit {after}. {turns} turns, in each of which every program ran once from
either build, one straight after the other{rounds}. Written by `{command}`; nothing here is written by hand.

{facts}

The time of before is what the row takes now, as a part of what it took before: below 1 is faster, of rates as
well; the median over the turns. A row's own spread is how much one build differs from itself between turns.
A row is slower, or faster, where it is so in each turn, and by more than that spread.

{count} values: {slower} slower, {faster} faster. The median of all ratios is {median:.3f}.
Where the instructions of a program are the same in both builds, what differs is chance: of {same} such values
{chance} would have counted as slower or faster.
"""


def page(programs, found, facts, before, after, turns, rounds, command):
    """`found`: what of_program() gave, by the names of programs."""
    every = [one for rows in found.values() for one in rows]
    told = " · ".join(f"{name} {value}" for name, value in facts.items()
                      if name not in ("commit", "load before"))
    out = [_opening.format(
        before=before, after=after, turns=turns, command=command, facts=told, count=len(every),
        rounds=f", with {rounds} rounds" if rounds else "",
        slower=sum(one.verdict == "slower" for one in every),
        faster=sum(one.verdict == "faster" for one in every),
        same=sum(one.same_code for one in every),
        chance=sum(one.same_code and one.beyond != "" for one in every),
        median=statistics.median(one.ratio for one in every) if every else 1)]
    for word in ("slower", "faster"):
        those = [one for one in every if one.verdict == word]
        if those:
            out.append(f"## What became {word}\n\n" + table(_heads, _lines(those)))
    for one in programs:
        if found.get(one.name):
            out.append(f"## {one.title}\n\n" + table(_heads, _lines(found[one.name])))
    return "\n".join(out)
