# SPDX-License-Identifier: Apache-2.0
"""Each target of rows.py against the results."""
import dataclasses

import rows


@dataclasses.dataclass(frozen=True)
class verdict:
    target: rows.target
    value: float = None
    why: str = ""  # there is no value

    @property
    def word(self):
        if self.value is None:
            return "left out"
        return "met" if self.target.bound.holds(self.value, self.target.bound.limit) else "missed"


def judge(target, told):
    """`told` is the result of the target's program."""
    found = told.find(target.benchmark)
    if found and target.counter in found.values:
        return verdict(target, found.values[target.counter])
    if told.state != "ran":
        return verdict(target, why=told.why)
    return verdict(target, why=f"there is no {target.counter} of {target.benchmark}")


def judge_all(results, targets=rows.targets):
    """`results` by the names of their programs."""
    return [judge(one, results[one.program]) for one in targets]
