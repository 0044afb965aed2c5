# SPDX-License-Identifier: Apache-2.0
"""`rowe plot`: pictures of recordings and of a running robot, and what it says where there is none."""
import json
import os
import re
import signal
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as xml
import zlib

from program import ROWE, hub, kept_port, nobody_at, on_a_terminal, program, run, timeout
from recordings import damage, end_of_chunk, message, record, samples

svg = "{http://www.w3.org/2000/svg}"


def some():
    """Ten seconds: a position at 50 Hz with a pause of 2 s, volts at 10 Hz, a stop of 1 s, and losses."""
    for i in range(500):
        if not 300 <= i < 400:
            yield message("/odom", 20 * i, {"pose": {"x": i / 100, "y": -i / 50}, "frame": "odom",
                                            "moving": i % 2 == 0, "maybe": i if i % 3 else None})
        if i % 5 == 0:
            yield message("/power", 20 * i, {"volts": 24 - i / 1000})
        if i % 10 == 0:
            state = "stopped" if 200 <= i < 250 else "running"
            yield message("/rowe/stop/state", 20 * i, {"state": state, "number": 3, "cause": "request",
                                                       "source": "<joystick>"})
        if i == 120:
            yield message("/rowe/record/lost", 20 * i, {"topic": "/odom", "messages": 7})


def data_of(html):
    """What an HTML file plots."""
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.S)[1])


class plotting(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = self.at("run.mcap")

    def at(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.at(name), "w", encoding="utf-8") as file:
            file.write(text)
        return self.at(name)

    def plot(self, name, *arguments, of=None, **wanted):
        """The bytes of a picture, and the run that made it."""
        ended = run("plot", of or self.path, "-o", self.at(name), *arguments, **{"code": 0, **wanted})
        with open(self.at(name), "rb") as file:
            return file.read(), ended

    def svg_of(self, *arguments, **options):
        return xml.fromstring(self.plot("a.svg", *arguments, **options)[0])

    def html_of(self, *arguments, **options):
        return self.plot("a.html", *arguments, **options)[0].decode()

    def refused(self, *arguments, code=1, **wanted):
        """No picture is made."""
        ended = run("plot", self.path, "-o", self.at("none.svg"), *arguments, code=code, **wanted)
        self.assertFalse(os.path.exists(self.at("none.svg")))
        return "\n".join(ended.stderr)


def lines_of(picture):
    """The polylines of each series, by its name."""
    found = {}
    for group in picture.iter(svg + "g"):
        parts = [line.get("points").split() for line in group.findall(svg + "polyline")]
        found.setdefault(group.find(svg + "title").text, []).extend(parts)
    return found


def texts_of(picture):
    return [one.text for one in picture.iter(svg + "text")]


class pictures(plotting):
    def setUp(self):
        super().setUp()
        record(self.path, some(), "lz4")

    def test_an_svg_has_a_line_for_each_field_broken_by_gaps(self):
        picture = self.svg_of("--field", "/odom:pose.x,pose.y", "--field", "/power:volts")
        lines = lines_of(picture)
        self.assertEqual({name: len(parts) for name, parts in lines.items()},
                         {"/odom:pose.x": 2, "/odom:pose.y": 2, "/power:volts": 1})
        self.assertEqual((picture.get("width"), picture.get("height")), ("1200", "600"))
        for text in ("run.mcap", "/odom:pose.x", "/power:volts", "1 stop", "1 gap", "7 messages lost"):
            self.assertIn(text, texts_of(picture))
        self.assertTrue([t for t in texts_of(picture) if t.startswith("s since 2025-11-30T")])

    def test_a_line_goes_where_the_numbers_do(self):
        points = [tuple(map(float, at.split(",")))
                  for at in lines_of(self.svg_of("--field", "/power:volts"))["/power:volts"][0]]
        self.assertEqual(len(points), 100)
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in zip(points, points[1:])]
        self.assertLess(max(dx for dx, _ in steps) - min(dx for dx, _ in steps), 0.05)
        self.assertGreater(min(dy for _, dy in steps), 0, "volts fall, so the line does")

    def test_a_png_has_its_size_and_is_not_empty(self):
        for options, size in (((), (1200, 600)), (("--dark",), (1200, 600)),
                              (("--size", "400x300"), (400, 300))):
            data, _ = self.plot("a.png", "--field", "/odom:pose.x", *options)
            self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(struct.unpack(">II", data[16:24]), size)
            packed = b"".join(chunk for kind, chunk in self.chunks(data) if kind == b"IDAT")
            self.assertGreater(len(set(zlib.decompress(packed))), 20)

    @staticmethod
    def chunks(data):
        at = 8
        while at < len(data):
            length, kind = struct.unpack(">I4s", data[at:at + 8])
            yield kind, data[at + 8:at + 8 + length]
            at += length + 12

    def test_an_html_file_has_the_data_and_loads_nothing(self):
        html = self.html_of("--field", "/odom:pose.x,pose.y", "--field", "/power:volts", "--title",
                            "</script>&")
        data = data_of(html)
        x, y = data["lanes"][0]["fields"]
        self.assertEqual((x["name"], y["name"], data["title"]),
                         ("/odom:pose.x", "/odom:pose.y", "</script>&"))
        self.assertEqual((x["t"], x["v"]), (y["t"], [i / 100 for i in range(500) if not 300 <= i < 400]))
        self.assertEqual((len(x["t"]), x["samples"], x["kept"]), (400, 400, 400))
        self.assertEqual((x["gaps"], data["gaps"]), ([[5.98, 8]], 1))
        self.assertEqual(data["lanes"][1]["fields"][0]["v"][1], 23.995)
        self.assertEqual(data["stops"], [{"from": 4, "to": 5, "number": 3, "cause": "request",
                                          "source": "<joystick>"}])
        self.assertEqual((data["lost"], data["lanes"][0]["lost"][0][1]), (7, 7))
        self.assertEqual(re.findall("<script[^>]*>", html),
                         ['<script type="application/json" id="data">', '<script type="text/plain">',
                          "<script>", "<script>"])
        self.assertNotRegex(re.sub("(?s)<script.*?</script>", "", html),
                            r"(?i)https?:|src=|href=|url\(|@import|<link")
        self.assertNotIn("sourceMappingURL", html)
        self.assertIn("default-src 'none'", html)

    def test_many_samples_are_thinned_and_it_is_said(self):
        path = self.at("many.mcap")
        record(path, (message("/a", i, {"n": i % 100 if i != 31_234 else 1000}) for i in range(60_000)))
        data, ended = self.plot("a.html", "--field", "/a:n", of=path)
        field = data_of(data.decode())["lanes"][0]["fields"][0]
        self.assertEqual((field["samples"], field["kept"]), (60_000, len(field["t"])))
        self.assertLessEqual(field["kept"], 20_000)
        self.assertIn(1000, field["v"])
        self.assertIn(f"60000 samples, of which {field['kept']} are drawn", ended.stderr[-1])
        points = lines_of(self.svg_of("--field", "/a:n", of=path))["/a:n"][0]
        self.assertLess(len(points), 4 * 1200)

    def test_a_path_is_drawn_as_it_was_driven(self):
        picture = self.svg_of("--xy", "/odom:pose.x,pose.y")
        lines = lines_of(picture)["/odom:pose.x,pose.y"]
        first, last = ([float(n) for n in at.split(",")] for at in (lines[0][0], lines[-1][-1]))
        right, down = last[0] - first[0], last[1] - first[1]
        self.assertAlmostEqual(down / right, 2, 2)  # a metre is as long either way
        self.assertEqual(len(lines), 2)

    def test_from_and_to_choose_a_part(self):
        for options, wanted in ((("--from", "2s", "--to", "3s"), range(100, 150)),
                                (("--from", "-1s"), range(449, 500)),
                                (("--to", "2025-11-30T04:09:59Z"), range(0, 50))):
            field = data_of(self.html_of("--field", "/odom:pose.x", *options))["lanes"][0]["fields"][0]
            self.assertEqual(field["v"], [i / 100 for i in wanted])
            self.assertEqual(field["t"][0], wanted[0] / 50, "counted from the begin of the recording")
        self.refused("--field", "/odom:pose.x", "--from", "1h", code=2, says="is behind its end")
        self.refused("--field", "/odom:pose.x", "--from", "soon", code=2, says="--from needs a time such as")

    def test_true_and_false_are_1_and_0(self):
        self.assertEqual(data_of(self.html_of("--field", "/odom:moving"))["lanes"][0]["fields"][0]["v"][:3],
                         [1, 0, 1])

    def test_what_is_no_number_is_counted(self):
        _, ended = self.plot("a.svg", "--field", "/odom:maybe")
        self.assertIn("/odom:maybe: 133 messages have no number there (133 null)", "\n".join(ended.stderr))

    def test_stdout_has_the_picture_and_nothing_else(self):
        for kind, begin in (("svg", b"<svg "), ("png", b"\x89PNG"), ("html", b"<!doctype html>")):
            command = [ROWE, "plot", self.path, "-f", "/odom:pose.x", "-o", "-", "--format", kind]
            done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                  timeout=timeout)
            self.assertTrue(done.stdout.startswith(begin))

    def test_a_full_disk_is_a_failure(self):
        run("plot", self.path, "-f", "/odom:pose.x", "-o", "/dev/full", "--format", "svg", code=1,
            stderr=["rowe plot: cannot write /dev/full: No space left on device"])
        run("plot", self.path, "-f", "/odom:pose.x", "-o", self.at("none/a.svg"), code=1,
            says="No such file or directory")

    def test_the_unit_that_the_schema_says_stands_in_the_legend(self):
        schema = {"type": "object", "properties": {"age": {"type": "integer", "description": "milliseconds"},
                                                   "speed": {"type": "number", "unit": "m/s"}}}
        path = self.at("units.mcap")
        record(path, [message("/a", i, {"age": i, "speed": 1}, schema=json.dumps(schema)) for i in range(3)])
        picture = self.svg_of("-f", "/a:age,speed", of=path)
        self.assertEqual(list(lines_of(picture)), ["/a:age [ms]", "/a:speed [m/s]"])


class wrong_wishes(plotting):
    def setUp(self):
        super().setUp()
        record(self.path, some())

    def test_an_unknown_topic_is_told_with_the_nearest(self):
        self.refused("-f", "/odm:pose.x",
                     stderr=["rowe plot: the recording has no topic '/odm'; did you mean /odom?"])
        self.refused("-f", "/something/else:x",
                     says="; there is /odom, /power, /rowe/stop/state, /rowe/record/lost")

    def test_an_unknown_field_is_told_with_the_nearest(self):
        for path, said in (("pose.z", "messages of /odom have no 'pose.z'; did you mean pose.x?"),
                           ("y", "messages of /odom have no 'y'; did you mean pose.y?"),
                           ("pose", "'pose' is an object in the messages of /odom; there is pose.x, pose.y"),
                           ("frame", "'frame' is a text in the messages of /odom; there is pose.x, ")):
            self.refused("-f", f"/odom:{path}", says=said)
        self.refused("--xy", "/odom:pose.x,pose.w", says="have no 'pose.w'; did you mean pose.x?")

    def test_options_that_make_no_sense_are_told(self):
        for options, said in ((("-f", "odom"), "--field needs a topic and a field"),
                              (("-f", "/odom:a..b"), "--field '/odom:a..b': "),
                              (("--xy", "/odom:x"), "--xy needs two fields"),
                              ((), "--field TOPIC:PATH is missing"),
                              (("-f", "/odom:a", "--xy", "/odom:b,c"), "are two pictures"),
                              (("-f", "/odom:pose.x", "--size", "12x9"), "--size needs a width and a height"),
                              (("-f", "/odom:pose.x", "--size", "1200"), "--size needs a width and a height"),
                              (("-f", "/odom:pose.x", "--for", "1s"), "--for is for a robot"),
                              (("-f", "/odom:pose.x", "--format", "gif"), "--format is svg or png or html"),
                              (("-f", "/odom:" + ",".join("abcdefghijklm")), "13 lines on one axis are too"),
                              ([word for name in "abcdefghij" for word in ("-f", f"/odom:{name}")],
                               "10 axes need a --size of")):
            self.refused(*options, code=2, says=said)
        run("plot", self.path, "-f", "/a:b", code=2, says="--output FILE is missing")
        run("plot", self.path, "-f", "/a:b", "-o", "picture", code=2, says="does not say what picture")
        run("plot", self.path, "--xy", "/a:b,c", "-o", self.at("a.html"), code=2, says="not as html")

    def test_a_font_that_is_none_is_told_before_the_file_is_read(self):
        run("plot", self.path, "-f", "/odom:pose.x", "-o", self.at("a.png"), "--font", self.path, code=1,
            says="is no font that can be read")

    def test_a_part_without_messages_is_told(self):
        record(self.at("late.mcap"), [message("/a", 0, {"n": 1}), message("/b", 5000, {"n": 1})])
        run("plot", self.at("late.mcap"), "-f", "/b:n", "--to", "1s", "-o", self.at("a.svg"), code=1,
            says="there is nothing to draw: no message of /b came")


class other_files(plotting):
    def test_lines_of_json_are_read(self):
        lines = [json.dumps({"topic": "/a", "msg": {"n": i}, "time": 1000 + i / 10}) for i in range(20)]
        path = self.write("run.jsonl", "\n".join(lines))
        data = data_of(self.html_of("-f", "/a:n", of=path))
        self.assertEqual(data["lanes"][0]["fields"][0]["v"], list(range(20)))

    def test_lines_without_times_need_a_rate(self):
        path = self.write("run.jsonl", "".join(f'{{"n":{i}}}\n' for i in range(20)))
        data = data_of(self.html_of("-f", "/a:n", "--topic", "/a", "--rate", "10Hz", of=path))
        self.assertEqual((data["lanes"][0]["fields"][0]["t"][:3], data["caption"]), ([0, 0.1, 0.2], "s"))
        run("plot", path, "-f", "/a:n", "--topic", "/a", "-o", self.at("a.svg"), code=1, says="give a --rate")

    def test_a_trajectory_is_odometry(self):
        path = self.write("path.txt", "".join(f"{1000 + i / 10} {i} {2 * i} 0 0 0 0 1\n" for i in range(20)))
        data = data_of(self.html_of("-f", "/odom:pose.pose.position.y", of=path))
        self.assertEqual(data["lanes"][0]["fields"][0]["v"], list(range(0, 40, 2)))
        place = "pose.pose.position"
        picture = self.svg_of("--xy", f"/p:{place}.x,{place}.y", "--topic", "/p", of=path)
        self.assertEqual(len(lines_of(picture)), 1)

    def test_damaged_parts_are_told_and_the_rest_is_drawn(self):
        record(self.path, [message("/a", 0, {"n": 0, "t": "damaged"}), end_of_chunk,
                           message("/a", 1, {"n": 1}), message("/a", 2, {"n": 2})])
        damage(self.path, b'"damaged"')
        data, _ = self.plot("a.html", "-f", "/a:n", code=1, says="damaged at byte")
        self.assertEqual(data_of(data.decode())["lanes"][0]["fields"][0]["v"], [1, 2])

    def test_what_cannot_be_read_is_told(self):
        samples(self.folder)
        empty = self.write("empty.mcap", "")
        for path, said in ((empty, "empty.mcap"), (self.write("a.txt", "no numbers"), "a.txt:1: "),
                           (self.write("b.jsonl", "{}\n{"), "b.jsonl: no line is"),
                           (self.at("none.mcap"), "No such file"), (self.folder, "Is a directory"),
                           (self.at("empty.mcap"), "empty.mcap")):
            ended = run("plot", path, "-f", "/a:n", "-o", self.at("x.svg"), code=1)
            self.assertIn(said, "\n".join(ended.stderr))
        run("plot", self.at("many.lz4.mcap"), "-f", "/größe:n", "-o", self.at("x.svg"), code=1,
            says="50 messages could not be read: no JSON object")
        run("plot", self.at("many.lz4.mcap"), "-f", "/no/schema:n", "-o", self.at("x.svg"), code=1,
            says="is in the encoding '', which cannot be decoded")

    def test_a_long_read_shows_how_far_it_is_and_ends_at_a_signal(self):
        record(self.path, (message("/a", i, {"n": i}) for i in range(2000)))
        shown = on_a_terminal(80, "plot", self.path, "-f", "/a:n", "-o", self.at("a.svg"))
        self.assertIn("has 2000 samples", shown)


class a_running_robot(plotting):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))

    def test_is_plotted_for_a_time(self):
        html = self.html_of("-f", "/odom:pose.pose.position.x", "-f", "/odom:header.seq", "--for", "500ms",
                            of=self.demo.url)
        data = data_of(html)
        seq = data["lanes"][1]["fields"][0]["v"]
        self.assertGreater(len(seq), 3)
        self.assertEqual(seq, sorted(seq))
        self.assertEqual((data["from"], data["to"]), (0, 0.5))

    def test_is_plotted_until_a_signal(self):
        with program("plot", self.demo.url, "-f", "/odom:header.seq", "-o", self.at("a.svg"), "--for",
                     "1h") as it:
            with program("echo", self.demo.url, "/odom", "-n", "20") as other:
                other.end()
            it.end(signal.SIGINT)
            self.assertIn(it.process.returncode, (0, 130))  # nothing may have come yet on a busy machine

    def test_has_not_the_topic_or_the_field(self):
        run("plot", self.demo.url, "-f", "/odm:x", "-o", self.at("a.svg"), code=1,
            ends="did you mean /odom\\?$")
        run("plot", self.demo.url, "-f", "/odom:pose.pose.positon.x", "--for", "300ms", "-o",
            self.at("a.svg"), code=1, ends="did you mean pose.pose.position.x\\?$")

    def test_says_when_it_is_stopped(self):
        with hub("--demo") as demo:
            run("stop", demo.url)
            picture = self.svg_of("-f", "/odom:header.seq", "--for", "500ms", of=demo.url)
            self.assertIn("1 stop", texts_of(picture))

    def test_that_is_not_there_is_no_picture(self):
        with kept_port() as port:
            nobody_at("plot", f"ws://127.0.0.1:{port}", "-f", "/odom:x", "-o", self.at("a.svg"), code=3)
        self.assertFalse(os.path.exists(self.at("a.svg")))

    def test_takes_no_options_of_files(self):
        run("plot", self.demo.url, "-f", "/odom:x", "--from", "1s", "-o", self.at("a.svg"), code=2,
            says="--from, --to, --topic and --rate are for files")


if __name__ == "__main__":
    unittest.main()
