# SPDX-License-Identifier: Apache-2.0
"""What `tools/test --quick` builds and runs: areas, which are the folders of tests/ and docs. An area is due
when something that it is about has changed since its tests last passed."""
import json
import os
import pathlib

# What an area is about, besides its folder of tests. Headers of other rooms are left to the compiler: they
# build an area's programs anew, but do not make it due.
about = {
    "rt": ["rt"], "json": ["src/json"], "access": ["src/access"], "wire": ["src/wire"], "net": ["src/net"],
    "mcap": ["src/mcap"], "rosmsg": ["src/rosmsg"],
    "service": ["src/service", "tests/memory_transport"], "sim": ["tests/memory_transport"],
    "page": ["src/page"], "web": ["clients", "src/page"], "api": ["src/api", "include"], "capi": ["src/capi"],
    "install": ["include", "rt", "README.md"], "tools": ["tools"],
    "ros1": ["tools/ros1"],
    "setup": ["tools/rowe"], "faults": ["tools/rowe", "src/net", "tests/impair", "tests/tools"],
    "bench": ["bench", "docs/benchmarks.md", "docs/benchmarks", "tools/benchmark"],
    "docs": ["docs/examples", "tests/tools/examples_test.py"],
    "counts": ["bench/instructions.cpp", "docs/real-time.md"],
    "rt_contract": ["rt/tripwire", "docs/real-time.md"],
    "tidy": ["."],
}
# What every area is built with.
everywhere = ["CMakeLists.txt", "CMakePresets.json", "cmake", "src/CMakeLists.txt", "tests/CMakeLists.txt"]
unwatched = {".git", "build", "node_modules", "__pycache__"}
seconds_max = 20  # of tests, one after the other on each core


def known():
    folders = {one.parent.name for one in pathlib.Path("tests").glob("*/CMakeLists.txt")}
    return sorted(folders | {"docs"})


def changed_at(area):
    """When the newest of an area's files changed; folders change when a file comes or goes."""
    roots = [os.path.join("tests", area), *about.get(area, []), *everywhere]
    return max(map(newest, roots))


def newest(root):
    if not os.path.isdir(root):
        return os.stat(root).st_mtime if os.path.exists(root) else 0.0
    at = 0.0
    for folder, inside, files in os.walk(root):
        inside[:] = [one for one in inside if one not in unwatched]
        # The top of the tree changes with the build folder.
        own = [folder] if folder != "." else []
        at = max([at, *(os.stat(one).st_mtime
                        for one in (*own, *(os.path.join(folder, file) for file in files)))])
    return at


class record:
    """What is remembered of the tests of a preset, in its build folder: when those of each area last passed,
    and how many seconds each took."""

    def __init__(self, preset):
        self.build = pathlib.Path("build") / preset
        self.folder = self.build / "passed"
        self.times = self.folder / "seconds.json"

    def passed_at(self, area):
        file = self.folder / area
        return file.stat().st_mtime if file.exists() else 0.0

    def passed(self, areas, began):
        """All of these passed in a run that began then."""
        self.folder.mkdir(exist_ok=True)
        for area in areas:
            (self.folder / area).touch()
            os.utime(self.folder / area, (began, began))

    def failed(self, areas):
        for area in areas:
            (self.folder / area).unlink(missing_ok=True)

    def due(self):
        return [area for area in known() if changed_at(area) >= self.passed_at(area)]

    def is_current(self, area):
        """Its tests passed with what is there now: its files, and every program that was built."""
        last = self.passed_at(area)
        programs = max(newest(str(self.build / one)) for one in ("bin", "tests", "examples"))
        return last > max(changed_at(area), programs)

    def scripts_due(self, area):
        """The tests of an area that are scripts and have changed."""
        last = self.passed_at(area)
        changed = [one for one in pathlib.Path("tests", area).rglob("*")
                   if one.suffix in (".py", ".js") and one.stat().st_mtime >= last
                   and not unwatched.intersection(one.parts)]
        names = {str(one.relative_to(pathlib.Path("tests", area))) for one in changed}
        return ({f"{area}/{name.removesuffix('_test.py')}" for name in names if name.endswith("_test.py")} |
                {f"{area}/{name.removesuffix('.test.js').replace('/', '.')}" for name in names
                 if name.endswith(".test.js")})

    def took(self):
        """name -> seconds, the last time."""
        return json.loads(self.times.read_text(encoding="utf-8")) if self.times.exists() else {}

    def forget_times(self):
        """Before all tests run: some may have other names now."""
        self.times.unlink(missing_ok=True)

    def remember(self, tests):
        """Takes in (name, seconds) of tests that ran."""
        self.folder.mkdir(exist_ok=True)
        self.times.write_text(json.dumps({**self.took(), **dict(tests)}, indent=0), encoding="utf-8")


def left_out(took, wanted, jobs):
    """Of the tests of an area, by how long each took: those that are too long, so that the rest takes no
    longer than seconds_max. Those in `wanted` stay."""
    kept = sum(took[name] for name in wanted if name in took)
    out = []
    for name, seconds in sorted(took.items(), key=lambda one: one[1]):
        if name in wanted:
            continue
        kept += seconds
        if kept > seconds_max * jobs:
            out.append(name)
    return out
