# SPDX-License-Identifier: Apache-2.0
"""`rowe topics`, `services`, `actions`, `list` and `info URL NAME`: what a robot has, and who does what."""
import json
import os
import re
import subprocess
import unittest

from program import hub, on_a_terminal, program, run
from websocket import closed, listener, peer, settle


def rows(ended):
    return [line.split() for line in ended.stdout]


class look(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))
        cls.url = cls.demo.url

    def test_lists_topics_with_their_types(self):
        listed = rows(run("topics", self.url, code=0))
        self.assertEqual(listed[0], ["TOPIC", "TYPE"])
        for row in (["/odom", "nav_msgs/Odometry"], ["/cmd_vel", "geometry_msgs/Twist"]):
            self.assertIn(row, listed)
        self.assertNotIn("/rowe/stats", [row[0] for row in listed])
        self.assertIn(["/rowe/stats", "rowe/Stats"], rows(run("topics", self.url, "--all", code=0)))
        said = json.loads("".join(run("topics", self.url, "--json", code=0).stdout))
        self.assertIn({"name": "/odom", "type": "nav_msgs/Odometry"}, said["topics"])

    def test_lists_the_services_of_the_program_and_counts_the_others(self):
        ended = run("services", self.url, code=0, says="services are the endpoint's own (--all)")
        self.assertEqual(rows(ended), [["SERVICE", "TYPE"], ["/robot/set_speed", "rowe_demo/SetSpeed"]])
        everything = rows(run("services", self.url, "--all", code=0, stderr=[]))
        self.assertIn(["/rowe/stats", "rowe/GetStats"], everything)
        self.assertIn(["/rowe/record", "rowe/Record"], everything)

    def test_lists_actions_and_says_that_there_are_none(self):
        run("actions", self.url, code=0, stdout=[], says="it has no actions of its program")
        with hub() as serving, peer(serving.port) as p:
            p.send({"op": "advertise_action", "action": "/fetch", "type": "a/Fetch"})
            settle(p)
            self.assertIn(["/fetch", "a/Fetch"], rows(run("actions", serving.url, code=0)))
            said = json.loads("".join(run("list", serving.url, "--json", code=0).stdout))
            self.assertEqual(said["actions"], [{"name": "/fetch", "type": "a/Fetch"}])
            self.assertIn("/fetch (action)", run("info", serving.url, "/fetch", code=0).stdout)

    def test_lists_all_of_it(self):
        listed = rows(run("list", self.url, code=0))
        for row in (["TOPIC", "TYPE"], ["/odom", "nav_msgs/Odometry"], ["SERVICE", "TYPE"],
                    ["/robot/set_speed", "rowe_demo/SetSpeed"]):
            self.assertIn(row, listed)
        self.assertEqual(set(json.loads("".join(run("list", self.url, "--json").stdout))),
                         {"topics", "services", "actions"})

    def test_a_server_that_knows_only_topics_is_listed_all_the_same(self):
        with listener() as there, program("list", there.url) as asking, there.accept() as p:
            while asking.process.poll() is None:
                call = p.called()
                if call["service"] == "/rosapi/topics":
                    p.answer(call, {"topics": ["/a"], "types": ["x/A"]})
                else:
                    p.answer(call, "no such service", False)
                if call["service"] == "/rosapi/action_servers":
                    break
            self.assertEqual(asking.end(), 0)
            self.assertEqual(rows(asking), [["TOPIC", "TYPE"], ["/a", "x/A"]])

    def asked(self, answers, *arguments):
        """A verb that asks a server with these answers, and none for other services."""
        with listener() as there, program(arguments[0], there.url, *arguments[1:]) as asking:
            with there.accept() as p:
                while asking.process.poll() is None:
                    try:
                        call = p.called()
                    except closed:
                        break
                    if call["service"] in answers:
                        answer = answers[call["service"]]
                        p.answer(call, answer(call) if callable(answer) else answer)
                asking.end()
        return asking

    def test_a_server_that_says_no_types_is_not_asked_for_each(self):
        ended = self.asked({"/rosapi/services": {"services": [f"/s{i}" for i in range(100)]}}, "services",
                           "--timeout", "300ms")
        ended.expect(0)
        self.assertEqual(len(ended.stdout), 101)

    def test_types_without_end_are_refused(self):
        answers = {"/rowe/types": lambda call: {"types": [], "next": call["args"]["from"] + 1}}
        self.asked(answers, "types").expect(1, stdout=[], says="it has more types than there can be")

    def test_what_a_server_says_reaches_no_terminal_as_it_is(self):
        evil = {"name": ["\u009b2J\u202e"], "losses": {"x\u001b": "\u009b1"}, "uptime_s": "\u001b[2J"}
        for verb in (("peers",), ("top", "--once")):
            ended = self.asked({"/rowe/stats": evil, "/rowe/stop/state": {"state": "\u009b"}}, *verb)
            ended.expect(0)
            self.assertNotRegex("".join(ended.stdout), "[\u0000-\u001f\u0080-\u009f\u202e]")

    def test_says_what_a_topic_is(self):
        text = "\n".join(run("info", self.url, "/odom", code=0).stdout)
        for like in (r"^/odom \(topic\)$", r"(?m)^  type +nav_msgs/Odometry$", r"(?m)^  publishers +\S",
                     r"(?m)^  subscribers +", r"(?m)^  rate +",
                     r"(?m)^  geometry_msgs/PoseWithCovariance pose$"):
            self.assertRegex(text.split("\n")[0] if like.startswith("^/") else text, like)
        said = json.loads("".join(run("info", self.url, "odom", "--json", code=0).stdout))
        self.assertEqual((said["kind"], said["name"], said["type"]), ("topic", "/odom", "nav_msgs/Odometry"))
        self.assertEqual(said["message"]["title"], "nav_msgs/Odometry")

    def test_says_what_a_service_is_asked_and_answers(self):
        text = "\n".join(run("info", self.url, "/robot/set_speed", code=0).stdout)
        for part in ("/robot/set_speed (service)", "\nrequest\n", "\nanswer\n", "speed"):
            self.assertIn(part, text)

    def test_names_what_was_probably_meant(self):
        run("info", self.url, "/odmo", code=1, stdout=[],
            says="there is no topic, service or action '/odmo' at ws://", ends=r"; did you mean /odom\?$")
        run("info", self.url, "set_speed", code=1, ends=r"; did you mean /robot/set_speed\?$")

    def test_takes_the_robot_from_the_environment(self):
        at_demo = {"ROWE_URL": self.url}
        run("info", "/odom", code=0, environment=at_demo)
        run("topics", code=0, environment=at_demo)
        run("info", self.url, code=2, says="a TOPIC or SERVICE is missing")
        run("info", "no-robot", "/odom", "--timeout", "10ms", code=3, says="ws://no-robot:8080")

    def test_fits_narrow_terminals_and_has_colours_there(self):
        for columns in (40, 80):
            for arguments in (("topics", self.url), ("services", self.url, "--all"), ("list", self.url),
                              ("peers", self.url), ("help",),
                              ("echo", "--help")):
                shown = on_a_terminal(columns, *arguments, stderr=subprocess.DEVNULL)
                for line in re.sub("\x1b\\[[01]m", "", shown).split("\n"):
                    blank = line.find(" ", len(line) - len(line.lstrip(" ")))
                    # A word that is longer than the terminal is wide stands whole.
                    self.assertTrue(len(line) <= columns or blank in (-1, len(line) - 1), (arguments, line))
        coloured = on_a_terminal(80, "topics", self.url, env={**os.environ, "TERM": "xterm"})
        self.assertIn("\x1b[1mTOPIC", coloured)
        self.assertNotIn("\x1b", on_a_terminal(80, "topics", self.url, "--color", "never"))
        self.assertIn("\x1b[1mTOPIC", "\n".join(run("topics", self.url, "--color=always", code=0).stdout))
        run("topics", self.url, "--color", "blue", code=2,
            says="--color is auto or always or never, not 'blue'")


if __name__ == "__main__":
    unittest.main()
