# SPDX-License-Identifier: Apache-2.0
"""Somebody sets the clock of the robot's machine, a day ahead or back, while it is served. Its stop, its
guards, the time to live of its messages and its calls follow the monotonic clock and notice nothing; its
certificate follows the clock of the day."""
import datetime
import ssl
import subprocess
import tempfile
import unittest

from clock import clock
from program import run, undisturbed
from robot import numbers_until, publish, robot, round_trip, shown, until
from websocket import ask_in_time

day = 24 * 60 * 60
steps = (day, -day, 0)  # from the right time


class a_clock_that_is_set(unittest.TestCase):
    def setUp(self):
        self.clock = self.enterContext(clock())
        self.bot = self.enterContext(robot())

    def serving(self, *options):
        return self.bot.serving(*options, environment=self.clock.environment)

    def test_is_what_the_process_reads(self):
        for shift in steps:
            self.clock.set(shift)
            with tempfile.TemporaryDirectory() as folder:
                run("setup", "--name", "x", "--dir", f"{folder}/x",
                    environment=self.clock.environment, code=0)
                said = subprocess.run(["openssl", "x509", "-noout", "-startdate",
                                       "-in", f"{folder}/x/certificate.pem"], stdout=subprocess.PIPE,
                                      check=True, text=True, timeout=60).stdout
            begins = datetime.datetime.strptime(said.strip(), "notBefore=%b %d %H:%M:%S %Y GMT")
            wanted = datetime.datetime.utcnow() + datetime.timedelta(seconds=shift - day)
            self.assertLess(abs(begins - wanted), datetime.timedelta(hours=1))

    @undisturbed
    def test_lets_a_guarded_robot_move_on_and_stop_as_before(self):
        bot = self.bot
        with self.serving("--demo", "--stop-guard-timeout", "30 s", "--stop-tick", "100 ms") as serving:
            serving.line("the robot drives unguarded")
            with bot.peer(serving, "supervisor") as guard:
                self.assertIsNone(ask_in_time(guard, "/rowe/stop/guard", guard="desk")["refused"])
                for shift in steps:
                    self.clock.set(shift)
                    for _ in range(3):
                        tick = guard.call("/rowe/stop/state")["values"]["tick"]
                        guard.call("/rowe/stop/guard", guard="desk", tick=tick)
                    self.assertEqual(guard.call("/rowe/stop/state")["values"]["state"], "running", shift)
                self.clock.set(-day)
                number = bot.stop(serving)["number"]
                for shift in steps:
                    self.clock.set(shift)
                    state = guard.call("/rowe/stop/state")["values"]
                    self.assertEqual((state["state"], state["number"]), ("stopped", number))
                    self.assertLess(state["since_ms"], 60_000)
                guard.call("/rowe/stop/guard", guard="desk", resign=True)
                self.assertIsNone(ask_in_time(guard, "/rowe/stop/reset", number=number)["refused"])

    def test_ends_no_message_no_call_and_no_connection(self):
        bot = self.bot
        with self.serving("--inbound-ttl", "30 s") as serving, bot.peer(serving, "peer") as provider, \
                bot.subscriber(serving) as reader, bot.peer(serving, "peer") as writer:
            provider.send({"op": "advertise_service", "service": "/late", "type": "t/T"})
            round_trip(provider)
            for at, shift in enumerate(steps):
                writer.send({"op": "call_service", "id": "c", "service": "/late", "timeout": 30})
                call = provider.called()
                self.clock.set(shift)
                publish(writer, range(100 * at, 100 * at + 100))
                numbers = numbers_until(reader, 100 * at + 99)
                self.assertEqual(numbers, list(range(100 * at, 100 * at + 100)))
                provider.answer(call, {"shift": shift})
                answer = writer.receive_until(lambda m: m["op"] == "service_response")
                self.assertEqual((answer["result"], answer["values"]), (True, {"shift": shift}))
            counts = serving.summary()
        for name in ("expired", "inbound_expired", "calls_timed_out", "silent_peers", "stalled_peers",
                     "outbox_full", "lost_with_peer", "unfinished_messages"):
            self.assertEqual(counts[name], 0, name)
        self.assertNotIn("renewed", "\n".join(serving.stderr))  # 397 days are no matter of one day

    def test_is_told_of_a_certificate_that_ends_and_renews_it(self):
        """Six days, renewed in the last third: a day ahead it is not due, four days ahead it is."""
        bot = self.bot
        bot.renew("--days", "6")
        with self.serving() as serving:
            before = shown(serving)
            serving.line("the certificate ends in 5 days")
            self.clock.set(day)
            serving.line("the certificate ends in 4 days")
            self.assertEqual(bot.text("certificate.pem"), before)
            self.clock.set(4 * day)
            serving.line("the certificate in .* was renewed")
            until(lambda: shown(serving) != before)
            # Back in the right time nobody would take it: it begins in three days.
            self.clock.set(0)
            serving.line("the certificate in .* was renewed", count=2)
            until(lambda: self.is_trusted(serving))

    def test_a_day_ahead_or_back_makes_no_certificate_that_a_client_refuses(self):
        bot = self.bot
        with self.serving() as serving:
            for shift in steps:
                self.clock.set(shift)
                bot.renew(environment=self.clock.environment)
                until(lambda: shown(serving) == bot.text("certificate.pem"))
                self.assertTrue(self.is_trusted(serving))

    def is_trusted(self, serving):
        """By a client that has the right time."""
        try:
            self.bot.peer(serving, "driver").__exit__()
        except ssl.SSLCertVerificationError:
            return False
        return True


if __name__ == "__main__":
    unittest.main()
