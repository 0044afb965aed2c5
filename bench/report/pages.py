# SPDX-License-Identifier: Apache-2.0
"""docs/benchmarks.md and its plots, from results. Nothing in the page is written by hand."""
import machine
import methods
import svg
import targets
import words
from programs import programs

_opening = """# Benchmarks

{facts}

Written by `tools/benchmark` from what its programs measured; nothing here is written by hand. Everything that
is compared ran alternately, in each round of one run; ratios were taken inside a round; all figures are
medians over the rounds, and over the turns if there were several. Compare ratios, not times, with other
machines.
[bench/README.md]({up}bench/README.md) says of each program what it measures, what it leaves out and what
would make it lie. In the plots rowe is blue, a limit that nobody can pass green, everything else grey.

    tools/benchmark                  # installs what is missing, builds, runs all, writes this page
    tools/benchmark --only publish   # one of them
{versions}"""


def cell(text):
    return str(text).replace("|", "\\|")


def table(heads, lines):
    """The first column to the left, the others to the right."""
    out = ["| " + " | ".join(map(cell, heads)) + " |",
           "|---|" + "--:|" * (len(heads) - 1)]
    out += ["| " + " | ".join(map(cell, line)) + " |" for line in lines]
    return "\n".join(out) + "\n"


def group_table(rows):
    columns = words.columns(rows)
    with_size = any(one.size for one in rows)
    heads = [rows[0].group.replace("_", " ")] + ([""] if with_size else []) + [one.heading for one in columns]
    lines = []
    for one in rows:
        label = one.contender or one.name
        start = [f"**{label}**" if label.startswith("rowe") else label] + ([one.size] if with_size else [])
        lines.append(start + [words.number(one.values.get(each.name)) for each in columns])
    return table(heads, lines)


def target_lines(verdicts):
    last = None
    for one in verdicts:
        asked = one.target
        quantity = asked.quantity if asked.quantity != last else "  ″"
        last = asked.quantity
        what = quantity + (f": {asked.of}" if asked.of else "")
        here = words.number(one.value) if one.value is not None else "–"
        yield [what, str(asked.bound), here, one.word if one.word == "met" else f"**{one.word}**",
               f"`{asked.program}`"]


def targets_section(verdicts):
    count = {word: sum(one.word == word for one in verdicts) for word in ("met", "missed", "left out")}
    out = ["## Targets\n", f"{count['met']} met, {count['missed']} missed, {count['left out']} left out.\n",
           table(["quantity", "target", "here", "", "program"], target_lines(verdicts))]
    for word, heading in (("missed", "What is missed, and why"), ("left out", "What is left out, and why")):
        those = [one for one in verdicts if one.word == word]
        if those:
            out.append(f"### {heading}\n")
            out.append("\n".join(f"- {reason(one)}" for one in those) + "\n")
    return "\n".join(out)


def reason(one):
    asked = one.target
    what = asked.quantity + (f" ({asked.of})" if asked.of else "")
    if one.word == "left out":
        return f"{what}: {one.why}"
    return f"{what}: {words.number(one.value)} instead of {asked.bound}. " + \
        (asked.reason or "The reason has not been measured.")


def section(one, told, first, drawings, folder, up):
    """Of one program; what is drawn goes into `drawings`, by file name."""
    out = [f"## {one.title}\n", methods.question(one) + "\n"]
    note = f"[How, and what would make it lie]({up}bench/README.md#{methods.anchor(one)}) · " \
        f"`tools/benchmark --only {one.name}`"
    note += f" · {told.rounds} rounds" if told.rounds else ""
    note += f" · {told.turns} turns" if told.turns > 1 else ""
    note += f" · {told.seconds:.0f} s · load before {told.load}"
    if (told.commit, told.date) != (first["commit"], first["date"]):
        note += f" · of {told.date}, commit {told.commit}"
    out.append(note + "\n")
    out += [f"*{line}*\n" for line in told.notes]
    if told.text:
        out.append("```text\n" + told.text.expandtabs() + "\n```\n")
    for group, rows in told.tables():
        said = group.replace("_", " ")
        drawn = svg.plot(one.title + ("" if group in ("", one.name) else f": {said}"), rows)
        if drawn:
            name = one.name + ("" if group == one.name else f"-{group or 'others'}")
            while name + ".svg" in drawings:
                name += "_more"
            name += ".svg"
            drawings[name] = drawn
            out.append(f"![{said or one.title}]({folder}/{name})\n")
        out.append(group_table(rows))
    return "\n".join(out)


def not_run(results):
    lines = [f"- `{one.name}` {results[one.name].state}: {results[one.name].why}" for one in programs
             if results[one.name].state != "ran"]
    return "## Programs that did not run\n\n" + "\n".join(lines) + "\n" if lines else ""


def page(results, facts, versions=(), up="../", folder="benchmarks", since=""):
    """(text of the page, {file name: SVG}); `since` is the section that compares with a release."""
    drawings = {}
    first = {"commit": facts["commit"], "date": facts["date"]}
    told = " · ".join(f"{name} {value}" if name != "processor" else f"**{value}**"
                      for name, value in facts.items())
    compared = ", ".join(f"{name} {version}" for name, version in versions)
    out = [_opening.format(facts=told, up=up, versions=f"\nCompared with {compared}.\n" if compared else ""),
           targets_section(targets.judge_all(results)), since]
    out += [section(one, results[one.name], first, drawings, folder, up) for one in programs
            if results[one.name].state == "ran"]
    out.append(not_run(results))
    return "\n".join(part for part in out if part), drawings


def write(out, results, facts, since=""):
    """Into the folder `out`: benchmarks.md, and benchmarks/ with the plots, which are made anew. The runs of
    releases are there, too, and stay."""
    text, drawings = page(results, facts, machine.versions(), since=since)
    (out / "benchmarks").mkdir(parents=True, exist_ok=True)
    (out / "benchmarks.md").write_text(text, encoding="utf-8")
    for old in (out / "benchmarks").glob("*.svg"):
        old.unlink()
    for name, drawn in drawings.items():
        (out / "benchmarks" / name).write_text(drawn, encoding="utf-8")
