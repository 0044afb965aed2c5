# SPDX-License-Identifier: Apache-2.0
"""`rowe info`: what it says of recordings, whole, damaged, cut off and of other makers."""
import json
import os
import tempfile
import unittest

from program import on_a_terminal, run
from recordings import damage, end_of_chunk, message, record, samples, write_packed_by, write_with_attachment

at_utc = {"TZ": "UTC"}


def some():
    """A second and a half of a robot: 100 Hz of odometry, a stop of 0.3 s, and losses."""
    yield {"metadata": {"robot": "ang-01", "operator": "anna"}}
    for i in range(151):
        yield message("/odom", 10 * i, {"n": i}, type="nav_msgs/Odometry")
        if i in (50, 60):
            yield message("/rowe/record/lost", 10 * i, {"topic": "/scan", "messages": i})
        if i % 10 == 0:
            state = "stopped" if 60 <= i < 90 else "running"
            yield message("/rowe/stop/state", 10 * i, {"state": state, "number": 3 if i >= 60 else 2,
                                                       "cause": "request", "source": "joystick"})
    yield message("/map", 200, {"late": 1}, published_ns=2000)
    yield message("/map", 1300, {"late": 2}, published_ns=1000)


class info(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "run.mcap")

    def described(self, *arguments):
        """What --json says of one file."""
        lines = run("info", "--json", *arguments, code=0).stdout
        self.assertEqual(len(lines), 1)
        return json.loads(lines[0])

    def test_says_what_is_in_a_recording(self):
        record(self.path, some(), "lz4")
        text = "\n".join(run("info", self.path, code=0, stderr=[], environment=at_utc).stdout)
        self.assertEqual(text.split("\n")[0], self.path)
        for like in (r"size +\d.*, compressed \d+\.\d to 1 by lz4\n", r"written by +rowe", r"messages +171\n",
                     r"begin +2025-11-30T04:09:58\.000Z\n", r"end +2025-11-30T04:09:59\.500Z\n",
                     r"duration +1\.500 s\n", r"rowe +operator: anna, robot: ang-01\n",
                     r"lost +110 messages: /scan 110\n", r"stops +1\n",
                     r"at 0:00\.600: number 3, request by joystick, for 0\.300 s\n",
                     r"/odom +nav_msgs/Odometry +151 +100 Hz +0\.010 s +0 +\d\.\d+ kB\n",
                     r"/map +- +2 +0\.91 Hz +1\.100 s +1 +22 B\n"):
            self.assertRegex(text + "\n", like)
        self.assertNotIn("not ended", text)
        self.assertNotIn("damaged", text)

    def test_says_local_times_with_their_offset(self):
        record(self.path, some())
        run("info", self.path, environment={"TZ": "NPT-3:30"}, code=0)
        text = "\n".join(run("info", self.path, environment={"TZ": "NPT-3:30"}).stdout)
        self.assertIn("2025-11-30T07:39:58.000+03:30", text)

    def test_says_all_of_it_as_json(self):
        record(self.path, some(), "zstd")
        said = self.described(self.path)
        self.assertEqual((said["path"], said["messages"], said["ended"]), (self.path, 171, True))
        self.assertEqual(said["bytes"], os.path.getsize(self.path))
        self.assertEqual((said["begin"], said["end"], said["duration_s"]),
                         ("2025-11-30T04:09:58.000000000Z", "2025-11-30T04:09:59.500000000Z", 1.5))
        self.assertEqual((said["packed_by"], said["compression_ratio"] > 1), ("zstd", True))
        odom = next(one for one in said["topics"] if one["topic"] == "/odom")
        self.assertEqual(odom, {"topic": "/odom", "type": "nav_msgs/Odometry", "encoding": "json",
                                "messages": 151, "rate_hz": 100, "longest_gap_s": 0.01, "out_of_order": 0,
                                "bytes": sum(len(json.dumps({"n": i})) for i in range(151))})
        self.assertEqual(said["lost"], {"/scan": 110})
        self.assertEqual(said["stops"], [{"time": "2025-11-30T04:09:58.600000000Z",
                                          "until": "2025-11-30T04:09:58.900000000Z", "number": 3,
                                          "cause": "request", "source": "joystick"}])
        self.assertEqual(said["metadata"][0]["values"]["robot"], "ang-01")
        self.assertEqual((said["damaged"], said["attachments"]), ([], []))

    def test_a_quick_look_reads_the_summary_only(self):
        lines = list(some())
        record(self.path, [*lines[:50], end_of_chunk, *lines[50:]])
        damage(self.path, b'{"n": 0}')  # which the summary does not know
        said = self.described("--quick", self.path)
        self.assertEqual((said["messages"], said["duration_s"], said["damaged"]), (171, 1.5, []))
        self.assertEqual({one["topic"]: one["messages"] for one in said["topics"]},
                         {"/odom": 151, "/rowe/record/lost": 2, "/rowe/stop/state": 16, "/map": 2})
        self.assertNotIn("rate_hz", said["topics"][0])
        self.assertNotIn("stops", said)
        self.assertRegex("\n".join(run("info", "--quick", self.path, code=0).stdout),
                         r"/odom +nav_msgs/Odometry +151 +- +- +- +-")

    def test_lists_what_is_damaged_and_goes_on(self):
        record(self.path, [message("/a", 0, {"n": "damaged"}), end_of_chunk, message("/a", 1, {"n": 1})])
        damage(self.path, b'"damaged"')
        said = self.described(self.path)
        self.assertEqual((said["messages"], len(said["damaged"])), (1, 1))
        self.assertGreater(said["damaged"][0]["bytes"], 0)
        text = "\n".join(run("info", self.path, code=0).stdout)
        self.assertRegex(text, r"damaged +1 part\n +at byte \d+, \d+ bytes: \w+")
        self.assertIn(f"`rowe record --repair {self.path}` saves the rest", text)

    def test_says_how_a_file_without_its_end_is_made_whole(self):
        record(self.path, some(), "lz4", cut=True)
        said = self.described(self.path)
        self.assertEqual((said["ended"], said["messages"]), (False, 171))
        self.assertIn(f"`rowe record --repair {self.path}` makes it whole",
                      "\n".join(run("info", self.path, code=0).stdout))
        with open(self.path, "r+b") as file:  # in the midst of a record
            file.truncate(os.path.getsize(self.path) - 3)
        self.assertEqual(self.described(self.path)["ended"], False)

    def test_says_a_stop_that_lasts_until_the_end(self):
        states = [message("/rowe/stop/state", i, {"state": "stopped", "number": number, "cause": "guard"})
                  for i, number in ((0, 4), (5, 4), (10, 5))]
        record(self.path, states)
        stops = self.described(self.path)["stops"]
        self.assertEqual([(one["number"], one["until"] is None) for one in stops], [(4, False), (5, True)])

    def test_reads_what_others_wrote(self):
        samples(self.folder)
        said = self.described(os.path.join(self.folder, "many.lz4.mcap"))
        self.assertEqual((said["profile"], said["messages"], said["packed_by"]), ("sample", 200, "lz4"))
        self.assertEqual({one["topic"]: one["encoding"] for one in said["topics"]},
                         {"/a": "json", "/b": "json", "/größe": "cdr", "/no/schema": ""})
        empty = self.described(os.path.join(self.folder, "empty.mcap"))
        self.assertEqual((empty["messages"], empty["begin"], empty["topics"][0]["messages"]), (0, None, 0))
        for name in sorted(os.listdir(self.folder)):
            run("info", os.path.join(self.folder, name), code=0, stderr=[])
        write_with_attachment(self.path)
        said = self.described(self.path)
        self.assertEqual(said["attachments"], [{"name": "map.png", "media_type": "image/png", "bytes": 5}])
        self.assertEqual((said["written_by"], said["messages"]), ("another writer", 1))
        self.assertRegex("\n".join(run("info", self.path).stdout),
                         r"attachment +map\.png, image/png, 5 B")

    def test_names_what_cannot_be_read_and_goes_on_with_the_next_file(self):
        record(self.path, some())
        none = os.path.join(self.folder, "none.mcap")
        text = os.path.join(self.folder, "text")
        with open(text, "w", encoding="ascii") as file:
            file.write("no recording")
        ended = run("info", "--json", none, text, self.path, code=1, says=(none, text))
        first, second, third = map(json.loads, ended.stdout)
        self.assertEqual((first["path"], second["path"], third["messages"]), (none, text, 171))
        self.assertTrue(first["wrong"] and second["wrong"])
        run("info", none, self.path, code=1, prints=self.path)

    def test_several_files_are_told_one_after_the_other(self):
        record(self.path, some())
        lines = run("info", self.path, self.path, code=0).stdout
        self.assertEqual(lines.count(self.path), 2)
        self.assertEqual(len(run("info", "--json", self.path, self.path, code=0).stdout), 2)

    def test_takes_words_that_are_no_files_for_something_else(self):
        for word in ("/odom", "odom", "/a.b/c", ".mcap"):
            run("info", word, code=2, stdout=[], says=(f"there is no file '{word}'", "*.mcap"))
        run("info", code=2, first="the argument FILE|URL TOPIC|SERVICE|ACTION is missing")

    def test_what_a_recording_says_reaches_no_terminal_as_it_is(self):
        write_packed_by(self.path, "\x1b]0;owned\x07\x1b[2J\nrobot: FINE")
        for quick in ((), ("--quick",)):
            text = "\n".join(run("info", *quick, self.path).stdout)
            self.assertIn("owned", text)
            self.assertNotRegex(text, "[\x1b\x07]")
            self.assertNotIn("\nrobot", text)

    def test_fits_a_narrow_terminal(self):
        record(self.path, some())
        os.chdir(self.folder)
        self.addCleanup(os.chdir, "/")
        for columns in (40, 72):
            for line in on_a_terminal(columns, "info", "run.mcap").splitlines():
                self.assertLessEqual(len(line), columns, line)
        wide = on_a_terminal(200, "info", "run.mcap")
        self.assertIn("LONGEST GAP", wide)

    def test_names_of_others_cannot_move_the_cursor(self):
        record(self.path, [{"metadata": {"a\x1b[2J": "b\nc"}}, message("/x\u009b", 0, {}, type="t\u202e")])
        text = "\n".join(run("info", self.path, code=0).stdout)
        for one in ("\x1b", "\u009b", "\u202e"):
            self.assertNotIn(one, text)
        self.assertEqual(json.loads(run("info", "--json", self.path).stdout[0])["messages"], 1)


if __name__ == "__main__":
    unittest.main()
