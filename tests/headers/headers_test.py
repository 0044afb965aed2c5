#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The public headers compile wherever programs include them.

    tests/headers/headers_test.py [OPTION OF UNITTEST]... together|each

`together`: all in one file; the C headers in each C; each header in C++17, which must say one thing. `each`:
each header alone in both versions of C++, and the examples, which instantiate what is in the headers.

The compilers are g++ and clang++, gcc and clang, those of them that are here. Headers of detail/ are
compiled as parts of the others."""
import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

root = pathlib.Path(__file__).resolve().parents[2]
folders = (root / "include", root / "rt" / "include")
warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
cxx_warnings = {"g++": (*warnings, "-Wold-style-cast", "-Wuseless-cast"),
                "clang++": (*warnings, "-Wold-style-cast")}
without = ("-fno-exceptions", "-fno-rtti")
cxx_versions = ("c++20", "c++2b")
c_versions = ("c90", "gnu90", "c99", "c11", "c17", "c2x")


def here(*compilers):
    found = [one for one in compilers if shutil.which(one)]
    assert found, f"none of {compilers} is here"
    return found


def headers(ending):
    found = [one.relative_to(folder).as_posix() for folder in folders
             for one in sorted(folder.rglob("*" + ending)) if one.parent.name != "detail"]
    assert found, f"no headers *{ending}"
    return found


def compiled(compiler, version, language, text, *options):
    """What the compiler says of this text, and whether it takes it."""
    ran = subprocess.run([compiler, f"-std={version}", "-fsyntax-only", *options,
                          *(f"-I{one}" for one in folders), "-x", language, "-"],
                         input=text, capture_output=True, text=True, check=False,
                         env={**os.environ, "LC_ALL": "C"})
    return ran.returncode == 0, ran.stderr


def including(*names):
    return "".join(f"#include <{one}>\n" for one in names)


class all_cases(unittest.TestCase):
    def each_of(self, cases, check):
        """Calls check(taken, said) for each case, which is the arguments of compiled()."""
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for case, (taken, said) in zip(cases, pool.map(lambda case: compiled(*case), cases)):
                with self.subTest(" ".join(case[:2]) + ": " + case[3].splitlines()[-1]):
                    check(taken, said)

    def compile(self, cases):
        self.each_of(cases, lambda taken, said: self.assertTrue(taken, said[:4000]))

    def cxx_cases(self, versions, texts):
        macros = f'#include "{root / "tests" / "headers" / "macros.hpp"}"\n'
        return [(compiler, version, "c++", macros + text, *cxx_warnings[compiler], *without)
                for compiler in here("g++", "clang++") for version in versions for text in texts]


class together(all_cases):
    def test_all_headers_compile_among_the_macros_of_others_without_exceptions_and_types_at_run_time(self):
        self.compile(self.cxx_cases(cxx_versions[:1], [including(*headers(".hpp"), *headers(".h"))]))

    def test_headers_of_c_compile_in_every_c(self):
        self.compile([(compiler, version, "c", including(one), *warnings) for compiler in here("gcc", "clang")
                      for version in c_versions for one in headers(".h")])

    def test_tables_of_c_compile_in_every_c_and_cpp(self):
        text = """#include <rowe/struct.h>
struct inner { double x; };
struct all { double d; char text[4]; struct inner one, some[2]; float list[3]; int32_t count, mode; };
extern const struct rowe_member inner_members[1];
const struct rowe_member inner_members[1] = {ROWE_MEMBER(struct inner, x, rowe_member_double)};
extern const struct rowe_struct inner_type;
const struct rowe_struct inner_type = {"Inner", sizeof(struct inner), inner_members, 1};
extern const struct rowe_name names[2];
const struct rowe_name names[2] = {{"off", 0}, {"on", 1}};
extern const struct rowe_member members[6];
const struct rowe_member members[6] = {
    ROWE_MEMBER(struct all, d, rowe_member_double | rowe_member_decimals_2), /* a form */
    ROWE_MEMBER(struct all, text, rowe_member_text),
    ROWE_NAMED(struct all, mode, rowe_member_int32, names),
    ROWE_INSIDE(struct all, one, &inner_type),
    ROWE_ARRAY(struct all, some, rowe_member_struct, &inner_type),
    ROWE_COUNTED(struct all, list, rowe_member_float, NULL, count, rowe_member_int32)};
"""
        self.compile([(compiler, version, "c", text, *warnings) for compiler in here("gcc", "clang")
                      for version in c_versions])
        self.compile([(compiler, version, "c++", text, *cxx_warnings[compiler])
                      for compiler in here("g++", "clang++") for version in ("c++11", "c++17", "c++20")])

    def test_headers_of_c_compile_in_every_cpp(self):
        self.compile([(compiler, version, "c++", including(one), *cxx_warnings[compiler])
                      for compiler in here("g++", "clang++") for version in ("c++11", "c++17", "c++20")
                      for one in headers(".h")])

    def test_each_header_says_in_one_error_that_it_needs_cpp20(self):
        def check(taken, said):
            errors = [line for line in said.splitlines() if "error: " in line]
            self.assertFalse(taken)
            self.assertEqual(len(errors), 1, said[:4000])
            self.assertIn("rowe needs C++20", errors[0])

        self.each_of([(compiler, "c++17", "c++", including(one)) for compiler in here("g++", "clang++")
                      for one in headers(".hpp")], check)

    def test_a_header_with_a_macro_of_others_as_a_name_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            wrong = pathlib.Path(folder) / "wrong.hpp"
            for line in ("inline int slots() { return 1; }", "enum class colour { None };",
                         "inline int of(int a) { return std::max(a, 1, std::less<>{}); }",
                         "inline int of(double a) { return (int)a; }", "inline void of() { throw 1; }"):
                wrong.write_text("#pragma once\n" + line + "\n", encoding="utf-8")
                for case in self.cxx_cases(cxx_versions[:1], [f'#include "{wrong}"\n']):
                    self.assertFalse(compiled(*case)[0], line)


class each(all_cases):
    def test_header_compiles_alone(self):
        texts = [including(one) for one in headers(".hpp") + headers(".h")]
        self.compile(self.cxx_cases(cxx_versions, texts))

    def test_example_compiles_without_a_warning(self):
        examples = sorted((root / "docs" / "examples").glob("*.cpp"))
        texts = [one.read_text(encoding="utf-8") for one in examples]
        self.compile([(compiler, version, "c++", text, *cxx_warnings[compiler])
                      for compiler in here("g++", "clang++") for version in cxx_versions for text in texts])


if __name__ == "__main__":
    unittest.main()
