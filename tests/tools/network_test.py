# SPDX-License-Identifier: Apache-2.0
"""A robot on a network: `rowe setup`, `rowe serve` of what it made, and who comes with which token."""
import os
import re
import tempfile
import unittest

from program import hub, learns, program, run


class network(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.made = os.path.join(cls.folder, "bot")
        ended = run("setup", "--name", "bot", "--dir", cls.made, "--keep-ca")
        assert ended.code == 0, ended.stderr
        said = "\n".join(ended.stdout)
        cls.tokens = dict(re.findall(r"(?m)^(observer|driver|supervisor|peer) +(\S+)$", said))
        cls.file = os.path.join(cls.made, "rowe.toml")

    def serving(self, *options):
        return hub("--config", self.file, "--address", "127.0.0.1", *options)

    def who(self, token):
        """The environment of one who has it."""
        return {"ROWE_CA": os.path.join(self.made, "ca.pem"), "ROWE_TOKEN": token or ""}

    def asks(self, port, verb, *arguments, token=None):
        return run(verb, f"wss://127.0.0.1:{port}/", *arguments, environment=self.who(token))

    def asks_in_vain(self, why, port, verb, token):
        return learns(why, verb, f"wss://127.0.0.1:{port}/", environment=self.who(token))

    def add_token(self, name, role):
        ended = run("token", "add", name, role, "--dir", self.made)
        self.assertEqual(ended.code, 0, ended.stderr)
        return re.search(r"\S{40,}", "\n".join(ended.stdout))[0]

    def test_who_may_do_what(self):
        with self.serving("--demo") as serving:
            pose = self.asks(serving.port, "echo", "/odom", "--once", "--json", token=self.tokens["observer"])
            self.assertEqual(pose.code, 0, pose.stderr)
            peers = self.asks(serving.port, "peers", token=self.tokens["observer"])
            self.assertEqual(peers.code, 0)
            self.assertEqual([line.split()[1:3] for line in peers.stdout[1:3]],
                             [["IDENTITY", "ROLE"], ["observer", "observer"]])
            speed = ("/robot/set_speed", '{"speed":0.5}')
            self.assertEqual(self.asks(serving.port, "call", *speed, token=self.tokens["driver"]).code, 0)
            denied = self.asks(serving.port, "call", *speed, token=self.tokens["observer"])
            self.assertEqual(denied.code, 1)
            self.assertIn("has no right to call /robot/set_speed", "\n".join(denied.stderr))
            denied = self.asks(serving.port, "pub", "/cmd_vel", '{"x":1}', token=self.tokens["observer"])
            self.assertEqual(denied.code, 1)
            said = "\n".join(denied.stderr)
            self.assertIn("has no right to advertise /cmd_vel", said)
            self.assertNotIn("unadvertise", said)
            self.assertRegex(said, "sent 1 message in .*; the server (reported errors|refused the topic)")
            self.assertEqual(self.asks(serving.port, "stop", token=self.tokens["observer"]).code, 0)
            stands = self.asks(serving.port, "reset", token=self.tokens["driver"])
            number = re.search(r"rowe reset \S+ (\d+)|number (\d+)", "\n".join(stands.stdout + stands.stderr))
            self.assertIsNotNone(number, stands.stdout + stands.stderr)
            number = number[1] or number[2]
            for role, code in (("driver", 1), ("supervisor", 0)):
                ended = self.asks(serving.port, "reset", number, token=self.tokens[role])
                self.assertEqual(ended.code, code, ended.stdout + ended.stderr)
                if role == "driver":
                    self.assertIn("NOT reset: your role has no right to reset", "\n".join(ended.stderr))

    def test_the_log_says_who_did_it_whatever_they_say(self):
        with self.serving("--demo", "--log", "json") as serving:
            token = self.tokens["observer"]
            self.assertEqual(self.asks(serving.port, "stop", "--source", "supervisor", token=token).code, 0)
            serving.line(r'"event":"stop","peer":"127\.0\.0\.1:\d+","identity":"observer",'
                         r'"what":"stopped: request, by .observer \(supervisor\).')
            speed = ("/robot/set_speed", '{"speed":0.5}')
            self.assertEqual(self.asks(serving.port, "call", *speed, token=token).code, 1)
            serving.line(r'"event":"denied","peer":"127\.0\.0\.1:\d+","identity":"observer"')

    def test_nobody_comes_without_a_token_or_trusts_another_root(self):
        with self.serving() as serving:
            for token in (None, "x" * 43):
                ended = self.asks_in_vain("401", serving.port, "peers", token=token)
                self.assertEqual(ended.code, 3)
                self.assertIn("401", "\n".join(ended.stderr))
                self.assertIn("--token-file FILE or $ROWE_TOKEN", "\n".join(ended.stderr))
            ended = learns("certificate", "peers", f"wss://127.0.0.1:{serving.port}/",
                           environment={"ROWE_TOKEN": self.tokens["driver"]})
            self.assertEqual(ended.code, 3)
            self.assertIn("certificate", "\n".join(ended.stderr))

    def test_tokens_come_and_go_without_a_restart(self):
        with self.serving() as serving:
            token = self.add_token("anna", "driver")
            serving.line("has changed: its roles and identities hold now")
            with program("echo", f"wss://127.0.0.1:{serving.port}/", "/never", "--json",
                         environment=self.who(token)) as anna:
                serving.line(r"anna.*connected|connected.*anna")
                self.assertEqual(run("token", "remove", "anna", "--dir", self.made).code, 0)
                anna.line("token revoked|401")
            self.assertEqual(self.asks_in_vain("401", serving.port, "peers", token=token).code, 3)

    def test_a_wrong_file_changes_nothing(self):
        with open(self.file, encoding="utf-8") as before:
            text = before.read()
        self.addCleanup(self.write, text)
        with self.serving() as serving:
            self.write(text + "\n[[identity]]\nname = 1\n")
            serving.line("is wrong: the values that it had before hold")
            self.assertEqual(self.asks(serving.port, "peers", token=self.tokens["supervisor"]).code, 0)

    def write(self, text):
        with open(self.file, "w", encoding="utf-8") as out:
            out.write(text)


if __name__ == "__main__":
    unittest.main()
