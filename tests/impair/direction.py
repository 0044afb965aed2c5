# SPDX-License-Identifier: Apache-2.0
"""One direction of a link: what becomes of each packet, and when it leaves.

A function of its settings, its seed, the times and the sizes it is given: it reads no clock and moves no
byte. Every packet takes the same number of random numbers, whatever the settings are. So where two runs
with one seed differ in one setting, the other settings have the same effect on the same packets.
"""
import dataclasses
import random
import re

ns_per_second = 1_000_000_000


def _duration(text):
    found = re.fullmatch(r"(\d+(?:\.\d+)?)(us|ms|s)", text)
    if not found:
        raise ValueError("a time such as 200us, 20ms or 1.5s")
    return round(float(found[1]) * {"us": 1_000, "ms": 1_000_000, "s": ns_per_second}[found[2]])


def _share(text):
    found = re.fullmatch(r"(\d+(?:\.\d+)?)%", text)
    if not found or float(found[1]) > 100:
        raise ValueError("a share from 0% to 100%")
    return float(found[1]) / 100


def _rate(text):
    if text == "none":
        return 0
    found = re.fullmatch(r"(\d+(?:\.\d+)?)(kbit|mbit|gbit)", text)
    if not found or float(found[1]) == 0:
        raise ValueError("bits a second such as 500kbit or 2mbit, or none")
    return round(float(found[1]) * {"kbit": 1_000, "mbit": 1_000_000, "gbit": 1_000_000_000}[found[2]] / 8)


def _bytes(text):
    found = re.fullmatch(r"(\d+)(KiB|MiB)?", text)
    if not found:
        raise ValueError("bytes such as 1500 or 64KiB")
    return int(found[1]) << {None: 0, "KiB": 10, "MiB": 20}[found[2]]


def _switch(text):
    if text not in ("on", "off"):
        raise ValueError("on or off")
    return text == "on"


def show_duration(ns):
    unit, of = ("us", 1_000) if ns % 1_000_000 else ("ms", 1_000_000)
    return f"{ns / of:g}{unit}"


def _setting(default, read, show):
    return dataclasses.field(default=default, metadata={"read": read, "show": show})


@dataclasses.dataclass
class settings:
    delay: int = _setting(0, _duration, show_duration)
    jitter: int = _setting(0, _duration, show_duration)
    loss: float = _setting(0.0, _share, lambda p: f"{p * 100:g}%")
    duplicate: float = _setting(0.0, _share, lambda p: f"{p * 100:g}%")
    reorder: float = _setting(0.0, _share, lambda p: f"{p * 100:g}%")
    reorder_by: int = _setting(5_000_000, _duration, show_duration)
    rate: int = _setting(0, _rate, lambda b: f"{b * 8 / 1000:g}kbit" if b else "none")
    queue: int = _setting(64 * 1024, _bytes, str)
    black_hole: bool = _setting(False, _switch, lambda on: "on" if on else "off")

    def set(self, name, text):
        """Raises ValueError with what was wrong."""
        kinds = {field.name: field for field in dataclasses.fields(self)}
        if name not in kinds:
            raise ValueError(f"there is no setting {name}; there are {', '.join(kinds)}")
        try:
            setattr(self, name, kinds[name].metadata["read"](text))
        except ValueError as wanted:
            raise ValueError(f"{name}={text}: wanted {wanted}") from None

    def __str__(self):
        """Those that differ from a perfect line, as they are typed."""
        changed = [field for field in dataclasses.fields(self) if getattr(self, field.name) != field.default]
        words = [f"{field.name}={field.metadata['show'](getattr(self, field.name))}" for field in changed]
        return " ".join(words) or "perfect"


@dataclasses.dataclass
class counts:
    packets: int = 0
    lost: int = 0
    swallowed: int = 0  # by a black hole
    overflowed: int = 0  # the queue before the rate limit
    duplicated: int = 0
    reordered: int = 0

    def __str__(self):
        return ", ".join(f"{value} {name}" for name, value in dataclasses.asdict(self).items())


class direction:
    def __init__(self, seed):
        self.settings, self.counts = settings(), counts()
        self.random = random.Random(seed)
        self.line_free = 0  # when the last byte before the rate limit has passed it
        self.last = 0  # when the last packet that was not reordered leaves

    def take(self, now, size):
        """A packet of `size` bytes at `now` (ns): the times at which it leaves; none, one or two of them."""
        lose, shake, twice, astray, by = (self.random.random() for _ in range(5))
        has, seen = self.settings, self.counts
        seen.packets += 1
        if has.black_hole:
            seen.swallowed += 1
            return []
        if lose < has.loss:
            seen.lost += 1
            return []
        passed = now
        if has.rate:
            begin = max(now, self.line_free)
            if (begin - now) * has.rate > has.queue * ns_per_second:
                seen.overflowed += 1
                return []
            passed = self.line_free = begin + size * ns_per_second // has.rate
        leaves = max(passed, passed + has.delay + round((2 * shake - 1) * has.jitter))
        if astray < has.reorder:  # held back, and nobody waits for it
            seen.reordered += 1
            leaves += round(by * has.reorder_by)
        else:
            leaves = self.last = max(leaves, self.last)
        if twice < has.duplicate:
            seen.duplicated += 1
            return [leaves, leaves]
        return [leaves]
