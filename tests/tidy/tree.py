# SPDX-License-Identifier: Apache-2.0
"""The files of a working tree, C++ without its comments and strings, and what is found in them."""
import collections
import functools
import os
import re

finding = collections.namedtuple("finding", "path line rule what")

code_suffixes = (".hpp", ".cpp", ".h", ".c")
source_suffixes = code_suffixes + (
    ".S", ".py", ".js", ".ts", ".css", ".html", ".svg", ".cmake", ".sh", ".pml")
text_suffixes = source_suffixes + (".md", ".txt", ".json", ".yml", ".yaml", ".cff", ".in")
left_out = {".git", "node_modules", "__pycache__"}

_token = re.compile(r'//[^\n]*|/\*.*?\*/|R"([^()\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|'
                    r"(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])'", re.DOTALL)


@functools.lru_cache(maxsize=None)  # the same text comes again in each tree that has it
def strip(text):
    """C++ with comments and the insides of literals blanked; line breaks stay."""

    def blank(match):
        breaks = "\n" * match[0].count("\n")
        if match[0].startswith("/"):
            return breaks
        return ("' '" if match[0].startswith("'") else '""') + breaks

    return _token.sub(blank, text)


class tree:
    """No build folders, nothing that was downloaded."""

    def __init__(self, root):
        self.root = os.path.abspath(root)
        self.paths = []
        for folder, folders, names in os.walk(self.root):
            inside = os.path.relpath(folder, self.root)
            if inside == "build" or "CMakeCache.txt" in names:
                folders[:] = []
                continue
            folders[:] = sorted(name for name in folders if name not in left_out)
            self.paths += [os.path.normpath(os.path.join(inside, name)) for name in sorted(names)]

    def exists(self, path):
        return os.path.exists(os.path.join(self.root, path))

    @functools.lru_cache(maxsize=None)
    def text(self, path):
        """Nothing of what is no text."""
        try:
            with open(os.path.join(self.root, path), encoding="utf-8", newline="") as file:
                return file.read()
        except UnicodeDecodeError:
            return ""

    @functools.lru_cache(maxsize=None)
    def lines(self, path):
        text = self.text(path)
        return text.split("\n") if text else []

    @functools.lru_cache(maxsize=None)
    def code(self, path):
        """Of a C++ file, the same lines, stripped."""
        return strip(self.text(path)).split("\n")

    def within(self, folders, suffixes=code_suffixes):
        inside = tuple(folder + "/" for folder in folders)
        return [path for path in self.paths if path.endswith(suffixes) and path.startswith(inside)]

    def is_script(self, path):
        return "." not in os.path.basename(path) and "".join(self.lines(path)[:1]).startswith("#!")

    @functools.lru_cache(maxsize=None)
    def sources(self):
        return [path for path in self.paths if path.endswith(source_suffixes) or self.is_script(path) or
                os.path.basename(path) == "CMakeLists.txt"]

    @functools.lru_cache(maxsize=None)
    def texts(self):
        return [path for path in self.paths if path.endswith(text_suffixes) or path in self.sources()]
