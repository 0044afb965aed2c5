#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Wrong schemas, and the one sentence that their author is told.

    tests/json/refused_test.py [OPTION OF UNITTEST]... COMPILER ARGUMENT...

None of the cases may compile in refused.cpp, and the compiler's first error must be a failed static_assert
with its sentence. With g++ it must be the only error: those that follow from a wrong line hide which one that
is. With g++, too, the headers are compiled once for all cases."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

here = pathlib.Path(__file__).resolve().parent


def fields(*members, of="subject"):
    return [("TYPE=" + of, f"SCHEMA=rowe::fields<{each}>{{}}") for each in members]


def names(*listed):
    return [(*fields("&subject::gear")[0], f"NAMES={each}") for each in listed]


def enumerators(*values):
    return names(*(f"rowe::enumerators<{each}>{{}}" for each in values))


# sentence: cases, each some definitions for refused.cpp
sentences = {
    "rowe: get<T>() reads bool, numbers, enums": [('USED=rowe::json_value{}.get<subject>("a").has_value()',)],
    "rowe: this type has no schema": [("TYPE=subject",)],
    "rowe::schema: this type cannot be written as JSON":
        fields("&subject::unknown", "&subject::unknowns", "&subject::pointer", "&subject::maybe",
               "&subject::wide"),
    "rowe::schema: a character is neither text nor a number": fields("&subject::letter"),
    "rowe::schema: an array of characters is neither text nor numbers": fields("&subject::text"),
    "rowe::schema: two members have the same name": fields('&subject::x, rowe::field<&subject::x2, "x">'),
    "rowe::schema: a member listed in the schema belongs to another type": fields("&subject::x, &other::y"),
    "rowe::fields: list pointers to data members": fields("&subject::function", "&subject::x, 4"),
    "rowe::field: the first argument must be a pointer to a data member": fields("rowe::field<4>"),
    "rowe::schema: a schema must read": [("TYPE=subject", "SCHEMA=&subject::x")],
    "rowe::field: as_string() is for integers": fields("rowe::field<&subject::x>.as_string()"),
    "rowe::field: decimals() is for float, double": fields("rowe::field<&subject::count>.decimals(3)"),
    "rowe::field: decimals() takes 0 to 9": fields("rowe::field<&subject::x>.decimals(10)"),
    "rowe::counted: the first argument must be":
        fields("rowe::counted<&subject::x, &subject::count>",
               "rowe::counted<&subject::list, &subject::count>"),
    "rowe::counted: the second argument must be an integer member":
        fields("rowe::counted<&subject::ranges, &subject::x>", "rowe::counted<&subject::ranges, &sound::x>",
               "rowe::counted<&subject::ranges, 4>"),
    "rowe: a type with a schema must be trivially copyable":
        fields("", "&heap::text", of="heap") + fields("&heap_list::list", of="heap_list"),
    "rowe::field: by_name() is for enums whose names are listed":
        fields("rowe::field<&subject::count>.by_name()", "rowe::field<&subject::mode>.by_name()"),
    "rowe::names: two values of the enum, or two of their names, are the same":
        enumerators("gear::first, gear::forward", 'gear::first, rowe::enumerator<gear::neutral, "first">'),
    "rowe::names: list values of the enum": enumerators("gear::first, mode::on", "gear::first, 7"),
    "rowe::enumerators: this value of the enum has no name":
        enumerators("gear::first, static_cast<gear>(7)"),
    "rowe::enumerator: the second argument must be a name": enumerators('rowe::enumerator<gear::first, "">'),
    "rowe::names: names must read": names("gear::first"),
    "rowe::field: as_seconds() is for std::chrono durations and times":
        fields(*(f"rowe::field<&subject::{each}>.as_seconds()" for each in ("count", "wait", "minutes"))),
    "rowe::field: as_numbers() is for arrays of std::uint8_t or std::byte":
        fields("rowe::field<&subject::count>.as_numbers()"),
    "rowe::field: give one form": fields("rowe::field<&subject::age>.as_seconds().as_string()"),
    "rowe::schema: a time of a steady clock means nothing to another program": fields("&subject::when"),
}


def compiled(*arguments):
    return subprocess.run([*command, *arguments], capture_output=True, text=True, check=False,
                          env={**os.environ, "LC_ALL": "C"})


class a_schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        said = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=True).stdout
        cls.is_gnu = "clang" not in said
        cls.folder = tempfile.TemporaryDirectory()
        for name in ("refused.cpp", "refused.hpp"):
            shutil.copy(here / name, cls.folder.name)
        if cls.is_gnu:
            header = os.path.join(cls.folder.name, "refused.hpp")
            compiled("-x", "c++-header", header, "-o", header + ".gch").check_returncode()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def case(self, definitions):
        return compiled("-fsyntax-only", *("-D" + each for each in definitions),
                        os.path.join(self.folder.name, "refused.cpp"))

    def refuse(self, case, sentence):
        ran = self.case(case)
        errors = [line for line in ran.stderr.splitlines() if " error: " in line]
        self.assertTrue(errors and ran.returncode != 0, "it compiles")
        self.assertIn(sentence, errors[0])
        if self.is_gnu:
            self.assertEqual(len(errors), 1, "more than one error:\n" + "\n".join(errors))

    def test_with_nothing_wrong_compiles(self):
        ran = self.case(())
        self.assertEqual(ran.returncode, 0, ran.stderr)


for its_sentence, its_cases in sentences.items():
    for one in its_cases:
        setattr(a_schema, "test_" + " ".join(one),
                lambda self, case=one, said=its_sentence: self.refuse(case, said))

if __name__ == "__main__":
    options = [each for each in sys.argv[1:2] if each.startswith("-")]
    command = sys.argv[1 + len(options):]
    unittest.main(argv=[sys.argv[0], *options])
