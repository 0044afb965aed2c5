# SPDX-License-Identifier: Apache-2.0
"""Descriptions as others read them: python3-jsonschema, and the rules by which ROS 1 makes md5sums."""
import copy
import hashlib
import json
import os
import re
import subprocess
import sys
import unittest

try:
    import jsonschema
except ImportError:
    debian = "/usr/bin/python3"  # where Debian's python3-jsonschema is
    if os.path.realpath(sys.executable) != os.path.realpath(debian) and os.path.exists(debian):
        os.execv(debian, [debian, *sys.argv])
    jsonschema = None

lines = subprocess.run([os.environ["ROWE_DESCRIPTIONS"]], capture_output=True, check=True, text=True).stdout
types = {one["name"]: one for one in map(json.loads, lines.splitlines())}


def spoiled(value, schema):
    """Copies of a value, each with one thing that the schema must refuse."""
    if schema.get("type") == "object":
        for name in schema["required"]:
            yield {key: inside for key, inside in value.items() if key != name}
        for name, inside in value.items():
            for bad in spoiled(inside, schema["properties"][name]):
                yield {**value, name: bad}
    elif schema.get("type") == "array":
        yield value + [copy.deepcopy(value[0])] * (schema["maxItems"] + 1 - len(value)) if value else None
        if schema.get("minItems"):
            yield value[:-1]
        if value:
            for bad in spoiled(value[0], schema["items"]):
                yield [bad] + value[1:]
    elif schema.get("type") == "string":
        yield "x" * 1000
        yield 7
    elif schema.get("type") == "integer":
        yield 1.5
        yield 2 ** 64
        yield -2 ** 63 - 1
    elif "anyOf" in schema:
        yield "neither"
    else:
        yield "text"
        yield None


@unittest.skipIf(jsonschema is None, "python3-jsonschema is not there")
class json_schemas(unittest.TestCase):
    def test_are_valid_and_accept_what_the_encoder_writes(self):
        self.assertGreaterEqual(len(types), 8)
        for name, one in types.items():
            with self.subTest(name):
                jsonschema.Draft202012Validator.check_schema(one["schema"])
                validator = jsonschema.Draft202012Validator(one["schema"])
                for value in one["values"]:
                    validator.validate(value)

    def test_refuse_everything_else(self):
        count = 0
        for name, one in types.items():
            validator = jsonschema.Draft202012Validator(one["schema"])
            for value in one["values"]:
                for bad in spoiled(value, one["schema"]):
                    count += 1
                    self.assertFalse(validator.is_valid(bad), (name, bad))
        self.assertGreater(count, 200)

    def test_have_what_a_reader_of_single_types_can_read(self):
        """Foxglove throws at a `type` that is a list, and at $ref."""
        for name in ("twist", "odometry", "odometry of ROS 2", "report"):
            text = json.dumps(types[name]["schema"])
            self.assertNotIn('"type": [', text)
            self.assertNotIn("$ref", text)
            self.assertNotIn("anyOf", text)


def definitions(text):
    """{name: its lines} of a text as gendeps prints it; the message itself is None."""
    main, *others = re.split(r"\n={80}\nMSG: ", text)
    found = {None: main}
    for other in others:
        name, _, body = other.partition("\n")
        found[name] = body
    return found


def md5sum(found, name=None):
    built_in = {"bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32",
                "float64", "string", "time", "duration"}
    lines = []
    for line in found[name].splitlines():
        line = line.partition("#")[0].strip()
        if not line:
            continue
        kind, member = line.split()
        if re.sub(r"\[\d*\]$", "", kind) in built_in:
            lines.append(line)
        else:
            lines.append(md5sum(found, re.sub(r"\[\d*\]$", "", kind)) + " " + member)
    return hashlib.md5("\n".join(lines).encode()).hexdigest()


class ros_messages(unittest.TestCase):
    def test_have_the_md5sums_of_the_packages(self):
        for name, expected in (("odometry", "cd5e73d190d741a2f92e81eda573aca7"),
                               ("twist", "9f195f881246fdfa2798d1d3eebca84a")):
            self.assertEqual(types[name]["reason"], "")
            self.assertEqual(md5sum(definitions(types[name]["ros"])), expected)

    def test_define_each_type_that_they_need_and_each_once(self):
        for name in ("odometry", "odometry of ROS 2", "report"):
            text = types[name]["ros"]
            self.assertTrue(text)
            found = definitions(text)
            self.assertEqual(len(found), text.count("=" * 80) + 1)
            md5sum(found)  # looks all of them up


if __name__ == "__main__":
    unittest.main()
