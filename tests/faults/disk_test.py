# SPDX-License-Identifier: Apache-2.0
"""A disk that is full: what `rowe` writes, it writes whole or not at all, and says which; and a robot that is
served from it goes on, and stops. setup_test.py has files whose size is limited, at each place."""
import os
import re
import shutil
import subprocess
import types
import unittest

from clock import clock, preloaded
from program import ROWE, run
from robot import content_of, numbers_until, publish, robot, shown, until
from small_disk import without_small_disk

disk_bytes = 256 * 1024
day = 24 * 60 * 60  # seconds

why_not = without_small_disk(disk_bytes) if __name__ == "__main__" else ""


@unittest.skipIf(why_not, why_not)
class full(unittest.TestCase):
    def setUp(self):
        self.disk = os.environ["ROWE_SMALL_DISK"]
        self.addCleanup(self.clear)
        self.bot = self.enterContext(robot())
        self.folder = os.path.join(self.disk, "bot")
        shutil.copytree(self.bot.folder, self.folder)
        self.bot.folder, self.bot.file = self.folder, os.path.join(self.folder, "rowe.toml")

    def clear(self):
        for name in os.listdir(self.disk):
            path = os.path.join(self.disk, name)
            shutil.rmtree(path) if os.path.isdir(path) else os.unlink(path)

    def fill(self):
        """Returns a file that may go again."""
        path = os.path.join(self.disk, "filler")
        with open(path, "wb", buffering=0) as file:
            while True:
                try:
                    file.write(b"x" * 4096)
                except OSError:
                    return path

    def refused(self, *arguments):
        before = content_of(self.folder)
        ended = run(*arguments, cwd=self.disk)
        self.assertEqual(ended.code, 1, (arguments, ended.stdout, ended.stderr))
        self.assertIn("No space left on device", "\n".join(ended.stderr))
        self.assertEqual(ended.stdout, [])  # no token that does not hold, and nothing that was done
        self.assertEqual(content_of(self.folder), before)
        self.assertEqual(sorted(os.listdir(self.disk)), ["bot", "filler"])

    def test_nothing_is_written_by_halves_and_nothing_is_lost(self):
        self.fill()
        self.refused("setup", "--name", "bot", "--dir", "other")
        self.refused("setup", "--name", "bot", "--dir", "bot", "--force")
        self.refused("setup", "--renew", "--dir", "bot")
        self.refused("token", "add", "anna", "driver", "--dir", "bot")
        self.refused("token", "remove", "driver", "--dir", "bot")

    def test_a_robot_that_is_served_goes_on_and_stops_and_takes_what_is_written_later(self):
        bot = self.bot
        filler = self.fill()
        with bot.serving("--demo") as serving, bot.subscriber(serving) as reader:
            self.refused("token", "add", "anna", "driver", "--dir", "bot")
            with bot.peer(serving, "peer") as writer:
                publish(writer, range(100))
                self.assertEqual(numbers_until(reader, 99), list(range(100)))
            bot.stop(serving)
            os.unlink(filler)
            ended = run("token", "add", "anna", "driver", "--dir", "bot", cwd=self.disk, code=0)
            serving.line("its roles and identities hold now")
            bot.tokens["anna"] = ended.stdout[0]
            bot.peer(serving, "anna").__exit__()

    @unittest.skipIf(not preloaded, "nothing can be preloaded here")
    def test_a_certificate_that_cannot_be_renewed_is_renewed_when_there_is_room(self):
        bot = self.bot
        bot.renew("--days", "6")
        filler, before = self.fill(), content_of(self.folder)
        with clock() as time, bot.serving("--demo", environment=time.environment) as serving:
            old = shown(serving)
            time.set(4 * day)
            serving.line("could not be renewed: .*No space left on device")
            self.assertEqual(content_of(self.folder), before)
            self.assertEqual(shown(serving), old)
            bot.stop(serving)
            os.unlink(filler)
            time.set(4 * day + 3600)  # it is tried each hour, and when the clock is set
            serving.line("the certificate in .* was renewed")
            until(lambda: shown(serving) != old)

    def test_a_log_that_cannot_be_written_keeps_nobody_waiting(self):
        bot = self.bot
        self.fill()
        for log in (os.path.join(self.disk, "log"), "/dev/full"):
            with open(log, "wb") as unwritable:
                process = subprocess.Popen([ROWE, "serve", "--config", bot.file, "--address", "127.0.0.1",
                                            "--port", "0", "--demo"],
                                           stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                           stderr=unwritable)
            self.addCleanup(process.kill)
            port = int(re.search(rb":(\d+)/", process.stdout.readline())[1])
            there = types.SimpleNamespace(host="127.0.0.1", port=port)
            for _ in range(20):  # each of them is told of
                with bot.subscriber(there):
                    pass
            bot.stop(there)
            process.terminate()
            self.assertEqual(process.wait(timeout=60), 1)  # for nobody has heard what it said
            process.stdout.close()
            self.assertEqual(os.path.getsize(log), 0)


if __name__ == "__main__":
    unittest.main()
