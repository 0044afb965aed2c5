# SPDX-License-Identifier: Apache-2.0
"""usage: programs_test.py FOLDER [unittest's options]

The programs that have figures to meet, run shortly: they come to their end, count, and say of each figure
what was measured and what is wanted. Of what they measure only counts are compared, and at rates that a busy
machine keeps up with.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

folder = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 else None
ends_s = 240  # far more than it takes: it hangs


def run(name, *options):
    """(its rows by name, what it printed)."""
    with tempfile.TemporaryDirectory() as place:
        out = pathlib.Path(place) / "out.json"
        done = subprocess.run([folder / f"bench_{name}", "--rounds=1", *options, f"--benchmark_out={out}",
                               "--benchmark_out_format=json"], capture_output=True, text=True, timeout=ends_s)
        if "needs two cores" in done.stderr:
            raise unittest.SkipTest(done.stderr)
        if done.returncode != 0:
            raise AssertionError(f"{name} ended with {done.returncode}: {done.stdout}{done.stderr}")
        rows = json.loads(out.read_text(encoding="utf-8"))["benchmarks"]
    return {one["name"]: one for one in rows}, done.stdout


class every_client(unittest.TestCase):
    def test_counts_what_nine_clients_get_of_what_is_published(self):
        rows, said = run("every_client", "--milliseconds=1000", "--rate=100")
        self.assertEqual(list(rows), ["every_client/none", "every_client/one", "every_client/nine",
                                      "every_client/elsewhere"])
        for name, one in rows.items():
            self.assertEqual(one["published"] + one["refused"], 100, name)
            self.assertGreater(one["publish_p50_ns"], 0, name)
            self.assertEqual(one.get("lost", 0), 0, said)
        self.assertGreater(rows["every_client/nine"]["arrival_p99_us"], 0)
        self.assertEqual(said.count(": measured "), 5, said)
        for what in ("cost of publish()", "a healthy client lost", "counted as lost", "arrival, p99"):
            self.assertRegex(said, rf"{what}.*: measured \S+, wanted .*, (not )?met\n")
        self.assertIn("share core", said)


class maps(unittest.TestCase):
    def test_counts_maps_and_what_they_do_to_a_stream_and_the_stop(self):
        rows, said = run("maps", "--milliseconds=500", "--megabytes=2")
        self.assertEqual(list(rows), ["maps/quiet", "maps/out", "maps/in"])
        for name, one in rows.items():
            self.assertEqual(one["stream_lost"], 0, said)
            self.assertEqual(one["unanswered"], 0, said)
            self.assertGreater(one["stop_p99_us"], 0, name)
        self.assertEqual(rows["maps/quiet"]["maps"], 0)
        for name in ("maps/out", "maps/in"):
            self.assertGreater(rows[name]["maps"], 0, said)
        self.assertEqual(said.count(": measured "), 8, said)
        self.assertIn("share core", said)


class requests(unittest.TestCase):
    def test_counts_each_kind_of_request_and_what_it_does_to_the_stop(self):
        rows, said = run("requests", "--milliseconds=200", "--peers=4")
        self.assertGreater(len(rows), 15)
        for name, one in rows.items():
            self.assertEqual(one["unanswered"], 0, said)
            self.assertGreater(one["stop_p99_us"], 0, name)
            if name != "requests/ping":  # pings are no messages
                self.assertGreater(one["per_s"], 0, name)
        self.assertEqual(said.count(": measured "), 3, said)


class wrong_options(unittest.TestCase):
    def test_are_named(self):
        for name in ("every_client", "maps", "requests"):
            done = subprocess.run([folder / f"bench_{name}", "--what=1"], capture_output=True, text=True,
                                  timeout=ends_s)
            if "needs two cores" in done.stderr:
                self.skipTest(done.stderr)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("what is --what=1?", done.stderr)


if __name__ == "__main__":
    unittest.main()
