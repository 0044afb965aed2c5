# SPDX-License-Identifier: Apache-2.0
"""Certificates that change while a robot is served: who is connected notices nothing, who comes later sees
the new one, and a wrong file changes nothing."""
import os
import subprocess
import threading
import unittest

import websocket
from program import learns, program, run
from robot import content_of, dropped, publish, replace, restored, robot, shown, topic, until


def until_shown(serving, wanted):
    until(lambda: shown(serving) == wanted)  # it looks each second


class swapped(unittest.TestCase):
    def setUp(self):
        self.bot = self.enterContext(robot())
        self.serving = self.enterContext(self.bot.serving("--demo"))

    def test_again_and_again_under_load_it_loses_nothing(self):
        bot, serving = self.bot, self.serving
        swaps, over = 3, threading.Event()
        sent = 0

        def swap():
            try:
                for _ in range(swaps):
                    until_shown(serving, bot.renew())
            finally:
                over.set()

        swapping = threading.Thread(target=swap)
        with bot.subscriber(serving) as reader, bot.peer(serving, "peer") as writer:
            swapping.start()
            while not over.is_set():
                with bot.peer(serving, "driver") as newcomer:  # under whichever certificate there is
                    publish(newcomer, range(sent, sent + 50))
                    publish(writer, range(sent + 50, sent + 100))
                    got = []
                    while len(got) < 100:
                        got += [reader.receive_until(lambda m: m.get("op") == "publish")["msg"]["n"]]
                self.assertEqual(sorted(got), list(range(sent, sent + 100)))
                self.assertEqual([n for n in got if n < sent + 50], list(range(sent, sent + 50)))
                sent += 100
            swapping.join()
            bot.stop(serving)
            counts = bot.counts(serving)
        self.assertEqual((dropped(counts), counts["stops"]), (0, 1))
        self.assertNotIn("handshake failed", "\n".join(serving.stderr))

    def test_a_broken_one_keeps_the_old_one(self):
        serving = self.serving
        before = self.bot.text("certificate.pem")
        foreign_key = content_of(self.enterContext(robot()).folder)["key.pem"]
        half = before.encode()[:len(before) // 2]
        with restored(self.bot.at("certificate.pem")):
            replace(self.bot.at("certificate.pem"), b"")
            serving.line("new certificate is not used: it holds no certificate in PEM")
            replace(self.bot.at("certificate.pem"), half)
            os.unlink(self.bot.at("certificate.pem"))
            serving.line("new certificate is not used: No such file")
            self.assertEqual(shown(serving), before)
        with restored(self.bot.at("key.pem")):
            replace(self.bot.at("key.pem"), foreign_key)
            serving.line("new certificate is not used: it is not the key of")
            replace(self.bot.at("key.pem"), foreign_key, 0o644)
            serving.line("new certificate is not used: others can read it")
            self.assertEqual(shown(serving), before)
            self.bot.stop(serving)
        until_shown(serving, self.bot.renew())

    def test_a_file_that_is_written_to_bit_by_bit_is_taken_when_it_is_whole(self):
        serving = self.serving
        with restored(self.bot.at("certificate.pem")):
            new = self.bot.renew().encode()
        until_shown(serving, self.bot.text("certificate.pem"))
        with open(self.bot.at("certificate.pem"), "wb", buffering=0) as file:
            file.write(new[:300])
            serving.line("new certificate is not used")
            file.write(new[300:])
        until_shown(serving, new.decode())

    def test_key_and_root_of_another_are_refused_by_who_knows_the_old_ones(self):
        """A certificate that was renewed is the same robot's; one of another root, or another key, is not."""
        bot, serving = self.bot, self.serving
        url = f"wss://127.0.0.1:{serving.port}/"
        public = subprocess.run(["openssl", "pkey", "-in", bot.at("key.pem"), "-pubout", "-outform", "DER"],
                                capture_output=True, check=True, timeout=60).stdout
        pin = subprocess.run(["openssl", "dgst", "-sha256", "-r"], input=public, capture_output=True,
                             check=True, timeout=60).stdout.decode().split()[0]
        pinned = {"ROWE_PIN": pin, "ROWE_TOKEN": bot.tokens["driver"]}
        until_shown(serving, bot.renew())
        for environment in (pinned, bot.who("driver")):  # the same key: nothing has changed for them
            self.assertEqual(run("peers", url, environment=environment).code, 0)
        with program("echo", url, topic, "--json", environment=pinned) as staying:
            staying.line("nobody publishes")
            other = self.enterContext(robot())
            for name in ("key.pem", "certificate.pem"):
                replace(bot.at(name), content_of(other.folder)[name])
            until_shown(serving, other.text("certificate.pem"))
            for environment, why in ((pinned, "not the one that is pinned"),
                                     (bot.who("driver"), "unable to get local issuer certificate")):
                learns(why, "peers", url, environment=environment).expect(3, says=why)
            # Who was connected stays so.
            with websocket.peer(serving.port, secure=other.trust(),
                                headers={"Authorization": f"Bearer {bot.tokens['peer']}"}) as writer:
                publish(writer, [7])
                staying.line('"n": 7', "stdout")


if __name__ == "__main__":
    unittest.main()
