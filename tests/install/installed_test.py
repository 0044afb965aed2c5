# SPDX-License-Identifier: Apache-2.0
"""Installs what was built, moves it elsewhere, and uses it there as its users do: by find_package in C++, in
C and for the real-time parts alone, and by pkg-config."""
import pathlib
import re
import shutil
import tempfile
import unittest

from projects import build, cmake, compilers, copied, done, libraries, project, source, version


def install(prefix, *components):
    for component in components:
        done(cmake, "--install", build, "--prefix", prefix, "--component", component)


class installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.room = pathlib.Path(tempfile.mkdtemp(prefix="rowe-installed-"))
        cls.addClassCleanup(shutil.rmtree, cls.room)
        cls.first = cls.room / "first"
        cls.prefix = cls.room / "moved"
        install(cls.first, "rowe_rt", "rowe_library", "rowe_programs")
        cls.first.rename(cls.prefix)
        cls.projects = copied(cls.room / "projects")
        cls.nothing = cls.room / "nothing"
        cls.nothing.mkdir()

    def pkg_config(self, *arguments):
        return done("pkg-config", *arguments, PKG_CONFIG_PATH=self.prefix / libraries / "pkgconfig").split()

    def asks(self, lines, prefix=None, **more):
        """What is wrong with a project of these lines alone; its compiler is not looked at."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.room))
        text = f"cmake_minimum_required(VERSION 3.22)\nproject(asks LANGUAGES C)\n{lines}\n"
        (folder / "CMakeLists.txt").write_text(text, encoding="utf-8")
        package = (prefix or self.prefix) / libraries / "cmake" / "rowe"
        return project(folder, ["C"], "-DCMAKE_C_COMPILER_FORCED=ON", f"-Drowe_DIR={package}",
                       **more).diagnostic()


class by_find_package(installed):
    def use(self, name, language, program, *, without_libraries=False):
        """(what the build said, what the program said)"""
        hidden = {"PKG_CONFIG_LIBDIR": self.nothing} if without_libraries else {}
        one = project(self.projects / name, [language], CMAKE_PREFIX_PATH=self.prefix, **hidden)
        one.configure()
        commands = one.make(program)
        for line in commands.splitlines():
            self.assertNotRegex(line, r"\s-W(?!l,)", "a user's warnings are a user's affair")
        return commands, done(one.built / program)

    def test_the_unit_stands_where_systemd_looks(self):
        unit = (self.prefix / "lib/systemd/system/rowe@.service").read_text(encoding="utf-8")
        (program,) = re.findall(r"(?m)^ExecStart=(\S+) serve ", unit)
        self.assertEqual(pathlib.Path(program), self.first / "bin/rowe", "systemd's path need not have it")
        self.assertIn("--config %S/rowe/%i/rowe.toml", unit)
        self.assertIn("SystemCallFilter=~@privileged @keyring", unit)

    def test_a_program_in_cpp(self):
        commands, said = self.use("cpp", "CXX", "robot")
        self.assertEqual(said, "x 1.5, y -2\n")
        self.assertIn("-std=gnu++20", commands)
        self.assertIn("-Wl,-z,now", commands)

    def test_a_program_in_c_whose_project_knows_no_cpp(self):
        commands, said = self.use("c", "C", "robot")
        self.assertEqual(said, '{"x":1.5,"y":-2}\n')
        self.assertIn("-Wl,-z,now", commands)

    def test_the_real_time_parts_where_no_other_library_is(self):
        commands, said = self.use("rt", "CXX", "loop", without_libraries=True)
        self.assertEqual(said, "sum 45, newest 9, expired 1, allocations 0, noticed 1\n")
        self.assertNotRegex(commands, "websockets|simdjson|librowe.a")

    def test_the_rest_says_there_what_it_lacks(self):
        for asked in ("", "COMPONENTS c", "COMPONENTS rt rowe"):
            said = self.asks(f"find_package(rowe CONFIG REQUIRED {asked})", PKG_CONFIG_LIBDIR=self.nothing)
            self.assertIsNotNone(said, asked)
            self.assertRegex(said, r"pkg-config does not find"
                                   r" libwebsockets>=\S+, simdjson>=\S+, libcrypto>=\S+, libssl>=\S+,"
                                   r" liblz4>=\S+, libzstd>=\S+, zlib>=", asked)
        self.assertIsNone(self.asks("find_package(rowe CONFIG REQUIRED COMPONENTS rt OPTIONAL_COMPONENTS c)\n"
                                    "if(rowe_c_FOUND OR NOT rowe_rt_FOUND)\n  message(FATAL_ERROR wrong)\n"
                                    "endif()", PKG_CONFIG_LIBDIR=self.nothing))

    def test_the_real_time_parts_are_installed_alone(self):
        alone = self.room / "alone"
        install(alone, "rowe_rt")
        self.assertIsNone(self.asks("find_package(rowe CONFIG REQUIRED COMPONENTS rt)", alone))
        self.assertIn("only component rt of it is installed",
                      self.asks("find_package(rowe CONFIG REQUIRED)", alone))

    def test_versions_that_may_differ_are_refused(self):
        major, minor, _ = map(int, version.split("."))
        self.assertIsNone(self.asks(f"find_package(rowe {major}.{minor} CONFIG REQUIRED COMPONENTS rt)"))
        for other in (f"{major}.{minor + 1}", f"{major + 1}.0", "0.0"):
            self.assertIn(f"rowe-config.cmake, version: {version}",
                          self.asks(f"find_package(rowe {other} CONFIG REQUIRED COMPONENTS rt)"), other)

    def test_a_component_that_there_is_not(self):
        self.assertIn("components rt, rowe and c",
                      self.asks("find_package(rowe CONFIG REQUIRED COMPONENTS python)"))


class by_pkg_config(installed):
    readme = (source / "README.md").read_text(encoding="utf-8")

    def compiled(self, language, file, *options):
        program = self.room / "compiled"
        done(compilers[language], *(["-std=c++20"] if language == "CXX" else []), self.projects / file,
             *options, "-o", program)
        return done(program)

    def test_a_program_in_cpp(self):
        documented = "g++ -std=c++20 robot.cpp $(pkg-config --cflags --libs rowe) -o robot"
        self.assertTrue(documented in self.readme, documented)
        options = self.pkg_config("--cflags", "--libs", "rowe")
        self.assertIn("-Wl,-z,now", options)
        self.assertEqual(self.compiled("CXX", "cpp/robot.cpp", *options), "x 1.5, y -2\n")

    def test_a_program_in_c(self):
        for asked in (["--libs"], ["--static", "--libs"]):
            options = self.pkg_config("--cflags", *asked, "rowe-c")
            self.assertIn("-Wl,-z,now", options)
            # In this order of libraries, too, where the linker takes only those that somebody needs by then.
            said = self.compiled("C", "c/robot.c", "-Wl,--as-needed", *options)
            self.assertEqual(said, '{"x":1.5,"y":-2}\n')

    def test_the_real_time_parts(self):
        options = self.pkg_config("--cflags", "--libs", "rowe-rt")
        self.assertNotRegex(" ".join(options), "websockets|simdjson|-lrowe ")
        self.assertEqual(self.compiled("CXX", "rt/threads.cpp", *options), "read by reader: 1\n")

    def test_rings_window_and_wheel_are_headers_only(self):
        said = self.compiled("CXX", "rt/headers.cpp", f"-I{self.prefix}/include", "-O2", "-Wall", "-Wextra",
                             "-Werror")
        self.assertEqual(said, "ring, free ring, window, wheel\n")

    def test_versions(self):
        for name in ("rowe", "rowe-c", "rowe-rt"):
            self.assertEqual(self.pkg_config("--modversion", name), [version])


class what_is_there(installed):
    def test_every_public_header_and_nothing_else(self):
        wanted = {str(one.relative_to(folder)) for folder in (source / "include", source / "rt" / "include")
                  for one in folder.rglob("*") if one.is_file()}
        there = {str(one.relative_to(self.prefix / "include"))
                 for one in (self.prefix / "include").rglob("*") if one.is_file()}
        self.assertEqual(there, wanted)
        self.assertIn("rowe/rt/spsc_ring.hpp", there)

    def test_an_archive_for_each_target(self):
        self.assertEqual({one.name for one in (self.prefix / libraries).glob("lib*")},
                         {"librowe.a", "librowe_c.a", "librowe_rt.a"})
        self.assertTrue((self.prefix / "share" / "doc" / "rowe" / "LICENSE").exists())

    def test_the_program(self):
        programs = {one.name for one in (self.prefix / "bin").iterdir()}
        self.assertEqual(programs - {"rowe_ros1"}, {"rowe"})  # the bridge is there where roscpp is
        self.assertIn(version, done(self.prefix / "bin" / "rowe", "--version"))

    def test_no_file_names_a_folder_of_this_machine(self):
        seen = 0
        for one in (*self.prefix.rglob("*.cmake"), *self.prefix.rglob("*.pc")):
            text = one.read_text(encoding="utf-8")
            for folder in (self.first, build, source):
                self.assertNotIn(str(folder), text, one)
            for line in text.splitlines():
                # For /usr alone CMake knows where it was to be, for those who link /lib to /usr/lib.
                if not re.search(r"^#|_realOrig|set\(\w+_PREFIX ", line):
                    self.assertNotRegex(line, r"(?<![\w.}])/(usr|opt|tmp)/", one)
            seen += 1
        self.assertEqual(seen, 9)


if __name__ == "__main__":
    unittest.main()
