# SPDX-License-Identifier: Apache-2.0
"""Plain messages: `rowe echo --plain`, and the programs that send back what they receive."""
import contextlib
import json
import os
import signal
import subprocess
import unittest

from program import ROWE, given_time, program, run
from websocket import CLOSE, closed, listener, peer


def beside(name):
    """The program that was built beside the one under test."""
    return (os.path.join(os.path.dirname(ROWE), name),)


class echoing(unittest.TestCase):
    def setUp(self):
        self.there = self.enterContext(listener())

    def test_prints_plain_messages(self):
        for how, lines in ((("--json",), ['{"a":1.50}', '{"b":[1,2]}']),
                           ((), ["a: 1.50", "---", "b: [1, 2]", "---"]),
                           (("--csv", "--field", "a", "-n", "1"), ["a", "1.50"])):
            count = ("-n", "2") if "-n" not in how else ()
            with program("echo", self.there.url, "--plain", *how, *count) as echo, self.there.accept() as p:
                p.send_text('{"a":1.50}')
                p.send_text('{"b":[1,2]}')
                self.assertEqual((echo.end(), echo.stdout, echo.stderr), (0, lines, []), how)

    def test_prints_calls_and_refuses_them(self):
        with program("echo", self.there.url, "--plain", "--json", "--once") as echo, self.there.accept() as p:
            # It takes calls before its lane is open, and then knows nobody who answers (docs/roadmap.md).
            for _ in range(1000):
                p.send({"service": "x", "message_id": "m7"})
                answer = p.receive()
                if "does not exist" not in answer["error"]["text"]:
                    break
            self.assertEqual(answer["in_reply_to"], "m7")
            self.assertIn("only listens", answer["error"]["text"])
            self.assertEqual(echo.end(), 0)
            self.assertEqual(json.loads(echo.stdout[0])["service"], "x")

    def test_asks_for_nothing(self):
        def listens(time):
            with listener() as there, program("echo", there.url, "--plain", "--timeout", time) as echo:
                with contextlib.suppress(closed), there.accept() as p:  # closed: it has given up already
                    echo.code = echo.end()
                    with self.assertRaises(closed):
                        p.receive()
                echo.code = echo.end()
            return echo

        echo = given_time(listens, lambda echo: echo.code != 3)
        echo.expect(4, stdout=[], ends=r"no plain message within \d+\.\d{3} s")

    def test_takes_no_topics_and_no_contradictions(self):
        for words, says in ((("/t", "--plain"), "one argument too many: '/t'"),
                            (("--csv", "--json", "/t"), "exclude"),
                            (("/t", "/u", "--csv"), "a table of one topic, not of 2"),
                            ([f"/{i}" for i in range(17)], "17 topics are too many: at most 16")):
            run("echo", self.there.url, *words, code=2, stdout=[], first=says)

    def test_a_field_that_is_missing_is_named(self):
        with (program("echo", self.there.url, "--plain", "--field", "pose.y") as echo,
              self.there.accept() as p):
            p.send_text('{"pose":{"x":1}}')
            self.assertEqual((echo.end(), echo.stdout), (1, []))
            self.assertIn('the member "pose.y" is missing', echo.stderr[-1])


class sending_back(unittest.TestCase):
    """Both programs have to behave alike; `client` is the other side of one connection."""

    def check(self, client):
        for text in ('{"a":1.50}', '{"text":"ä\\n"}', '{"x":"' + "x" * 50000 + '"}', "{}"):
            client.send_text(text)
            self.assertEqual(client.receive_text(), text)
        for i in range(100):
            client.send({"i": i})
        self.assertEqual([client.receive()["i"] for _ in range(100)], list(range(100)))
        client.send({"service": "x", "a": {"b": 1}, "message_id": 7})
        self.assertEqual(client.receive(), {"service": "x", "a": {"b": 1}, "in_reply_to": 7})
        client.send_text("no JSON")
        if client.masks:  # servers complain, clients do not
            self.assertIn("error", client.receive())
        client.send_text('{"still":"there"}')
        self.assertEqual(client.receive_text(), '{"still":"there"}')

    @contextlib.contextmanager
    def server(self, *arguments):
        with program("--port", "0", *arguments, command=beside("rowe_echo")) as echo:
            port = int(echo.line(r"^rowe_echo listens on ws://127\.0\.0\.1:(\d+)/$", "stdout")[1])
            yield echo, port
            self.assertEqual(echo.end(signal.SIGINT), 0)
            self.assertEqual(len(echo.stdout), 1)

    def test_as_a_server(self):
        with self.server() as (echo, port):
            with peer(port) as one, peer(port) as other:
                self.check(one)
                self.check(other)
            echo.line("connected", count=2)

    def test_as_a_server_answers_the_program_s_own_calls(self):
        with self.server("--quiet") as (echo, port):
            ended = run("call", f"127.0.0.1:{port}", "/x", '{"a":1}', "--plain")
            self.assertEqual((ended.code, ended.stdout), (0, ['{"service":"/x","a":1}']), ended.stderr)
            self.assertEqual(run("call", f"127.0.0.1:{port}", "/x", "--repeat", "100").code, 0)
            with program("pub", f"127.0.0.1:{port}", "--plain", "-", stdin=subprocess.PIPE) as pub:
                pub.process.stdin.write(b'{"a":1}\n' * 1000)
                pub.process.stdin.close()
                self.assertEqual(pub.end(), 0, pub.stderr)
            self.assertEqual(echo.stderr, [])

    def test_as_a_client(self):
        with listener() as there:
            with program(there.url, command=beside("rowe_echo_client")) as echo:
                for _ in range(2):  # it comes back
                    with there.accept() as p:
                        self.check(p)
                self.assertEqual(echo.end(signal.SIGINT), 0)
        with listener() as there:  # to which the one before has not come a third time
            with program(there.url + "case?n=1", "--once", command=beside("rowe_echo_client")) as echo:
                with there.accept() as p:
                    self.assertEqual(p.path, "/case?n=1")
                    self.check(p)
                    p.send_frame(CLOSE, b"\x03\xe8")
                    self.assertEqual(p.wait_for_close(), 1000)
                    self.assertEqual(echo.end(), 0)

    def test_says_how_it_is_used(self):
        for name in ("rowe_echo", "rowe_echo_client"):
            helped = run("--help", command=beside(name), code=0, stderr=[])
            self.assertIn(f"usage: {name} [options]", "\n".join(helped.stdout))
            run("--prot", "1", command=beside(name), code=2, first=f"{name}: unknown option '--prot'")
        run("--listen", "0.0.0.0", command=beside("rowe_echo"), code=2)
        run("127.0.0.1:1", "--timeout", "200ms", command=beside("rowe_echo_client"), code=3)


if __name__ == "__main__":
    unittest.main()
