# SPDX-License-Identifier: Apache-2.0
"""The program as a user runs it, and packets through it. Times are bounded from below only."""
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

import link
import bad_network
import direction

impair = [sys.executable, os.path.join(bad_network.here, "impair")]
packets = 100  # fewer than a device or a socket holds until they are read
seconds_max = 30  # far above what anything here takes


def run(*arguments, before=()):
    return subprocess.run([*before, *impair, *arguments], stdin=subprocess.PIPE, capture_output=True,
                          text=True, timeout=seconds_max, check=False)


def udp(side):
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.settimeout(seconds_max)
    s.bind((link.address[side], 7000))
    return s


def send(s, numbers, to="b"):
    for number in numbers:
        s.sendto(str(number).encode(), (link.address[to], 7000))


def receive(s, count):
    return [int(s.recv(100)) for _ in range(count)]


class arguments(unittest.TestCase):
    def test_help_shows_what_to_type(self):
        said = run("--help")
        self.assertEqual((said.returncode, said.stderr), (0, ""))
        for words in ("usage: impair", "ip netns exec impair-a", *direction.settings().__dict__):
            self.assertIn(words, said.stdout)

    def test_wrong_ones_are_refused_by_name(self):
        for words, wanted in ((("loos=3%",), "no setting loos"), (("loss",), "a setting is NAME=VALUE"),
                              (("ac.loss=3%",), "ab or ba"), (("--fast",), "no option --fast"),
                              (("--seed", "x"), "--seed needs a number"),
                              (("--name",), "--name needs a name")):
            said = run(*words)
            self.assertEqual((said.returncode, said.stdout), (2, ""))
            self.assertIn(wanted, said.stderr)


why_not = bad_network.why_not() if __name__ == "__main__" else ""


@unittest.skipIf(why_not, why_not)
class refusals(unittest.TestCase):
    def test_without_the_privileges_it_says_which(self):
        said = run(before=["setpriv", "--bounding-set", "-net_admin,-sys_admin"])
        self.assertEqual((said.returncode, said.stdout), (1, ""))
        self.assertRegex(said.stderr, "may not create network namespaces .*CAP_NET_ADMIN")

    def test_without_tun_devices_it_says_so(self):
        said = run(before=["unshare", "-m", "sh", "-c", 'mount -t tmpfs none /dev/net && exec "$0" "$@"'])
        self.assertEqual((said.returncode, said.stdout), (1, ""))
        self.assertIn("/dev/net/tun: No such file", said.stderr)

    def test_a_second_one_of_its_name(self):
        with bad_network.network() as first:
            said = run("--name", first.name)
            self.assertEqual(said.returncode, 1)
            self.assertIn("exists", said.stderr)
            self.assertIn("loss=1%", first.tell("loss=1%"))  # it left the first one's alone


@unittest.skipIf(why_not, why_not)
class endings(unittest.TestCase):
    def ends(self, how):
        between = bad_network.network()
        self.assertTrue(os.path.exists(f"/run/netns/{between.namespace('a')}"))
        how(between.process)
        said, _ = between.process.communicate(timeout=seconds_max)
        self.assertEqual(between.process.returncode, 0)
        self.assertTrue(said.startswith("ab 0 packets"), said)
        for side in link.sides:
            self.assertFalse(os.path.exists(f"/run/netns/{between.namespace(side)}"))

    def test_removes_what_it_made(self):
        self.ends(lambda one: one.send_signal(signal.SIGTERM))
        self.ends(lambda one: one.send_signal(signal.SIGINT))
        self.ends(lambda _: None)  # its input ends
        self.ends(lambda one: print("quit", file=one.stdin, flush=True))

    def test_removes_half_of_it_when_it_is_ended_while_it_makes_it(self):
        for after in range(0, 100, 5):  # ms; the set-up takes some 50
            one = subprocess.Popen([*impair, "--name", f"half{os.getpid()}"], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            threading.Timer(after / 1000, one.terminate).start()
            one.wait(timeout=seconds_max)
            one.communicate()
            left = os.listdir("/run/netns") if os.path.exists("/run/netns") else []
            self.assertEqual([name for name in left if name.startswith(f"half{os.getpid()}")], [])


@unittest.skipIf(why_not, why_not)
class packets_through_it(unittest.TestCase):
    def setUp(self):
        self.between = self.enterContext(bad_network.network(seed=7))
        self.end = {side: self.between.call(side, udp, side) for side in link.sides}
        for one in self.end.values():
            self.addCleanup(one.close)

    def send_all(self):
        """From a to b; returns when it is decided which arrive, and when."""
        send(self.end["a"], range(packets), "b")
        while not self.between.tell("counts").startswith(f"ab {packets} packets"):
            pass

    def test_take_the_delay_both_ways(self):
        for settings, least in (("delay=5ms", 0.010), ("ab.delay=30ms", 0.035), ("ba.delay=30ms", 0.060)):
            self.between.tell(settings)
            begin = time.monotonic()
            send(self.end["a"], [1], "b")
            receive(self.end["b"], 1)
            send(self.end["b"], [2], "a")
            receive(self.end["a"], 1)
            self.assertGreaterEqual(time.monotonic() - begin, least)

    def test_leave_when_the_seed_says(self):
        expected = direction.direction("7 a")
        for setting in ("loss=20%", "duplicate=10%"):
            self.between.tell("ab." + setting)
            expected.settings.set(*setting.split("="))
        self.send_all()
        expected = [number for number in range(packets) for _ in expected.take(0, 100)]
        self.assertNotEqual(expected, list(range(packets)))
        self.between.tell("ab.loss=0% ab.duplicate=0%")
        send(self.end["a"], [packets])  # all that arrives has come before this one
        self.assertEqual(receive(self.end["b"], len(expected) + 1), [*expected, packets])

    def test_do_not_arrive_through_a_black_hole_and_the_other_way_they_do(self):
        self.between.tell("ab.black_hole=on")
        self.send_all()
        send(self.end["b"], range(packets), "a")
        self.assertEqual(receive(self.end["a"], packets), list(range(packets)))
        self.assertIn(f" {packets} swallowed", self.between.tell("counts").split(";")[0])
        self.between.tell("black_hole=off")
        send(self.end["a"], [packets], "b")
        self.assertEqual(receive(self.end["b"], 1), [packets])

    def test_are_overtaken_when_they_are_reordered(self):
        self.between.tell("ab.reorder=10% ab.reorder_by=20ms")
        self.send_all()
        got = receive(self.end["b"], packets)
        self.assertEqual(sorted(got), list(range(packets)))
        self.assertNotEqual(got, sorted(got))

    def test_a_wrong_setting_is_answered_and_changes_nothing(self):
        self.assertRegex(self.between.tell("delay=fast"), "error: .*wanted a time")
        self.assertEqual(self.between.tell("show"), "ab perfect; ba perfect")


if __name__ == "__main__":
    watchdog = threading.Timer(100, os._exit, [1])
    watchdog.daemon = True
    watchdog.start()
    unittest.main()
