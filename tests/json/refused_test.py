#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Wrong schemas, and the one sentence that their author is told.

    tests/json/refused_test.py [OPTION OF UNITTEST]... COMPILER ARGUMENT...

None of the cases of refused.cpp may compile, and the compiler's first error must be a failed static_assert
with its sentence. With g++ it must be the only error: those that follow from a wrong line hide which one that
is. With g++, too, the headers are compiled once for all cases."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

here = pathlib.Path(__file__).resolve().parent
# sentence: cases
sentences = {
    "rowe: get<T>() reads bool, numbers, enums": "UNREADABLE",
    "rowe: this type has no schema": "NO_SCHEMA",
    "rowe::schema: this type cannot be written as JSON":
        "MEMBER_WITHOUT_SCHEMA ELEMENT_WITHOUT_SCHEMA POINTER OPTIONAL_POINTER LONG_DOUBLE",
    "rowe::schema: a character is neither text nor a number": "CHARACTER",
    "rowe::schema: an array of characters is neither text nor numbers": "CHARACTER_ARRAY",
    "rowe::schema: two members have the same name": "SAME_NAME",
    "rowe::schema: a member listed in the schema belongs to another type": "FOREIGN_MEMBER",
    "rowe::fields: list pointers to data members": "MEMBER_FUNCTION NO_MEMBER",
    "rowe::field: the first argument must be a pointer to a data member": "FIELD_OF_NO_MEMBER",
    "rowe::schema: a schema must read": "NO_FIELDS",
    "rowe::field: as_string() is for integers": "STRING_FORM",
    "rowe::field: decimals() is for float, double": "DECIMALS_OF_INTEGER",
    "rowe::field: decimals() takes 0 to 9": "DECIMALS_RANGE",
    "rowe::counted: the first argument must be": "COUNTED_SCALAR COUNTED_TWICE",
    "rowe::counted: the second argument must be an integer member":
        "COUNT_IS_REAL COUNT_OF_ANOTHER COUNT_IS_NO_MEMBER",
    "rowe: a type with a schema must be trivially copyable": "NOT_TRIVIALLY_COPYABLE STRING VECTOR",
    "rowe::field: by_name() is for enums whose names are listed":
        "BY_NAME_OF_INTEGER BY_NAME_WITHOUT_NAMES",
    "rowe::names: two values of the enum, or two of their names, are the same": "NAMES_ALIAS NAMES_TWICE",
    "rowe::names: list values of the enum": "NAMES_OF_ANOTHER NAMES_OF_NO_ENUM",
    "rowe::enumerators: this value of the enum has no name": "NAMES_OF_A_NUMBER",
    "rowe::enumerator: the second argument must be a name": "NAME_IS_EMPTY",
    "rowe::names: names must read": "NO_ENUMERATORS",
    "rowe::field: as_seconds() is for std::chrono durations and times":
        "SECONDS_OF_INTEGER SECONDS_OF_REAL SECONDS_OF_MINUTES",
    "rowe::field: as_numbers() is for arrays of std::uint8_t or std::byte": "NUMBERS_OF_INTEGERS",
    "rowe::field: give one form": "TWO_FORMS",
    "rowe::schema: a time of a steady clock means nothing to another program": "STEADY_TIME",
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

    def case(self, name):
        return compiled("-fsyntax-only", "-D" + name, os.path.join(self.folder.name, "refused.cpp"))

    def refuse(self, case, sentence):
        ran = self.case(case)
        errors = [line for line in ran.stderr.splitlines() if " error: " in line]
        self.assertTrue(errors and ran.returncode != 0, "it compiles")
        self.assertIn(sentence, errors[0])
        if self.is_gnu:
            self.assertEqual(len(errors), 1, "more than one error:\n" + "\n".join(errors))

    def test_with_nothing_wrong_compiles(self):
        ran = self.case("NOTHING_WRONG")
        self.assertEqual(ran.returncode, 0, ran.stderr)

    def test_of_each_case_is_tried(self):
        text = (here / "refused.cpp").read_text(encoding="utf-8")
        self.assertEqual(set(re.findall(r"defined\(([A-Z_]+)\)", text)) - {"NOTHING_WRONG"},
                         set(" ".join(sentences.values()).split()))


for its_sentence, its_cases in sentences.items():
    for one in its_cases.split():
        setattr(a_schema, "test_" + one, lambda self, case=one, said=its_sentence: self.refuse(case, said))

if __name__ == "__main__":
    options = [each for each in sys.argv[1:2] if each.startswith("-")]
    command = sys.argv[1 + len(options):]
    unittest.main(argv=[sys.argv[0], *options])
