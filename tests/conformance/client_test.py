# SPDX-License-Identifier: Apache-2.0
"""The client's role: RFC 6455 sections 4.1, 5, 7 and 8.1, played to `transport_echo --connect` and to
`rowe echo` by a server that misbehaves."""
import base64
import contextlib
import json
import ssl
import time
import unittest

import cases
import programs
from frames import BINARY, CLOSE, CONTINUATION, PING, PONG, TEXT, close_body, cut, frame, wrong
from programs import accept_of, fields_of, listener, program, switching
from server_test import ways_to_send

at_a_time = 4  # clients that run for one case
hubs_at_a_time = 8  # clients that come again, after a quarter of a second


def transport_echo(url, *options):
    trusting = ["--ca", f"{programs.TLS}/ca.pem"] if programs.TLS else []
    return program(programs.ECHO, "--connect", url, *options, *trusting)


@contextlib.contextmanager
def rowe_echo():
    """`rowe echo`, which comes again whatever one does to it: a place to await it, and the program."""
    with listener() as here, program(programs.ROWE, "echo", here.url, "/t", "--json") as running:
        running.ends_with = (0, 130)  # with a message, and without
        here.program = running
        yield here


def finish(test, running, s, exit_code=0):
    """The client has closed, and waits for us; then it is over."""
    s.until_end()
    s.socket.close()
    test.assertEqual(running.wait(), exit_code)


def check_keys(s):
    """10.3: no key is like the others."""
    if len(s.keys) > 1 and len(set(s.keys)) < len(s.keys) / 2:
        raise wrong(f"5.3: masks are repeated: {s.keys[:4]}")


class endings(unittest.TestCase):
    """After each of these the client says why in a Close frame, and its side of the stream ends."""

    def test_the_echo(self):
        jobs = [(f"{one.section}: {one.name}, {how}",
                 lambda here, one=one, way=way: self.echo(here, one, way))
                for one in cases.endings() for how, way in ways_to_send(one)
                if way == "send" or one.section != "8.1"]
        programs.in_parallel(jobs, at_a_time, listener)
        print(f"client role, echo: {len(jobs)} endings", flush=True)

    def echo(self, here, one, way):
        with transport_echo(here.url) as running:
            s = here.open()
            s.send_what_it_takes(way, *one.script)
            before, code, _ = s.until_close()
            self.assertEqual(before, list(one.replies))
            self.assertIn(code, one.codes())
            finish(self, running, s)
            check_keys(s)

    def test_the_subscriber(self):
        jobs = [(f"{one.section}: {one.name}", lambda here, one=one: self.subscriber(here, one))
                for one in cases.endings() if one.section != "8.1" or len(one.script) == 1]
        programs.in_parallel(jobs, hubs_at_a_time, rowe_echo)
        print(f"client role, rowe echo: {len(jobs)} endings", flush=True)

    def subscriber(self, here, one):
        with here.open() as s:
            s.send_what_it_takes("send", *one.script)
            before, code, _ = s.until_close()
            self.assertEqual([event for event in before if event[0] not in (TEXT, PING)],
                             [reply for reply in one.replies if reply[0] == PONG])
            self.assertIn(code, one.codes())
            s.until_end()
            check_keys(s)


class echoes(unittest.TestCase):
    def test_what_an_echo_sends_back(self):
        jobs = [(f"{one.section}: {one.name}", lambda here, one=one: self.goes_on(here, one))
                for one in cases.echoes()]
        programs.in_parallel(jobs, at_a_time, listener)
        print(f"client role, echo: {len(jobs)} echoes", flush=True)

    def goes_on(self, here, one):
        with transport_echo(here.url) as running:
            s = here.open()
            s.send(*one.script)
            for reply in one.replies:
                self.assertEqual(s.event(), reply)
            self.closes_well(running, s)

    def closes_well(self, running, s):
        s.send(frame(PING, b"alive?"), frame(CLOSE, close_body(1000, b"done")))
        self.assertEqual(s.until_close()[:2], ([(PONG, b"alive?")], 1000))
        finish(self, running, s)
        check_keys(s)

    def test_16_mib(self):  # 5.2, 10.4
        size = 1 << 24
        payload = bytes(range(256)) * (size // 256)
        for script in ([frame(BINARY, payload)], cut(BINARY, payload, [4096] * (size // 4096 - 1))):
            with listener() as here, transport_echo(here.url) as running:
                s = here.open()
                s.send(*script)
                self.assertTrue(s.event() == (BINARY, payload))
                self.closes_well(running, s)
        with listener() as here, transport_echo(here.url) as running:
            s = here.open()
            s.send(frame(BINARY, b"x", fin=False), frame(CONTINUATION, length=size, length_bytes=8))
            self.assertEqual(s.until_close()[:2], ([], 1009))
            finish(self, running, s)

    def test_every_shape_of_a_message_reaches_a_subscriber(self):
        count = 0
        with rowe_echo() as here, here.open() as s:
            subscribe = json.loads(s.event()[1])
            self.assertEqual((subscribe["op"], subscribe["topic"]), ("subscribe", "/t"))
            for name, way, script, body in cases.published():
                with self.subTest(name):
                    getattr(s, way)(*script)
                    self.assertEqual(json.loads(here.program.line()), body)
                    count += 1
            s.send(frame(CLOSE, close_body(1000)))
            s.until_close()
        print(f"client role, rowe echo: {count} messages", flush=True)

    def test_a_message_beyond_the_limit_is_refused_by_its_length(self):  # 10.4
        with rowe_echo() as here:
            for script in ([frame(TEXT, length=(1 << 20) + 1)],
                           [frame(TEXT, b" " * 60000, fin=False), frame(CONTINUATION, length=1_000_000)]):
                with here.open() as s:
                    s.send(*script)
                    self.assertEqual(s.until_close()[1], 1009)
                    s.until_end()

    def test_frames_may_come_right_behind_the_answer(self):  # 4.1
        early = frame(PING, b"early").to_bytes(False)
        for behind in (early, early + frame(TEXT, b"{}").to_bytes(False), early * 100):
            with self.subTest(len(behind)), listener() as here, transport_echo(here.url) as running:
                s = here.open(behind)
                self.assertEqual(s.event(), (PONG, b"early"))
                s.send(frame(CLOSE))
                s.until_close()
                finish(self, running, s)

    def test_a_stream_that_ends_without_a_word(self):  # 7.1.5
        for last in (b"", b"\x81", b"\x81\x7e\x01", b"\x81\x05ab"):
            with self.subTest(last), listener() as here, transport_echo(here.url) as running:
                s = here.open(last)
                s.socket.close()
                self.assertEqual(running.wait(), 0)

    def test_a_server_that_does_not_close_is_left_after_a_second(self):  # 7.1.1
        begin = time.monotonic()
        with listener() as here, transport_echo(here.url) as running, here.open() as s:
            s.send(frame(CLOSE))
            s.until_close()
            self.assertEqual(running.wait(), 0)  # although we hold the stream open
        self.assertGreater(time.monotonic() - begin, 0.9)


# Answers that open a connection: name -> the answer to a request.
good_answers = {
    "as it should be": switching,
    "Upgrade in capitals": lambda r: switching(r, Upgrade="WebSocket"),
    "Connection in small letters": lambda r: switching(r, Connection="upgrade"),
    "Connection as a list": lambda r: switching(r, Connection="keep-alive, Upgrade"),
    "a subprotocol in a field of Hop's own": lambda r: switching(r, "WebSocket-Protocol: foo"),
    "other fields besides": lambda r: switching(r, "Server: x/1", "Date: today", "X-A: b", "X-A: c"),
    "no blanks behind the colons": lambda r: switching(r).replace(b": ", b":"),
    "fields in small letters": lambda r: b"\r\n".join(
        line if number == 0 else line.partition(b":")[0].lower() + b":" + line.partition(b":")[2]
        for number, line in enumerate(switching(r)[:-4].split(b"\r\n"))) + b"\r\n\r\n",
    "another reason": lambda r: switching(r).replace(b"Switching Protocols", b"Web Socket Handshake"),
    "3000 bytes of fields": lambda r: switching(r, "X-Long: " + "x" * 3000),
}


def tampered(header, change):
    """switching() with one value changed by a function."""
    return lambda r: switching(r, **{header: change(r)})


def key_of(request):
    return fields_of(request[1:])["sec-websocket-key"]


def status(line, *fields):
    return lambda r: "\r\n".join([line, *fields, "Content-Length: 0", "", ""]).encode()


# Answers that must not: RFC 6455 4.1, the list of what a client checks.
bad_answers = {
    "1: status 100, and nothing else": status("HTTP/1.1 100 Continue"),
    "1: status 200": status("HTTP/1.1 200 OK"),
    "1: status 200 with all fields of a 101": lambda r: switching(r).replace(b"101 Switching", b"200"),
    "1: status 201 with all fields of a 101": lambda r: switching(r).replace(b"101", b"201"),
    "1: a redirect": status("HTTP/1.1 302 Found", "Location: ws://127.0.0.1:1/"),
    "1: a redirect for ever": status("HTTP/1.1 308 Permanent Redirect", "Location: /elsewhere"),
    "1: status 400": status("HTTP/1.1 400 Bad Request"),
    "1: status 401": status("HTTP/1.1 401 Unauthorized", 'WWW-Authenticate: Basic realm="x"'),
    "1: status 403": status("HTTP/1.1 403 Forbidden"),
    "1: status 404": status("HTTP/1.1 404 Not Found"),
    "1: status 426": status("HTTP/1.1 426 Upgrade Required", "Sec-WebSocket-Version: 14"),
    "1: status 500": status("HTTP/1.1 500 Internal Server Error"),
    "1: status 503": status("HTTP/1.1 503 Service Unavailable", "Retry-After: 1"),
    "1: a status of four digits": lambda r: switching(r).replace(b"101", b"1010"),
    "1: no status": lambda r: switching(r).replace(b" 101 Switching Protocols", b""),
    "2: no Upgrade": lambda r: switching(r, Upgrade=None),
    "2: an empty Upgrade": lambda r: switching(r, Upgrade=""),
    "2: Upgrade to something else": lambda r: switching(r, Upgrade="h2c"),
    "2: Upgrade to websockets": lambda r: switching(r, Upgrade="websockets"),
    "3: no Connection": lambda r: switching(r, Connection=None),
    "3: Connection: close": lambda r: switching(r, Connection="close"),
    "3: Connection: keep-alive": lambda r: switching(r, Connection="keep-alive"),
    "3: Connection: Upgraded": lambda r: switching(r, Connection="Upgraded"),
    "4: no Accept": lambda r: switching(r, Sec_WebSocket_Accept=None),
    "4: an empty Accept": lambda r: switching(r, Sec_WebSocket_Accept=""),
    "4: the Accept of another key": lambda r: switching(r, Sec_WebSocket_Accept=accept_of("AAAA")),
    "4: the key as Accept": tampered("Sec_WebSocket_Accept", key_of),
    "4: Accept in the other letters": tampered("Sec_WebSocket_Accept",
                                               lambda r: accept_of(key_of(r)).swapcase()),
    "4: Accept cut short": tampered("Sec_WebSocket_Accept", lambda r: accept_of(key_of(r))[:-1]),
    "4: Accept and more": tampered("Sec_WebSocket_Accept", lambda r: accept_of(key_of(r)) + "A"),
    "4: two Accepts, the second one right": lambda r: switching(r).replace(
        b"\r\n", b"\r\nSec-WebSocket-Accept: AAAAAAAAAAAAAAAAAAAAAAAAAAA=\r\n", 1),
    "4: two Accepts, the first one right": lambda r: switching(r, f"Sec-WebSocket-Accept: {accept_of('x')}"),
    "2: Upgrade to two things": lambda r: switching(r, Upgrade="websocket, h2c"),
    "2: two Upgrades": lambda r: switching(r, "Upgrade: websocket"),
    "5: an extension that was not offered": lambda r: switching(
        r, "Sec-WebSocket-Extensions: permessage-deflate"),
    "5: an extension nobody knows": lambda r: switching(r, "Sec-WebSocket-Extensions: x-none"),
    "6: a subprotocol that was not offered": lambda r: switching(r, "Sec-WebSocket-Protocol: chat"),
    "a folded field": lambda r: switching(r, "X: a\r\n b"),
    "a field with a bare line feed": lambda r: switching(r, "X: a\n"),
    "a field with a blank before its colon": lambda r: switching(r, "X : a"),
    "a field without colon": lambda r: switching(r, "no colon"),
    "a field with a control character": lambda r: switching(r, "X: \x01"),
    "a header of more than 4096 bytes": lambda r: switching(r, "X-Long: " + "x" * 4200),
    "a header without end": lambda r: switching(r)[:-2] + b"X-Long: " + b"x" * 100000,
    "another protocol's greeting": lambda r: b"SSH-2.0-OpenSSH_9.2\r\n\r\n",
    "a mail server's greeting": lambda r: b"220 mail ESMTP\r\n\r\n",
    "bytes": lambda r: bytes(range(256)) * 20,
    "HTTP/1.0": lambda r: switching(r).replace(b"HTTP/1.1", b"HTTP/1.0"),
    "HTTP/2": lambda r: switching(r).replace(b"HTTP/1.1", b"HTTP/2"),
    "nothing": lambda r: b"",
    "half a line": lambda r: b"HTTP/1.1 10",
    "half a header": lambda r: switching(r)[:-10],
}
# Those after which the next answer may be another: the server is busy, or was cut off.
may_pass = ("1: status 100, and nothing else", "1: status 500", "1: status 503", "nothing", "half a line",
            "half a header")


class handshakes(unittest.TestCase):
    def test_what_a_client_accepts(self):
        for name, answer in good_answers.items():
            for how in ("sendall", "bytewise"):
                with self.subTest(f"4.1: {name}, {how}"), listener() as here:
                    with transport_echo(here.url) as running:
                        s, request = here.accept()
                        step = 1 if how == "bytewise" else 1 << 20
                        data = answer(request)
                        for at in range(0, len(data), step):
                            s.sendall(data[at:at + step])
                        peer = programs.frames.stream(s, peer_masks=True)
                        peer.send(frame(PING, b"?"), frame(CLOSE))
                        self.assertEqual(peer.until_close()[0], [(PONG, b"?")])
                        finish(self, running, peer)

    def test_what_a_client_refuses(self):
        jobs = [(f"4.1.{name}", lambda here, answer=answer: self.refuses(here, answer))
                for name, answer in bad_answers.items()]
        programs.in_parallel(jobs, at_a_time, listener)
        print(f"client role, echo: {len(jobs)} answers refused", flush=True)

    def refuses(self, here, answer, *options):
        with transport_echo(here.url, *options) as running:
            s, request = here.accept()
            self.no_frame_comes(s, answer(request))
            self.assertEqual(running.wait(), 1)
            self.assertTrue(running.errors)

    def no_frame_comes(self, s, data):
        with s:
            with contextlib.suppress(OSError):  # it left before we were done
                s.sendall(data)
                programs.half_close(s)
            with contextlib.suppress(ConnectionResetError, ssl.SSLError):
                self.assertEqual(s.recv(100), b"")

    def test_what_a_subscriber_refuses(self):
        jobs = [(f"4.1.{name}", lambda here, name=name: self.comes_again(here, bad_answers[name]))
                for name in may_pass]
        programs.in_parallel(jobs, hubs_at_a_time, rowe_echo)
        jobs = [(f"4.1.{name}", lambda here, answer=answer: self.gives_up(here, answer))
                for name, answer in bad_answers.items() if name not in may_pass]
        programs.in_parallel(jobs, at_a_time, contextlib.nullcontext)
        print(f"client role, rowe echo: {len(bad_answers)} answers refused", flush=True)

    def gives_up(self, _, answer):
        # Of its own: a program may come once more before it gives up, which the next one must not find there.
        with listener() as here, program(programs.ROWE, "echo", here.url, "/t", "--json") as running:
            s, request = here.accept()
            self.no_frame_comes(s, answer(request))
            self.assertEqual(running.wait(), 3)
            self.assertTrue(running.errors)

    def comes_again(self, here, answer):
        s, request = here.accept()
        self.no_frame_comes(s, answer(request))
        with here.open() as s:
            s.send(frame(PING, b"?"))
            events = []
            while not {TEXT, PONG} <= {opcode for opcode, _ in events}:  # its handles may be opened behind it
                events.append(s.message())  # it pings for a long silence
            self.assertIn((PONG, b"?"), events)
            self.assertEqual({opcode for opcode, _ in events}, {TEXT, PONG})
            s.send(frame(CLOSE, close_body(1000)))
            s.until_close()
            s.until_end()

    def test_subprotocols(self):  # 4.1, 6th point
        offered = ("--subprotocol", "first.v1", "--subprotocol", "second.v1")
        with listener() as here:
            for chosen in ("first.v1", "second.v1", None):
                with self.subTest(chosen), transport_echo(here.url, *offered) as running:
                    s, request = here.accept()
                    asked = fields_of(request[1:])["sec-websocket-protocol"].replace(" ", "")
                    self.assertEqual(asked, "first.v1,second.v1")
                    s.sendall(switching(request, Sec_WebSocket_Protocol=chosen))
                    peer = programs.frames.stream(s, peer_masks=True)
                    peer.send(frame(CLOSE))
                    peer.until_close()
                    finish(self, running, peer)
            for wrong_one in ("third.v1", "first.v1, second.v1", "FIRST.V1", "first"):
                with self.subTest(wrong_one):
                    self.refuses(here, lambda r, name=wrong_one: switching(r, Sec_WebSocket_Protocol=name),
                                 *offered)
            self.refuses(here, lambda r: switching(r, "Sec-WebSocket-Protocol: second.v1",
                                                   Sec_WebSocket_Protocol="first.v1"), *offered)

    def test_what_a_client_asks(self):  # 4.1, the request
        keys = set()
        for path in ("/", "/a/b?case=1&agent=x", "/%20"):
            with listener() as here, transport_echo(here.url[:-1] + path) as running:
                running.ends_with = (0, 1)
                s, request = here.accept()
                s.close()
                self.assertEqual(request[0], f"GET {path} HTTP/1.1")
                fields = fields_of(request[1:])
                self.assertEqual(fields["host"], f"127.0.0.1:{here.port}")
                self.assertEqual(fields["upgrade"].lower(), "websocket")
                self.assertIn("upgrade", fields["connection"].lower())
                self.assertEqual(fields["sec-websocket-version"], "13")
                self.assertEqual(len(base64.b64decode(fields["sec-websocket-key"], validate=True)), 16)
                self.assertNotIn("sec-websocket-extensions", fields)
                self.assertNotIn("sec-websocket-protocol", fields)
                self.assertNotIn("origin", fields)
                self.assertEqual(len(fields), len(request) - 1, "a field is there twice")
                keys.add(fields["sec-websocket-key"])
        self.assertEqual(len(keys), 3)

    def test_a_server_that_stalls_is_left(self):
        """All at the same time, because it takes seconds by the clock."""
        def stalls(begun):
            begin = time.monotonic()
            with listener() as here, transport_echo(here.url) as running:
                s, request = here.accept()
                with s:
                    s.sendall(begun(request))
                    self.assertEqual(running.wait(), 1)
            self.assertGreater(time.monotonic() - begin, 4.5)

        def drips(_):
            begin = time.monotonic()
            with listener() as here, transport_echo(here.url) as running:
                s, request = here.accept()
                with s, contextlib.suppress(OSError):
                    for byte in switching(request):
                        s.sendall(bytes([byte]))
                        programs.pause(s, 1)
                        if running.process.poll() is not None:
                            break
                self.assertEqual(running.wait(), 1)
            self.assertGreater(time.monotonic() - begin, 4.5)

        programs.in_parallel([("nothing", lambda _: stalls(lambda r: b"")),
                              ("a line", lambda _: stalls(lambda r: b"HTTP/1.1 101 Switching Protocols\r\n")),
                              ("all but the end", lambda _: stalls(lambda r: switching(r)[:-1])),
                              ("a byte a second", drips)], 4)


if __name__ == "__main__":
    unittest.main()
