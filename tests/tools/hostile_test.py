# SPDX-License-Identifier: Apache-2.0
"""The hub against HTTP clients that do not read. tests/conformance has the peers that are too many, too large
or too slow, or break a rule of RFC 6455 or of HTTP."""
import contextlib
import socket
import unittest

from program import hub
from websocket import get, peer, request


class scrapers(unittest.TestCase):
    def test_that_do_not_read_keep_nobody_from_stopping_or_asking(self):
        with hub("--demo") as serving, contextlib.ExitStack() as held:
            for _ in range(200):
                stream = held.enter_context(socket.socket())
                stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
                stream.connect(("127.0.0.1", serving.port))
                stream.sendall(request("GET", "/metrics", {"Host": f"127.0.0.1:{serving.port}"}))
            with peer(serving.port, path="/rowe/stop") as p:
                answer = p.call("/rowe/stop")
                self.assertEqual((answer["id"], answer["result"]), ("now", True))
            status, headers, body = get(serving.port, "/metrics")
            self.assertEqual((status, headers["cache-control"]), (200, "no-store"))
            self.assertIn(b"\nrowe_stopped 1\n", body)


if __name__ == "__main__":
    unittest.main()
