# SPDX-License-Identifier: Apache-2.0
"""Plots of our own: a bar for each contender, as long as its median, and a mark at its p99. They bring their
own background, so they can be read on light and on dark pages, and need no font but the reader's."""
import dataclasses
import math
from xml.sax.saxutils import escape

import words

_width = 860
_row = 22
_block = 26  # of a size, which stands above its bars
_top = 44
_bottom = 30
_right = 150  # for the numbers behind the bars
_tail_max = 3  # of the largest median: how far a p99 may stretch the scale
_letter = 7.9  # width of a character of 13 px
_limits = ("raw", "bare", "copied", "limit")  # contenders that are no peers, but what nobody can beat

_style = """<style>
  svg { font: 13px sans-serif; } .page { fill: #ffffff; } text { fill: #1a1a1a; }
  .title { font-size: 15px; font-weight: bold; } .quiet { fill: #595959; } .size { font-weight: bold; }
  .grid { stroke: #d9d9d9; } .ours { fill: #0b61a4; } .other { fill: #b9c2cb; } .limit { fill: #2e7d4f; }
  .tail { stroke: #b35c00; stroke-width: 2.5; } .reach { stroke: #b35c00; stroke-dasharray: 2 3; }
  @media (prefers-color-scheme: dark) {
    .page { fill: #14171a; } text { fill: #ececec; } .quiet { fill: #a6a6a6; } .grid { stroke: #34393e; }
    .ours { fill: #4f9fe0; } .other { fill: #58626c; } .limit { fill: #57b07f; }
    .tail, .reach { stroke: #ffb35c; }
  }
</style>"""


@dataclasses.dataclass(frozen=True)
class bar:
    label: str
    size: str
    value: float
    tail: float = None


def main_column(columns):
    """What a plot shows: the median, or else the first rate, or else whatever comes first."""
    plain = [one for one in columns if one.what == "" and one.quantile]
    median = next((one for one in plain if one.quantile in ("p50", "median")), None)
    rate = next((one for one in columns if one.unit.endswith("/s") and not one.is_ratio), None)
    if median and (len(plain) > 1 or not rate):
        return median
    return rate or next((one for one in columns if not one.is_ratio), None)


def tail_column(columns, main):
    return next((one for one in columns if one.quantile == "p99" and
                 (one.what, one.unit) == (main.what, main.unit)), None)


def bars(rows, main, tail):
    alone = len({one.contender for one in rows}) == 1  # then its sizes are what is compared
    return [bar(one.size if alone else one.contender, "" if alone else one.size, one.values[main.name],
                one.values.get(tail.name) if tail else None)
            for one in rows if math.isfinite(one.values.get(main.name, math.nan))]


class scale:
    """From a value to its place; logarithmic where a linear one would hide the short bars."""

    def __init__(self, values, tails, left, right):
        low = min((value for value in values if value > 0), default=1)
        self.left, self.right = left, right
        self.logarithmic = max(values) / low > 40
        high = max(values + tails) or 1
        if self.logarithmic:
            self.low = math.floor(math.log10(low) - 0.2)
            self.high = max(math.log10(high), self.low + 1)
        else:
            self.low, self.high = 0, high

    def __call__(self, value):
        if self.logarithmic:
            value = math.log10(value) if value > 0 else self.low
        share = (value - self.low) / (self.high - self.low)
        return self.left + max(0, min(1, share)) * (self.right - self.left)

    def ticks(self):
        if self.logarithmic:
            step = math.ceil((self.high - self.low) / 7)
            return [10.0 ** power for power in range(self.low, math.floor(self.high) + 1, step)]
        step = 10.0 ** math.floor(math.log10(self.high))
        step = next(step * part for part in (0.1, 0.2, 0.5, 1, 2) if self.high / (step * part) <= 6)
        return [step * count for count in range(int(self.high / step) + 1)]


def _kind(label, ours_are_named):
    if label.startswith(_limits):
        return "limit"
    return "ours" if label.startswith("rowe") or not ours_are_named else "other"


def plot(title, rows):
    """The text of an SVG file; None if there is nothing to compare."""
    columns = words.columns(rows)
    main = main_column(columns)
    if not main:
        return None
    tail = tail_column(columns, main)
    all_bars = bars(rows, main, tail)
    if len(all_bars) < 2:
        return None
    labels = [one.label or "all" for one in all_bars]
    left = 20 + _letter * max(map(len, labels))
    values = [one.value for one in all_bars]
    # What is still later than that has its mark at the edge, and its number beside it.
    tails = [min(one.tail, _tail_max * max(values)) for one in all_bars if one.tail]
    place = scale(values, tails, left, _width - _right)
    sizes = list(dict.fromkeys(one.size for one in all_bars))
    ours_are_named = any(one.contender.startswith("rowe") for one in rows) and \
        len({one.contender for one in rows}) > 1
    height = _top + _row * len(all_bars) + (_block * len(sizes) if sizes != [""] else 0) + _bottom
    what = main.heading + ("; the mark is p99" if tail else "") + \
        ("; logarithmic" if place.logarithmic else "")
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_width} {height}" width="{_width}" '
           f'height="{height}" role="img">',
           "<!-- SPDX-License-Identifier: Apache-2.0 -->", _style, f"<title>{escape(title)}</title>",
           f'<rect class="page" width="{_width}" height="{height}"/>',
           f'<text class="title" x="10" y="20">{escape(title)}</text>',
           f'<text class="quiet" x="10" y="37">{escape(what)}</text>']
    for tick in place.ticks():
        x = place(tick)
        out.append(f'<line class="grid" x1="{x:.1f}" y1="{_top}" x2="{x:.1f}" y2="{height - _bottom}"/>')
        out.append(f'<text class="quiet" x="{x:.1f}" y="{height - 12}" text-anchor="middle">'
                   f'{words.number(round(tick, 9))}</text>')
    y = _top
    for size in sizes:
        if sizes != [""]:
            y += _block
            out.append(f'<text class="size" x="10" y="{y - 8}">{escape(size)}</text>')
        for one, label in zip(all_bars, labels):
            if one.size == size:
                out += _bar(one, label, _kind(label, ours_are_named), place, y)
                y += _row
    return "\n".join(out + ["</svg>", ""])


def _bar(one, label, kind, place, y):
    x, middle = place(one.value), y + _row / 2
    out = [f'<text x="{place.left - 8:.1f}" y="{middle + 4.5:.1f}" text-anchor="end">{escape(label)}</text>',
           f'<rect class="{kind}" x="{place.left:.1f}" y="{y + 4}" width="{max(1, x - place.left):.1f}" '
           f'height="{_row - 8}"/>']
    said, end = words.number(one.value), x
    if one.tail is not None and math.isfinite(one.tail):
        end = max(x, place(one.tail))
        said += f" · {words.number(one.tail)}"
        out.append(f'<line class="reach" x1="{x:.1f}" y1="{middle}" x2="{end:.1f}" y2="{middle}"/>')
        out.append(f'<line class="tail" x1="{end:.1f}" y1="{y + 4}" x2="{end:.1f}" y2="{y + _row - 4}"/>')
    out.append(f'<text x="{end + 7:.1f}" y="{middle + 4.5:.1f}">{escape(said)}</text>')
    return out
