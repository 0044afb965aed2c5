# SPDX-License-Identifier: Apache-2.0
"""The pages in the tree: made by their programs and not by hand, and the targets name what is there."""
import os
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree

top = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(top / "bench" / "report"))
import methods
import programs
import rows
import runs


def source_text(path, seen=None):
    """Of a bench, with the headers and sources beside it that it includes."""
    seen = set() if seen is None else seen
    if path in seen or not path.is_file():
        return ""
    seen.add(path)
    text = path.read_text(encoding="utf-8")
    for name in re.findall(r'(?m)^#include "([^"]+)"', text):
        for folder in (path.parent, top / "bench"):
            for file in (folder / name, (folder / name).with_suffix(".cpp")):
                text += source_text(file, seen)
    return text


class bench_readme(unittest.TestCase):
    def test_is_what_the_comments_say(self):
        self.assertEqual((top / "bench" / "README.md").read_text(encoding="utf-8"), methods.readme(),
                         "bench/report/main.py --readme writes it")

    def test_each_comment_has_its_headings(self):
        for one in programs.programs:
            self.assertEqual(methods.missing_headings(one), [], one.source)

    def test_each_bench_is_run_by_the_command(self):
        known = {one.source for one in programs.programs}
        for path in sorted((top / "bench").glob("*.cpp")):
            if "Question: " in methods.opening_comment(path.read_text(encoding="utf-8")):
                self.assertIn(path.name, known, "bench/report/programs.py")


class target_rows(unittest.TestCase):
    def test_name_benchmarks_and_counters_of_their_programs(self):
        for one in rows.targets:
            program = programs.named(one.program)
            self.assertIsNotNone(program, one)
            text = source_text(top / "bench" / program.source)
            # Sizes may be made up when it runs: `echo_64`.
            named = [re.sub(r"\d+$", "", part) for part in one.benchmark.split("/") if not part.isdigit()]
            for part in named + ([one.counter] if one.counter not in ("time", "instructions") else []):
                self.assertTrue(part in text or part == program.name, f"{part} of {one}")

    def test_stand_together_by_quantity(self):
        quantities = [one.quantity for one in rows.targets]
        changes = [each for each, before in zip(quantities, [None] + quantities) if each != before]
        self.assertEqual(len(changes), len(set(quantities)))


class page(unittest.TestCase):
    def setUp(self):
        self.text = (top / "docs" / "benchmarks.md").read_text(encoding="utf-8")

    def test_says_which_machine_and_has_the_targets(self):
        self.assertTrue(self.text.startswith("# Benchmarks\n\n**"))
        for fact in ("cores", "kernel", "clock source", "governor", "compiler", "date", "commit",
                     "load before"):
            self.assertIn(f" · {fact} ", self.text.split("\n")[2])
        self.assertIn("\n## Targets\n", self.text)

    def test_has_tables_of_even_width(self):
        width = None
        for line in self.text.split("\n"):
            cells = len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else None
            if cells and width:
                self.assertEqual(cells, width, line)
            width = cells

    def test_shows_every_plot_there_is(self):
        shown = re.findall(r"!\[[^]]*\]\(benchmarks/([^)]+)\)", self.text)
        there = sorted(path.name for path in (top / "docs" / "benchmarks").glob("*.svg"))
        self.assertEqual(sorted(shown), there)
        for name in there:
            xml.etree.ElementTree.parse(top / "docs" / "benchmarks" / name)

    def test_has_beside_its_plots_the_runs_of_releases_and_each_can_be_compared_with(self):
        for path in sorted((top / "docs" / "benchmarks").iterdir()):
            if path.suffix != ".svg":
                self.assertIsNotNone(runs.version(path), f"{path.name}: a release's is named 0.1.0.json")
                runs.load(path)


if __name__ == "__main__":
    os.chdir(top)
    unittest.main()
