# SPDX-License-Identifier: Apache-2.0
"""No descriptor is left: nobody new gets in but who comes to stop, and those who are there notice nothing.
What changed on the disk meanwhile, a token that was revoked or a certificate, holds once it can be read."""
import contextlib
import os
import resource
import unittest

import websocket
import program
from program import run
from robot import numbers_until, publish, restored, robot, shown, until


def kept_by(process):
    """Its descriptors, but those of files and folders, which it reads and closes."""
    found = []
    for name in os.listdir(f"/proc/{process.pid}/fd"):
        with contextlib.suppress(FileNotFoundError):
            behind = os.readlink(f"/proc/{process.pid}/fd/{name}")
            if not os.path.isfile(behind) and not os.path.isdir(behind):
                found.append(int(name))
    return found


@contextlib.contextmanager
def none_left(serving):
    """The server gets no descriptor any more, and keeps those it has."""
    process = serving.process
    before = resource.prlimit(process.pid, resource.RLIMIT_NOFILE)
    kept = kept_by(process)
    lowest = next(number for number in range(len(kept) + 1) if number not in kept)
    resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (lowest, before[1]))
    try:
        yield
    finally:
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, before)


def awakenings(process):
    """How often the thread of the handshakes has slept so far."""
    for task in os.listdir(f"/proc/{process.pid}/task"):
        with open(f"/proc/{process.pid}/task/{task}/status", encoding="ascii") as file:
            facts = dict(line.split(":\t", 1) for line in file.read().splitlines())
        if facts["Name"] == "rowe-tls":
            return int(facts["voluntary_ctxt_switches"])
    raise AssertionError("there is no thread rowe-tls")


class descriptors(unittest.TestCase):
    def setUp(self):
        self.bot = self.enterContext(robot())
        self.serving = self.enterContext(self.bot.serving("--demo"))

    def test_those_who_are_there_go_on_and_stop_it_and_others_get_in_later(self):
        bot, serving = self.bot, self.serving
        with bot.subscriber(serving) as reader, bot.peer(serving, "peer") as writer:
            with none_left(serving):
                for _ in range(5):  # they say nothing, and stay
                    self.enterContext(websocket.connect(serving.port))
                slept = awakenings(serving.process)
                for begin in range(0, 2000, 100):  # fewer than a queue holds, so none is dropped
                    publish(writer, range(begin, begin + 100))
                    self.assertEqual(numbers_until(reader, begin + 99), list(range(begin, begin + 100)))
                answer = reader.call("/rowe/stop")
                self.assertEqual((answer["id"], answer["result"]), ("now", True))
                # It waits for descriptors, and does not ask for them all the time.
                self.assertLess(awakenings(serving.process) - slept, 1000)
            bot.subscriber(serving).stream.close()
            counts = bot.counts(serving)
            self.assertEqual(counts["outbox_full"] + counts["evicted"] + counts["lost_with_peer"], 0)
            self.assertEqual(counts["stops"], 1)

    def test_who_comes_to_stop_gets_in_and_nobody_else(self):
        for in_plain in (False, True):
            with self.subTest(in_plain=in_plain), contextlib.ExitStack() as held:
                serving = held.enter_context(program.hub("--demo")) if in_plain else self.serving

                def peer(path, serving=serving, in_plain=in_plain):
                    return websocket.peer(serving.port, path=path) if in_plain else \
                        self.bot.peer(serving, "driver", path)

                held.enter_context(none_left(serving))
                for round in range(4):
                    for _ in range(6):  # they say nothing, and stay
                        held.enter_context(websocket.connect(serving.port))
                    with self.assertRaises(websocket.refused) as refused:
                        peer("/")
                    self.assertEqual(refused.exception.status, 503)
                    stopper = held.enter_context(peer("/rowe/stop"))
                    self.assertTrue(stopper.call("/rowe/stop", round)["result"])
                    if round < 2:
                        stopper.stream.close()
                serving.line("only peers that come to stop can connect: this process has no file descriptor")

    def test_a_token_that_was_revoked_meanwhile_is_refused_as_soon_as_the_file_can_be_read(self):
        bot, serving = self.bot, self.serving
        with bot.peer(serving, "driver") as driver:
            with restored(bot.file), none_left(serving):
                self.assertEqual(run("token", "remove", "driver", "--dir", bot.folder).code, 0)
                serving.line("is wrong: the values that it had before hold")
                websocket.settle(driver)
            # Put back as it was: that is a change as well, and nothing was lost.
            serving.line("has changed: its roles and identities hold now")
            websocket.settle(driver)
            with none_left(serving):
                self.assertEqual(run("token", "remove", "driver", "--dir", bot.folder).code, 0)
                serving.line("is wrong: the values that it had before hold", count=2)
            serving.line("has changed: its roles and identities hold now", count=2)
            driver.wait_for_close()
        with self.assertRaises(websocket.refused) as refused:
            bot.peer(serving, "driver")
        self.assertEqual(refused.exception.status, 401)
        self.assertEqual(len([line for line in serving.stderr if "is wrong" in line]), 2)  # each said once

    def test_a_certificate_that_was_renewed_meanwhile_is_shown_as_soon_as_it_can_be_read(self):
        bot, serving = self.bot, self.serving
        before = bot.text("certificate.pem")
        with none_left(serving):
            renewed = bot.renew()
            serving.line("the new certificate is not used: .*[Tt]oo many open files")
        self.assertNotEqual(renewed, before)
        until(lambda: shown(serving) == renewed)  # it looks each second
        said = [line for line in serving.stderr if "the new certificate is not used" in line]
        self.assertEqual(len(said), 1)


if __name__ == "__main__":
    unittest.main()
