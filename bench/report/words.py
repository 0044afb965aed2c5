# SPDX-License-Identifier: Apache-2.0
"""Names of counters as headings, in the order of a table; numbers as a reader wants them."""
import dataclasses
import math
import re

_units = {"ns": "ns", "us": "µs", "ms": "ms", "s": "s", "per_s": "/s", "k_per_s": "k/s", "m_per_s": "M/s",
          "million_per_s": "M/s",
          "percent": "%", "bytes": "B", "kib": "KiB", "mib": "MiB", "w": "W", "mhz": "MHz"}
_with_unit = re.compile(r"(?i)^(?:(.*?)_)??(" + "|".join(sorted(_units, key=len)[::-1]) +
                        r")$")
_quantile = re.compile(r"(?:^|_)(p[\d.]+|min|median|max)$")
_order = ["min", "p50", "median", "p90", "p99", "p99.9", "p99.99", "max"]


@dataclasses.dataclass(frozen=True)
class counter:
    """`push_p999_us`: what `push`, quantile `p99.9`, unit `µs`."""
    name: str
    what: str
    quantile: str
    unit: str

    @property
    def is_ratio(self):
        return self.what.startswith(("of_", "x_")) or self.what.endswith("_ratio") or "over_" in self.what

    @property
    def heading(self):
        what = self.what.replace("_", " ")
        if self.what.startswith("of_"):
            what = "× " + what[3:]
        elif self.what.startswith("x_"):
            what = "times faster than " + what[2:]
        parts = [part for part in (what, self.quantile) if part]
        return ", ".join(part for part in (" ".join(parts), self.unit) if part)

    @property
    def key(self):
        rank = _order.index(self.quantile) if self.quantile in _order else -1
        return (self.is_ratio, self.what != "", self.what, self.unit, rank)


def read(name, unit_of_time="ns"):
    if name == "time":
        return counter(name, "", "median", _units.get(unit_of_time, unit_of_time))
    rest, unit = name, ""
    found = _with_unit.match(name)
    if found and (found[1] or "per" in found[2]):
        rest, unit = found[1] or "", _units[found[2].lower()]
    found = _quantile.search(rest)
    quantile = ""
    if found:
        rest, quantile = rest[:found.start()], found[1]
        quantile = re.sub(r"^p(\d\d)(\d+)$", r"p\1.\2", quantile)
    return counter(name, rest, quantile, unit)


def _is_the_time(column, rows):
    """Or the same in another unit, as a share of a second is."""
    if column.name == "time" or column.quantile or column.is_ratio or len(rows) < 2 or not column.unit:
        return False
    shares = [one.values.get(column.name, math.nan) / (one.values.get("time") or math.nan) for one in rows]
    return all(share > 0 and math.isclose(share, shares[0], rel_tol=1e-3) for share in shares)


def columns(rows):
    """The counters of these rows, in the order of a table: quantiles first, ratios last."""
    names = dict.fromkeys(name for one in rows for name in one.values)
    unit = rows[0].unit if rows else "ns"
    found = [read(name, unit) for name in names]
    # A program that counts its time says it twice.
    if any((one.quantile == "p50" and one.what == "" and one.unit) or _is_the_time(one, rows)
           for one in found):
        found = [one for one in found if one.name != "time"]
    return sorted(found, key=lambda one: one.key)


def number(value):
    """Three digits that mean something, and no more."""
    if value is None:
        return ""
    if not math.isfinite(value):
        return "∞" if value > 0 else "–"
    size = abs(value)
    if value == int(value) and size < 1e15:
        return f"{int(value):,}" if size >= 10_000 else str(int(value))
    if size >= 100:
        return f"{value:,.0f}" if size >= 10_000 else f"{value:.0f}"
    if size >= 10:
        return f"{value:.1f}"
    if size >= 0.01:
        return f"{value:.2f}" if size >= 0.1 else f"{value:.3f}"
    return f"{value:.2g}"
