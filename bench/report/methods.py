# SPDX-License-Identifier: Apache-2.0
"""bench/README.md, made of the opening comments of the programs' sources, which open with

    Question: what is asked?
    Measured, ...
    Excluded: ...
    What would make it lie: ...
    Run: how to run it

each at the beginning of a paragraph; a script's usage stands for its `Run`.
"""
import pathlib
import re

from programs import programs

top = pathlib.Path(__file__).resolve().parents[2]
headings = ("Question", "Measured", "Excluded", "What would make it lie", "Run")

_opening = """# Benches

Made by `bench/report/main.py --readme` from the opening comments of the programs; change those. One program
a question; each runs by itself, or all of them by [tools/benchmark](../tools/benchmark), which writes
[docs/benchmarks.md](../docs/benchmarks.md). Everything that is compared runs once in every round of one run,
because machines drift from minute to minute; ratios are taken inside a round, and their medians over the
rounds reported. Run by hand: [newcomers.py](newcomers.py): who gets in beside a flood of handshakes;
[stick.js](stick.js): how long it is from a finger in a browser to the loop; [page.js](page.js): when the
page is there, and what it costs the robot.

"""


def opening_comment(text):
    """The first comment behind the licence, or the first docstring."""
    docstring = re.match(r'(?:#[^\n]*\n)*"""(.*?)"""', text, re.DOTALL)
    if docstring:
        return docstring[1].strip("\n")
    lines = []
    for line in text.splitlines():
        if line.startswith("#!") or "SPDX-License-Identifier" in line:
            continue
        found = re.match(r"(?://|#)(?: (.*)|$)", line)
        if not found:
            break
        lines.append(found[1] or "")
    return "\n".join(lines).strip("\n")


def comment(one):
    return opening_comment((top / "bench" / one.source).read_text(encoding="utf-8"))


def paragraphs(text):
    return [part for part in re.split(r"\n\s*\n", text) if part.strip()]


def question(one):
    for part in paragraphs(comment(one)):
        if part.startswith("Question: "):
            asked = " ".join(part.removeprefix("Question: ").split())
            return asked[0].upper() + asked[1:]
    return one.title


def missing_headings(one):
    starts = paragraphs(comment(one))
    return [name for name in headings if not any(re.match(rf"{name}\b", part) or
                                                 (name == "Run" and part.startswith("usage: "))
                                                 for part in starts)]


def anchor(one):
    return one.source.rpartition(".")[0] or one.source.replace("/", "")


def markdown(part):
    """A paragraph: what is indented in it is set as it is, and what it begins with is set off."""
    out, block = [], []

    def flush():
        if block:
            out.append("\n```text\n" + "\n".join(block) + "\n```\n")
            block.clear()

    for line in part.split("\n"):
        if line.startswith("  "):
            block.append(line)
        else:
            flush()
            out.append(line)
    flush()
    text = "\n".join(out).strip("\n")
    for start in ("Run: ", "usage: "):
        if text.startswith(start) and "\n" not in text:
            return f"**Run:** `{text[len(start):]}`"
    for name in headings:
        if re.match(rf"{name}\b", text):
            rest = text[len(name):]
            return f"**{name}:**{rest[1:]}" if rest.startswith(":") else f"**{name}**{rest}"
    return text


def section(one):
    parts = [markdown(part) for part in paragraphs(comment(one))]
    return f"## {one.source.rpartition('.')[0] or one.source}\n\n[{one.source}]({one.source})\n\n" + \
        "\n\n".join(parts) + "\n"


def readme():
    return _opening + "\n".join(section(one) for one in programs)
