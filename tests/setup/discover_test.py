# SPDX-License-Identifier: Apache-2.0
"""`rowe discover`, with an avahi-browse of the tests in PATH."""
import json
import os
import signal
import unittest

from program import given_time, program
from robot_folder import in_a_folder

ang = ('=;eth0;IPv4;ang\\03201;_rowe._tcp;local;ang-01.local;192.168.1.5;8443;'
       '"api=rowe.v1" "name=ang-01" "scheme=https" "path=/"')
upstairs = '=;wlan0;IPv6;upstairs;_rowe._tcp;local;up.local;fd00::7;8080;"scheme=http" "path=/ui"'


class discovering(in_a_folder):
    def browse(self, script):
        """What avahi-browse does from now on."""
        self.write("#!/bin/sh\n" + script + "\n", "avahi-browse", mode=0o700)

    def prints(self, *lines):
        self.browse("cat <<'END'\n" + "\n".join(lines) + "\nEND")

    def setUp(self):
        super().setUp()
        self.environment = {"PATH": f"{self.top}:{os.environ['PATH']}"}

    def discover(self, *arguments, **more):
        return self.rowe("discover", *arguments, environment=self.environment, **more)

    def test_asks_for_robots_and_prints_a_line_for_each(self):
        self.prints("+;eth0;IPv4;ang\\03201;_rowe._tcp;local", ang, ang, upstairs)
        self.assertEqual(self.discover().stdout,
                         ["ang 01  https://ang-01.local:8443/ 192.168.1.5 api=rowe.v1 name=ang-01 "
                          "scheme=https path=/", "upstairs  http://up.local:8080/ui fd00::7 scheme=http path=/ui"])
        self.browse('echo "$@" > asked')
        self.discover()
        self.assertEqual(self.text("asked"), "-rpt _rowe._tcp\n")

    def test_prints_json(self):
        self.prints(ang, upstairs)
        found = [json.loads(line) for line in self.discover("--json").stdout]
        texts = {"api": "rowe.v1", "name": "ang-01", "scheme": "https", "path": "/"}
        self.assertEqual(found[0], {"name": "ang 01", "url": "https://ang-01.local:8443/",
                                    "host": "ang-01.local", "port": 8443, "addresses": ["192.168.1.5"],
                                    "txt": texts})
        self.assertEqual(found[1]["url"], "http://up.local:8080/ui")

    def test_what_is_announced_does_not_move_the_cursor(self):
        hostile = ang.replace("ang\\03201", "\\027[2J\\194\\155x")
        self.prints(hostile.replace("name=ang-01", "name=\\027]0;y\\007"))
        ended = self.discover()
        self.assertTrue(ended.stdout[0].startswith(r"\u001b[2J\u009bx  https://ang-01.local:8443/ "))
        self.assertIn(r"name=\u001b]0;y\u0007", ended.stdout[0])
        self.assertEqual(json.loads(self.discover("--json").stdout[0])["name"], "\x1b[2J\x9bx")

    def test_bytes_that_are_no_text_are_still_json(self):
        self.prints(ang.replace("ang\\03201", "\\255\\254"))
        self.assertEqual(len(json.loads(self.discover("--json").stdout[0])["name"]), 2)

    def test_answers_that_cannot_be_read_are_counted(self):
        self.prints("=;nonsense", ang)
        ended = self.discover(first="1 answer could not be read")
        self.assertEqual(len(ended.stdout), 1)

    def test_says_that_there_is_none(self):
        self.prints("")
        self.discover(stdout=[], first="no robot is announced here")

    def test_names_the_package_where_avahi_browse_is_missing(self):
        self.rowe("discover", code=1, environment={"PATH": self.top}, first="install the package avahi-utils")

    def test_says_that_avahi_browse_failed(self):
        self.browse("echo 'Daemon not running' >&2; exit 1")
        self.discover(code=1, says="ended with 1: is avahi-daemon running?")

    def test_stops_waiting_in_time(self):
        self.browse("exec sleep 1000")
        self.discover("--timeout", "50ms", code=4)
        self.browse(f"cat <<'END'\n{ang}\nEND\nexec sleep 1000")
        ended = given_time(lambda time: self.discover("--timeout", time, code=None),
                           lambda ended: ended.stdout).expect(0)
        self.assertEqual(len(ended.stdout), 1)

    def test_reads_no_more_than_robots_can_have_to_say(self):
        self.browse("exec yes '=;eth0;IPv4;a;_rowe._tcp;local;a.local;10.0.0.1;1;\"x=y\"'")
        ended = self.discover("--timeout", "60s", says="writes without end")
        self.assertEqual(len(ended.stdout), 1)

    def test_an_interrupt_ends_it_and_the_other_program(self):
        self.browse("echo $$ > pid.new; mv pid.new pid; exec sleep 1000")
        with program("discover", "--timeout", "60s", cwd=self.top, environment=self.environment) as running:
            while not os.path.exists(self.at("pid")):
                self.assertIsNone(running.process.poll())
            self.assertEqual(running.end(signal.SIGINT), 130)
        with self.assertRaises(ProcessLookupError):
            os.kill(int(self.text("pid")), 0)


if __name__ == "__main__":
    unittest.main()
