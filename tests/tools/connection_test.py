# SPDX-License-Identifier: Apache-2.0
"""What each verb says of a connection that it cannot use: once, and at once where it will not get better."""
import re
import signal
import unittest

from program import ROWE, hub, nobody_at, program, run, verbs
from robot import robot

long = ("--timeout", "20s")  # whoever waits for its end says "within", and fails


def verbs_with_a_place():
    """Those whose help has a URL, but for those that have modes, of which one stands for all."""
    for verb in verbs():
        if re.search(r"^usage: rowe \w+ .*\bURL\b", "\n".join(run(verb, "--help").stdout), re.M):
            yield verb


class connection(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bot = cls.enterClassContext(robot())
        cls.plain = cls.enterClassContext(hub())
        cls.secure = f"127.0.0.1:{cls.enterClassContext(cls.bot.serving()).port}"
        cls.trajectory = cls.bot.at("trajectory.tum")
        with open(cls.trajectory, "w", encoding="ascii") as file:
            file.write("0 0 0 0 0 0 0 1\n")

    def commands(self, url):
        """Each verb with a place, as it connects to `url`."""
        alone = ("actions", "list", "peers", "reset", "services", "stop", "topics", "types")
        some = {**{verb: (url,) for verb in alone},
                **{verb: (url, "/x") for verb in ("bw", "call", "delay", "echo", "hz", "info")},
                "param": ("list", url), "plot": (url, "--field", "/x:y", "-o", self.bot.at("none.svg")),
                "pub": (url, "/x", "{}"), "top": (url, "--once"),
                "replay": (url, "--tum", self.trajectory, "--topic", "/x"),
                "record": (url, "-o", self.bot.at("none.mcap"))}
        self.assertEqual(set(some), set(verbs_with_a_place()))
        same = ("actions", "services", "topics", "bw", "delay")  # as list, and as hz: one file each
        yield from ([ROWE, verb, *arguments] for verb, arguments in some.items() if verb not in same)
        yield [ROWE, "echo", url]  # the list of topics

    def ends_at_once(self, command, why, **environment):
        with self.subTest(command=command):
            ended = run(*long, command=command, environment=environment, code=3)
            said = "\n".join(ended.stderr)
            # `rowe stop` tries its kept place as well, and says so of both.
            self.assertEqual(len(re.findall(why, said)), 2 if "nor to " in said else 1, said)
            self.assertEqual(said.count("could not connect to"), 1, said)
            self.assertNotIn("within", said)

    def end_at_once(self, url, why, **environment):
        for command in self.commands(url):
            self.ends_at_once(command, why, **environment)

    def test_without_a_right_token(self):
        place = f"wss://{self.secure}"
        for token, commands in (("", self.commands(place)), ("x" * 43, [[ROWE, "peers", place]])):
            for command in commands:
                with self.bot.serving() as serving:  # one that has seen no wrong token is not slow to say so
                    there = f"wss://127.0.0.1:{serving.port}"
                    self.ends_at_once([there if word == place else word for word in command],
                                      "401 .*send a token", **self.bot.who(token))

    def test_in_plain_where_tls_is_spoken(self):
        self.end_at_once(f"ws://{self.secure}", "400 .*connect to wss://")

    def test_by_tls_where_none_is_spoken(self):
        self.end_at_once(f"wss://127.0.0.1:{self.plain.port}", "check that this port speaks TLS",
                         ROWE_CA=self.bot.ca)

    def test_with_a_certificate_that_nobody_vouches_for(self):
        self.end_at_once(f"wss://{self.secure}", "give the root that signed it",
                         ROWE_TOKEN=self.bot.tokens["driver"])

    def test_where_nobody_listens_yet_is_waited_for_and_told_once(self):
        for _, verb, *arguments in self.commands("127.0.0.1:1"):
            with self.subTest(verb=verb):
                ended = nobody_at(verb, *arguments).expect(3, stdout=None if verb == "stop" else [])
                said = "\n".join(ended.stderr)
                times = 2 if "nor to " in said else 1
                self.assertEqual(said.count("nobody listens at 127.0.0.1:1"), times, said)
                self.assertRegex(said, r"could not connect to ws://127\.0\.0\.1:1 within \d+\.\d{3} s")

    def test_is_to_the_url_of_the_environment_where_none_is_given(self):
        for _, verb, *arguments in self.commands("URL"):
            with self.subTest(verb=verb):
                given = (one for one in arguments if one != "URL")
                ended = nobody_at(verb, *given, environment={"ROWE_URL": "127.0.0.1:1"})
                ended.expect(3, says="could not connect to ws://127.0.0.1:1")

    def test_that_is_waited_for_can_be_given_up(self):
        for command in self.commands("127.0.0.1:1"):
            with self.subTest(command=command), program("--timeout", "50s", command=command) as waiting:
                waiting.line("waiting for ws://127.0.0.1:1")
                self.assertEqual(waiting.end(signal.SIGINT), 130)

    def test_said_quietly_has_its_reason_still(self):
        ended = nobody_at("echo", "--quiet", "127.0.0.1:1", "/x")
        self.assertRegex("\n".join(ended.stderr), r"^rowe echo: could not connect .* s: nobody listens")
        self.assertEqual(len(ended.stderr), 1)


if __name__ == "__main__":
    unittest.main()
