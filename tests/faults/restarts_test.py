# SPDX-License-Identifier: Apache-2.0
"""A robot that is started again, and peers that are: who stayed finds the other by itself, and gets nothing
of before. And no robot moves that stood."""
import itertools
import re
import signal
import unittest

from program import kept_port, program, run
from robot import publish, robot, round_trip, topic, until

many = 10**9  # more than are published until somebody has connected


class restarted(unittest.TestCase):
    def setUp(self):
        self.bot = self.enterContext(robot())
        self.port = self.enterContext(kept_port())
        self.url = f"wss://127.0.0.1:{self.port}/"

    def serving(self, *options):
        return self.bot.serving(*options, port=self.port)

    def numbers(self, echo, count):
        """The first ones that it printed."""
        return [int(re.search(r'"n": (\d+)', line)[1]) for line in echo.lines(count)[:count]]

    def test_killed_it_is_found_again_and_shows_nothing_twice(self):
        bot = self.bot
        with program("echo", self.url, topic, "--json", environment=bot.who("observer")) as echo:
            for begin, ending in ((0, signal.SIGKILL), (many, signal.SIGTERM), (2 * many, signal.SIGKILL)):
                with self.serving() as serving, bot.peer(serving, "peer") as writer:
                    self.until_heard(writer, echo, begin)
                    publish(writer, range(begin + many - 100, begin + many))
                    echo.line(rf'"n": {begin + many - 1}\b', "stdout")
                    serving.end(ending)
            got = self.numbers(echo, len(echo.stdout))
        self.assertEqual(sorted(set(got)), got)  # in order, none twice
        for end in (many, 2 * many, 3 * many):  # and none of those left out that came behind the first
            self.assertEqual([n for n in got if end - 100 <= n < end], list(range(end - 100, end)))

    def test_a_peer_that_is_started_again_gets_nothing_of_before(self):
        bot = self.bot
        with self.serving() as serving, bot.peer(serving, "peer") as writer:
            for begin in range(0, 3 * many, many):
                with program("echo", self.url, topic, "--json", environment=bot.who("observer")) as echo:
                    self.until_heard(writer, echo, begin)
                    self.assertGreaterEqual(self.numbers(echo, 1)[0], begin)
                    echo.process.send_signal(signal.SIGSTOP)
                    # On their way to it, or queued for it.
                    publish(writer, range(begin + many - 200, begin + many))
                    round_trip(writer)
                    echo.process.kill()

    def until_heard(self, writer, echo, begin):
        """Publishes from `begin` on until one comes: who connects has not subscribed yet."""
        before, following = len(echo.stdout), itertools.count(begin)

        def heard():
            publish(writer, [next(following)])
            round_trip(writer)
            return len(echo.stdout) > before

        until(heard)

    def test_a_robot_that_stood_stands_again_and_a_reset_of_before_moves_nothing(self):
        bot = self.bot
        with self.serving("--demo", "--guarded") as serving:
            before = bot.stop(serving)["number"]
            serving.end(signal.SIGKILL)
        with self.serving("--demo", "--guarded"):
            ended = run("call", self.url, "/rowe/stop/state", environment=bot.who("observer"))
            self.assertIn('"state":"stopped"', ended.stdout[0].replace(" ", ""))
            run("reset", self.url, str(before), environment=bot.who("supervisor"), code=1)

    def test_with_another_key_it_is_not_taken_for_the_one_before(self):
        """Somebody else at its address, with a certificate of its own: who stayed shows no token to it."""
        bot, other = self.bot, self.enterContext(robot())
        with program("echo", self.url, topic, "--json", environment=bot.who("observer")) as echo:
            with self.serving() as serving:
                serving.line("observer.*: connected")
            with other.serving(port=self.port) as impostor:
                echo.line("unable to get local issuer certificate")
                self.assertNotIn("observer", "\n".join(impostor.stderr))
            with self.serving() as serving:
                serving.line("observer.*: connected")


if __name__ == "__main__":
    unittest.main()
