# SPDX-License-Identifier: Apache-2.0
"""A robot on a network: `rowe setup`, `rowe serve` of what it made, and who comes with which token."""
import re
import unittest

from program import learns, program, run
from robot import restored, robot

speed = ("/robot/set_speed", '{"speed":0.5}')


class network(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bot = cls.enterClassContext(robot())

    def asks(self, serving, role, verb, *arguments, **how):
        return run(verb, f"wss://127.0.0.1:{serving.port}/", *arguments, environment=self.bot.who(role), **how)

    def asks_in_vain(self, serving, token):
        return learns("401", "peers", f"wss://127.0.0.1:{serving.port}/", environment=self.bot.who(token))

    def test_who_may_do_what(self):
        with self.bot.serving("--demo") as serving:
            self.asks(serving, "observer", "echo", "/odom", "--once", "--json", code=0)
            peers = self.asks(serving, "observer", "peers", code=0)
            self.assertEqual([line.split()[1:3] for line in peers.stdout[1:3]],
                             [["IDENTITY", "ROLE"], ["observer", "observer"]])
            self.asks(serving, "driver", "call", *speed, code=0)
            self.asks(serving, "observer", "call", *speed, code=1,
                      says="has no right to call /robot/set_speed")
            denied = self.asks(serving, "observer", "pub", "/cmd_vel", '{"x":1}', code=1,
                               says="has no right to advertise /cmd_vel")
            said = "\n".join(denied.stderr)
            self.assertNotIn("unadvertise", said)
            self.assertRegex(said, "sent 1 message in .*; the server (reported errors|refused the topic)")
            self.asks(serving, "observer", "record", "--snapshot", code=1,
                      says="has no right to call /rowe/record")
            self.asks(serving, "driver", "record", "--snapshot", code=1, says="has no black box")
            self.asks(serving, "observer", "stop", code=0)
            stands = self.asks(serving, "driver", "reset")
            number = re.search(r"rowe reset \S+ (\d+)|number (\d+)", "\n".join(stands.stdout + stands.stderr))
            self.assertIsNotNone(number, stands.stdout + stands.stderr)
            number = number[1] or number[2]
            self.asks(serving, "driver", "reset", number, code=1,
                      says="NOT reset: your role has no right to reset")
            self.asks(serving, "supervisor", "reset", number, code=0)

    def test_the_log_says_who_did_it_whatever_they_say(self):
        with self.bot.serving("--demo", "--log", "json") as serving:
            self.asks(serving, "observer", "stop", "--source", "supervisor", code=0)
            serving.line(r'"event":"stop","peer":"127\.0\.0\.1:\d+","identity":"observer",'
                         r'"what":"stopped: request, by .observer \(supervisor\).')
            self.asks(serving, "observer", "call", *speed, code=1)
            serving.line(r'"event":"denied","peer":"127\.0\.0\.1:\d+","identity":"observer"')

    def test_nobody_comes_without_a_token_or_trusts_another_root(self):
        with self.bot.serving() as serving:
            for token in ("", "x" * 43):
                self.asks_in_vain(serving, token).expect(3, says=("401", "--token-file FILE or $ROWE_TOKEN"))
            learns("certificate", "peers", f"wss://127.0.0.1:{serving.port}/",
                   environment={"ROWE_TOKEN": self.bot.tokens["driver"]}).expect(3, says="certificate")

    def test_tokens_come_and_go_without_a_restart(self):
        with self.bot.serving() as serving:
            ended = run("token", "add", "anna", "driver", "--dir", self.bot.folder, code=0)
            token = re.search(r"\S{40,}", "\n".join(ended.stdout))[0]
            serving.line("has changed: its roles and identities hold now")
            with program("echo", f"wss://127.0.0.1:{serving.port}/", "/never", "--json",
                         environment=self.bot.who(token)) as anna:
                serving.line(r"anna.*connected|connected.*anna")
                run("token", "remove", "anna", "--dir", self.bot.folder, code=0)
                anna.line("token revoked|401")
            self.asks_in_vain(serving, token).expect(3)

    def test_a_wrong_file_changes_nothing(self):
        with restored(self.bot.file), self.bot.serving() as serving:
            with open(self.bot.file, "a", encoding="utf-8") as file:
                file.write("\n[[identity]]\nname = 1\n")
            serving.line("is wrong: the values that it had before hold")
            self.asks(serving, "supervisor", "peers", code=0)


if __name__ == "__main__":
    unittest.main()
