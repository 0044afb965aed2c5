# SPDX-License-Identifier: Apache-2.0
"""Trajectories made for tests: TUM files whose numbers are as nasty as doubles can be."""
import math
import random
import struct

# Where shortest digits, rounding and signs go wrong first.
nasty = [0.0, -0.0, 0.1, -0.3, 4.35, 1 / 3, 5e-324, -5e-324, 2.2250738585072011e-308, 2.2250738585072014e-308,
         1.7976931348623157e308, -1.7976931348623157e308, 9007199254740991.0, 9007199254740992.0,
         9007199254740994.0, 9223372036854775808.0,
         18446744073709551616.0, 1e21, 1e22, 1e23, -1e-7, 1e-6, 123456789.12345679,
         0.1 + 0.2, 2.0**-1074 * 3, 4.9406564584124654e-324, 9.5e-5, 0.00001, 1e15, 1e16, 1e17, 299792458.0]


def any_double(chance):
    """A finite double, each bit pattern as likely as the next."""
    while True:
        (value,) = struct.unpack("<d", struct.pack("<Q", chance.getrandbits(64)))
        if math.isfinite(value):
            return value


def a_double(chance):
    return chance.choice(nasty) if chance.random() < 0.3 else any_double(chance)


def bits(value):
    return struct.pack("<d", float(value))


class trajectory:
    """`count` poses, `step_ns` apart: .times (secs, nsecs) and .numbers (tx ty tz qx qy qz qw)."""

    def __init__(self, count, step_ns, seed, first_ns=1305031098_665900001):
        chance = random.Random(seed)
        self.times, self.numbers = [], []
        for i in range(count):
            self.times.append(divmod(first_ns + i * step_ns, 1_000_000_000))
            self.numbers.append([a_double(chance) for _ in range(7)])

    def write(self, path):
        with open(path, "w") as file:
            file.write("# timestamp tx ty tz qx qy qz qw\n")
            for (secs, nsecs), numbers in zip(self.times, self.numbers):
                file.write(f"{secs}.{nsecs:09} " + " ".join(map(repr, numbers)) + "\n")
        return path


def time_of(message):
    stamp = message["header"]["stamp"]
    return stamp["secs"], stamp["nsecs"]


def numbers_of(message):
    pose = message["pose"]["pose"]
    return [pose["position"][axis] for axis in "xyz"] + [pose["orientation"][axis] for axis in "xyzw"]
