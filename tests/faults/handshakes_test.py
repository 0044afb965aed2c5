# SPDX-License-Identifier: Apache-2.0
"""A thousand who begin a TLS handshake and do not end it, each at another step, while somebody stops the
robot: they get no more than the places there are for handshakes, and each that loses one is counted."""
import contextlib
import os
import resource
import socket
import ssl
import threading
import unittest

from robot import robot
from websocket import closed

crowd = 1000
places = 32  # handshakes_max


def hello(bot):
    """A whole one, as a client would send it."""
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = bot.trust().wrap_bio(incoming, outgoing, server_hostname="127.0.0.1")
    with contextlib.suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return outgoing.read()


class half_done(unittest.TestCase):
    def setUp(self):
        before = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = min(crowd + 200, before[1])
        self.crowd = wanted - 200
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, before)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(wanted, before[0]), before[1]))
        self.bot = self.enterContext(robot())
        self.serving = self.enterContext(self.bot.serving("--demo", "--limit", f"handshakes_max={places}"))
        self.held = self.enterContext(contextlib.ExitStack())
        self.whole = hello(self.bot)

    def begin(self, step, address="127.0.0.1"):
        """A newcomer that goes so far and no further."""
        stream = self.held.enter_context(socket.create_connection(("127.0.0.1", self.serving.port),
                                                                  source_address=(address, 0)))
        stream.sendall((b"", self.whole[:3], self.whole[:-1], self.whole)[step])

    @contextlib.contextmanager
    def flood(self, steps, address="127.0.0.1"):
        """Newcomers without end. Gives the list of how many there were so far."""
        begun, over = [0], threading.Event()

        def send():
            while not over.is_set():
                with contextlib.suppress(OSError):
                    self.begin(steps[begun[0] % len(steps)], address)
                begun[0] += 1
                if begun[0] % self.crowd == 0:
                    self.held.close()

        flooding = threading.Thread(target=send)
        flooding.start()
        try:
            yield begun
        finally:
            over.set()
            flooding.join()

    def shake(self, request):
        """One that ends its handshake, and begins a request at most."""
        stream = socket.create_connection(("127.0.0.1", self.serving.port))
        self.held.enter_context(stream)
        with contextlib.suppress(OSError):  # it lost its place to one of the others
            secured = self.bot.trust().wrap_socket(stream, server_hostname="127.0.0.1")
            self.held.enter_context(secured)
            secured.sendall(request)

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.serving.process.pid}/fd"))

    def test_keep_nobody_from_stopping_it(self):
        before = self.descriptors()
        for number in range(self.crowd):
            if number % 20 == 19:
                self.shake((b"", b"GET /rowe/stop HTTP/1.1\r\nHost: ")[number // 20 % 2])
            else:
                self.begin(number % 4)
            # Behind its handshake, a connection has a pair of sockets besides, to the reader of its request.
            self.assertLessEqual(self.descriptors(), before + 3 * places)
        for _ in range(10):
            self.bot.stop(self.serving)
        counts = self.bot.counts(self.serving)
        self.assertEqual(counts["stops"], 10)
        # On a starved machine the time of some is over before it is their turn to make way. Of those that
        # have ended their handshake, that is not counted as a failure of TLS.
        late = sum(counts[f"tls_handshakes_failed {reason}"] for reason in ("silent", "timeout"))
        uncounted = self.crowd // 20 if late else 0
        self.assertGreaterEqual(counts["handshakes_evicted"] + late, self.crowd - places - 2 - uncounted)

    def test_keep_nobody_from_stopping_it_who_comes_among_them(self):
        stopped, lost = 0, 0
        with self.flood(range(4)) as begun:
            while begun[0] < self.crowd // 2 or stopped < 20:
                try:
                    self.bot.stop(self.serving)
                    stopped += 1
                except (OSError, closed):  # its place went to a newer one before its request was there
                    lost += 1
        self.assertLess(lost, stopped)  # or one would hardly come through
        self.assertEqual(self.bot.counts(self.serving)["stops"], stopped)

    def test_keep_nobody_of_another_address_from_stopping_it_however_costly_they_are(self):
        stopped = 0
        with self.flood([3], "127.0.0.2") as begun:
            while begun[0] < self.crowd or stopped < 20:
                self.bot.stop(self.serving)
                stopped += 1
        self.assertEqual(self.bot.counts(self.serving)["stops"], stopped)


if __name__ == "__main__":
    unittest.main()
