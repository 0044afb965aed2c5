# SPDX-License-Identifier: Apache-2.0
"""Takes rowe into another project by FetchContent: it works there, and nothing of rowe's own settings, names,
warnings and rules of installation becomes that project's."""
import pathlib
import re
import shutil
import tempfile
import unittest

from projects import cmake, copied, done, project, source

# What CMake and its modules keep themselves, the project's own, and rowe's.
names_allowed = r"(CMAKE_|FETCHCONTENT_|PKG_CONFIG_|fleet_|rowe_|ROWE_|pkgcfg_lib_ROWE_)\w+"


class fetched(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.room = pathlib.Path(tempfile.mkdtemp(prefix="rowe-fetched-"))
        cls.addClassCleanup(shutil.rmtree, cls.room)
        cls.fleet = project(copied(cls.room / "projects") / "fetched", ["C", "CXX"],
                            f"-DFETCHCONTENT_SOURCE_DIR_ROWE={source}", "-DCMAKE_UNITY_BUILD=ON",
                            "-DROWE_ONE_UNIT_A_FOLDER=OFF")  # a file without its includes is found
        cls.said = cls.fleet.configure()

    def listed(self, what):
        return re.findall(rf"^-- {what} (\S+)$", self.said, re.MULTILINE)

    def test_its_targets_have_its_name(self):
        targets = self.listed("target")
        self.assertIn("rowe_c", targets)
        for one in targets:
            self.assertRegex(one, r"^rowe(_\w+)?$")

    def test_its_cached_variables_have_its_name(self):
        names = self.listed("cached")
        self.assertIn("ROWE_TESTS", names)
        for one in names:
            self.assertRegex(one, f"^{names_allowed}$")

    def test_it_sets_nothing_for_others(self):
        for name in ("options", "CMAKE_BUILD_TYPE", "CMAKE_CXX_STANDARD", "CMAKE_CXX_EXTENSIONS",
                     "CMAKE_CXX_COMPILER_LAUNCHER", "CMAKE_EXPORT_COMPILE_COMMANDS",
                     "CMAKE_POSITION_INDEPENDENT_CODE", "CMAKE_RUNTIME_OUTPUT_DIRECTORY"):
            self.assertEqual(self.listed(re.escape(name)), ["[]"], name)
        self.assertFalse((self.fleet.built / "compile_commands.json").exists())

    def test_others_are_compiled_without_its_options(self):
        line, = (one for one in self.fleet.make("own").splitlines() if " -c " in one)
        self.assertNotRegex(line, r"\s-(W|f|I|std|include|isystem|-param)")
        self.assertTrue((self.fleet.built / "own").exists())

    def test_who_links_its_real_time_parts_needs_no_more(self):
        commands = self.fleet.make("loop")
        self.assertIn("sum 45, newest 9", done(self.fleet.built / "loop"))
        line, = (one for one in commands.splitlines() if " -c " in one and "loop.dir" in one)
        self.assertNotRegex(line, r"\s-W")
        self.assertIn("arena.cpp.o", commands)  # not compiled with others, although the project wants that
        self.assertNotIn("-Werror", commands)   # the project may have a compiler that warns of more

    def test_it_is_not_installed_with_others(self):
        prefix = self.room / "prefix"
        done(cmake, "--install", self.fleet.built, "--prefix", prefix)
        self.assertEqual([*prefix.rglob("*")], [])


if __name__ == "__main__":
    unittest.main()
