# SPDX-License-Identifier: Apache-2.0
"""Each target of rows.py against the results."""
import dataclasses

import programs
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
    asked = [target.benchmark] + ([target.over] if target.over else [])
    found = [told.find(name) for name in asked]
    values = [each.values[target.counter] for each in found if each and target.counter in each.values]
    if len(values) == len(asked):
        return verdict(target, values[0] / values[1] if target.over else values[0])
    if told.state != "ran":
        return verdict(target, why=told.why)
    return verdict(target, why=f"there is no {target.counter} of {target.benchmark}")


def judge_all(results, targets=rows.targets):
    """`results` by the names of their programs. In the order of the programs; a quantity stays together."""
    order = {one.name: place for place, one in enumerate(programs.programs)}
    place = {}
    for one in targets:
        place.setdefault(one.quantity, order[one.program])
    return [judge(one, results[one.program]) for one in sorted(targets, key=lambda one: place[one.quantity])]
