# SPDX-License-Identifier: Apache-2.0
"""Recordings for tests, by record_lines and mcap_samples, which are built beside the program under test."""
import json
import os
import struct
import subprocess

from program import ROWE, timeout

begin_ns = 1_764_475_798_000_000_000  # 2025-11-30T04:09:58Z
ms = 1_000_000
magic = b"\x89MCAP0\r\n"


def beside(name):
    return os.path.join(os.path.dirname(ROWE), name)


def at(milliseconds):
    return begin_ns + round(milliseconds * ms)


def message(topic, milliseconds, msg, **more):
    return {"topic": topic, "logged_ns": at(milliseconds), "msg": msg, **more}


end_of_chunk = {"flush": True}


def record(path, lines, packed="none", cut=False):
    """`cut`: as by a program that was killed."""
    text = "".join(json.dumps(line) + "\n" for line in lines)
    subprocess.run([beside("record_lines"), path, packed, *(["cut"] if cut else [])], input=text.encode(),
                   check=True, timeout=timeout)


def samples(folder):
    subprocess.run([beside("mcap_samples"), "write", folder], check=True, stdout=subprocess.DEVNULL,
                   timeout=timeout)


def damage(path, what):
    """Makes the one place that has these bytes something else."""
    with open(path, "r+b") as file:
        data = file.read()
        assert data.count(what) == 1, data.count(what)
        file.seek(data.index(what))
        file.write(bytes(byte ^ 0x55 for byte in what))


def record_of(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(words):
    return struct.pack("<I", len(words)) + words.encode()


def write_with_attachment(path):
    """A file without a summary that has an attachment, and a message behind it."""
    attached = struct.pack("<QQ", at(0), at(0)) + text("map.png") + text("image/png")
    attached += struct.pack("<Q", 5) + b"12345" + struct.pack("<I", 0)
    with open(path, "wb") as file:
        file.write(magic + record_of(1, text("ros2") + text("another writer")) + record_of(9, attached) +
                   record_of(4, struct.pack("<HH", 1, 0) + text("/a") + text("json") + struct.pack("<I", 0)) +
                   record_of(5, struct.pack("<HIQQ", 1, 1, at(0), at(0)) + b"{}"))


def write_ros(path, topics):
    """A recording as others write it: {topic: (encoding, schema's encoding, type, schema, message)}."""
    records = [record_of(0x01, text("") + text("by hand"))]
    for number, (topic, (encoding, schema_encoding, name, schema, data)) in enumerate(topics.items(), 1):
        records.append(record_of(0x03, struct.pack("<H", number) + text(name) + text(schema_encoding)
                                 + text(schema)))
        records.append(record_of(0x04, struct.pack("<HH", number, number) + text(topic) + text(encoding)
                                 + struct.pack("<I", 0)))
        records.append(record_of(0x05, struct.pack("<HIQQ", number, 1, number * 10**6, 0) + data))
    records.append(record_of(0x0f, struct.pack("<I", 0)))
    records.append(record_of(0x02, struct.pack("<QQI", 0, 0, 0)))
    with open(path, "wb") as file:
        file.write(magic + b"".join(records) + magic)


def write_packed_by(path, name):
    """A recording whose summary says that its chunk is packed by that."""
    one = record_of(0x05, struct.pack("<HIQQ", 1, 0, 1, 1) + b"{}")
    before = magic + record_of(0x01, text("") + text(""))
    chunk = record_of(0x06, struct.pack("<QQQI", 1, 1, len(one), 0) + text("")
                      + struct.pack("<Q", len(one)) + one)
    channel = struct.pack("<HH", 1, 0) + text("/a") + text("json") + struct.pack("<I", 0)
    counts = struct.pack("<QHIIIIQQ", 1, 0, 1, 0, 0, 1, 1, 1) + struct.pack("<IHQ", 10, 1, 1)
    index = struct.pack("<QQQQIQ", 1, 1, len(before), len(chunk), 0, 0) + text(name)
    index += struct.pack("<QQ", len(one), len(one))
    data = before + chunk + record_of(0x0f, struct.pack("<I", 0))
    summary = record_of(0x04, channel) + record_of(0x0b, counts) + record_of(0x08, index)
    with open(path, "wb") as file:
        file.write(data + summary + record_of(0x02, struct.pack("<QQI", len(data), 0, 0)) + magic)
