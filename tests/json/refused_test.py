#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Wrong schemas, and the one sentence that their author is told.

    tests/json/refused_test.py [OPTION OF UNITTEST]... COMPILER ARGUMENT...

None of the cases may compile, and the compiler's first error of each must be a failed static_assert with its
sentence. With g++ it must be the only error: those that follow from a wrong line hide which one that is.

All cases are compiled together: case 7 is refused.cpp with types of its own, such as subject_7, as if it were
a file case_7. An error that several have in common is reported once, and may name no case. So a case for
which none was reported is compiled again, alone."""
import collections
import os
import pathlib
import re
import subprocess
import sys
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


cases = [(case, sentence) for sentence, its_cases in sentences.items() for case in its_cases]
types = "sound other gear mode subject heap heap_list main".split()


def source(number, definitions):
    """A case, written so that others can stand before and behind it."""
    given = [(name, f"{name}_{number}") for name in types] + [each.split("=", 1) for each in definitions]
    return "\n".join([*(f"#define {name} {value}" for name, value in given), f'#line 1 "case_{number}"', body,
                      *(f"#undef {name}" for name, _ in given if name not in ("TYPE", "USED")),
                      "#undef TYPE", "#undef USED", ""])


def blocks(said):
    """The compiler's errors, each with what belongs to it: g++ says before an error where it comes from, and
    clang behind it."""
    if is_clang:
        return re.split(r"^(?=.* error: )", said, flags=re.MULTILINE)[1:]
    told = "".join(line for line in said.splitlines(keepends=True) if " note: " not in line)
    return re.findall(r"(?s).*? error: [^\n]*", told)


def errors_of(numbered):
    """The errors of these cases, (number, definitions), by number; those that name no case, by None."""
    ran = subprocess.run([*command, "-fsyntax-only", "-xc++", "-"], text=True, check=False,
                         input="".join(source(*each) for each in numbered), capture_output=True,
                         env={**os.environ, "LC_ALL": "C"})
    found = collections.defaultdict(list)
    for block in blocks(ran.stderr):
        named = re.search(rf"(?<!from )\b(?:case|{'|'.join(types)})_(\d+)\b", block)
        found[int(named[1]) if named else None].append(re.search(r".* error: .*", block)[0])
    return found


class a_schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        numbered = [(number, case) for number, (case, _) in enumerate(cases)]
        cls.errors = errors_of(numbered)
        cls.unclaimed = set(cls.errors.pop(None, []))
        for each in numbered:
            if each[0] not in cls.errors:
                cls.errors[each[0]] = [one for some in errors_of([each]).values() for one in some]
                cls.unclaimed.difference_update(cls.errors[each[0]])

    def refuse(self, number, sentence):
        errors = self.errors[number]
        self.assertTrue(errors, "it compiles")
        self.assertIn(sentence, errors[0])
        if not is_clang:
            self.assertEqual(len(errors), 1, "more than one error:\n" + "\n".join(errors))

    def test_causes_no_other_errors(self):
        self.assertEqual(self.unclaimed, set())

    def test_with_nothing_wrong_compiles(self):
        self.assertEqual(dict(errors_of([(0, ())])), {})


for its_number, (its_case, its_sentence) in enumerate(cases):
    setattr(a_schema, "test_" + " ".join(its_case),
            lambda self, number=its_number, said=its_sentence: self.refuse(number, said))

if __name__ == "__main__":
    options = [each for each in sys.argv[1:2] if each.startswith("-")]
    command = sys.argv[1 + len(options):]
    version = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=True).stdout
    is_clang = "clang" in version
    if is_clang:
        command.append("-ferror-limit=0")
    body = (here / "refused.cpp").read_text(encoding="utf-8")
    unittest.main(argv=[sys.argv[0], *options])
